"""Recorded traffic as what generators and drivers learn from, in place of runs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from odscen.app.learned.snapshot_data import (
    BRAKING_SECONDS,
    SUFFIX,
    MadeShard,
    snapshots_of_rows,
    town_of,
)
from odscen.app.maps import load_map
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import Category
from odscen.base.errors import InputError, SimulationError
from odscen.base.given_files import as_path
from odscen.base.text_files import write_file
from odscen.base.version import __version__
from odscen.formats.base import ElementReport, ImportMap
from odscen.formats.tracks.scenario_of_tracks import SceneChoice, scenario_of_tracks
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.reference.gap_states import seen_ahead
from odscen.learning.reference.road_strips import road_strips
from odscen.learning.traffic_snapshots import Shard, shard_bytes
from odscen.opendrive.parse import parse
from odscen.records.outcomes import RunStatus
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings

if TYPE_CHECKING:
    from odscen.app.learned.snapshot_data import DataSettings
    from odscen.base.arrays import FloatArray
    from odscen.base.given_files import GivenPath
    from odscen.formats.tracks.recorded_traffic import RecordedTraffic
    from odscen.learning.fill import Array
    from odscen.maps.store import Workspace

RECORDER: Final = "odscen.learning.behaviour.imitation_driver:DrivingRecorder"
PART: Final = 60.0
"""Seconds of a recording that are replayed at a time."""
LEARNED_SHARE: Final = 0.7
"""Of the time of a recording that is learned from; the rest is to measure on."""


def make_recorded_shard(
    workspace: Workspace,
    map_name: str,
    recorded: RecordedTraffic,
    out: GivenPath,
    *,
    name: str,
    settings: DataSettings,
) -> MadeShard:
    """Write snapshots of a recording as a shard, as those of a run are.

    Snapshots are even in time, as many as ``settings`` says of each run. What lights showed is left
    out, for a recording does not say on which lanes of the map.

    Parameters
    ----------
    name
        Of the recording; part of the file's name.

    Raises
    ------
    InputError
        If the recording is shorter than three seconds, or no vehicle is on a lane of the map.
    """
    loaded = load_map(workspace.map(map_name))
    rows = recorded.rows.filter(
        pl.col("category").is_not_null() & (pl.col("category") != str(Category.PEDESTRIAN))
    ).with_columns(pl.col("category").cast(pl.String))
    times = rows["time"].unique().sort().to_numpy()
    usable = times[times <= (times[-1] if len(times) else 0.0) - BRAKING_SECONDS]
    if len(usable) < 2:
        raise InputError(
            f"vehicles are in the recording for less than {BRAKING_SECONDS + 1.0:g} s",
            file=name,
        )
    chosen = usable[np.linspace(0, len(usable) - 1, settings.snapshots).round().astype(np.int64)]
    snapshots = snapshots_of_rows(rows, loaded, np.unique(chosen).tolist())
    vehicles = sum(len(snapshot.node) for snapshot in snapshots)
    if not vehicles:
        raise InputError(f"no vehicle is on a lane of map {map_name!r}", file=name)
    graph = loaded.sumo.graph
    about: dict[str, Any] = {"recording": name, "schema": recorded.schema, "odscen": __version__}
    shard = Shard(graph.map_name, graph.map_sha256, town_of(map_name), about, snapshots)
    strips = road_strips(graph.lanes)
    views = [seen_ahead(graph.lanes, strips, snapshot) for snapshot in snapshots]
    folder = as_path(out)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{map_name}-{name}{SUFFIX}"
    write_file(
        file,
        shard_bytes(shard, queues=[view[0] for view in views], ahead=[view[1] for view in views]),
    )
    return MadeShard(file, vehicles, None)


def record_replays(
    workspace: Workspace, map_name: str, recorded: RecordedTraffic, *, name: str
) -> tuple[list[tuple[Array, FloatArray]], list[tuple[Array, FloatArray]]]:
    """What drivers of a recording saw, and how they accelerated: first part, and the rest.

    The tracks of vehicles are replayed in SUMO, a minute at a time, so that what each sees is the
    same as in a run. Lights are not seen, for those of the map are not those of the recording.

    Raises
    ------
    InputError
        If the recording has no vehicle that is on the map.
    SimulationError
        If a replay fails.
    """
    vehicles = recorded.rows.filter(
        pl.col("category").is_not_null() & (pl.col("category") != str(Category.PEDESTRIAN))
    )
    if not vehicles.height:
        raise InputError("no vehicle is in the recording", file=name)
    recorded = replace(recorded, rows=vehicles)
    begin, end = vehicles.select(pl.col("time").min().alias("begin"), pl.col("time").max()).row(0)
    split = begin + LEARNED_SHARE * (end - begin)
    return (
        _replay_parts(workspace, map_name, recorded, name, begin, split),
        _replay_parts(workspace, map_name, recorded, name, split, end),
    )


def _replay_parts(
    workspace: Workspace,
    map_name: str,
    recorded: RecordedTraffic,
    name: str,
    begin: float,
    end: float,
) -> list[tuple[Array, FloatArray]]:
    parts = max(1, round((end - begin) / PART))
    bounds = np.linspace(begin, end, parts + 1).tolist()
    found = []
    for number in range(parts):
        inside = pl.col("time").is_between(bounds[number], bounds[number + 1], closed="left")
        rows = recorded.rows.filter(inside)
        if rows.height:
            part = replace(recorded, rows=rows)
            found.append(_replay_part(workspace, map_name, part, f"{name}-{bounds[number]:.0f}"))
    return found


def _replay_part(
    workspace: Workspace, map_name: str, recorded: RecordedTraffic, name: str
) -> tuple[Array, FloatArray]:
    entry = workspace.map(map_name)
    the_map = ImportMap(
        entry.name, entry.sha256, load_map(entry).sumo, lambda: parse(entry.read("xodr"))
    )
    scenario = scenario_of_tracks(
        recorded, the_map, SceneChoice(), name=name, assets=workspace.assets(),
        report=ElementReport(name),
    )  # fmt: skip
    with scratch_folder() as folder:
        file = folder / "seen.npz"
        settings = RunSettings(
            recording=Recording(emissions=False),
            behaviour=BehaviourDoor(
                name=RECORDER, options={"file": str(file), "every": 1, "lights": False}
            ),
        )
        checked = check_run(workspace, scenario, name=name, out=folder, settings=settings)
        (run,) = run_all([checked], reports=False)
        if run.status is not RunStatus.COMPLETED:
            raise SimulationError(f"{name}: {run.summary['error']}")
        if not file.is_file():
            raise InputError("no vehicle of it is on the road in SUMO", file=name)
        with np.load(file) as arrays:
            return arrays["x"].astype(np.float32), arrays["acceleration"]
