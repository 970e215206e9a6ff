"""One robot of a run as a process whose controller is in Python.

`lamplight run` starts these by itself. By hand, to look at one in a debugger:

    lamplight run SCENARIO --name lab --by-hand 7
    python3 -m lamplight.agent my.py:ToTheLight --run lab --robot 7
"""

import sys

from lamplight import _lamplight
from lamplight._controller import LoadError, load

if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: python3 -m lamplight.agent FILE.py:CLASS --run NAME --robot N")
    try:
        controller = load(sys.argv[1])
    except (LoadError, OSError) as error:
        sys.exit(f"error: {error}")
    sys.exit(_lamplight.run_agent(sys.argv[2:], sys.argv[1], controller))
