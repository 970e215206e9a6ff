"""Runs and batches, asked for in Python: the program `lamplight` does them."""

import contextlib
import csv
import inspect
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import weakref

from lamplight import _programs
from lamplight._controller import Controller, refuse_while_loading


class RunError(Exception):
    """A run that could not be done. `status` is the exit status of `lamplight`, `result` what a run has left that failed when
    it was under way, else None.
    """

    def __init__(self, message, status, result=None):
        super().__init__(message)
        self.status = status
        self.result = result


class Result:
    """What a run has left."""

    def __init__(self, folder, is_temporary):
        if is_temporary:
            weakref.finalize(self, shutil.rmtree, os.path.dirname(folder), ignore_errors=True)
        self.folder = folder
        """The run's folder; of a run without `out` one that goes with this result."""
        with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
            self.summary = json.load(file)

    @property
    def digest(self):
        """The digest of the run: equal runs have equal ones."""
        return self.summary["digest"]

    @property
    def metrics(self):
        """Rows of metrics.csv: a pandas DataFrame where pandas is installed, else a structured array of numpy."""
        return table(os.path.join(self.folder, "metrics.csv"))

    @property
    def robots(self):
        """Rows of robots.csv, one per robot."""
        return table(os.path.join(self.folder, "robots.csv"))

    def __repr__(self):
        summary = self.summary
        return f"<Result of {summary['scenario']}: {summary['ended']} after {summary['ticks']} ticks, digest {self.digest}>"


def run(
    scenario,
    controller=None,
    robots=None,
    *,
    seed=None,
    duration=None,
    settings=None,
    params=None,
    engine="processes",
    mode="lockstep",
    out=None,
    quiet=True,
    options=(),
):
    """Runs a scenario and returns its Result.

    Args:
        scenario: path of a scenario file.
        controller: a class derived from Controller, or a name such as "my.py:ToTheLight", that thinks for all robots; or
            a dict of these by robots, such as {"0-9": ToTheLight} or {range(10): ToTheLight}: the others keep what the
            scenario gives them.
        robots, seed, duration (seconds): in place of the scenario's.
        settings: other keys of the scenario by their paths, such as {"channel.range_m": 0.8}.
        params: parameters of the controller, which its constructor gets by name.
        engine: "processes", one per robot, or "in-process".
        mode: "lockstep" or "realtime".
        out: a folder for what the run leaves, which must not be there; without it, it goes with the Result.
        quiet: whether progress and notes are left out on standard error.
        options: more options of `lamplight run`, as on its command line.

    Raises:
        RunError: if the run cannot begin or fails.
    """
    refuse_while_loading("run")
    with contextlib.ExitStack() as stack:
        is_temporary = out is None
        if is_temporary:
            folder = tempfile.mkdtemp(prefix="lamplight-")
            out = os.path.join(folder, "run")
            # Unless there is a result that it goes with.
            abandon = stack.enter_context(contextlib.ExitStack())
            abandon.callback(shutil.rmtree, folder)
        words = ["run", *_scenario(stack, scenario, controller, robots, seed, duration, settings, params)]
        words += ["--engine", engine, "--mode", mode, "--out", os.fspath(out), *_options(options)]
        failure = None
        try:
            _command(words + ["--quiet"] * quiet)
        except RunError as error:
            if not os.path.exists(os.path.join(out, "summary.json")):
                raise
            failure = error
        result = Result(os.fspath(out), is_temporary)
        if is_temporary:
            abandon.pop_all()
        if failure is None:
            return result
        failure.result = result
        raise failure


def batch(
    scenario,
    controller=None,
    robots=None,
    *,
    out,
    trials=None,
    sweep=None,
    seed=None,
    duration=None,
    settings=None,
    params=None,
    engine="in-process",
    quiet=True,
    options=(),
):
    """Plays many trials of a scenario and returns the rows of trials.csv.

    Interrupted, the same call goes on where it was. Arguments are as with `run`, and
        robots: a number, or a list of them.
        out: the folder of the batch.
        trials: trials of each setting.
        sweep: values of keys of the scenario, such as {"channel.loss": [0, 0.1, 0.2]}.

    Raises:
        RunError: if a trial fails.
    """
    refuse_while_loading("batch")
    with contextlib.ExitStack() as stack:
        words = ["batch", *_scenario(stack, scenario, controller, None, seed, duration, settings, params)]
        if robots is not None:
            counts = robots if isinstance(robots, (list, tuple)) else [robots]
            words += ["--robots", ",".join(str(count) for count in counts)]
        if trials is not None:
            words += ["--trials", str(trials)]
        for key, values in (sweep or {}).items():
            if isinstance(values, str) or not hasattr(values, "__iter__"):
                raise TypeError(f"sweep: {key} needs a list of values, such as [0, 0.3], not {values!r}")
            words += ["--sweep", f"{key}={','.join(_toml(value) for value in values)}"]
        words += ["--engine", engine, "--out", os.fspath(out), *_options(options)]
        _command(words + ["--quiet"] * quiet)
        return table(os.path.join(os.fspath(out), "trials.csv"))


def table(path):
    """Returns the rows of a CSV file: a pandas DataFrame where pandas is installed, else a structured array of numpy."""
    try:
        import pandas
    except ImportError:
        return _structured(path)
    return pandas.read_csv(path)


def _structured(path):
    """Rows of a CSV file under the names that it gives them; a number that is not known is NaN."""
    import numpy

    with open(path, newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    columns = [_column(name, [row[at] for row in rows]) for at, name in enumerate(names)]
    table = numpy.empty(len(rows), dtype=[(name, column.dtype) for name, column in zip(names, columns)])
    for name, column in zip(names, columns):
        table[name] = column
    return table


def _column(name, cells):
    """A column as whole numbers, else as numbers, else as truth, else as text."""
    import numpy

    # Some digests might pass for numbers.
    for kind in () if name == "digest" else (int, float):
        try:
            return numpy.array([kind(cell or "nan") for cell in cells], dtype=kind)
        except ValueError:
            pass
    if set(cells) <= {"true", "false"}:
        return numpy.array([cell == "true" for cell in cells], dtype=bool)
    return numpy.array(cells, dtype=str)


def _options(options):
    if isinstance(options, str):
        raise TypeError(f"options must be a list of words, such as {options.split()!r}, not {options!r}")
    return map(str, options)


def _scenario(stack, scenario, controller, robots, seed, duration, settings, params):
    """The words that say which scenario, and what is changed in it."""
    words = [os.fspath(scenario)]
    for option, value in (("--robots", robots), ("--seed", seed), ("--duration", duration)):
        if value is not None:
            words += [option, str(value)]
    if isinstance(controller, dict):
        if params:
            raise TypeError("params are of one controller for all robots; give those of several in the scenario")
        for theirs, one in controller.items():
            robots = theirs if isinstance(theirs, (str, int)) else ",".join(map(str, theirs))
            words += ["--controller", f"{_name(stack, one)}={robots}"]
    elif controller is not None:
        words += ["--controller", _name(stack, controller)]
    for key, value in (params or {}).items():
        words += ["--set", f"controller.params.{key}={_toml(value)}"]
    for key, value in (settings or {}).items():
        words += ["--set", f"{key}={_toml(value)}"]
    return words


def _name(stack, controller):
    """The name of a controller on the command line, for as long as `stack` is open."""
    if isinstance(controller, (str, os.PathLike)):
        return os.fspath(controller)
    if not (inspect.isclass(controller) and issubclass(controller, Controller)):
        raise TypeError(f"a controller is a class derived from lamplight.Controller, or its name, not {controller!r}")
    if controller.__module__ != "__main__" and "<locals>" not in controller.__qualname__:
        return f"{inspect.getfile(controller)}:{controller.__name__}"
    # It is in no file that could be imported without running all that is in it.
    try:
        import cloudpickle
    except ImportError as error:
        raise ImportError(f"{controller.__name__} is defined in the main program; to hand it on, install cloudpickle") from error
    folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="lamplight-"))
    path = os.path.join(folder, f"{controller.__name__}.pickle")
    with open(path, "wb") as file:
        cloudpickle.dump(controller, file, protocol=pickle.HIGHEST_PROTOCOL)
    return path


def _toml(value):
    """A value as TOML spells it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {_toml(it)}" for key, it in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(it) for it in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if hasattr(value, "tolist"):
        return _toml(value.tolist())
    return repr(value)


def _command(words):
    """Runs `lamplight`, whose last words of trouble are those of the error. Interrupted, it ends first."""
    command = [_programs.path("lamplight"), *words]
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL if "--quiet" in words else None,
        stderr=subprocess.PIPE,
        env=_programs.environment(),
    )
    trouble = []
    with process:
        try:
            for line in process.stderr:
                line = line.decode(errors="replace")
                if trouble or line.startswith("error: "):
                    trouble.append(line)
                else:
                    sys.stderr.write(line)
        except BaseException:
            process.send_signal(signal.SIGINT)
            raise
    if process.returncode != 0:
        told = "".join(trouble).removeprefix("error: ").strip()
        raise RunError(told or f"lamplight ended with status {process.returncode}", process.returncode)
    sys.stderr.write("".join(trouble))
