"""The grid of SUMO's own tests, on which small runs are prepared."""

from tests.sumo.conftest import grid, prepare

__all__ = ["grid", "prepare"]
