"""The command `lamplight` once more, in an interpreter: what `lamplight` becomes to play controllers in Python in one
process.
"""

import signal
import sys

from lamplight import _lamplight


def main():
    # Ctrl-C ends a run, and not a controller's step.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # What controllers print is no result.
    sys.stdout = sys.stderr
    status = _lamplight.command(sys.argv[1:])
    sys.stderr.flush()
    sys.exit(status)
