"""A package with a generator of its own, as if installed, and one that cannot be imported."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

CODE = '''
import numpy as np


class Spread:
    """Places cars a number of nodes apart."""

    options = {
        "type": "object",
        "properties": {
            "apart": {"type": "integer", "title": "Nodes between two cars", "default": 12,
                      "minimum": 4, "maximum": 400},
            "category": {"type": "string", "title": "Category", "enum": ["car", "truck"],
                         "default": "car"},
            "moving": {"type": "boolean", "title": "They move", "default": False},
        },
    }

    def __init__(self, apart, category, moving):
        self.apart, self.category, self.moving = apart, category, moving

    def fill(self, graph, request, rng):
        nodes = np.flatnonzero(request.allowed[self.category])[:: self.apart]
        fill = {"node": nodes, "category": np.full(len(nodes), self.category)}
        if self.moving:
            fill["initial_speed"] = np.full(len(nodes), 2.0)
        return fill
'''
ENTRIES = """[odscen.generators]
spread = my_traffic:Spread
gone = my_traffic:Gone
"""


def install(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Put the package on the path of this process and of those that it starts."""
    (folder / "my_traffic.py").write_text(CODE)
    about = folder / "my_traffic-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-traffic\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRIES)
    patch.syspath_prepend(folder)
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    patch.setenv("PYTHONPATH", path)
    sys.modules.pop("my_traffic", None)
