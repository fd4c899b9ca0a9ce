"""A network of ours changed by netconvert, as netedit would, and brought back."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import pytest

from odscen.app.networks import bring_in
from odscen.app.running.runs import run
from odscen.app.scenarios import check_scenario
from odscen.base.errors import InputError
from odscen.convert.imported.net_import import read_network
from odscen.maps.netconvert import NetconvertLimits, run_netconvert
from odscen.maps.store import Workspace

ROOT = Path(__file__).parents[2]
NAME = "signal_crossing"
SCENARIO = ROOT / "suites" / "scenarios" / f"{NAME}.scenario.json"
LIMITS = NetconvertLimits(20.0, 1 << 30)


class Place(NamedTuple):
    """A workspace with the crossing, its network as text and as elements."""

    workspace: Workspace
    net: bytes
    root: ET.Element
    folder: Path

    def changed(self, kind: str = "", patch: str = "") -> Path:
        """The network after netconvert has read it, and a patch of one kind, and written it."""
        files = {"ours.net.xml": self.net, "patch.xml": patch.encode()}
        options = ["--sumo-net-file=ours.net.xml", "--precision=4"]
        options += [f"--{kind}-files=patch.xml"] if kind else []
        file = self.folder / "changed.net.xml"
        file.write_bytes(run_netconvert(options, files=files, limits=LIMITS).net_xml)
        return file

    def whats(self, file: Path) -> list[str]:
        """What is different after bringing a network in."""
        return [change.what for change in bring_in(self.workspace, NAME, file).changes]


@pytest.fixture
def place(tmp_path: Path) -> Place:
    workspace = Workspace.open(tmp_path / "workspace")
    net = workspace.add_map(ROOT / "maps" / f"{NAME}.xodr").path("net").read_bytes()
    return Place(workspace, net, ET.fromstring(net), tmp_path)


def run_of(place: Place) -> dict[str, int]:
    counts: dict[str, int] = run(place.workspace, SCENARIO, out=place.folder).summary["actors"]
    return counts


def a_left_turn(place: Place) -> dict[str, str]:
    """A connection that turns left at the light."""
    links = (one.attrib for one in place.root.iterfind("connection"))
    return next(one for one in links if one.get("tl") and one.get("via") and one["dir"] == "l")


@pytest.mark.slow
def test_a_network_that_netconvert_has_only_read_and_written_is_the_same(place: Place) -> None:
    assert place.whats(place.changed()) == []
    assert check_scenario(place.workspace, SCENARIO) == ()
    counts = run_of(place)
    assert counts["arrived"] == counts["planned"] == 56
    assert place.workspace.map(NAME).converter == "file"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["signal_crossing", "left_hand_crossing", "roundabout"])
def test_netconvert_keeps_lanes_connections_links_and_programs_of_our_networks(
    name: str, tmp_path: Path
) -> None:
    entry = Workspace.open(tmp_path).add_map(ROOT / "maps" / f"{name}.xodr")
    ours = entry.path("net").read_bytes()
    done = run_netconvert(
        ["--sumo-net-file=n.net.xml", "--precision=4"], files={"n.net.xml": ours}, limits=LIMITS
    )
    before, after = read_network(ours), read_network(done.net_xml)
    kept = [(lane.id, lane.speed, lane.width, lane.allowed) for lane in _lanes(before)]
    assert [(lane.id, lane.speed, lane.width, lane.allowed) for lane in _lanes(after)] == kept
    assert _connections(after) == _connections(before)
    assert [(x.id, x.phases, x.offset, x.signals) for x in after.lights] == [
        (x.id, x.phases, x.offset, x.signals) for x in before.lights
    ]
    assert after.counts()["crossings"] == before.counts()["crossings"]


def _lanes(net):
    lanes = (net.lanes[lane] for edge in net.edges.values() for lane in edge.lanes)
    return sorted((one for one in lanes if net.function(one.id) == "normal"), key=lambda x: x.id)


def _connections(net):
    normal = {lane.id for lane in _lanes(net)}
    return {(x.source, x.target, x.light) for x in net.links if {x.source, x.target} <= normal}


@pytest.mark.slow
def test_a_forbidden_turn_is_reported_and_so_is_who_has_no_route_any_more(place: Place) -> None:
    turn = a_left_turn(place)
    ends = {key: turn[key] for key in ("from", "to", "fromLane", "toLane")}
    removed = ET.tostring(ET.Element("delete", ends), encoding="unicode")
    file = place.changed("connection", f"<connections>{removed}</connections>")
    changes = bring_in(place.workspace, NAME, file).changes
    assert {"connection gone", "lane gone"} <= {change.what for change in changes}
    problems = check_scenario(place.workspace, SCENARIO)
    assert {problem.code for problem in problems} == {"no_sumo_route"}
    assert {problem.severity for problem in problems} == {"warning"}
    counts = run_of(place)
    assert counts["arrived"] == counts["inserted"] < counts["planned"]
    assert counts["collided"] == 0


@pytest.mark.slow
def test_an_edited_program_is_reported_and_shown_and_run(place: Place) -> None:
    light = place.root.find("tlLogic")
    assert light is not None
    for phase in light.iterfind("phase"):
        if phase.get("name", "").startswith("stage"):
            phase.set("duration", "22")
    for param in light.findall("param"):
        light.remove(param)
    patch = f"<tlLogics>{ET.tostring(light, encoding='unicode')}</tlLogics>"
    done = bring_in(place.workspace, NAME, place.changed("tllogic", patch))
    (change,) = done.changes
    assert change.what == "program changed"
    assert "13, 13 s of 52 s" in change.detail
    assert "22, 22 s of 70 s" in change.detail
    assert done.entry.info["lights"][0]["green"] == [22, 22]
    counts = run_of(place)
    assert counts["arrived"] == counts["planned"]


@pytest.mark.slow
def test_a_scenario_with_times_for_stages_that_are_gone_is_refused(place: Place) -> None:
    light = place.root.find("tlLogic")
    assert light is not None
    phases = light.findall("phase")
    second = [phase.get("name") for phase in phases].index("stage 2")
    for phase in phases[second:]:
        light.remove(phase)
    for param in light.findall("param"):
        light.remove(param)
    patch = f"<tlLogics>{ET.tostring(light, encoding='unicode')}</tlLogics>"
    file = place.folder / "timed.scenario.json"
    text = SCENARIO.read_text().replace(
        '"simulation"',
        '"signals": {"junctions": [{"junction": "10001", "green": [20, 20]}]},\n"simulation"',
        1,
    )
    file.write_text(text)
    assert not check_scenario(place.workspace, file)
    bring_in(place.workspace, NAME, place.changed("tllogic", patch))
    codes = [problem.code for problem in check_scenario(place.workspace, file)]
    assert "wrong_number_of_greens" in codes


@pytest.mark.slow
def test_an_added_lane_is_reported_and_driven_on(place: Place) -> None:
    edge = place.root.find(f"edge[@id='{a_left_turn(place)['from']}']")
    assert edge is not None
    lanes = len(edge.findall("lane"))
    patch = f'<edges><edge id="{edge.get("id")}" numLanes="{lanes + 1}"/></edges>'
    done = bring_in(place.workspace, NAME, place.changed("edge", patch))
    assert [change.what for change in done.changes] == ["SUMO lane new"]
    assert done.entry.info["sumo"]["lanes"] == 61
    counts = run_of(place)
    assert counts["arrived"] == counts["planned"]


@pytest.mark.slow
def test_a_map_keeps_the_network_that_was_brought_in_until_a_converter_is_named(
    place: Place,
) -> None:
    from odscen.convert.model.conversion_settings import ConversionSettings

    bring_in(place.workspace, NAME, place.changed())
    file = ROOT / "maps" / f"{NAME}.xodr"
    assert place.workspace.add_map(file).info["network"]["source"] == "changed.net.xml"
    wider = place.workspace.add_map(file, settings=ConversionSettings(spacing=4.0))
    assert (wider.converter, wider.info["spacing"]) == ("file", 4.0)
    own = place.workspace.add_map(file, settings=ConversionSettings(converter="odscen"))
    assert own.path("net").read_bytes() == place.net


def test_a_network_that_cannot_be_used_leaves_the_map_as_it_was(place: Place) -> None:
    before = place.workspace.map(NAME)
    broken = place.folder / "broken.net.xml"
    broken.write_bytes(place.net[:9000])
    with pytest.raises(InputError, match=r"^broken\.net\.xml: not well-formed XML: "):
        bring_in(place.workspace, NAME, broken)
    assert place.workspace.map(NAME) == before
