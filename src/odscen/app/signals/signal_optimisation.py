"""Traffic lights timed after the demand of a scenario: cycles and splits, and green waves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from odscen.app.maps import map_of
from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.app.scenarios import given_scenario
from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import Category
from odscen.base.errors import InputError, NotFoundError
from odscen.records.outcomes import RunStatus
from odscen.runs.recorded import trajectory_files
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.signals.webster import LONGEST_CYCLE, SATURATION_FLOW, SHORTEST_CYCLE
from odscen.sumo.calibrate.light_timing import (
    TimedLight,
    retimed,
    timed_light,
    timing_of,
    with_timings,
)
from odscen.sumo.calibrate.turning_volumes import (
    driven_vehicles,
    planned_vehicles,
    turning_volumes,
)
from odscen.sumo.realize.lights.light_realization import realized_lights

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.calibrate.turning_volumes import PlannedVehicle, Volumes


_MOST_SATURATION = 100_000.0
"""Vehicles an hour and lane: far more than any lane carries, and still a number to reckon with."""


@dataclass(frozen=True, slots=True)
class TimedSignals:
    """Lights timed by Webster's method.

    Attributes
    ----------
    scenario
        With the new times.
    begin, end
        Seconds of the scenario whose demand it is.
    lights
        In the order of the map.
    without
        Lights that no vehicle comes to; they keep their times.
    """

    scenario: Scenario
    begin: float
    end: float
    lights: tuple[TimedLight, ...]
    without: tuple[str, ...]

    @property
    def oversaturated(self) -> tuple[str, ...]:
        """Junctions at which more vehicles come to a lane than have green."""
        return tuple(
            ", ".join(light.times.junctions) for light in self.lights if light.oversaturated
        )

    def to_words(self) -> tuple[str, ...]:
        """What has come of it, a sentence for each light."""
        found = [
            f"Junction {', '.join(light.times.junctions)}: cycle {light.times.cycle:g} s "
            f"(was {light.before.cycle:g} s), green "
            f"{', '.join(f'{green:g}' for green in light.times.green)} s "
            f"(was {', '.join(f'{green:g}' for green in light.before.green)} s)."
            for light in self.lights
        ]
        found += [
            f"Junction {name}: no vehicle comes; it keeps its times." for name in self.without
        ]
        found += [
            f"Junction {name} is oversaturated: more vehicles come than its greens carry."
            for name in self.oversaturated
        ]
        return (*found, f"The demand is that of {self.begin:g} to {self.end:g} s.")

    def to_dict(self) -> dict[str, Any]:
        """All of it but the scenario, as data."""
        return {
            "begin": self.begin,
            "end": self.end,
            "lights": [_light_fields(light) for light in self.lights],
            "without_demand": list(self.without),
            "oversaturated": list(self.oversaturated),
        }


def time_signals(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    junctions: Sequence[str] = (),
    begin: float | None = None,
    end: float | None = None,
    saturation: float = SATURATION_FLOW,
    bounds: tuple[float, float] = (SHORTEST_CYCLE, LONGEST_CYCLE),
) -> TimedSignals:
    """Give lights the cycle and greens of Webster's method for the demand of the scenario.

    Volumes are those of the routes that a run has, see :func:`coming_vehicles`. Stages, intergreens
    and offsets stay.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file; it is not changed.
    junctions
        Lights; all if empty.
    begin, end
        Seconds of the scenario; the busiest hour if not given.
    saturation
        Base saturation flow: passenger cars an hour and lane that drive straight on.
    bounds
        Shortest and longest cycle, seconds.

    Returns
    -------
    TimedSignals
        The scenario with the new times, and each light before and after.

    Raises
    ------
    InputError
        If the map has no light, no vehicle comes to any, or the interval or a bound is none.
    NotFoundError
        If a junction has no light.
    ScenarioError
        With every problem of the signals or of the demand.
    """
    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    _refuse_settings(scenario, begin, end, saturation, bounds)
    chosen = chosen_lights(loaded, junctions)
    problems = signal_problems(scenario.signals, loaded.lights)
    # Lights of one coordination get one cycle here, as when an arrow has made that of one longer.
    refuse_errors(problem for problem in problems if problem.code != "cycles_of_coordination")
    vehicles = coming_vehicles(workspace, scenario)
    volumes = turning_volumes(vehicles, duration=scenario.simulation.duration, begin=begin, end=end)
    timer = _Timer(scenario, loaded, volumes, saturation, bounds)
    lights = {number: timer.timed(number) for number in chosen}
    timed = timer.in_step({n: light for n, light in lights.items() if light is not None})
    if not timed:
        raise InputError(
            f"no vehicle that departs between {volumes.begin:g} and {volumes.end:g} s comes to a "
            "traffic light"
        )
    without = tuple(
        ", ".join(loaded.lights[n].names) for n, light in lights.items() if light is None
    )
    entries = [retimed(scenario, light.times) for light in timed.values()]
    new = with_timings(scenario, entries)
    refuse_errors(signal_problems(new.signals, loaded.lights))
    return TimedSignals(new, volumes.begin, volumes.end, tuple(timed.values()), without)


def coming_vehicles(workspace: Workspace, scenario: Scenario) -> list[PlannedVehicle]:
    """Vehicles that come to the lights of a scenario, by their routes.

    Those that are planned, counted when they depart; where measures lead drivers around, or routes
    go by travel time, those of a run with the seed of the scenario, counted when they pass.

    Raises
    ------
    InputError
        If that run fails.
    ScenarioError
        With every problem of the scenario.
    """
    if not scenario.measures and scenario.demand.routes.by != "travel_time":
        return list(planned_vehicles(scenario, map_of(workspace, scenario).sumo))
    settings = RunSettings(
        recording=Recording(emissions=False), slice_length=None, warm_up=0.0, seed=scenario.seed
    )
    with scratch_folder() as folder:
        checked = check_run(workspace, scenario, name="counted", out=folder, settings=settings)
        run = carry_out(checked, prepare_run(checked), reports=False, figures=False)
        if run.status != RunStatus.COMPLETED:
            raise InputError(
                f"the run in which vehicles are counted has not completed: {run.status}"
            )
        users = run.actors()
        categories = {
            name: Category(category)
            for name, category in users.select("id", "category").iter_rows()
            if category != Category.PEDESTRIAN
        }
        files = trajectory_files(run.folder)
        if not files:
            return []
        return list(driven_vehicles(pl.scan_parquet(files), checked.map.sumo, categories))


def chosen_lights(loaded: LoadedMap, junctions: Sequence[str]) -> list[int]:
    """Numbers of lights by their junctions; all if none are named.

    Raises
    ------
    InputError
        If the map has no light.
    NotFoundError
        If a junction has none.
    """
    names = {name: number for number, light in enumerate(loaded.lights) for name in light.names}
    if not names:
        raise InputError(f"map {loaded.entry.name!r} has no traffic lights")
    found = []
    for name in junctions:
        if name not in names:
            raise NotFoundError("traffic light in junction", name, list(names))
        found.append(names[name])
    return list(dict.fromkeys(found)) if junctions else list(range(len(loaded.lights)))


def refuse_interval(scenario: Scenario, begin: float | None, end: float | None) -> None:
    """Refuse seconds that are no part of a scenario.

    Raises
    ------
    InputError
        With the interval and the duration.
    """
    duration = scenario.simulation.duration
    first, last = begin or 0.0, duration if end is None else end
    if not 0.0 <= first < last <= duration:
        raise InputError(
            f"{first:g} to {last:g} s is no part of the scenario, which lasts {duration:g} s"
        )


def _refuse_settings(
    scenario: Scenario,
    begin: float | None,
    end: float | None,
    saturation: float,
    bounds: tuple[float, float],
) -> None:
    refuse_interval(scenario, begin, end)
    if not 0.0 < bounds[0] <= bounds[1]:
        raise InputError(
            f"a shortest cycle of {bounds[0]:g} s and a longest of {bounds[1]:g} s: none is both"
        )
    if not 1.0 <= saturation <= _MOST_SATURATION:
        raise InputError(
            f"a saturation flow of {saturation:g} vehicles an hour: it has to be 1 to "
            f"{_MOST_SATURATION:g}"
        )


class _Timer:
    """Times the lights of one scenario."""

    def __init__(
        self,
        scenario: Scenario,
        loaded: LoadedMap,
        volumes: Volumes,
        saturation: float,
        bounds: tuple[float, float],
    ) -> None:
        self._scenario, self._loaded, self._volumes = scenario, loaded, volumes
        self._saturation, self._bounds = saturation, bounds
        self._shown = [light.shown for light in realized_lights(scenario, loaded.sumo)]

    def timed(self, number: int, cycle: float | None = None) -> TimedLight | None:
        sumo, view = self._loaded.sumo, self._loaded.lights[number]
        return timed_light(
            sumo.lights[number], view, self._shown[number], sumo, self._volumes.by_turn,
            timing=timing_of(self._scenario, view.names), begin=self._volumes.begin,
            bounds=self._bounds, saturation=self._saturation, cycle=cycle,
        )  # fmt: skip

    def in_step(self, lights: dict[int, TimedLight]) -> dict[int, TimedLight]:
        """Give lights of one coordination the longest of their cycles, those left out too."""
        groups: dict[str, list[int]] = {}
        for number, view in enumerate(self._loaded.lights):
            timing = timing_of(self._scenario, view.names)
            if timing is not None and timing.coordination is not None:
                groups.setdefault(timing.coordination, []).append(number)
        for members in groups.values():
            own = [lights[n].times.cycle for n in members if n in lights]
            if not own:
                continue
            for number in members:
                again = self.timed(number, cycle=max(own))
                if again is not None:
                    lights[number] = again
        return lights


def _light_fields(light: TimedLight) -> dict[str, Any]:
    times, splits = light.times, light.splits
    return {
        "junctions": list(times.junctions),
        "plan": times.plan,
        "cycle": times.cycle,
        "cycle_before": light.before.cycle,
        "cycle_wanted": splits.wanted if splits.wanted < float("inf") else None,
        "lost_time": splits.lost,
        "flow_ratio": splits.flow_ratio,
        "oversaturated": bool(light.oversaturated),
        "stages": [
            {"id": name, "green": green, "green_before": before, "flow_ratio": ratio}
            for name, green, before, ratio in zip(
                times.stages, times.green, light.before.green, splits.ratios, strict=True
            )
        ],
        "movements": [movement._asdict() for movement in light.movements],
        "lanes": [
            {
                "lane": lane.load.lane,
                "turns": list(lane.load.turns),
                "volume": lane.load.volume,
                "saturation_flow": lane.load.saturation,
                "flow_ratio": lane.load.ratio,
                "green": lane.green,
                "v_c": lane.degree,
            }
            for lane in light.lanes
        ],
    }
