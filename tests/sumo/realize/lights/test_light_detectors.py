"""Where loops of actuated lights lie."""

from __future__ import annotations

import pytest

from odscen.base.ids import SumoLaneId
from odscen.convert.lane_table.table import SumoLight
from odscen.convert.model.net import LightLink
from odscen.scenario.document.signals_document import SignalDetector
from odscen.scenario.signals.light import Light, SignalMovement
from odscen.sumo.realize.lights.light_detectors import area_length, may_end, vehicle_loops
from odscen.sumo.realize.road_net import Link, RoadNet, RoadNetLane

LIGHT = SumoLight(
    "J1", (), (), 0.0, ((),), (LightLink(SumoLaneId("stop"), SumoLaneId("out"), "s", 13.89),)
)
VIEW = Light(("J1",), (20.0,), (SignalMovement("r1", "r2", "straight", ("1.0.-1", "2.0.-1")),))


def net(stop: float, inner: float, before: float) -> RoadNet:
    """A lane before a light, a lane inside a junction before it, and the lane that leads there."""
    lanes = {"stop": stop, "inner": inner, "before": before, "out": 50.0}
    return RoadNet(
        {name: RoadNetLane(name, name, 0, metres) for name, metres in lanes.items()},
        (Link("before", "stop", "inner"), Link("inner", "stop"), Link("stop", "out")),
    )


@pytest.mark.parametrize(
    ("lengths", "metres"),
    [
        ((100.0, 0.1, 100.0), 80.0),
        ((20.0, 10.0, 100.0), 80.0),
        ((20.0, 10.0, 30.0), 59.8),
        ((80.1, 10.0, 0.05), 79.9),
        ((79.98, 0.1, 100.0), 79.88),
    ],
)
def test_an_area_is_no_longer_than_the_road_before_the_light(
    lengths: tuple[float, float, float], metres: float
) -> None:
    assert area_length(net(*lengths), "stop", 80.0) == pytest.approx(metres, abs=0.011)


@pytest.mark.parametrize(
    ("lengths", "lane", "front"),
    [
        ((100.0, 0.1, 100.0), "stop", 70.0),
        ((20.0, 0.1, 100.0), "before", 90.1),
        ((29.98, 0.1, 100.0), "inner", 0.08),
        ((5.0, 0.1, 8.0), "before", 0.05),
    ],
)
def test_a_loop_lies_upstream_where_the_lane_before_the_light_is_short(
    lengths: tuple[float, float, float], lane: str, front: float
) -> None:
    detector = SignalDetector(id="D1", at="r1", before=30.0, stages=("1",))
    roads = net(*lengths)
    (loop,) = vehicle_loops(
        LIGHT, VIEW, roads, designed=[detector], green={"1": {0}}, least={"1": 8.0}
    )
    assert loop.lane == lane
    assert loop.pos + loop.length == pytest.approx(front, abs=0.011)
    assert loop.pos >= 0.0
    assert loop.pos + loop.length <= roads.lanes[lane].length
    assert loop.before == "stop"


def test_without_detectors_a_loop_is_so_near_that_the_shortest_green_clears_the_queue() -> None:
    roads = net(200.0, 0.1, 100.0)
    ahead = {
        least: vehicle_loops(LIGHT, VIEW, roads, designed=(), green={"1": {0}}, least={"1": least})[
            0
        ].ahead
        for least in (20.0, 5.0)
    }
    assert ahead[20.0] == pytest.approx(2.0 * 13.89)
    assert ahead[5.0] == pytest.approx((5.0 / 1.9 + 0.5) * 7.5)


def test_a_stage_may_end_when_no_loop_that_prolongs_it_has_seen_a_vehicle_or_one_blocks_it() -> (
    None
):
    detector = SignalDetector(id="D1", at="r1", before=30.0, gap=2.5, stages=("1",))
    loops = vehicle_loops(
        LIGHT, VIEW, net(100.0, 0.1, 1.0), designed=[detector], green={}, least={}
    )
    assert may_end(loops, "1", {0}) == ("((z:J1.D1.0 > 2.5) or ((w:J1.D1.0 > 10) and (g:0 > 15)))")
    assert may_end(loops, "2", {0}) == ""
    assert may_end(loops, "1", set()) == ""
