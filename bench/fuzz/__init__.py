"""Faults of every kind against every reader; each must end well or be refused with a reason.

    python -m bench fuzz --minutes 60
    python -m bench fuzz --targets map,tables --first 1000
    python -m bench fuzz --target map --seed 17      # one trial again; its folder is kept

A trial follows from its target and its seed alone. docs/faults.md says what counts as a failure.
"""

from bench.fuzz.driver import main

__all__ = ["main"]
