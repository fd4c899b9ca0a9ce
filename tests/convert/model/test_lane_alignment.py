"""What SUMO lanes are laid on: stretches of lanes, one after the other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from odscen.convert.model.lane_alignment import Stretch, evaluate
from odscen.opendrive.lanes import RoadTable
from tests.lanegraph.roads import lane, network, road, section


@pytest.mark.parametrize(("turned", "back"), [(0.0, 0.0), (0.01, 0.0), (-0.4, 0.68), (0.4, 0.0)])
def test_a_line_never_goes_back_where_the_next_road_begins_behind_the_end(
    turned: float, back: float
) -> None:
    """The lane of a road that turns right at once begins 1.75 m * sin(0.4) behind the end."""
    odr = network(
        road("1", section(lane(-1)), length=50.0),
        road("2", section(lane(-1)), x=50.0, hdg=turned, length=20.0),
    )
    table = RoadTable.of(odr)
    (line,) = evaluate([(Stretch(0, 40.0, 50.0), Stretch(1, 0.0, 20.0))], table)
    steps = np.diff(line.shape[:, :2], axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    assert np.abs(headings).max() <= math.pi / 2 + 1e-6
    assert line.s[0][[0, -1]] == pytest.approx([40.0, 50.0 - back], abs=0.01)
    assert line.s[1][[0, -1]] == pytest.approx([0.0, 20.0])
    assert line.length == pytest.approx(np.hypot(*steps.T).sum())
    assert np.all(np.diff(np.concatenate(line.arc)) >= 0)
