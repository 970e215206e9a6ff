"""The programs that come with the package."""

import os
import sys

_FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin")


def path(name):
    """Returns the path of a program of ours: the one in this package, or where there is none, as from a checkout, the one
    that LAMPLIGHT_PROGRAM names or that is in PATH.
    """
    program = os.path.join(_FOLDER, name)
    if os.path.exists(program):
        return program
    return os.environ.get("LAMPLIGHT_PROGRAM") or name


def environment():
    """Returns the environment in which programs use this very interpreter."""
    return {**os.environ, "LAMPLIGHT_PYTHON": sys.executable}


def main():
    """Becomes the program `lamplight`."""
    program = path("lamplight")
    try:
        os.execvpe(program, ["lamplight", *sys.argv[1:]], environment())
    except OSError as error:
        sys.exit(f"error: {program}: {error.strerror}")
