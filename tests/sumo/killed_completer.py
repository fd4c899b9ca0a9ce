"""The process that completes slices, killed with signal 9 just before a change of the run folder.

Run in place of :mod:`odscen.sumo.worker.completer` by ``killed_worker``: before the
``KILL_COMPLETER_AT``-th change it alone, before the ``KILL_BOTH_AT``-th the worker with it.
"""

from __future__ import annotations

import itertools
import os
import sys

from odscen.sumo.worker.completer import main
from tests.sumo.killed_worker import kill_before_change

if __name__ == "__main__":
    both = "KILL_BOTH_AT" in os.environ
    number = int(os.environ["KILL_BOTH_AT" if both else "KILL_COMPLETER_AT"])
    left = itertools.count(1)
    kill_before_change(sys.argv[1], lambda: next(left) == number, both=both)
    sys.exit(main())
