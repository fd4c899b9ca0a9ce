"""In SUMO: who turns left at a light takes the gaps of oncoming traffic that people take."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest

from bench.saturation import TURNS, build_without_crosswalks, count_entered
from odscen.sumo.worker.simulation.session import open_session
from odscen.sumo.worker.simulation.turning_gaps import TurningGaps
from tests.convert.maps import converted, named

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

LEFT, ONCOMING = "1.0.f 1.1.f 4.1.b 4.0.b", "3.0.f 3.1.f 1.1.b 1.0.b"
CAR = '<vType id="car" length="5" width="1.8" accel="2.6" decel="4" tau="1.1" sigma="0"/>'
BUS = '<vType id="bus" vClass="bus" length="12" width="2.5" accel="1.2" decel="4" sigma="0"/>'
LIGHT = (
    '<additional><tlLogic id="J10001" type="static" programID="one" offset="0">'
    f'<phase duration="999" state="{"GGGGgrrrrrGGGGg"}{"r" * 9}"/></tlLogic></additional>'
)


@pytest.fixture(scope="module")
def net(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("gaps") / "net.xml"
    file.write_bytes(converted(named("signal_crossing")).network.net_xml)
    return file


def turns_between(
    net: Path,
    folder: Path,
    gap: float,
    *,
    kinds: tuple[str, str] = ("car", "car"),
    moved: tuple[str, ...] = (),
    only: frozenset[str] | None = None,
    step: str = "0.1",
) -> bool:
    """Whether a vehicle turns between two that come ``gap`` s apart; no two may touch.

    Parameters
    ----------
    kinds
        Of the one that turns, and of those that come.
    """
    departs = [(18.5, "turns", LEFT, 2, kinds[0])]
    departs += [(20.0 + late, name, ONCOMING, 1, kinds[1]) for name, late in (("a", 0), ("b", gap))]
    routes, lights = folder / "routes.xml", folder / "lights.xml"
    lights.write_text(LIGHT)
    routes.write_text(
        f"<routes>{CAR}{BUS}"
        + "".join(
            f'<vehicle id="{name}" type="{kind}" depart="{depart}" departLane="{lane}"'
            f' departSpeed="max" speedFactor="1"><route edges="{edges}"/></vehicle>'
            for depart, name, edges, lane, kind in sorted(departs)
        )
        + "</routes>"
    )
    order: list[str] = []
    with open_session(
        ["-n", str(net), "-r", str(routes), "-a", str(lights), "--step-length", step,
         "--no-step-log", "--collision.action", "warn", "--collision.check-junctions",
         "--collision.mingap-factor", "0"]
    ) as session:  # fmt: skip
        while session.time < 120.0 and session.expected():
            session.turning_gaps.before_step(only=only, moved=moved)
            session.step()
            session.turning_gaps.after_step()
            happened = session.happened()
            assert happened is None or not happened.collisions
            for name in session.vehicles():
                ((lane, _),) = session.vehicle_places([name])
                if lane in ("4.1.b_1", "1.1.b_1") and name not in order:
                    order.append(name)
    assert sorted(order) == ["a", "b", "turns"]
    return order == ["a", "turns", "b"]


@pytest.mark.slow
def test_a_gap_is_taken_from_some_four_seconds_on(net: Path, tmp_path: Path) -> None:
    """HCM has 4.5 s. SUMO alone wants 12 s here, as paths cross 27 m behind the stop line."""
    taken = {gap: turns_between(net, tmp_path, gap) for gap in (3.0, 4.5, 7.0, 9.0)}
    assert taken == {3.0: False, 4.5: True, 7.0: True, 9.0: True}
    nobody = frozenset[str]()
    alone = [turns_between(net, tmp_path, gap, only=nobody) for gap in (7.0, 11.0, 14.0)]
    assert alone == [False, False, True]
    assert not turns_between(net, tmp_path, 7.0, moved=("turns",))


@pytest.mark.slow
@pytest.mark.parametrize("step", ["0.5", "1"])
def test_no_two_touch_whatever_the_gap(net: Path, tmp_path: Path, step: str) -> None:
    for gap in range(2, 14):
        turns_between(net, tmp_path, float(gap), step=step)
        turns_between(net, tmp_path, float(gap), kinds=("car", "bus"), step=step)


def test_a_bus_that_turns_waits_as_sumo_has_it(net: Path, tmp_path: Path) -> None:
    """Its sides leave its path in a turn, and it is long."""
    assert not turns_between(net, tmp_path, 9.0, kinds=("bus", "car"))
    assert turns_between(net, tmp_path, 15.0, kinds=("bus", "car"))


def test_nobody_touches_in_an_hour_of_turns_off_a_major_road(tmp_path: Path) -> None:
    """One who stood in its turn had let pass one who crept, and went when that one drove."""
    turn = TURNS["left turn from the major road"]
    net = build_without_crosswalks(turn.map, tmp_path)
    oncoming, turned, collisions = count_entered(tmp_path, net, turn, 600, "0.5", 1)
    assert (oncoming, collisions) == (602.0, 0.0)
    assert turned > 0.9 * turn.capacity(oncoming)


STRAIGHT = "1.0.f 1.1.f 3.1.b 3.0.b"


def drive(net: Path, folder: Path, routes: dict[str, str], *, rerouted: str = "") -> Counter[str]:
    """Let cars depart each 2 s on their routes for a minute; how often SUMO was asked for what."""
    file, lights = folder / "routes.xml", folder / "lights.xml"
    lights.write_text(LIGHT)
    file.write_text(
        f"<routes>{CAR}"
        + "".join(
            f'<vehicle id="{name}" type="car" depart="{2 * number}" departLane="1">'
            f'<route edges="{edges}"/></vehicle>'
            for number, (name, edges) in enumerate(routes.items())
        )
        + "</routes>"
    )
    asked: Counter[str] = Counter()

    def count_calls(domain: str, name: str) -> Callable[..., Any]:
        call = getattr(getattr(session._sumo, domain), name)

        def counted(*arguments: Any) -> Any:
            asked[name] += 1
            return call(*arguments)

        return counted

    arguments = ["-n", net, "-r", file, "-a", lights, "--step-length", "0.5", "--no-step-log"]
    with open_session([str(argument) for argument in arguments]) as session:
        gaps = TurningGaps(session._sumo, session._errors, session.lanes, count_calls)
        session.turning_gaps = gaps
        while session.time < 60.0 and session.expected():
            gaps.before_step()
            session.step()
            gaps.after_step()
            if rerouted and session.time == 4.0:
                before = session._sumo.vehicle.getRouteID("a")
                assert session.set_route("a", rerouted.split())
                assert session._sumo.vehicle.getRouteID("a") != before
        assert session.time == 60.0 or not session.expected()
    return asked


def test_who_makes_no_such_turn_is_looked_at_once(net: Path, tmp_path: Path) -> None:
    routes = {f"v{number}": STRAIGHT for number in range(20)}
    asked = drive(net, tmp_path, routes)
    assert asked["getLaneID"] == asked["getRouteIndex"] == 20
    assert asked["getLastStepVehicleIDs"] == 0


def test_who_turns_is_looked_at_when_it_may_have_come_near(net: Path, tmp_path: Path) -> None:
    asked = drive(net, tmp_path, {"a": LEFT})
    # It drives for some 25 s, of which some 6 s are near the turn and in it.
    assert 8 <= asked["getLaneID"] <= 30
    assert 0 < asked["getLastStepVehicleIDs"] <= 200
    changed = drive(net, tmp_path, {"a": STRAIGHT}, rerouted=LEFT)
    assert 0 < changed["getLastStepVehicleIDs"] <= 200


def touching_turns(folder: Path, *, looks: bool, step: str) -> tuple[int, int]:
    """Pairs that touch, and who arrives: left turns from both sides that pass beside each other."""
    net, routes = folder / "town.net.xml", folder / "both.xml"
    net.write_bytes(converted(named("carla-2020/Town07")).network.net_xml)
    ways = {"a": ("44.0.f 55.0.f",), "b": ("45.0.b 44.0.b", "45.0.b 0.0.f")}
    vehicles = [
        (number * (5.0 if side == "a" else 4.3), f"{side}{number}", edges[number % len(edges)])
        for side, edges in ways.items()
        for number in range(40)
    ]
    routes.write_text(
        "<routes>"
        + CAR.replace("/>", ' impatience="0.4"/>')
        + "".join(
            f'<vehicle id="{name}" type="car" depart="{depart}" departSpeed="max"><route'
            f' edges="{edges}"/></vehicle>'
            for depart, name, edges in sorted(vehicles)
        )
        + "</routes>"
    )
    touched, arrived = set(), 0
    with open_session(
        ["-n", str(net), "-r", str(routes), "--step-length", step, "--no-step-log",
         "--collision.action", "warn", "--collision.check-junctions",
         "--collision.mingap-factor", "0"]
    ) as session:  # fmt: skip
        while session.time < 900.0 and session.expected():
            if looks:
                session.turning_gaps.before_step()
            session.step()
            if looks:
                session.turning_gaps.after_step()
            if (happened := session.happened()) is not None:
                touched |= {frozenset((c.collider, c.victim)) for c in happened.collisions}
                arrived += len(happened.arrived)
    return len(touched), arrived


@pytest.mark.parametrize("step", ["0.1", "0.5"])
def test_turns_that_pass_beside_each_other_do_not_touch(step: str, tmp_path: Path) -> None:
    assert touching_turns(tmp_path, looks=True, step=step) == (0, 80)
    assert touching_turns(tmp_path, looks=False, step=step)[0] >= 3


def test_a_route_may_begin_inside_a_junction(net: Path, tmp_path: Path) -> None:
    routes = tmp_path / "inside.xml"
    with open_session(["-n", str(net), "--no-step-log"]) as session:
        lanes, edge_of = session.lanes, session._sumo.lane.getEdgeID
        begins = [
            (edge_of(via), edge_of(link[0]))
            for name, links in lanes.links_of.items()
            if name not in lanes.internal
            for link in links
            if (via := link[4]).startswith(":J10001") and lanes.admits(via, "passenger")
        ]
    routes.write_text(
        f"<routes>{CAR}{BUS}"
        + "".join(
            f'<vehicle id="{kind}{number}" type="{kind}" depart="{10 * number}"><route'
            f' edges="{inside} {onto}"/></vehicle>'
            for number, (inside, onto) in enumerate(begins)
            for kind in ("car", "bus")
        )
        + "</routes>"
    )
    with open_session(["-n", str(net), "-r", str(routes), "--no-step-log"]) as session:
        while session.time < 600.0 and session.expected():
            session.turning_gaps.before_step()
            session.turn_exits.before_step()
            session.curve_speeds.before_step()
            session.step()
            session.turning_gaps.after_step()
        assert session.expected() == 0
