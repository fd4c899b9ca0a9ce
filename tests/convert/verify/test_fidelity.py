import json
from dataclasses import replace

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.convert.verify.fidelity import REACH, verify
from odscen.convert.verify.polyline_finder import STEP, Finder, Polylines
from odscen.opendrive.lanes import RoadTable
from tests.convert.nets import HandNet, fork
from tests.lanegraph.roads import lane, network, road, section

MAP = fork()
TABLE = RoadTable.of(MAP)


def found(net):
    return verify(bytes(net), MAP, TABLE)


def broken(fidelity):
    return {verdict.name for verdict in fidelity.verdicts if not verdict.ok}


def pairs(relations):
    return [(relation.source, relation.target) for relation in relations]


def test_a_network_that_follows_its_map_passes():
    fidelity = found(HandNet())
    assert fidelity.passed, broken(fidelity)
    assert (fidelity.normal.lanes, fidelity.normal.places) == (3, 100)
    assert (fidelity.internal.lanes, fidelity.internal.places) == (2, 40)
    assert fidelity.normal.max < 1e-3
    assert fidelity.coverage.length == pytest.approx(140.0)
    assert fidelity.coverage_roads.length == pytest.approx(100.0)
    assert (fidelity.coverage.share, fidelity.sidewalks.share) == (1.0, 1.0)
    assert fidelity.sidewalks.length == pytest.approx(80.0)
    assert (fidelity.relations, fidelity.crosswalks) == (2, 1)


def test_a_lane_moved_by_0_3_m_is_seen_and_named():
    fidelity = found(HandNet().moved("b_1", y=0.3))
    assert fidelity.normal.max == pytest.approx(0.3, abs=1e-3)
    assert fidelity.normal.p50 == pytest.approx(0.0, abs=1e-3)
    assert fidelity.normal.far == pytest.approx(0.4)
    assert fidelity.coverage.share == pytest.approx(100 / 140)
    assert fidelity.coverage_junctions.share == 1.0
    [far] = fidelity.far_places
    assert far.lane == "b_1"
    assert far.metres == pytest.approx(0.3, abs=1e-3)
    [gap] = fidelity.gaps
    assert gap.lane == "2.0.-1"
    assert gap.metres == pytest.approx(40.0)
    assert (gap.x, gap.y) == pytest.approx((80.0, -1.75), abs=1.0)
    assert not fidelity.missing, "0.3 m aside it is still that lane"


def test_a_lane_inside_the_junction_is_measured_apart():
    fidelity = found(HandNet().moved(":j_0_0", y=0.1))
    assert fidelity.normal.max < 1e-3
    assert fidelity.internal.max == pytest.approx(0.1, abs=1e-3)
    assert broken(fidelity) == {"lanes in junctions, 99 %, m"}


def test_a_lane_against_the_traffic_is_no_lane_of_the_map():
    net = HandNet()
    fidelity = found(net.shaped("b_1", net.shapes["b_1"][::-1]))
    assert fidelity.normal.max == REACH
    assert [gap.lane for gap in fidelity.gaps] == ["2.0.-1"]


def test_a_missing_lane_is_a_gap():
    fidelity = found(HandNet().without("c_0"))
    assert [gap.lane for gap in fidelity.gaps] == ["3.0.-1"]
    assert fidelity.coverage.share == pytest.approx(120 / 140)
    assert pairs(fidelity.missing) == [("1.-1", "3.-1")]


def test_a_dropped_connection_is_named():
    fidelity = found(replace(HandNet(), links=HandNet().links[:1]))
    assert pairs(fidelity.missing) == [("1.-1", "3.-1")]
    assert (fidelity.missing[0].x, fidelity.missing[0].y) == pytest.approx((40.0, -1.75))
    assert broken(fidelity) == {"relations missing"}


def test_an_added_connection_is_named_with_its_sumo_lanes():
    fidelity = found(replace(HandNet(), links=(*HandNet().links, ("b_1", "c_0", ""))))
    assert pairs(fidelity.invented) == [("2.-1", "3.-1")]
    assert fidelity.invented[0].sumo == "b_1 to c_0"
    assert broken(fidelity) == {"relations invented"}


def test_a_lane_that_is_none_of_the_map_has_no_name_in_a_relation():
    fidelity = found(HandNet().moved("c_0", y=-9.0))
    assert pairs(fidelity.invented) == [("1.-1", "?")]


@pytest.mark.parametrize("node", [58.6, 60.0, 61.4])
@pytest.mark.parametrize("short", [0.01, 0.4, 20.0])
def test_a_node_beside_the_road_end_and_short_roads_lose_no_relation(node, short):
    odr = network(
        road("1", section(lane(-1, after=-1)), length=60.0, after="road 2 start"),
        road(
            "2",
            section(lane(-1, before=-1, after=-1)),
            x=60.0,
            length=short,
            before="road 1 end",
            after="road 3 start",
        ),
        road("3", section(lane(-1, before=-1)), x=60.0 + short, before="road 2 end"),
    )
    shapes = {
        "a_0": np.array([[0.0, -1.75], [node, -1.75]]),
        "b_0": np.array([[node, -1.75], [60.0 + short + 2.0, -1.75]]),
        "c_0": np.array([[60.0 + short + 2.0, -1.75], [160.0 + short, -1.75]]),
    }
    net = HandNet(shapes, walked=(), links=(("a_0", "b_0", ""), ("b_0", "c_0", "")), foes=())
    fidelity = verify(bytes(net), odr, RoadTable.of(odr))
    assert fidelity.relations == 2
    assert not fidelity.missing
    assert not fidelity.invented


@pytest.mark.parametrize(("length", "missing"), [(3.0, []), (20.0, [("1.-1", "2.-1")])])
def test_a_short_road_in_a_junction_of_sumo_is_crossed_and_a_longer_one_is_lost(length, missing):
    odr = network(
        road("1", section(lane(-1, after=-1)), length=60.0, after="road 2 start"),
        road(
            "2",
            section(lane(-1, before=-1, after=-1)),
            x=60.0,
            length=length,
            before="road 1 end",
            after="road 3 start",
        ),
        road("3", section(lane(-1, before=-1)), x=60.0 + length, before="road 2 end"),
    )
    near, far = 58.0, 62.0 + length
    shapes = {
        "a_0": np.array([[0.0, -1.75], [near, -1.75]]),
        ":j_0_0": np.array([[near, -1.75], [far, -1.75]]),
        "c_0": np.array([[far, -1.75], [160.0 + length, -1.75]]),
    }
    net = HandNet(shapes, walked=(), links=(("a_0", "c_0", ":j_0_0"),), foes=())
    fidelity = verify(bytes(net), odr, RoadTable.of(odr))
    assert pairs(fidelity.missing)[:1] == missing
    assert pairs(fidelity.invented) == ([("1.-1", "3.-1")] if missing else [])
    assert fidelity.coverage.share > 0.99


def test_a_moved_crossing_loses_its_crosswalk():
    fidelity = found(HandNet().moved(":j_c0_0", x=1.0))
    assert not fidelity.lost_crosswalks, "3 of its 4 m are left"
    fidelity = found(HandNet().moved(":j_c0_0", x=2.0))
    [lost] = fidelity.lost_crosswalks
    assert (lost.road, lost.object_id) == ("1", "77")
    assert lost.share == pytest.approx(0.5)
    assert (lost.x, lost.y) == pytest.approx((20.0, -1.75))
    assert found(HandNet().without(":j_c0_0")).lost_crosswalks[0].share == 0.0


def test_a_sidewalk_needs_a_lane_for_pedestrians_alone():
    net = HandNet()
    without = found(net.without("b_0"))
    assert without.sidewalks.share == pytest.approx(0.5)
    assert [gap.lane for gap in without.sidewalk_gaps] == ["2.0.-2"]
    assert found(net.shaped("b_0", net.shapes["b_0"][::-1])).sidewalks.share == 1.0
    cars = found(replace(net, walked=("a_0", ":j_c0_0")))
    assert cars.sidewalks.share == pytest.approx(0.5)
    assert cars.cars_on_sidewalks == ("b_0",)


@pytest.mark.parametrize(
    ("states", "unsafe"),
    [
        (("Gr", "rG"), []),
        (("Gr", "GG"), [(1, False)]),
        (("Gg", "yy"), [(0, True)]),
        (("GG", "Gg"), [(0, False), (1, True)]),
    ],
)
def test_conflicting_links_must_not_be_green_together(states, unsafe):
    fidelity = found(replace(HandNet(), states=states))
    assert [(pair.phase, pair.yields) for pair in fidelity.unsafe_pairs] == unsafe
    assert all(pair.links == (0, 1) for pair in fidelity.unsafe_pairs)
    assert found(replace(HandNet(), states=states, foes=("00", "00"))).unsafe_pairs == ()


def test_junctions_with_lights_are_compared_by_place():
    lit = fork(lights=True)
    table = RoadTable.of(lit)
    kept = verify(bytes(replace(HandNet(), states=("Gr", "rG"))), lit, table).signals
    assert (kept.opendrive, kept.sumo, kept.lost, kept.invented) == (1, 1, (), ())
    fidelity = verify(bytes(HandNet()), lit, table)
    assert (fidelity.signals.sumo, fidelity.signals.lost) == (0, ("9",))
    assert broken(fidelity) == {"junctions with lights lost"}
    invented = found(replace(HandNet(), states=("Gr", "rG"))).signals
    assert (invented.opendrive, invented.invented) == (0, ("j",))


LIT = replace(HandNet(), states=("Gr", "rG"))


LIGHT = '<signal s="39" t="-4" id="1" name="" dynamic="no" orientation="+" type="traffic_light"/>'


@pytest.mark.parametrize(("net", "lost"), [(LIT, ()), (HandNet(), ("road 1 > signal 1",))])
def test_a_light_on_an_approach_makes_no_invention_and_must_not_be_lost(net, lost):
    odr = fork(sign=LIGHT)
    fidelity = verify(bytes(net), odr, RoadTable.of(odr))
    assert fidelity.signals.lights == 1
    assert (fidelity.signals.opendrive, fidelity.signals.invented) == (0, ())
    assert fidelity.signals.lost_lights == lost
    assert broken(fidelity) == ({"traffic lights lost"} if lost else set())


def test_a_light_far_from_all_that_lights_control_is_lost():
    far = road("8", section(lane(-1)), y=300.0, length=40.0).replace(
        "</road>", f"<signals>{LIGHT}</signals></road>"
    )
    odr = network(road("1", section(lane(-1)), length=40.0), far)
    fidelity = verify(bytes(HandNet()), odr, RoadTable.of(odr))
    assert fidelity.signals.lost_lights == ("road 8 > signal 1",)


def test_a_controller_of_signs_alone_is_no_light():
    sign = '<signal s="39" t="-4" id="1" name="" dynamic="no" orientation="+" type="205"/>'
    odr = fork(lights=True, sign=sign)
    assert odr.roads["1"].signals
    assert verify(bytes(HandNet()), odr, RoadTable.of(odr)).signals.opendrive == 0


def test_a_map_without_drivable_lanes_and_a_network_without_any_can_be_compared():
    odr = network(road("1", section(lane(-1, kind="sidewalk"))))
    empty = b'<net><location netOffset="0,0"/></net>'
    fidelity = verify(empty, odr, RoadTable.of(odr))
    assert (fidelity.coverage.length, fidelity.coverage.share) == (0.0, 1.0)
    assert broken(fidelity) == {"sidewalks covered, share"}
    assert broken(verify(empty, MAP, TABLE)) == {
        "drivable lanes covered, share",
        "relations missing",
        "sidewalks covered, share",
        "crosswalks lost",
    }


def test_traffic_on_the_wrong_side_is_reported():
    assert broken(found(replace(HandNet(), left_hand=True))) == {"wrong side of the road"}


def test_the_result_becomes_json():
    net = replace(HandNet().moved("b_1", y=0.3), states=("GG",))
    data = json.loads(json.dumps(found(net).to_dict(), allow_nan=False))
    assert data["passed"] is False
    assert data["normal"]["max"] == pytest.approx(0.3, abs=1e-3)
    assert {"name", "value", "limit", "ok"} <= set(data["verdicts"][0])
    assert data["gaps"][0]["lane"] == "2.0.-1"


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<net",
        b"<net/>",
        bytes(HandNet()).replace(b"shape=", b"form="),
        b"<net><location/></net>",
        bytes(HandNet()).replace(b'via=":j_0_0"', b'via="gone"'),
        bytes(HandNet()).replace(b'netOffset="100.00', b'netOffset="nan'),
    ],
)
def test_what_is_no_network_is_refused(content):
    with pytest.raises(InputError, match=r"^(.* network cannot be read|not well-formed XML): "):
        verify(content, MAP, TABLE)


def test_the_nearest_piece_is_found_whatever_its_distance():
    rng = np.random.default_rng(7)
    shapes = [rng.uniform(0, 60, (1, 2)) + rng.uniform(-9, 9, (2, 2)) for _ in range(40)]
    finder = Finder(Polylines.of(shapes).cut(STEP))
    places = Polylines.of([rng.uniform(0, 60, (2, 2)) for _ in range(10)]).cut(1.0)
    distance, row = finder.nearest(places, REACH)
    place, piece, apart = finder.around(places, 200.0, directed=True)
    for k in range(len(places.xy)):
        best = apart[place == k].min(initial=REACH)
        assert distance[k] == pytest.approx(best)
        assert (row[k] >= 0) == (best < REACH)
        if row[k] >= 0:
            assert apart[(place == k) & (piece == row[k])] == pytest.approx(best)
