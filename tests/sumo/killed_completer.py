"""The process that completes slices, killed with signal 9 just before a change of the run folder.

Run in place of :mod:`odscen.sumo.worker.completer` by ``killed_worker``: before the
``KILL_COMPLETER_AT``-th change it alone, before the ``KILL_BOTH_AT``-th the worker with it.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from odscen.sumo.worker.completer import main
from tests.sumo.killed_worker import kill_before_change, reached

if __name__ == "__main__":
    both = "KILL_BOTH_AT" in os.environ
    name = "KILL_BOTH_AT" if both else "KILL_COMPLETER_AT"
    kill_before_change(sys.argv[1], reached(Path(sys.argv[1]), name), both=both)
    sys.exit(main())
