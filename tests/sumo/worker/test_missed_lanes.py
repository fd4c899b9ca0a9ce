"""In SUMO: who did not get to the lane of the route takes another one, and arrives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.opendrive.parse import parse
from odscen.records.outcomes import StopReason
from odscen.records.run_events import EventKind
from odscen.sumo.worker.detours import Detours, LaneLink
from odscen.sumo.worker.missed_lanes import PATIENCE, PERIOD, MissedLanes
from odscen.sumo.worker.simulation.session import open_session
from tests.convert.maps import of_model

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.records.run_events import Event


@pytest.fixture(scope="module")
def net(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Streets of two lanes each way that must not be changed in the last 20 m before junctions."""
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    file = tmp_path_factory.mktemp("lanes") / "town.net.xml"
    model = parse(map_text("varied_town_24").encode(), file="varied_town_24")
    file.write_bytes(of_model(model).network.net_xml)
    return file


def drive(
    net: Path,
    folder: Path,
    *,
    lane: int,
    closed: frozenset[tuple[str, str]] = frozenset(),
    only: frozenset[str] | None = None,
) -> tuple[list[Event], float, bool]:
    """A car at a stop line that is to turn left; events, when it is gone, whether it arrived."""
    routes = folder / "routes.xml"
    routes.write_text(
        '<routes><vType id="car"/><vehicle id="a" type="car" depart="0" departPos="5"'
        f' departLane="{lane}"><route edges="10.2.f 8.2.b 8.1.b"/></vehicle></routes>'
    )
    missed, events = MissedLanes((0.0, 0.0), only), []
    arguments = ["-n", str(net), "-r", str(routes), "--step-length", "0.5", "--no-warnings",
                 "--no-step-log", "--time-to-teleport", "-1"]  # fmt: skip
    with open_session(arguments) as session:
        detours = Detours(session.lanes.links())
        arrived = False
        while session.time < 600.0 and session.expected():
            if missed.due(session.time, 0.5):
                events += missed.before_step(session, session.time, detours, {"passenger": closed})
            session.step()
            happened = session.happened()
            arrived = arrived or (happened is not None and "a" in happened.arrived)
        return events, session.time, arrived


@pytest.mark.slow
def test_who_is_in_the_lane_beside_at_the_stop_line_goes_round_and_arrives(
    net: Path, tmp_path: Path
) -> None:
    events, _, arrived = drive(net, tmp_path, lane=0)
    (event,) = events
    assert event.kind is EventKind.ROUTE_CHANGED
    assert (event.actor, event.detail, event.lane) == ("a", StopReason.WRONG_LANE, "10.2.f_0")
    assert event.waited is not None
    assert PATIENCE <= event.waited < PATIENCE + 2 * PERIOD
    assert arrived


def test_who_is_in_the_right_lane_keeps_the_route(net: Path, tmp_path: Path) -> None:
    events, gone, arrived = drive(net, tmp_path, lane=1)
    assert events == []
    assert arrived
    assert gone < 200.0


def test_who_has_no_other_open_route_stays(net: Path, tmp_path: Path) -> None:
    events, gone, arrived = drive(net, tmp_path, lane=0, closed=frozenset({("10.2.f", "11.0.f")}))
    assert (events, gone, arrived) == ([], 600.0, False)


def test_the_time_of_a_route_is_that_of_its_links_in_free_flow() -> None:
    cars = frozenset({"passenger"})
    found = Detours([LaneLink("a", "b", 3.0, cars), LaneLink("a", "b", 2.5, cars),
                     LaneLink("b", "c", 4.0, cars)])  # fmt: skip
    assert found.seconds(("a", "b", "c"), "passenger") == 6.5


def test_who_is_of_a_sumo_project_stays_as_in_sumo(net: Path, tmp_path: Path) -> None:
    events, _, arrived = drive(net, tmp_path, lane=0, only=frozenset({"b"}))
    assert (events, arrived) == ([], False)
