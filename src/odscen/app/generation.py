"""Scenarios that are sampled on the maps of a workspace, by seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.app.generators import Placer, open_generator
from odscen.app.light_moments import draw_moment, signals_at
from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.base.errors import InputError
from odscen.base.given_files import as_path
from odscen.scenario.document.signals_document import Signals
from odscen.scenario.sampling.generation_settings import ONE_SCENARIO, GenerationSettings
from odscen.scenario.sampling.sampler import choose_map, passes_by_name, sample_scenario
from odscen.sumo.realize.signals_ahead import lights_at_start

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.app.generators import GeneratorDoor
    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.learning.fill import CheckedFill, Fill, FillRequest
    from odscen.maps.store import Workspace
    from odscen.scenario.document.sampling_config import MapFilter
    from odscen.scenario.document.scenario_document import Actor
    from odscen.scenario.placing.region import Region


def generate(
    workspace: Workspace,
    *,
    settings: GenerationSettings = ONE_SCENARIO,
    out: GivenPath | None = None,
    generator: GeneratorDoor | None = None,
    filled: Callable[[str, CheckedFill], None] | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> list[Path]:
    """Sample scenarios and write one file each.

    Parameters
    ----------
    workspace
        Has the maps.
    settings
        Which scenarios.
    out
        Folder; the workspace's ``scenarios`` if not given.
    generator
        Places the actors; they are placed at random if not given.
    filled
        Called with the name of each scenario and what was made of the generator's fill.
    progress
        Called with the name of each scenario and the share (0 to 1) that is done.

    Returns
    -------
    list of Path
        The files, in the order of their seeds.

    Raises
    ------
    NotFoundError
        If there is no such map.
    InputError
        If there is no map at all, or the generator does not give a fill.
    ScenarioError
        If the configuration cannot be met.
    """
    folder = workspace.scenarios if out is None else as_path(out)
    placer = None if generator is None else Placer(open_generator(generator))
    config, map_name = settings.sampling, settings.map_name
    statistics: dict[str, Any] = {}
    if map_name is not None:
        workspace.map(map_name)
    else:
        statistics = _map_statistics_by_name(workspace, config.maps)
        if not statistics:
            raise InputError(
                f"there is no map in {workspace.root}; add one with: odscen maps add FILE.xodr"
            )
    paths = []
    for number in range(settings.count):
        seed = settings.seed + number
        name = map_name or choose_map(config.maps, statistics, seed=seed)
        loaded = load_map(workspace.map(name))
        title = f"{name}-{seed:04d}"
        if progress is not None:
            progress(title, number / settings.count)
        usable, place, signals = loaded.usable, None, Signals()
        if generator is not None and placer is not None:
            moment = draw_moment(seed)
            signals = signals_at(loaded, moment)
            place = placer.for_scenario(
                usable.bodies,
                seed,
                lights=lights_at_start(loaded.sumo, signals),
                drive=_make_driver(workspace, loaded, generator.warm_up, moment),
            )
        scenario = sample_scenario(
            loaded.sumo.graph, config, seed=seed, name=title, usable=usable, place=place
        )
        if signals.junctions:
            scenario = scenario.model_copy(update={"signals": signals})
        if filled is not None and placer is not None and placer.checked is not None:
            filled(title, placer.checked)
        file = folder / f"{title}{SUFFIX}"
        paths.append(write_scenario(scenario, file))
    return paths


def _make_driver(
    workspace: Workspace, loaded: LoadedMap, seconds: float, moment: float
) -> Callable[[Region, FillRequest, Sequence[Actor]], Fill | None] | None:
    """What drives traffic before a scenario begins; ``None`` where nothing is to."""
    if not seconds:
        return None

    def drive(region: Region, request: FillRequest, actors: Sequence[Actor]) -> Fill | None:
        from odscen.app.moving_starts import driven_fill  # with all that runs need

        return driven_fill(
            workspace, loaded, region, request, actors=actors, seconds=seconds, moment=moment
        )

    return drive


def _map_statistics_by_name(workspace: Workspace, maps: MapFilter) -> dict[str, dict[str, Any]]:
    """Statistics of all maps, by name; those that decide what is drawn are up to date.

    Only maps whose statistics decide are opened: what an older odscen has built is then rebuilt.
    """
    by_statistics = bool(maps.where) or maps.weight_by is not None
    return {
        map_entry.name: (
            workspace.map(map_entry.name)
            if by_statistics and passes_by_name(maps, map_entry.name)
            else map_entry
        ).info["statistics"]
        for map_entry in workspace.maps()
    }
