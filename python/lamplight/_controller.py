"""The base class of controllers, and how one is found in a file."""

import importlib.util
import inspect
import os
import sys

from lamplight._lamplight import Command


class Controller:
    """The mind of one robot: percept in, command out.

    It knows what its percepts say, and nothing else. Equal percepts must give equal commands, or runs cannot be repeated:
    no clock, no random numbers but those seeded by the robot's number.

    Its constructor gets the scenario's `params` by name, and is called anew for each life of the robot.
    """

    robot = 0
    """Number of the robot in its swarm, from 0."""
    life = 1
    """Life of the robot, from 1: a restarted robot begins another one."""

    def boot(self):
        """Returns the first Command, before anything was sensed: by default to stand still and be heard."""
        return Command()

    def step(self, percept):
        """Plays one neighbor cycle: returns a Command for a Percept."""
        raise NotImplementedError(f"{type(self).__name__} has no method `step`")

    def notes(self):
        """Returns numbers for those who watch, by name: up to 16, the same names each time."""
        return {}


class LoadError(Exception):
    """Why there is no controller in a file, in one line."""


_loading = False
"""Whether a file is being run for its controllers."""

_loaded = {}
"""Controllers that have been loaded, by their names in a scenario: each file is run once."""


def load(spec):
    """Returns the class that a scenario calls `spec`, which is a file, or a file and a class: `my.py:ToTheLight`.

    Raises LoadError if there is none.
    """
    if spec not in _loaded:
        _loaded[spec] = _load(spec)
    return _loaded[spec]


def _load(spec):
    path, name = _split(spec)
    found = _pickled(path) if path.endswith(".pickle") else _classes(path)
    where = os.path.basename(path)
    if name is not None:
        if name not in found:
            raise LoadError(f"there is no class `{name}` in {where}{_choice(found)}")
        controller = found[name]
        if not _is_controller(controller):
            raise LoadError(f"`{name}` in {where} is no class derived from lamplight.Controller")
        return controller
    controllers = {name: it for name, it in found.items() if _is_controller(it)}
    if not controllers:
        raise LoadError(f"there is no class derived from lamplight.Controller in {where}")
    if len(controllers) > 1:
        raise LoadError(f"there is more than one controller in {where}: name one of them{_choice(controllers)}")
    return next(iter(controllers.values()))


def refuse_while_loading(what):
    """Raises RuntimeError while a file is being run for its controllers: a run begun then would run the file again, and so on."""
    if _loading:
        raise RuntimeError(
            f'lamplight.{what} is called while a controller is imported, in every process again: put it under if __name__ == "__main__":'
        )


def _split(spec):
    path, colon, name = spec.rpartition(":")
    if colon and name.isidentifier():
        return path, name
    return spec, None


def _is_controller(it):
    return inspect.isclass(it) and issubclass(it, Controller)


def _choice(found):
    names = [name for name, it in found.items() if _is_controller(it)]
    return f" (there is {', '.join(names)})" if names else ""


def _pickled(path):
    import pickle

    with open(path, "rb") as file:
        controller = pickle.load(file)
    return {controller.__name__: controller}


def _classes(path):
    """Everything that the file at `path` defines, by name."""
    folder, where = os.path.split(os.path.abspath(path))
    # Modules beside the file are found, as if Python had been started with it.
    if folder not in sys.path:
        sys.path.insert(0, folder)
    name = os.path.splitext(where)[0]
    if name in sys.modules or name in sys.stdlib_module_names:
        name = f"controller_{name}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None:
        raise LoadError(f"{where} is no file of Python: its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    global _loading
    _loading = True
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise LoadError(f"{where}, line {error.lineno}: {error.msg}") from error
    except ModuleNotFoundError as error:
        raise LoadError(f"{where} needs the package `{error.name}`, which {sys.executable} does not have") from error
    except Exception as error:
        raise LoadError(f"{where} cannot be imported: {type(error).__name__}: {error}") from error
    finally:
        _loading = False
    return {key: it for key, it in vars(module).items() if getattr(it, "__module__", None) == name}
