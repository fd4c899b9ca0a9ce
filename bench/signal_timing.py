"""What timing lights after demand gains: delay, paired over five seeds, with 95 % intervals.

Five comparisons on shipped maps, twenty minutes each and an hour with buses: Webster's splits
against equal ones with the same cycle; left turns with an arrow beside gaps, where the volumes ask
for it, against gaps alone; a green wave against lights that begin at once; actuated
against fixed-time control at half the demand; priority for buses. Prints the table of
``docs/signals.md``. A change is significant where its interval does not contain 0.

Demands of the crossing are set before anything is run: fractions of the volume at which Webster's Y
reaches what the longest cycle can carry, 1 - L / 120 s.
"""

from __future__ import annotations

import itertools
import json
import math
import statistics
import tempfile
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from odscen.app.demand.demands import add_background
from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.app.signals.green_waves import coordinate_signals
from odscen.app.signals.signal_optimisation import time_signals
from odscen.app.signals.turn_arrows import with_turn_arrows
from odscen.base.categories import Category
from odscen.lanegraph.query import node_id
from odscen.maps.store import Workspace
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.signals_document import Signals
from odscen.scenario.edits.edit_registry import changed_part, with_fields
from odscen.scenario.signals.webster import LONGEST_CYCLE, whole_seconds

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario

MAPS = Path(__file__).parents[1] / "maps"
SEEDS = (1, 2, 3, 4, 5)
UNTIL = 1200.0
BUS_UNTIL = 3600.0
"""Seconds with buses: a tenth of the traffic is few in twenty minutes."""
T_FOUR = 2.776
"""Student's t for 95 % of five pairs."""

LEVELS = (0.4, 0.5, 0.6, 0.7, 0.8)
"""Fractions of capacity."""

BUS_LEVELS = (0.4, 0.6)
"""Of them those with buses."""

MAJOR = 4.0
"""Vehicles on each leg of the main road for one on each leg of the side road."""


SETTINGS = RunSettings(recording=Recording(trajectories=False, emissions=False))

CLOSE = 5.0
"""Vehicles an hour to which capacity is found."""


class Delays(NamedTuple):
    """Mean time loss with insertion delay, seconds; ``along`` of those along a corridor."""

    every: float
    buses: float
    others: float
    along: float


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(folder))
        for name in ("signal_crossing", "town_5x5"):
            workspace.add_map(MAPS / f"{name}.xodr")
        print("| comparison | without, s | with, s | change of mean delay, s (95 %) |")
        print("|---|---|---|---|")
        bench = _Bench(workspace)
        bench.splits()
        bench.arrows()
        bench.wave()
        bench.actuation()
        bench.buses()


class _Bench:
    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._runs = 0
        self._graphs: dict[str, MapGraph] = {}
        self._done: dict[str, Delays] = {}

    def splits(self) -> None:
        for level in LEVELS:
            self._compare(
                f"Webster's splits against equal ones, {self._words(level)}",
                lambda seed, f=level: self._timed(self._crossing(seed, f), equal=True),
                lambda seed, f=level: self._timed(self._crossing(seed, f)),
                ("every",),
            )

    def arrows(self) -> None:
        for level in LEVELS:
            self._compare(
                f"protected-permissive against permissive left turns, {self._words(level)}",
                lambda seed, f=level: self._timed(self._crossing(seed, f)),
                lambda seed, f=level: self._timed(self._with_arrows(self._crossing(seed, f))),
                ("every",),
            )

    def wave(self) -> None:
        for favoured, words in (("out", "along"), ("both", "both directions")):
            found = coordinate_signals(
                self._workspace, self._avenue(1), along=["Avenue"], favoured=favoured
            )
            bands = ", ".join(
                f"{name} {band.seconds:.0f} s ({100 * band.seconds / found.cycle:.0f} %)"
                for name, band in (("along", found.out), ("back", found.back))
            )
            name = f"green wave on the Avenue, {words}: bands {bands} of {found.cycle:.0f} s"
            self._compare(
                name,
                lambda seed, f=favoured: self._waved(seed, f, offsets=False),
                lambda seed, f=favoured: self._waved(seed, f, offsets=True),
                ("along", "every"),
            )

    def actuation(self) -> None:
        high, low = LEVELS[-1], LEVELS[-1] / 2.0
        for level in (high, low):

            def made(seed: int, control: str, level: float = level) -> Scenario:
                timed = self._timed(self._crossing(seed, level)).signals
                half = self._crossing(seed, low)
                return with_fields(half, signals=changed_part(timed, {"control": control}))

            self._compare(
                f"actuated against fixed-time control timed for {self._words(level)}, "
                f"with {self._words(low)}",
                lambda seed, made=made: made(seed, "fixed"),
                lambda seed, made=made: made(seed, "actuated"),
                ("every",),
            )

    def buses(self) -> None:
        for level, control in itertools.product(BUS_LEVELS, ("fixed", "actuated")):

            def made(
                seed: int, asked: bool, level: float = level, control: str = control
            ) -> Scenario:
                timed = self._timed(self._crossing(seed, level, buses=0.1, until=BUS_UNTIL))
                changes = {"control": control, "bus_priority": asked}
                return with_fields(timed, signals=changed_part(timed.signals, changes))

            self._compare(
                f"bus priority, {control} control, {self._words(level)}, a tenth of them buses",
                lambda seed, made=made: made(seed, False),
                lambda seed, made=made: made(seed, True),
                ("buses", "others"),
            )

    def _compare(
        self,
        name: str,
        without: Callable[[int], Scenario],
        including: Callable[[int], Scenario],
        fields: tuple[str, ...],
    ) -> None:
        pairs = [(self._run(without(seed)), self._run(including(seed))) for seed in SEEDS]
        for field in fields:
            before = [getattr(one, field) for one, _ in pairs]
            after = [getattr(other, field) for _, other in pairs]
            changes = [b - a for a, b in zip(before, after, strict=True)]
            half = T_FOUR * statistics.stdev(changes) / math.sqrt(len(changes))
            mean = statistics.fmean(changes)
            words = {"every": "all", "along": "those along the Avenue"}.get(field, field)
            mark = "" if abs(mean) > half else ", not significant"
            print(
                f"| {name}: {words} | {statistics.fmean(before):.1f} | "
                f"{statistics.fmean(after):.1f} | {mean:+.1f} ({mean - half:+.1f} to "
                f"{mean + half:+.1f}){mark} |",
                flush=True,
            )

    def _run(self, scenario: Scenario) -> Delays:
        """Delays of a run, which is carried out once however often it is compared."""
        text = scenario.model_dump_json()
        if text not in self._done:
            self._done[text] = self._carried_out(scenario)
        return self._done[text]

    def _carried_out(self, scenario: Scenario) -> Delays:
        self._runs += 1
        done = run(self._workspace, scenario, name=f"run{self._runs}", settings=SETTINGS)
        plan = json.loads((done.folder / "plan.json").read_text())
        kinds = {actor["id"]: actor["category"] for actor in plan["actors"]}
        planned = {actor["id"]: actor["depart"] for actor in plan["actors"]}
        flows = {actor["id"]: actor.get("flow") or "" for actor in plan["actors"]}
        until = scenario.simulation.duration
        delays: dict[str, float] = {name: until - depart for name, depart in planned.items()}
        rows = pl.read_parquet(done.folder / "trips.parquet").filter(~pl.col("person"))
        for name, depart, loss in rows.select("id", "depart", "time_loss").iter_rows():
            delays[name] = loss + max(0.0, depart - planned[name])
        return Delays(
            _mean(delays, lambda name: name in kinds),
            _mean(delays, lambda name: kinds[name] == "bus"),
            _mean(delays, lambda name: kinds[name] != "bus"),
            _mean(delays, lambda name: flows[name].startswith("flow-")),
        )

    def _timed(self, scenario: Scenario, *, equal: bool = False) -> Scenario:
        timed = time_signals(self._workspace, scenario)
        if not equal:
            return timed.scenario
        (light,) = timed.lights
        greens = light.times.green
        share = sum(greens) / len(greens)
        same = whole_seconds(dict.fromkeys(range(len(greens)), share), sum(greens))
        (timing,) = timed.scenario.signals.junctions
        entry = changed_part(timing, {"green": same})
        return with_fields(scenario, signals=Signals(junctions=(entry,)))

    def _with_arrows(self, scenario: Scenario) -> Scenario:
        return with_turn_arrows(self._workspace, scenario)[0]

    def _waved(self, seed: int, favoured: str, *, offsets: bool) -> Scenario:
        found = coordinate_signals(
            self._workspace, self._avenue(seed), along=["Avenue"], favoured=favoured
        ).scenario
        if offsets:
            return found
        plain = tuple(changed_part(one, {"offset": 0.0}) for one in found.signals.junctions)
        return with_fields(found, signals=changed_part(found.signals, {"junctions": plain}))

    def _words(self, level: float) -> str:
        major, minor = self._volumes(level)
        return f"{major:.0f} and {minor:.0f} veh/h a leg ({level:g} of capacity)"

    def _volumes(self, level: float) -> tuple[float, float]:
        """Vehicles an hour on legs of the main and the side road, at a fraction of capacity."""
        return level * self.capacity, level * self.capacity / MAJOR

    @cached_property
    def capacity(self) -> float:
        """Vehicles an hour on a leg of the main road that the longest cycle just carries."""
        low, high = 100.0, 2000.0
        while high - low > CLOSE:
            middle = (low + high) / 2.0
            low, high = (middle, high) if self._spare(middle) > 0.0 else (low, middle)
        return low

    def _spare(self, major: float) -> float:
        """What the longest cycle can carry less Webster's Y, mean of the seeds."""
        found = []
        for seed in SEEDS:
            one = self._loaded(seed, major, major / MAJOR)
            (light,) = time_signals(self._workspace, one).lights
            found.append(1.0 - light.splits.lost / LONGEST_CYCLE - light.splits.flow_ratio)
        return statistics.fmean(found)

    def _crossing(
        self, seed: int, level: float, *, buses: float = 0.0, until: float = UNTIL
    ) -> Scenario:
        return self._loaded(seed, *self._volumes(level), buses=buses, until=until)

    def _loaded(
        self, seed: int, major: float, minor: float, *, buses: float = 0.0, until: float = UNTIL
    ) -> Scenario:
        graph = self._graph("signal_crossing")
        one = edits.new_scenario(graph, name="crossing", roi=graph.segments.ids, seed=seed)
        mix = {Category.CAR: 1.0 - buses, Category.BUS: buses} if buses else {Category.CAR: 1.0}
        for road, spawn in _entries(graph).items():
            volume = major if road in ("1", "3") else minor
            one = edits.add_flow(one, graph, spawn=spawn, per_hour=volume, mix=mix, end=until)
        one = edits.set_signal_control(one, control="fixed")
        return edits.set_simulation(one, duration=until)

    def _avenue(self, seed: int) -> Scenario:
        graph = self._graph("town_5x5")
        one = edits.new_scenario(graph, name="avenue", roi=graph.segments.ids, seed=seed)
        one = edits.set_signal_control(one, control="fixed")
        one = edits.set_simulation(one, duration=UNTIL)
        for first, last in (("r2", "r50"), ("r51", "r4")):
            spawn, goal = _through(graph, first, last)
            one = edits.add_flow(
                one, graph, spawn=spawn, goal=goal, per_hour=200.0, end=UNTIL,
                mix={Category.CAR: 1.0},
            )  # fmt: skip
        return add_background(self._workspace, one, name="others", per_km=4.0)

    def _graph(self, name: str) -> MapGraph:
        if name not in self._graphs:
            self._graphs[name] = load_map(self._workspace.map(name)).sumo.graph
        return self._graphs[name]


def _mean(delays: Mapping[str, float], chosen: Callable[[str], bool]) -> float:
    found = [delay for name, delay in delays.items() if chosen(name)]
    return statistics.fmean(found) if found else 0.0


def _entries(graph: MapGraph) -> dict[str, str]:
    """First node of the second car lane of each leg."""
    lanes = graph.lanes
    starts = np.setdiff1d(np.arange(len(lanes.x)), lanes.target)
    found = {}
    for node in starts.tolist():
        key = lanes.lanes.keys[lanes.lane[node]]
        if key.lane == -2:
            found[str(key.road)] = node_id(graph, node)
    return dict(sorted(found.items()))


def _through(graph: MapGraph, first: str, last: str) -> tuple[str, str]:
    """Nodes in the middle of two segments, one of which can be driven to from the other."""
    from odscen.lanegraph.shortest_paths import Router

    lanes = graph.lanes
    row = {str(name): n for n, name in enumerate(graph.segments.ids)}
    starts, goals = (np.flatnonzero(lanes.segment == row[name]) for name in (first, last))
    router = Router(graph, None)
    best = None
    for start in starts[:: max(len(starts) // 12, 1)].tolist():
        far = router.distances(start)[goals]
        if np.isfinite(far).any():
            found = float(far.min()), start, int(goals[np.isfinite(far)][-1])
            best = found if best is None else min(best, found)
    assert best is not None
    return node_id(graph, best[1]), node_id(graph, best[2])
