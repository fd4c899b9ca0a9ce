"""How road users move in runs of SUMO: changes of lanes in time, curves by lateral acceleration."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from odscen.app.running.runs import run
from odscen.app.scenarios import read_scenario
from odscen.figures.measures.motion import implausible
from odscen.maps.store import Workspace
from odscen.runs.net_facts import read_net_facts
from odscen.runs.run_settings import RunSettings

SUITES = Path(__file__).parents[3] / "suites" / "scenarios"
MAPS = Path(__file__).parents[3] / "maps"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("step", "slices"), [(0.05, None), (0.1, None), (0.5, None), (1.0, None), (0.5, 20.0)]
)
def test_vehicles_change_lanes_in_seconds_at_every_step_length_and_in_slices(
    step, slices, tmp_path
):
    store = Workspace.open(tmp_path / "workspace")
    store.add_map(MAPS / "motorway_weave.xodr")
    scenario = read_scenario(SUITES / "motorway_weave.scenario.json")
    settings = RunSettings(step_length=step, slice_length=slices)
    done = run(store, scenario, settings=settings, out=tmp_path / "run")
    facts = read_net_facts(done.folder)
    assert facts is not None
    rows = done.trajectories().join(facts.limits.select("lane", "edge"), on="lane")
    before = rows.select(pl.col("lane", "edge").shift(1).over("id"))
    changes = rows.filter((rows["edge"] == before["edge"]) & (rows["lane"] != before["lane"]))
    assert len(changes) > 20  # there is something to see
    found = done.motion()
    assert found.filter(pl.col("kind") == "jump").is_empty()
    # At 0.05 s there is one: SUMO shifts a vehicle in a junction by more than a slip.
    assert len(found.filter(pl.col("kind") == "recorded speed")) <= (step < 0.1)
    sideways = found.filter(
        (pl.col("kind") == "lateral speed") & (pl.col("cause") == "lane change")
    )
    assert sideways.is_empty()
    lateral = implausible(found).filter(pl.col("kind") == "lateral acceleration")
    assert len(lateral) <= 0.02 * len(done.actors())
