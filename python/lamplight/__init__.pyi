"""Controllers of robots in Python, each in a process of its own."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

from lamplight._lamplight import Command as Command
from lamplight._lamplight import Compass as Compass
from lamplight._lamplight import Light as Light
from lamplight._lamplight import Odometry as Odometry
from lamplight._lamplight import Percept as Percept
from lamplight._lamplight import Position as Position
from lamplight._lamplight import __version__ as __version__
from lamplight._lamplight import always as always
from lamplight._lamplight import sometimes as sometimes

class Controller:
    """The mind of one robot: percept in, command out."""

    robot: int
    life: int
    def boot(self) -> Command: ...
    def step(self, percept: Percept) -> Command: ...
    def notes(self) -> Mapping[str, float]: ...

_Robots = str | int | range | tuple[int, ...]
_Named = type[Controller] | str | os.PathLike[str]

class RunError(Exception):
    """A run that could not be done."""

    status: int
    result: Result | None
    def __init__(self, message: str, status: int, result: Result | None = None) -> None: ...

class Result:
    """What a run has left."""

    folder: str
    summary: dict[str, Any]
    @property
    def digest(self) -> str: ...
    @property
    def metrics(self) -> Any: ...
    @property
    def robots(self) -> Any: ...

def run(
    scenario: str | os.PathLike[str],
    controller: _Named | Mapping[_Robots, _Named] | None = None,
    robots: int | None = None,
    *,
    seed: int | None = None,
    duration: float | None = None,
    settings: Mapping[str, Any] | None = None,
    params: Mapping[str, Any] | None = None,
    engine: Literal["processes", "in-process"] = "processes",
    mode: Literal["lockstep", "realtime"] = "lockstep",
    out: str | os.PathLike[str] | None = None,
    quiet: bool = True,
    options: Iterable[object] = (),
) -> Result: ...
def batch(
    scenario: str | os.PathLike[str],
    controller: _Named | Mapping[_Robots, _Named] | None = None,
    robots: int | Sequence[int] | None = None,
    *,
    out: str | os.PathLike[str],
    trials: int | None = None,
    sweep: Mapping[str, Sequence[Any]] | None = None,
    seed: int | None = None,
    duration: float | None = None,
    settings: Mapping[str, Any] | None = None,
    params: Mapping[str, Any] | None = None,
    engine: Literal["processes", "in-process"] = "in-process",
    quiet: bool = True,
    options: Iterable[object] = (),
) -> Any: ...
