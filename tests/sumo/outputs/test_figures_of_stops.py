"""Figures of lines and parking held against the stop output of plain SUMO in the same run.

The run's own files go to ``sumo -c`` once more; what it writes is counted here by other means, stop
by stop and second by second.
"""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.summary import actors_from_json
from odscen.figures.measures.timetable import stops_served
from odscen.runs.measured import read_run_data
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.parking_case import PLACES, parking_scenario, parking_town
from tests.sumo.conftest import BIN
from tests.sumo.realize.transit.test_lines_on_maps import MAP, line
from tests.sumo.runner.test_on_maps import built, net_file

if TYPE_CHECKING:
    from odscen.figures.measures.figure import RunData
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap

CLOSE = 0.01
"""Of a figure: one per cent."""


def run_both(
    scenario: Scenario, sumo_map: SumoMap, net: Path, folder: Path
) -> tuple[RunData, list[ET.Element]]:
    """Our figures of a run, and the stops that plain SUMO writes of it."""
    # In long steps nothing steers vehicles but SUMO, so that it drives the same by itself.
    settings = RunSettings(step_length=1.0)
    done = run_prepared(prepare(scenario, sumo_map, net, settings=settings), folder / "run")
    subprocess.run(
        [BIN / "sumo", "-c", "sumo/scenario.sumocfg"], cwd=done.folder, check=True,
        capture_output=True,
    )  # fmt: skip
    outcomes = actors_from_json((done.folder / "actors.json").read_text("utf-8"))
    data = read_run_data(done.folder, outcomes, end=float(done.summary["sim_seconds"]))
    stops = ET.parse(done.folder / "sumo" / "stopinfo.xml").getroot().findall("stopinfo")
    return data, stops


def test_figures_of_lines_are_those_of_the_stop_output(tmp_path: Path) -> None:
    # Scheduled a little early, so that some departures are late, and by more than 5 min.
    stops: Any = ({"stop": "first", "after": 20}, {"stop": "second", "after": 30})
    dwell = {"kind": "choice", "values": [15, 320]}
    scenario = line(stops=stops, dwell=dwell, headway=200, bay=True, duration=1800)
    data, found = run_both(scenario, built(MAP).sumo, net_file(MAP, tmp_path), tmp_path)
    ended = [one.attrib for one in found if float(one.get("ended", "-1")) >= 0.0]
    late = np.array([max(float(one["delay"]), 0.0) for one in ended])
    assert len(ended) > 8
    assert 0.0 < (late <= 300.0).mean() < 1.0
    values = figure_values(data)
    assert values["stops_served"] == len(ended)
    assert values["departure_lateness"] == pytest.approx(late.mean(), rel=CLOSE)
    assert values["on_time_departures"] == pytest.approx((late <= 300.0).mean(), rel=CLOSE)
    assert data.visits is not None
    for _, stop, visits, dwell, delay, *_ in stops_served(data.visits).iter_rows():
        own = [one for one in ended if one["busStop"] == stop]
        stood = [float(one["ended"]) - float(one["started"]) for one in own]
        assert visits == len(own)
        assert dwell == pytest.approx(np.mean(stood), rel=CLOSE)
        assert delay == pytest.approx(
            np.mean([max(float(one["delay"]), 0.0) for one in own]), rel=CLOSE
        )


@pytest.mark.slow
def test_figures_of_parking_are_those_of_the_stop_output(tmp_path: Path) -> None:
    parking: dict[str, object] = {
        "begin": 0.3, "end": 0.6, "stay": {"kind": "uniform", "low": 100, "high": 300},
    }  # fmt: skip
    net = tmp_path / "net.net.xml"
    net.write_bytes(parking_town().net_xml)
    scenario = parking_scenario(parking, trips=120)
    data, found = run_both(scenario, parking_town().sumo, net, tmp_path)
    end = data.end
    assert data.parking is not None
    assert end is not None
    seconds = np.arange(0.0, end, 0.5)
    taken: dict[str, np.ndarray] = {}
    ended: dict[str, int] = {}
    for one in (stop.attrib for stop in found):
        if float(one["started"]) < 0.0:  # was on its way when the run ended
            continue
        area, left = one["parkingArea"], float(one["ended"])
        there = (seconds >= float(one["started"])) & (seconds < (left if left >= 0 else end))
        whole = area.removesuffix(".begin")
        taken[whole] = taken.get(whole, np.zeros(len(seconds))) + there
        ended[whole] = ended.get(whole, 0) + (whole == area)
    values = figure_values(data)
    assert values["parked_trips"] == sum(ended.values())
    places = PLACES * len(data.parking.areas)
    mean = sum(one.mean() for one in taken.values()) / places
    assert values["parking_occupancy"] == pytest.approx(mean, rel=CLOSE)
    for area, counts in taken.items():
        use = data.parking.use(area)
        assert use.ended == ended[area]
        assert use.highest == counts.max()
        assert use.occupancy == pytest.approx(counts.mean() / PLACES, rel=CLOSE)
        assert use.full == pytest.approx((counts >= PLACES).mean(), rel=CLOSE, abs=0.002)
