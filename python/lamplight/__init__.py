"""Controllers of robots in Python, each in a process of its own.

    from lamplight import Command, Controller, run

    class ToTheLight(Controller):
        def step(self, percept):
            return Command(velocity=0.1 * percept.light.direction)

    if __name__ == "__main__":
        result = run("swarmbots.toml", controller=ToTheLight, robots=50)
"""

import sys

if sys.version_info < (3, 10):
    raise ImportError(f"lamplight needs Python 3.10 or later, and {sys.executable} is {sys.version.split()[0]}")

from lamplight._lamplight import (
    Command,
    Compass,
    Light,
    Odometry,
    Percept,
    Position,
    __version__,
    always,
    sometimes,
)
from lamplight._controller import Controller
from lamplight._run import Result, RunError, batch, run

__all__ = [
    "Command",
    "Compass",
    "Controller",
    "Light",
    "Odometry",
    "Percept",
    "Position",
    "Result",
    "RunError",
    "__version__",
    "always",
    "batch",
    "run",
    "sometimes",
]
