"""A package with figures of its own, as if installed: one that works, and some that do not."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

CODE = '''
def top_speed(run):
    """Highest speed that anybody had, m/s."""
    return run.trajectories()["speed"].max()


def words(run):
    return "many"


def fails(run):
    return 1 / 0
'''
ENTRIES = """[odscen.figures]
top_speed = my_figures:top_speed
words = my_figures:words
fails = my_figures:fails
gone = my_figures:gone
mean_speed = my_figures:top_speed
"""


def install(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Put the package on the path of this process and of those that it starts."""
    (folder / "my_figures.py").write_text(CODE)
    about = folder / "my_figures-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-figures\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRIES)
    patch.syspath_prepend(folder)
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    patch.setenv("PYTHONPATH", path)
    sys.modules.pop("my_figures", None)
