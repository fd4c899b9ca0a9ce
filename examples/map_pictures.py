"""Maps: pictures of one with its segments, and the lane that a place belongs to.

Run it with ``python examples/map_pictures.py [WORKSPACE]``.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path

import odscen

MAP = "roundabout"


def draw(workspace: odscen.Workspace) -> None:
    entry = workspace.map(MAP)
    figures = entry.statistics()
    print(f"{figures.driving_lane_length:.0f} m of lanes, {figures.junctions} junctions")
    for name, picture in (("map", entry.plot()), ("segments", entry.plot(segments=True))):
        print("drawn:", picture.save(workspace.root / f"{name}.svg"))

    # The same place belongs to another lane for whoever drives the other way.
    east, west = entry.nearest(60.0, 0.0, hdg=0.0), entry.nearest(60.0, 0.0, hdg=math.pi)
    print(f"eastbound {east.id} at {east.distance:.1f} m, westbound {west.id}")


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    draw(store)
