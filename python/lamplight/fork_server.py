"""One warmed interpreter, which forks the agents of all robots that a class thinks for.

`lamplight run` starts it as a child of its own. Its standard input is a socket: a line of JSON asks for an agent, with a
descriptor for what that prints; the answer is the number of its process. Each agent becomes a child of `lamplight` itself,
by way of a process that forks it and ends, so that it is signaled and waited for as any other. When the socket is closed,
this ends.
"""

import gc
import json
import os
import socket
import sys
import time

from lamplight import _lamplight

MESSAGE_BYTES_MAX = 1 << 16
REPARENTED_POLL_S = 0.0002


def serve(spec):
    _lamplight.die_with_parent()
    channel = socket.socket(fileno=os.dup(0))
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    try:
        controller = warmed(spec)
    except BaseException as error:
        say(channel, {"failed": str(error)})
        raise
    say(channel, {"ready": _lamplight.__version__})
    while True:
        request, descriptors, _, _ = socket.recv_fds(channel, MESSAGE_BYTES_MAX, 1)
        if not request:
            return
        fork(channel, spec, controller, json.loads(request), descriptors[0])
        os.close(descriptors[0])


def warmed(spec):
    """Returns the class, with all that its agents share in memory."""
    try:
        import numpy  # noqa: F401
    except ImportError as error:
        raise ImportError(f"{sys.executable} has no numpy, in which percepts are given: {error}") from error
    from lamplight._controller import load

    controller = load(spec)
    # What is there now is there for good: collecting it would give each agent pages of its own.
    gc.collect()
    gc.freeze()
    return controller


def fork(channel, spec, controller, words, log):
    between = os.fork()
    if between:
        os.waitpid(between, 0)
        return
    try:
        parent = os.getpid()
        agent = os.fork()
        if agent == 0:
            live(channel, spec, controller, words, log, parent)
        os.setpgid(agent, agent)
        say(channel, {"pid": agent})
    finally:
        os._exit(0)


def live(channel, spec, controller, words, log, parent):
    """Is an agent, and never returns."""
    status = 1
    try:
        # Until then its parent is one whose end must not end it.
        while os.getppid() == parent:
            time.sleep(REPARENTED_POLL_S)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.close(log)
        channel.close()
        status = _lamplight.run_agent(words, spec, controller)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except Exception:
                pass
        os._exit(status)


def say(channel, message):
    channel.sendall(json.dumps(message).encode() + b"\n")


if __name__ == "__main__":
    try:
        serve(sys.argv[1])
    except BaseException as error:
        # The supervisor has been told.
        if error.__cause__ is not None and not isinstance(error.__cause__, SyntaxError):
            sys.excepthook(type(error.__cause__), error.__cause__, error.__cause__.__traceback__)
        sys.exit(1)
