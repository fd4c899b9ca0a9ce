"""How good generated traffic is, map by map, beside baselines and SUMO's own."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.app.learned.evaluated_scenes import (
    placed_at_random,
    scenario_of,
    scene_of_actors,
    scene_of_scenario,
    scenes_of,
)
from odscen.app.learned.learned_maps import examples_of, whole_map
from odscen.app.learned.snapshot_data import BRAKING_SECONDS, braking_of
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.app.scenarios import read_scenario, scenario_files
from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.learning.fill import VEHICLES, Fill, checked_fill
from odscen.learning.reference.binned_statistics import place_binned
from odscen.learning.reference.model_training import binned_statistics, placed
from odscen.learning.reference.reference_generator import ReferenceGenerator, names_of
from odscen.learning.traffic_metrics import (
    MEASURES,
    TrafficScene,
    interval,
    novelty,
    scene_features,
    together,
)
from odscen.learning.traffic_snapshots import no_lights
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.distributions import stream
from odscen.sumo.realize.signals_ahead import lights_at_start

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.app.learned.learned_maps import WholeMap
    from odscen.base.arrays import FloatArray
    from odscen.learning.fill import FillRequest
    from odscen.learning.reference.traffic_model import TrafficModel
    from odscen.learning.traffic_metrics import VehicleRows
    from odscen.learning.traffic_snapshots import LightView, Shard
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Actor, Scenario


# ------------------------ what SUMO does with generated traffic in its first two seconds, above all
HARD = 4.0
"""m/s²; a vehicle that brakes harder brakes hard. SUMO's cars brake with up to 4.5 as a habit."""
STEP = 0.5


class FirstSeconds(NamedTuple):
    """What became of the vehicles of one scenario.

    ``braking`` is the strongest deceleration of each that came onto the road, m/s²; ``collided``
    and ``inserted`` are shares of those planned.
    """

    braking: FloatArray
    collided: float
    inserted: float


def first_seconds(workspace: Workspace, scenarios: Sequence[Scenario]) -> list[FirstSeconds]:
    """Run scenarios for two seconds.

    Raises
    ------
    ScenarioError
        With every error of a scenario.
    InputError
        If a run fails.
    """
    with scratch_folder() as folder:
        settings = RunSettings(
            until=BRAKING_SECONDS + STEP,
            step_length=STEP,
            warm_up=0.0,
            recording=Recording(emissions=False),
        )
        checked = [
            check_run(workspace, scenario, name=f"{place:03d}", out=folder, settings=settings)
            for place, scenario in enumerate(scenarios)
        ]
        seconds = []
        for run in run_all(checked, reports=False, figures=False):
            if run.exit_code == 3:
                raise InputError(
                    f"the run has failed: {run.known.get('error')}", file=run.known.get("scenario")
                )
            rows = run.trajectories()
            rows = rows.filter(rows["category"] != str(Category.PEDESTRIAN))
            first = rows.filter(rows["time"] < STEP / 2.0)["id"].to_list()
            planned = max(run.counts["planned"], 1)
            braking = braking_of(rows, 0.0, first)
            seconds.append(
                FirstSeconds(
                    braking[~np.isnan(braking)],
                    run.counts["collided"] / planned,
                    run.counts["inserted"] / planned,
                )
            )
    return seconds


# ----------------------- how good generated traffic is, map by map, beside baselines and SUMO's own
FLOOR, REFERENCE, BINNED, RANDOM = "SUMO", "reference", "binned statistics", "random fill"
NEAR = 1
"""Nodes: a vehicle nearer to one of a known snapshot is no new one."""
SCENES = 12
"""Fills of each map that are compared, at most."""
DRAWS = 20
RUN = 3
"""Fills of each map that are run for two seconds, as full as snapshots at even steps of size."""


class MeasuredValue(NamedTuple):
    """A value with its 90 % bootstrap interval over snapshots."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class TrafficQuality:
    """How one source of traffic does on one map.

    Attributes
    ----------
    map_name
        The map.
    source
        Where the traffic comes from.
    scenes, vehicles
        How many scenes, and vehicles in the mean.
    values
        By name: ``frechet``, ``mmd``, ``jsd_gap``, ``jsd_speed``, ``jsd_junction``,
        ``jsd_heading``, ``stopped`` (share), ``novelty``, ``off_road``, and where traffic was run
        ``hard_braking``, ``collided`` and ``inserted`` (shares).
    """

    map_name: str
    source: str
    scenes: int
    vehicles: float
    values: dict[str, MeasuredValue]

    def to_dict(self) -> dict[str, Any]:
        """As values that JSON can hold, ``None`` for those that are not known."""
        values = {
            name: {part: None if math.isnan(number) else number for part, number in pairs}
            for name, pairs in (
                (name, value._asdict().items()) for name, value in self.values.items()
            )
        }
        return {**asdict(self), "values": values}


def evaluate_model(
    workspace: Workspace,
    shards: Sequence[Shard],
    others: Sequence[Shard],
    *,
    model: TrafficModel | None = None,
    seed: int = 0,
    run: bool = True,
    baselines: bool = True,
    most: int = SCENES,
    draws: int = DRAWS,
    told: Callable[[str], None] | None = None,
) -> list[TrafficQuality]:
    """Evaluate a model and the baselines on the maps of shards.

    For each snapshot traffic is asked for with its number of vehicles and its lights, and checked
    as every fill is. SUMO's own row compares its runs of odd numbers with those of even ones.

    Parameters
    ----------
    shards
        What is compared with.
    others
        What binned statistics are made of; the towns of ``shards`` are left out.
    model
        The model that ships if not given.
    run
        Whether fills are run for two seconds.
    baselines
        Whether random fill and binned statistics are measured as well.
    most
        Fills of each map; they are like snapshots at even steps of the data.
    draws
        Of the bootstrap for the intervals.
    """
    towns = {shard.town for shard in shards}
    known = [place for place in others if place.town not in towns]
    count = known if baselines else []
    statistics = binned_statistics(examples_of(workspace, count)) if count else None
    generator = ReferenceGenerator(model)

    def by_reference(on: WholeMap, request: FillRequest, rng: np.random.Generator) -> Fill:
        return generator.fill(on.region.graph, request, rng)

    def by_bins(on: WholeMap, request: FillRequest, rng: np.random.Generator) -> Fill:
        assert statistics is not None
        lengths = np.array([request.bodies[category].length for category in VEHICLES])
        site, allowed = on.learned.site, on.learned.allowed
        placed = place_binned(
            statistics, site, request.lights, allowed,
            wanted=request.vehicles, lengths=lengths, rng=rng,
        )  # fmt: skip
        return Fill(placed.node, names_of(placed.category), initial_speed=placed.speed)

    sources = {REFERENCE: by_reference, BINNED: by_bins, RANDOM: placed_at_random}
    if statistics is None:
        del sources[BINNED]
    if not baselines:
        del sources[RANDOM]
    qualities = []
    for name in sorted({shard.map_name for shard in shards}):
        mine = [shard for shard in shards if shard.map_name == name]
        on = whole_map(workspace.map_for(name, mine[0].map_sha256))
        compared = _ComparedMap(on, scenes_of(workspace, mine), workspace, draws)
        qualities.append(compared.floor(mine))
        for source, place in sources.items():
            if told is not None:
                told(f"{name}: {source}")
            made = compared.filled(place, seed, most)
            qualities.append(compared.quality(source, made, run=run))
    return qualities


def evaluate_scenarios(
    workspace: Workspace, folder: Path, shards: Sequence[Shard], *, run: bool = True
) -> list[TrafficQuality]:
    """Compare scenarios, whoever has made them, with snapshots of SUMO on the same maps.

    Vehicles that depart at the beginning count; those without an initial speed are stopped.

    Raises
    ------
    InputError
        If there are no scenarios, or no snapshots of the map of one.
    """
    scenarios = [read_scenario(file) for file in scenario_files([folder])]
    qualities = []
    for name in sorted({scenario.map.name for scenario in scenarios}):
        mine = [shard for shard in shards if shard.map_name == name]
        if not mine:
            known = ", ".join(sorted({shard.map_name for shard in shards}))
            raise InputError(
                f"there are no snapshots of map {name!r} to compare with; there are of {known}",
                file=str(folder),
                element="data",
            )
        on = whole_map(workspace.map_for(name, mine[0].map_sha256))
        compared = _ComparedMap(on, scenes_of(workspace, mine), workspace)
        own = [scenario for scenario in scenarios if scenario.map.name == name]
        lights = [lights_at_start(on.loaded.sumo, scenario.signals) for scenario in own]
        scenes, off = zip(
            *(scene_of_scenario(on, *pair) for pair in zip(own, lights, strict=True)), strict=True
        )
        made = _MadeTraffic(list(scenes), float(np.mean(off)), own)
        qualities += [compared.floor(mine), compared.quality(folder.name, made, run=run)]
    return qualities


class _MadeTraffic(NamedTuple):
    """Scenes of one source, the share of vehicles that were off the road, and scenarios to run."""

    scenes: list[TrafficScene]
    off_road: float
    scenarios: list[Scenario]


class _ComparedMap:
    """The reference of one map, and what is compared with it."""

    def __init__(
        self,
        on: WholeMap,
        scenes: list[TrafficScene],
        workspace: Workspace,
        draws: int = DRAWS,
    ) -> None:
        self._draws = draws
        self._on, self._scenes, self._workspace = on, scenes, workspace
        self._rows = self._scene_rows(scenes)

    def floor(self, shards: Sequence[Shard]) -> TrafficQuality:
        """SUMO's own traffic: runs of even numbers compared with those of odd ones."""
        runs = list(dict.fromkeys(scene.name for scene in self._scenes))
        even = [place for place, scene in enumerate(self._scenes) if runs.index(scene.name) % 2]
        odd = [place for place in range(len(self._scenes)) if place not in even]
        values: dict[str, MeasuredValue] = {}
        if even:
            scenes = [self._scenes[place] for place in even]
            rows = [self._rows[place] for place in even]
            reference = [self._rows[place] for place in odd]
            known = [self._scenes[place] for place in odd]
            values = _measure_values(scenes, rows, reference, self._draws)
            values["novelty"] = _value_without_interval(novelty(scenes, known, near=NEAR))
        stopped = MEASURES["stopped"]
        values["stopped"] = _with_interval(
            self._scenes,
            lambda some: stopped(self._rows[0], self._pick_rows(self._rows, some)),
            self._draws,
        )
        examples = examples_of(self._workspace, shards)
        values["hard_braking"] = _measure_hard_braking(
            [example.snapshot.braking[placed(example)] for example in examples]
        )
        return self._measure_quality(FLOOR, self._scenes, values)

    def filled(
        self,
        source: Callable[[WholeMap, FillRequest, np.random.Generator], Fill],
        seed: int,
        most: int,
    ) -> _MadeTraffic:
        """Ask for traffic like that of each scene, and for some with the lights of a beginning."""
        on, scenes, off = self._on, [], []
        for number, place in enumerate(_even_steps(len(self._scenes), most)):
            scene = self._scenes[place]
            actors, dropped = self._ask_generator(
                source, len(scene.node), scene.lights, seed, number
            )
            scenes.append(scene_of_actors(on, actors, scene.lights, name=scene.name))
            off.append(dropped)
        lights = lights_at_start(on.loaded.sumo)
        by_size = sorted(range(len(self._scenes)), key=lambda k: len(self._scenes[k].node))
        scenarios = []
        for number in (by_size[place] for place in _even_steps(len(by_size), RUN)):
            wanted = len(self._scenes[number].node)
            actors, _ = self._ask_generator(source, wanted, lights, seed, len(scenes) + number)
            scenarios.append(scenario_of(on, actors, number))
        return _MadeTraffic(scenes, float(np.mean(off)), scenarios)

    def quality(self, source: str, made: _MadeTraffic, *, run: bool) -> TrafficQuality:
        """Compare scenes, and run what is to be run."""
        values = _measure_values(
            made.scenes, self._scene_rows(made.scenes), self._rows, self._draws
        )
        values["novelty"] = _value_without_interval(novelty(made.scenes, self._scenes, near=NEAR))
        values["off_road"] = _value_without_interval(made.off_road)
        runnable = [scenario for scenario in made.scenarios if scenario.actors]
        if run and runnable:
            outcomes = first_seconds(self._workspace, runnable)
            values["hard_braking"] = _measure_hard_braking(
                [outcome.braking for outcome in outcomes]
            )
            values["collided"] = _value_without_interval(
                float(np.mean([outcome.collided for outcome in outcomes]))
            )
            values["inserted"] = _value_without_interval(
                float(np.mean([outcome.inserted for outcome in outcomes]))
            )
        return self._measure_quality(source, made.scenes, values)

    def _ask_generator(
        self,
        place: Callable[[WholeMap, FillRequest, np.random.Generator], Fill],
        wanted: int,
        lights: LightView,
        seed: int,
        number: int,
    ) -> tuple[tuple[Actor, ...], float]:
        """Actors of one fill, and the share of it that the check has dropped."""
        request = self._on.request(wanted, lights, seed=seed)
        rng = stream(seed, "evaluation", str(number))
        checked = checked_fill(place(self._on, request, rng), request, self._on.region)
        dropped = 1.0 - len(checked.actors) / checked.given if checked.given else 0.0
        return checked.actors, dropped

    def _scene_rows(self, scenes: Sequence[TrafficScene]) -> list[VehicleRows]:
        lanes, site = self._on.region.graph.lanes, self._on.learned.site
        return [scene_features(lanes, site, scene) for scene in scenes]

    def _pick_rows(self, rows: Sequence[VehicleRows], some: Sequence[int]) -> VehicleRows:
        return together([rows[place] for place in some])

    def _measure_quality(
        self, source: str, scenes: Sequence[TrafficScene], values: dict[str, MeasuredValue]
    ) -> TrafficQuality:
        mean = float(np.mean([len(scene.node) for scene in scenes])) if scenes else 0.0
        name = self._on.region.graph.map_name
        return TrafficQuality(name, source, len(scenes), mean, values)


def _even_steps(count: int, most: int) -> list[int]:
    """Places at even steps, ``most`` of them at most; of a run with snapshots, early and late."""
    wanted = max(min(count, most), 1)
    return [int((place + 0.5) / wanted * count) for place in range(wanted)]


def _measure_values(
    scenes: Sequence[TrafficScene],
    rows: Sequence[VehicleRows],
    reference: Sequence[VehicleRows],
    draws: int,
) -> dict[str, MeasuredValue]:
    against = together(reference)
    if sum(len(row.speed) for row in rows) < 2:
        return {}
    return {
        name: _with_interval(
            scenes,
            lambda some, m=measure: m(against, together([rows[k] for k in some])),  # type: ignore[misc]
            draws,
        )
        for name, measure in MEASURES.items()
    }


def _with_interval(
    scenes: Sequence[TrafficScene], measure: Callable[[Sequence[int]], float], draws: int = DRAWS
) -> MeasuredValue:
    return MeasuredValue(measure(range(len(scenes))), *interval(scenes, measure, draws=draws))


def _value_without_interval(value: float) -> MeasuredValue:
    """A value without an interval."""
    return MeasuredValue(value, float("nan"), float("nan"))


def _measure_hard_braking(groups: Sequence[FloatArray]) -> MeasuredValue:
    """Share of vehicles that brake hard, of groups that are drawn together for the interval."""
    hard = [group[~np.isnan(group)] > HARD for group in groups]
    nobody = np.empty(0, dtype=np.int64)
    scenes = [TrafficScene(nobody, nobody, np.empty(0), no_lights(0)) for _ in hard]

    def share(some: Sequence[int]) -> float:
        chosen = np.concatenate([hard[place] for place in some])
        return float(chosen.mean()) if len(chosen) else float("nan")

    return _with_interval(scenes, share)
