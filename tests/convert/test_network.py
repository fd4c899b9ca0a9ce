from __future__ import annotations

import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from odscen.convert import network
from odscen.convert.lane_table import LaneTable
from odscen.convert.netconvert import netconvert_path
from odscen.convert.network import build_network
from odscen.convert.report import Entry, Fate
from odscen.errors import NetconvertError
from odscen.ids import LaneKey, RoadId
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.model import DRIVABLE_TYPES, WALKABLE_TYPES
from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, converted, converted_text
from tests.opendrive.snippets import document, lane, road, section

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.convert.netconvert import NetconvertResult

SHIPPED = Path(__file__).parents[2] / "maps"

TOWNS = [
    "carla-2019/Town01",
    "carla-2019/Town03",
    "carla-2019/Town04",
    "carla-2019/Town05",
    "carla-2020/Town01",
    "carla-2020/Town04",
    "esmini/fabriksgatan",
    "esmini/e6mini-lht",
    "esmini/curves_elevation",
]

CURVE = '<geometry s="0" x="5" y="-7" hdg="0.3" length="60"><arc curvature="0.01"/></geometry>'
STREET = document(
    road(
        plan=CURVE,
        length=60.0,
        lanes=section(
            lane(2, kind="sidewalk", width=2.0),
            lane(1),
            lane(-1),
            lane(-2, kind="biking", width=1.5),
            lane(-3, kind="sidewalk", width=2.0),
        ),
    )
)


def test_each_kind_of_lane_is_found_where_it_is(tmp_path: Path) -> None:
    street = converted_text(STREET, tmp_path)
    for number, vclass in [(2, "pedestrian"), (1, "passenger"), (-1, "bus"), (-2, "bicycle")]:
        key = LaneKey(RoadId("1"), 0, number)
        place = street.network.table.to_sumo(key, 20.0)
        assert place is not None
        assert street.network.table.allowed(place.lane, vclass)
        assert place.deviation < 0.01
    lefts = [street.network.table.to_sumo(LaneKey(RoadId("1"), 0, 1), s) for s in (20.0, 40.0)]
    assert lefts[0] is not None
    assert lefts[1] is not None
    assert lefts[0].pos > lefts[1].pos


def test_a_place_on_the_sumo_lane_is_where_the_opendrive_lane_is(tmp_path: Path) -> None:
    street = converted_text(STREET, tmp_path)
    key = LaneKey(RoadId("1"), 0, -1)
    place = street.network.table.to_sumo(key, 33.0)
    assert place is not None
    found = street.net().lanes[place.lane]
    steps = np.hypot(*np.diff(found.shape[:, :2], axis=0).T)
    arc = np.concatenate(([0.0], np.cumsum(steps)))
    at = place.pos * arc[-1] / found.length
    drawn = [np.interp(at, arc, found.shape[:, axis]) for axis in (0, 1)]
    exact = street.roads.lane_points(np.array([street.roads.lane_index[key]]), np.array([33.0]))
    assert np.hypot(drawn[0] - exact.x[0], drawn[1] - exact.y[0]) < 0.01


def test_cars_never_get_onto_sidewalks_or_shoulders(shared_maps: Path) -> None:
    for name in ("carla-2019/Town03", "carla-2020/Town04"):
        town = converted(shared_maps / f"{name}.xodr")
        table = town.network.table
        kinds = {
            table.lane_keys[piece.lane]: piece.sumo
            for piece in table.pieces
            if town.roads.lane_type[town.roads.lane_index[table.lane_keys[piece.lane]]]
            in WALKABLE_TYPES
        }
        assert kinds
        assert not any(table.lane_list[row].allows("passenger") for row in kinds.values())
        matched = {piece.sumo for piece in table.pieces}
        lost = [
            found.length
            for row, found in enumerate(table.lane_list)
            if table.edges[found.edge].function == "normal"
            and found.allows("passenger")
            and row not in matched
        ]
        assert sum(lost) < 5.0


@pytest.mark.parametrize("name", TOWNS)
def test_spawn_nodes_on_roads_have_a_sumo_lane_within_a_decimetre(
    shared_maps: Path, name: str
) -> None:
    town = converted(shared_maps / f"{name}.xodr")
    lane, s = town.nodes(DRIVABLE_TYPES)
    places = town.places(lane, s)
    found = places.lane >= 0
    assert found.mean() >= 0.997
    assert np.quantile(places.deviation[found], 0.99) <= 0.01
    assert (places.deviation[found] <= 0.10).mean() >= 0.994


@pytest.mark.parametrize("name", TOWNS)
def test_to_sumo_and_back_ends_within_a_decimetre_of_where_it_began(
    shared_maps: Path, name: str
) -> None:
    town = converted(shared_maps / f"{name}.xodr")
    lane, s = town.nodes(DRIVABLE_TYPES)
    places = town.places(lane, s)
    found = np.flatnonzero(places.lane >= 0)
    table = town.network.table
    back = table.xodr_places(places.lane[found], places.pos[found])
    same = np.array(
        [
            row >= 0 and table.lane_keys[row] == town.roads.lane_keys[lane[i]]
            for row, i in zip(back.lane, found, strict=True)
        ]
    )
    assert same.mean() >= 0.999
    assert np.abs(back.s - s[found])[same].max() <= 0.1


@pytest.mark.parametrize(
    ("name", "least"),
    [("carla-2019/Town01", 0.95), ("carla-2019/Town04", 0.99), ("carla-2020/Town04", 0.99)],
)
def test_sidewalks_have_a_sumo_lane_too(shared_maps: Path, name: str, least: float) -> None:
    town = converted(shared_maps / f"{name}.xodr")
    places = town.places(*town.nodes(WALKABLE_TYPES))
    found = places.lane >= 0
    assert found.mean() >= least
    assert np.quantile(places.deviation[found], 0.99) <= 0.05


@pytest.mark.parametrize("name", ["carla-2019/Town05", "carla-2020/Town01", "carla-2020/Town04"])
def test_no_lane_relation_of_these_towns_is_missing(shared_maps: Path, name: str) -> None:
    figures = converted(shared_maps / f"{name}.xodr").network.report.figures
    assert figures["connections"] >= 88
    assert figures["connections_missing"] == 0
    assert figures["connections_invented"] <= 2


def test_left_hand_traffic_keeps_left(shared_maps: Path) -> None:
    town = converted(shared_maps / "esmini" / "e6mini-lht.xodr")
    table = town.network.table
    assert table.lefthand
    for key in table.lane_keys:
        row = town.roads.lane_index[key]
        middle = 0.5 * (town.roads.lane_s0[row] + town.roads.lane_s1[row])
        before, after = (table.to_sumo(key, middle + step) for step in (-1.0, 1.0))
        assert before is not None
        assert after is not None
        assert (after.pos > before.pos) == (key.lane > 0)


def test_walkers_reach_every_sidewalk_of_a_town_over_its_crossings(shared_maps: Path) -> None:
    table = converted(shared_maps / "carla-2019/Town05.xodr").network.table
    edges = sorted(
        {
            found.edge
            for found in table.lane_list
            if found.allows("pedestrian") and table.edges[found.edge].function == "normal"
        }
    )
    assert len(edges) > 90
    assert all(table.walk_connected(edges[0], other) for other in edges)


def loads_in_sumo(net_xml: bytes, folder: Path) -> str:
    path = folder / "net.net.xml"
    path.write_bytes(net_xml)
    sumo = netconvert_path().with_name("sumo")
    command = [str(sumo), "-n", str(path), "--end", "1", "--no-step-log"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = [line for line in done.stderr.splitlines() if "SUMO_HOME" not in line]
    return "\n".join(said) if done.returncode == 0 else f"exit code {done.returncode}: {said}"


@pytest.mark.parametrize("name", sorted(path.stem for path in SHIPPED.glob("*.xodr")))
def test_shipped_maps_become_networks_that_sumo_loads_without_a_word(
    name: str, tmp_path: Path
) -> None:
    made = converted(SHIPPED / f"{name}.xodr")
    assert loads_in_sumo(made.network.net_xml, tmp_path) == ""
    assert made.network.report.figures["connections_missing"] == 0
    places = made.places(*made.nodes(DRIVABLE_TYPES))
    assert (places.lane >= 0).mean() >= 0.99


@pytest.mark.parametrize(
    "name",
    [
        "connected_junctions_simple",
        "direct_junction_simple",
        "mixed_roads",
        "soderleden",
        "some_signs",
        "straight_500m_signs",
    ],
)
def test_maps_that_netconvert_fails_on_work(shared_maps: Path, name: str, tmp_path: Path) -> None:
    made = converted(shared_maps / "esmini" / f"{name}.xodr")
    assert loads_in_sumo(made.network.net_xml, tmp_path) == ""
    places = made.places(*made.nodes(DRIVABLE_TYPES))
    assert (places.lane >= 0).mean() >= 0.98
    assert Fate.REPAIRED in {entry.fate for entry in made.network.report.entries}


def test_a_direct_junction_is_driven_through_as_the_map_says(shared_maps: Path) -> None:
    made = converted(shared_maps / "esmini" / "direct_junction_simple.xodr")
    figures = made.network.report.figures
    assert figures["connections"] == 5
    assert figures["connections_missing"] == figures["connections_invented"] == 0


def test_limits_of_the_map_are_those_of_the_network(shared_maps: Path) -> None:
    made = converted(shared_maps / "carla-2019" / "Town04.xodr")
    speeds = {
        round(found.speed, 2)
        for found in made.network.table.lane_list
        if found.allows("passenger") and made.network.table.edges[found.edge].function == "normal"
    }
    assert speeds == {29.06, 24.59, 15.65, 13.41}


def test_two_conversions_give_the_same_bytes(shared_maps: Path, tmp_path: Path) -> None:
    path = shared_maps / "esmini" / "fabriksgatan_traffic_lights.xodr"
    odr = parse(path.read_bytes(), file=path.name)
    made = []
    for name in ("a", "b"):
        folder = tmp_path / name
        folder.mkdir()
        made.append(build_network(odr, RoadTable.of(odr), path, folder))
    assert made[0].net_xml == made[1].net_xml
    assert made[0].table.to_json() == made[1].table.to_json()
    assert made[0].report == made[1].report


def test_the_table_of_a_town_survives_json(shared_maps: Path) -> None:
    table = converted(shared_maps / "carla-2020" / "Town04.xodr").network.table
    text = table.to_json()
    assert len(text) < 300_000
    assert LaneTable.from_json(text).to_json() == text


def test_a_rung_that_fails_is_followed_by_the_next_and_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = network.run_netconvert
    tried: list[tuple[str, ...]] = []

    def failing_first(
        path: Path, options: Sequence[str], *, time_limit: float, memory_limit: int
    ) -> NetconvertResult:
        tried.append(tuple(options))
        if len(tried) <= 2:
            msg = "netconvert crashed (SIGSEGV)"
            raise NetconvertError(msg, output="Error: vectors of different lengths")
        return real(path, options, time_limit=time_limit, memory_limit=memory_limit)

    monkeypatch.setattr(network, "run_netconvert", failing_first)
    street: Converted = converted_text(STREET, tmp_path)
    assert len(tried) == 3
    steps = [entry for entry in street.network.report.entries if entry.element == "netconvert"]
    assert steps[:2] == [
        Entry(
            Fate.LOST,
            "netconvert",
            f"{gives_up}, because netconvert crashed (SIGSEGV); Error: "
            "vectors of different lengths",
        )
        for gives_up in ("curves are sampled every 2 m", "no crossings are made")
    ]


def test_when_every_rung_fails_the_last_one_speaks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_args: object, **_kwargs: object) -> NetconvertResult:
        msg = "netconvert refused the map (exit code 1)"
        raise NetconvertError(msg, output="Error: no nodes")

    monkeypatch.setattr(network, "run_netconvert", failing)
    with pytest.raises(NetconvertError, match="no nodes"):
        converted_text(STREET, tmp_path)


def test_what_has_no_place_in_sumo_is_in_the_report(shared_maps: Path) -> None:
    entries = converted(shared_maps / "carla-2020" / "Town01.xodr").network.report.entries
    assert any(entry.fate is Fate.LOST and "shoulder" in entry.reason for entry in entries)
    assert any(entry.fate is Fate.GUESSED and "crossings" in entry.reason for entry in entries)
    assert any(entry.fate is Fate.GUESSED and "no timing" in entry.reason for entry in entries)
