"""Percepts, commands and agents, made in Rust."""

from collections.abc import Sequence
from typing import Any

import numpy
import numpy.typing

__version__: str

class Command:
    """What a controller decides: where to go, and what to say next."""

    def __init__(
        self,
        velocity: Sequence[float] | numpy.typing.NDArray[Any] | None = None,
        payload: bytes | None = None,
        estimated_error: Sequence[float] | numpy.typing.NDArray[Any] | None = None,
    ) -> None: ...
    @property
    def velocity(self) -> tuple[float, float]: ...
    @property
    def payload(self) -> bytes: ...
    @property
    def estimated_error(self) -> tuple[float, float] | None: ...

class Percept:
    """All that a robot gets in one neighbor cycle, in its body frame: x ahead, y to the left."""

    @property
    def tick(self) -> int: ...
    @property
    def bump(self) -> bool: ...
    @property
    def light(self) -> Light: ...
    @property
    def odometry(self) -> Odometry | None: ...
    @property
    def compass(self) -> Compass | None: ...
    @property
    def position(self) -> Position | None: ...
    @property
    def neighbors(self) -> numpy.typing.NDArray[numpy.void]: ...
    @property
    def payloads(self) -> list[bytes]: ...
    @property
    def walls(self) -> numpy.typing.NDArray[numpy.void]: ...

class Light:
    """Light where a robot stands."""

    @property
    def value(self) -> float: ...
    @property
    def bearing_rad(self) -> float | None: ...
    @property
    def gradient(self) -> numpy.typing.NDArray[numpy.float64] | None: ...
    @property
    def direction(self) -> numpy.typing.NDArray[numpy.float64]: ...

class Odometry:
    """A robot's own motion as its wheels believe, in the body frame of its beginning."""

    @property
    def x_m(self) -> float: ...
    @property
    def y_m(self) -> float: ...
    @property
    def heading_rad(self) -> float: ...

class Compass:
    """A compass's reading."""

    @property
    def heading_rad(self) -> float: ...

class Position:
    """A position's reading, in the arena."""

    @property
    def x_m(self) -> float: ...
    @property
    def y_m(self) -> float: ...

def run_agent(words: Sequence[str], program: str, controller: type) -> int: ...
def command(words: Sequence[str]) -> int: ...
def die_with_parent() -> None: ...
