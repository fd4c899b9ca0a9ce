from __future__ import annotations

import numpy as np

from odscen.changes.map_differences import map_differences
from odscen.drawing.changed_places import changed_places
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.drawing.maps import document, lane, road, signal, signals


def test_a_narrowed_lane_is_a_line_along_it_and_a_lost_sign_a_ring() -> None:
    sign = signals(signal("7", "206", 20, -5))
    before = parse(document(road(right=lane(-1), more=sign)))
    after = parse(document(road(right=lane(-1, width=2.5))))
    tables = RoadTable.of(before), RoadTable.of(after)
    removed, changed = changed_places(map_differences(before, after), *tables)
    assert (removed.name, removed.xy.tolist()) == ("Removed", [[20.0, -5.0]])
    assert changed.lines is not None
    assert (changed.name, changed.total, changed.lines.total) == ("Changed", 1, 1)
    assert np.allclose(changed.lines.xy[[0, -1]], [[0.0, -1.75], [100.0, -1.75]], atol=1e-6)
