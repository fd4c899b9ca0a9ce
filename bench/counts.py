"""Counts drawn from a known demand, and the traffic that is made from them alone.

On Town04: three hours of trips anywhere, whose turns and streams at every junction are counted in
slices of 15 minutes (as they would pass at free flow). A second scenario gets the counts and
nothing else. Aim: at least 85 % of the counts within GEH 5, those that are not named.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from bench.common import shared_maps
from odscen.app.maps import LoadedMap, load_map
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.demand.count_stations import Observation, transitions
from odscen.scenario.demand.zones import TripEnds
from odscen.scenario.document.scenario_document import (
    Background,
    Counts,
    Demand,
    Scenario,
    Simulation,
)
from odscen.scenario.placing.region import Region
from odscen.sumo.calibrate.count_fit import CountFits, planned_fit
from odscen.sumo.realize.passages import planned_passages
from odscen.sumo.realize.realization import all_road_users

HOURS = 3
SLICE = 900.0
PER_HOUR = 3000
AIM = 0.85
MIX = {"car": 8, "van": 1, "truck": 0.5, "motorcycle": 0.5}


def main() -> None:
    real = shared_maps()
    town = real / "carla-2020" / "Town04.xodr" if real else None
    if town is None or not town.is_file():
        print("Town04 is not here (set ODSCEN_TEST_MAPS)")
        return
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(folder))
        loaded = load_map(workspace.add_map(town))
        known = known_demand(loaded)
        counts = counted(known, loaded)
        scenario = known.model_copy(update={"demand": Demand(counts=(counts,)), "seed": 2})
        start = time.perf_counter()
        fit = planned_fit(scenario, loaded.sumo)
        show(fit, time.perf_counter() - start)
        wrong = spoiled(counts)
        print("\nThe same with the first stream's counts doubled:")
        demand = Demand(counts=(wrong,))
        start = time.perf_counter()
        bad = planned_fit(scenario.model_copy(update={"demand": demand}), loaded.sumo)
        show(bad, time.perf_counter() - start)
        if (fit.share_met or 0.0) < AIM or not bad.contradictions:
            sys.exit(1)


def known_demand(loaded: LoadedMap) -> Scenario:
    graph = loaded.sumo.graph
    scenario = edits.new_scenario(graph, name="known", roi=graph.segments.ids, seed=1)
    trips = Background.model_validate({"id": "known", "trips": PER_HOUR * HOURS, "mix": MIX})
    return scenario.model_copy(
        update={
            "simulation": Simulation(duration=HOURS * 3600.0),
            "demand": Demand(background=(trips,)),
        }
    )


def counted(known: Scenario, loaded: LoadedMap) -> Counts:
    """Turns and streams at every junction; those that nobody uses are not counted."""
    region = Region.of(loaded.sumo.graph, known.roi)
    users, _ = all_road_users(known, loaded.sumo, region, until=known.simulation.duration)
    places = sorted(_places(loaded))
    slices = [(k * SLICE, (k + 1) * SLICE) for k in range(int(HOURS * 3600 / SLICE))]
    seen = [Observation("known", place, *when, 0.0) for place in places for when in slices]
    ground = TripEnds(region, loaded.usable)
    passages = planned_passages(users, region, ground.router, seen)
    used = {place for place, _, _ in passages}
    rows = [
        (place, *when, float(passages.get((place, *when), 0)))
        for place in places
        if place in used
        for when in slices
    ]
    return Counts.model_validate({"id": "survey", "rows": rows, "mix": MIX})


def spoiled(counts: Counts) -> Counts:
    first = next(row[0] for row in counts.rows if row[3] > 20 and row[0].count(">") == 1)
    rows = [(p, b, e, n * 2 if p == first else n) for p, b, e, n in counts.rows]
    return Counts.model_validate({**counts.model_dump(), "rows": rows})


def _places(loaded: LoadedMap) -> set[str]:
    graph = loaded.sumo.graph
    onwards = transitions(graph)
    junctions = [
        name
        for name, kind in zip(graph.segments.ids, graph.segments.kinds, strict=True)
        if kind == "junction"
    ]
    places = set()
    for junction in junctions:
        ways_out = onwards.get(junction, set())
        places |= {f"{junction}>{other}" for other in ways_out}
        for before in (one for one, others in onwards.items() if junction in others):
            places.add(f"{before}>{junction}")
            places |= {f"{before}>{junction}>{other}" for other in ways_out}
    return places


def show(fit: CountFits, seconds: float) -> None:
    met = sum(row.met for row in fit.rows)
    seen = sum(row.counted for row in fit.rows)
    print(
        f"{met} of {len(fit.rows)} counts within GEH 5 ({met / len(fit.rows):.1%}), RMSE "
        f"{fit.rmse:.2f} vehicles, {fit.vehicles} vehicles for {seen:g} passages counted, "
        f"{len(fit.contradictions)} contradictions, {seconds:.1f} s"
    )
    for row in [row for row in fit.rows if not row.met][:20]:
        when = f"{row.begin:g} to {row.end:g} s"
        numbers = f"{row.counted:g} counted, {row.modelled} made, GEH {row.geh:.1f}"
        print(f"  {row.place} {when}: {numbers}: {row.why}")


if __name__ == "__main__":
    main()
