from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from odscen.records.outcomes import StopReason
from odscen.records.run_events import EventKind, events_from_json
from odscen.sumo.realize.sumocfg import SumocfgSettings, sumo_config
from odscen.sumo.runner.forked_worker import expect_runs
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.runner.worker_process import run_worker
from odscen.sumo.worker import jams
from odscen.sumo.worker.simulation.observed import ViewAhead
from tests.sumo.conftest import TYPES, Prepare

FREE = ViewAhead(True, "M", True, None, people=False)


class Street:
    """What each vehicle has ahead."""

    def __init__(self, **ahead: ViewAhead) -> None:
        self._ahead = ahead
        self.asked: list[str] = []

    def ahead(self, name: str) -> ViewAhead | None:
        self.asked.append(name)
        return self._ahead.get(name)


@pytest.mark.parametrize(
    ("head", "reason"),
    [
        (FREE._replace(onwards=False), StopReason.NO_CONNECTION),
        (FREE._replace(onwards=False, beside=True), StopReason.WRONG_LANE),
        (FREE._replace(light="r", open=False), StopReason.RED),
        (FREE._replace(light="g", open=False), StopReason.GIVES_WAY),
        (FREE._replace(open=False, people=True), StopReason.PEOPLE),
        (FREE, StopReason.UNKNOWN),
    ],
)
def test_a_queue_stands_for_the_reason_of_its_head(head: ViewAhead, reason: str) -> None:
    red = FREE._replace(light="r", open=False)
    street = Street(a=FREE._replace(leader="b"), b=red._replace(leader="c"), c=head)
    assert jams.explain(street, "a") == (reason, "c")  # type: ignore[arg-type]


def test_vehicles_that_wait_for_each_other_are_a_circle() -> None:
    street = Street(
        a=FREE._replace(leader="b"), b=FREE._replace(leader="c"), c=FREE._replace(leader="b")
    )
    assert jams.explain(street, "a") == (StopReason.CIRCLE, "c")  # type: ignore[arg-type]


def test_queues_with_a_common_head_ask_for_each_vehicle_once() -> None:
    red = FREE._replace(light="r", open=False)
    street = Street(
        a=FREE._replace(leader="c"), b=FREE._replace(leader="c"), c=FREE._replace(leader="d"), d=red
    )
    known: dict[str, ViewAhead | None] = {}
    found = [jams.explain(street, one, known) for one in ("a", "b")]  # type: ignore[arg-type]
    assert found == [(StopReason.RED, "d"), (StopReason.RED, "d")]
    assert street.asked == ["a", "c", "d", "b"]


@pytest.mark.slow
@pytest.mark.parametrize(("until", "dissolved"), [(280.0, False), (400.0, True)])
def test_a_light_that_never_turns_green_is_named_with_place_and_time(
    prepare: Prepare, grid: Path, tmp_path: Path, until: float, dissolved: bool
) -> None:
    """And so is the vehicle in front of it, which SUMO lifts over after 300 s."""
    net = grid.read_text()
    light = re.search(r'<tlLogic id="B1".*?state="(\w+)"', net, re.DOTALL)
    assert light is not None
    red = (
        '<additional><tlLogic id="B1" type="static" programID="red" offset="0">'
        f'<phase duration="9999" state="{"r" * len(light[1])}"/></tlLogic></additional>'
    )
    car = (
        '<vehicle id="car0" type="car" depart="0" departLane="1">'
        '<route edges="A1B1 B1C1"/></vehicle>'
    )
    run = prepare(cars=1, walker=False, routes=f"<routes>{TYPES}\n{car}\n</routes>")
    settings = SumocfgSettings(until=until, step_length=0.5, seed=7, signals=True)
    files = {**run.sumo_files, "signals.add.xml": red, "scenario.sumocfg": sumo_config(settings)}
    run = replace(run, plan=replace(run.plan, until=until), sumo_files=files)
    expect_runs(2)  # so that its process leaves the results to be made here
    result = run_prepared(run, tmp_path / "run")
    assert result.status == "completed", result.summary["error"]

    text = (tmp_path / "run" / "events.json").read_text()
    (alone := tmp_path / "alone").mkdir()
    run.write(alone)
    assert run_worker(alone).error is None
    assert (alone / "events.json").read_text() == text
    events = events_from_json(text)
    (jam,) = [event for event in events if event.kind is EventKind.JAM_BEGIN]
    assert (jam.actor, jam.lane, jam.detail) == ("car0", "A1B1_1", StopReason.RED)
    rows = pl.read_parquet(tmp_path / "run" / "trajectories.parquet")
    assert jam.waited is not None
    stood = rows.filter(
        (pl.col("vehicle_id") == "car0")
        & pl.col("timestep_time").is_between(jam.time - jam.waited + 0.5, jam.time - 0.5)
    )
    assert stood["vehicle_speed"].max() < 0.1  # type: ignore[operator]
    assert (stood["vehicle_x"][-1], stood["vehicle_y"][-1]) == pytest.approx((jam.x, jam.y))

    gridlock = result.summary["gridlock"]
    assert gridlock["jams"] == 1
    assert (gridlock["jams_at_the_end"], gridlock["moved_on"]) == ((0, 1) if dissolved else (1, 0))
    places = {place["kind"]: place for place in gridlock["places"]}
    assert (places["jam"]["until"] is not None) == dissolved
    assert {place["reason"] for place in places.values()} == {StopReason.RED}
    assert all(place["lane"] == "A1B1_1" for place in places.values())
    if dissolved:
        teleported = places["moved_on"]
        assert teleported["until"] - teleported["time"] == pytest.approx(300.0, abs=1.0)


def test_a_vehicle_that_cannot_get_to_its_lane_takes_another_route_and_is_no_jam(
    prepare: Prepare, tmp_path: Path
) -> None:
    """The left lane is full of parked cars, and the one on the right is to turn left."""
    parked = "\n".join(
        f'<vehicle id="parked{k}" type="car" depart="0" departLane="2" departPos="{x}"'
        ' departSpeed="0" insertionChecks="none"><route edges="A1B1 B1C1"/>'
        f'<stop lane="A1B1_2" endPos="{x + 0.1}" duration="1000"/></vehicle>'
        for k, x in enumerate(range(25, 100, 6))
    )
    left = (
        '<vehicle id="car0" type="car" depart="1" departLane="1" departPos="80">'
        '<route edges="A1B1 B1B2"/></vehicle>'
    )
    run = prepare(cars=1, walker=False, routes=f"<routes>{TYPES}\n{parked}\n{left}\n</routes>")
    result = run_prepared(replace(run, plan=replace(run.plan, until=260.0)), tmp_path / "run")
    assert result.status == "completed", result.summary["error"]
    events = events_from_json((tmp_path / "run" / "events.json").read_text())
    found = [event for event in events if event.kind is EventKind.ROUTE_CHANGED]
    # Around the block there is no other way than back to the same lane.
    assert {(event.actor, event.lane, event.detail) for event in found} == {
        ("car0", "A1B1_1", StopReason.WRONG_LANE)
    }
    assert found[0].waited == pytest.approx(60.0, abs=1.0)
    assert result.summary["gridlock"]["places"] == []
