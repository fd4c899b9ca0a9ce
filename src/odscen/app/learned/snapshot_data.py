"""Snapshots of SUMO's traffic as data to learn from: runs of background traffic on whole maps.

Every run is a *shard*, one file whose name says map and seed. A shard that is there is not made
again, so that the command resumes after an interruption.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.app.maps import load_map
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.base.given_files import as_path
from odscen.base.text_files import write_file, write_text
from odscen.base.version import __version__
from odscen.learning.reference.gap_states import seen_ahead
from odscen.learning.reference.road_strips import road_strips
from odscen.learning.traffic_snapshots import (
    STOPPED,
    Shard,
    Snapshot,
    shard_bytes,
    shard_from_bytes,
)
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.distributions import stream
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.document.scenario_document import (
    Background,
    Demand,
    MapReference,
    Scenario,
    Simulation,
)
from odscen.sumo.realize.signals_ahead import lights_at

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.app.maps import LoadedMap
    from odscen.base.arrays import BoolArray, IntArray
    from odscen.base.given_files import GivenPath
    from odscen.lanegraph.graphs import MapGraph
    from odscen.learning.traffic_snapshots import LightView
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.sumo.realize.signals_ahead import LightLog


# ------------------------------------------------ whether the traffic of a run is in a steady state
FEW = 30
"""Vehicles, of which one light may stop most."""


def stopped_growth(rows: pl.DataFrame, *, start: float, middle: float) -> float:
    """How much the share of stopped vehicles rises: after ``middle``, from ``start`` until then.

    Parameters
    ----------
    rows
        Trajectories of vehicles: ``time`` (s) and ``speed`` (m/s).
    start, middle
        Seconds of the run.

    Returns
    -------
    float
        Difference of two shares, -1 to 1; 0 for fewer vehicles than :data:`FEW` in the mean.
    """
    rows = rows.filter(rows["time"] >= start)
    late = rows["time"].to_numpy() >= middle
    stands = rows["speed"].to_numpy() < STOPPED
    if late.all() or not late.any() or len(rows) < FEW * rows["time"].n_unique():
        return 0.0
    return float(stands[late].mean() - stands[~late].mean())


def most_stopped(snapshots: Sequence[Snapshot]) -> float:
    """Largest share of stopped vehicles; snapshots of few count together."""
    few = [snapshot.speed for snapshot in snapshots if len(snapshot.speed) < FEW]
    many = [snapshot.speed for snapshot in snapshots if len(snapshot.speed) >= FEW]
    groups = [*many, np.concatenate([np.empty(0), *few])]
    return max((float(np.mean(group < STOPPED)) for group in groups if len(group)), default=0.0)


# ------------------------------------------------ snapshots of SUMO's traffic as data to learn from
SUFFIX = ".shard.npz"
SKIPPED = ".skipped.json"
OFF_NODE = 2.5
"""Metres from the centre of a body to a node; vehicles farther from any are left out."""
BRAKING_SECONDS = 2.0
ATTEMPTS = 3
"""Runs that are tried until one does not gridlock, each with half the traffic of the last."""
_HEADING = 4.0
"""Metres that a heading wrong by one radian counts as, in search of the nearest node."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DataSettings:
    """Which runs snapshots are taken from.

    Attributes
    ----------
    runs
        For each map.
    seed
        Of the first run.
    density
        Least and most vehicles per kilometre of lane; each run draws one between.
    warm_up, duration
        Snapshots are taken between these seconds of a run.
    snapshots
        Of each run.
    stopped_most
        Share of stopped vehicles in a snapshot above which its run counts as gridlocked.
    growth_most
        Traffic to learn from is in a steady state: from the first half of the time after the
        warm-up to the second the share of stopped vehicles rises by this at most, as else a
        snapshot tells more of when it was taken than of the traffic. As much as generated
        traffic may differ from SUMO's in this share.
    """

    runs: int = 6
    seed: int = 1
    density: tuple[float, float] = (3.0, 14.0)
    warm_up: float = 120.0
    duration: float = 300.0
    snapshots: int = 4
    stopped_most: float = 0.5
    growth_most: float = 0.1

    def __post_init__(self) -> None:
        low, high = self.density
        if not 0 < low <= high <= 200:
            raise InputError(
                f"densities lie between 0 and 200 vehicles per km, not {low:g} to {high:g}",
                element="density",
            )
        if self.runs < 1 or self.snapshots < 1:
            raise InputError(
                f"at least one run and one snapshot are needed, not {self.runs}", element="runs"
            )
        if self.duration < self.warm_up + BRAKING_SECONDS + 1.0:
            raise InputError(
                f"a run of {self.duration:g} s has no snapshot after {self.warm_up:g} s",
                element="duration",
            )


class MadeShard(NamedTuple):
    """What became of one run: its file, the vehicles in it, and why it was left out, if it was."""

    file: Path
    vehicles: int
    skipped: str | None


def make_shards(
    workspace: Workspace,
    maps: Sequence[str],
    out: GivenPath,
    *,
    settings: DataSettings,
    done: Callable[[MadeShard], None] | None = None,
) -> list[MadeShard]:
    """Run traffic on maps and write a shard of snapshots for each run.

    Raises
    ------
    NotFoundError
        If the workspace has no such map.
    InputError
        If there is no map at all.
    """
    names = list(maps) or [entry.name for entry in workspace.maps()]
    if not names:
        raise InputError(
            f"there is no map in {workspace.root}; add one with: odscen maps add FILE.xodr"
        )
    entries = [workspace.map(name) for name in names]
    out = as_path(out)
    out.mkdir(parents=True, exist_ok=True)
    made = []
    for entry in entries:
        for seed in range(settings.seed, settings.seed + settings.runs):
            file = out / f"{entry.name}-{seed:04d}{SUFFIX}"
            found = _read_earlier_shard(file) or _make_shard(
                workspace, entry.name, seed, file, settings
            )
            made.append(found)
            if done is not None:
                done(found)
    return made


def read_shards(folder: GivenPath) -> list[Shard]:
    """Read all shards of a folder, in the order of their names.

    Raises
    ------
    InputError
        If there are none, or one cannot be read.
    """
    folder = as_path(folder)
    files = sorted(folder.glob(f"*{SUFFIX}"))
    if not files:
        raise InputError(
            f"no *{SUFFIX} in this folder; make some with: odscen learn data", file=str(folder)
        )
    return [shard_from_bytes(file.read_bytes(), file=str(file)) for file in files]


def town_of(map_name: str) -> str:
    """Town that a map is a version of: its name without a year, and without ``carla``."""
    return re.sub(r"(?i)[-_. ]?((19|20)\d\d|carla)[-_. ]?", "", map_name) or map_name


def _read_earlier_shard(file: Path) -> MadeShard | None:
    """What an earlier call has made of a run."""
    if file.is_file():
        shard = shard_from_bytes(file.read_bytes(), file=str(file))
        return MadeShard(file, sum(len(snapshot.node) for snapshot in shard.snapshots), None)
    note = file.with_name(file.name.removesuffix(SUFFIX) + SKIPPED)
    if note.is_file():
        return MadeShard(file, 0, str(json.loads(note.read_text(encoding="utf-8"))["why"]))
    return None


def _make_shard(
    workspace: Workspace, name: str, seed: int, file: Path, settings: DataSettings
) -> MadeShard:
    density = float(stream(seed, "density", name).uniform(*settings.density))
    for _ in range(ATTEMPTS):
        shard = _attempt_shard(workspace, name, seed, density, file, settings)
        if shard.skipped is None:
            break
        density /= 2.0
    if shard.skipped is not None:
        note = file.with_name(file.name.removesuffix(SUFFIX) + SKIPPED)
        write_text(note, json.dumps({"why": shard.skipped}) + "\n")
    return shard


def _attempt_shard(
    workspace: Workspace,
    name: str,
    seed: int,
    density: float,
    file: Path,
    settings: DataSettings,
) -> MadeShard:
    loaded = load_map(workspace.map(name))
    scenario = traffic_scenario(loaded, seed=seed, density=density, duration=settings.duration)
    with scratch_folder() as folder:
        checked = check_run(
            workspace,
            scenario,
            name=f"{name}-{seed:04d}",
            out=folder,
            settings=RunSettings(recording=Recording(emissions=False)),
        )
        (run,) = run_all([checked], reports=False, figures=False)
        why, snapshots = _judge_run(run, loaded, settings, seed)
    if why is not None:
        return MadeShard(file, 0, why)
    about: dict[str, Any] = {"seed": seed, "per_km": round(density, 3), "odscen": __version__}
    graph = loaded.sumo.graph
    shard = Shard(graph.map_name, graph.map_sha256, town_of(name), about, snapshots)
    strips = road_strips(graph.lanes)
    views = [seen_ahead(graph.lanes, strips, snapshot) for snapshot in snapshots]
    data = shard_bytes(shard, queues=[view[0] for view in views], ahead=[view[1] for view in views])
    write_file(file, data)
    return MadeShard(file, sum(len(snapshot.node) for snapshot in snapshots), None)


def traffic_scenario(loaded: LoadedMap, *, seed: int, density: float, duration: float) -> Scenario:
    """Background traffic on a whole map, ``density`` vehicles per kilometre of lane."""
    graph = loaded.sumo.graph
    mix = SamplingConfig().vehicles
    return Scenario(
        name=f"{graph.map_name}-{seed:04d}",
        map=MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing),
        seed=seed,
        roi=connected_segments(graph),
        demand=Demand(background=(Background(id="traffic", per_km=round(density, 3), mix=mix),)),
        simulation=Simulation(duration=duration, step_length=0.5),
    )


def connected_segments(graph: MapGraph) -> tuple[str, ...]:
    """Segments of the largest part of a map that hangs together, by length of its roads."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    segments = graph.segments
    one, other = segments.adjacency.reshape(-1, 2).T
    count = len(segments.ids)
    pairs = coo_array((np.ones(len(one)), (one, other)), shape=(count, count))
    _, parts = connected_components(pairs, directed=False)
    largest = int(np.argmax(np.bincount(parts, weights=segments.lengths)))
    return tuple(
        str(name) for name, part in zip(segments.ids, parts, strict=True) if part == largest
    )


def _judge_run(
    run: Run, loaded: LoadedMap, settings: DataSettings, seed: int
) -> tuple[str | None, tuple[Snapshot, ...]]:
    """Why a run is left out, or its snapshots."""
    if run.exit_code == 3:
        return f"the run has failed: {run.known.get('error')}", ()
    if run.counts["inserted"] == 0:
        return "no vehicle came onto the map", ()
    bad = [
        reason["words"]
        for reason in run.usability.get("reasons", ())
        if reason["kind"] == "gridlock"
    ]
    if bad:
        return f"gridlocked: {bad[0]}", ()
    if run.counts["teleported"] > 0.02 * max(run.counts["inserted"], 1):
        return f"{run.counts['teleported']} vehicles were teleported", ()
    growth = stopped_growth(
        vehicles_of(run), start=settings.warm_up, middle=(settings.warm_up + settings.duration) / 2
    )
    if growth > settings.growth_most:
        return f"a jam grows: {growth:.0%} more of the vehicles are stopped in the second half", ()
    rng = stream(seed, "snapshot times")
    span = settings.duration - settings.warm_up - BRAKING_SECONDS - 0.5
    each = span / settings.snapshots
    times = settings.warm_up + each * (np.arange(settings.snapshots) + rng.random())
    snapshots = snapshots_of(run, loaded, [round(float(2 * time)) / 2 for time in times])
    stopped = most_stopped(snapshots)
    if stopped > settings.stopped_most:
        return f"gridlocked: {stopped:.0%} of the vehicles are stopped", ()
    return None, snapshots


def snapshots_of(run: Run, loaded: LoadedMap, times: Sequence[float]) -> tuple[Snapshot, ...]:
    """Take snapshots of the vehicles of a run.

    Parameters
    ----------
    times
        Recorded seconds.

    Raises
    ------
    InputError
        If no trajectories were recorded.
    """
    logs = light_logs(run)
    return snapshots_of_rows(vehicles_of(run), loaded, times, logs=logs)


def snapshots_of_rows(
    rows: pl.DataFrame,
    loaded: LoadedMap,
    times: Sequence[float],
    *,
    logs: Mapping[str, LightLog] | None = None,
) -> tuple[Snapshot, ...]:
    """Take snapshots of vehicles, whoever recorded them.

    Parameters
    ----------
    rows
        ``id``, ``time``, ``category``, ``x``, ``y``, ``hdg`` and ``speed`` of vehicles.
    times
        Seconds, each of some row.
    logs
        What each light showed, by its SUMO id.
    """
    tree = _build_node_tree(loaded)
    return tuple(
        _make_snapshot(rows, time, tree, lights_at(loaded.sumo, logs or {}, time)) for time in times
    )


def vehicles_of(run: Run) -> pl.DataFrame:
    """Take trajectories without those of pedestrians."""
    import polars as pl

    return run.trajectories().filter(pl.col("category") != str(Category.PEDESTRIAN))


def nodes_under(loaded: LoadedMap, rows: pl.DataFrame) -> tuple[IntArray, BoolArray]:
    """Find the node of the lane graph nearest to each body, and whether it is near enough.

    Parameters
    ----------
    rows
        ``x``, ``y`` (m) and ``hdg`` (rad) of the centres of bodies.

    Returns
    -------
    tuple
        Nodes and flags, shape ``(V,)``.
    """
    return _nearest_nodes(_build_node_tree(loaded), rows)


def _nearest_nodes(tree: Any, rows: pl.DataFrame) -> tuple[IntArray, BoolArray]:
    points = _stack_poses(_PlacedBodies(rows["x"], rows["y"], rows["hdg"]))
    far, node = tree.query(points) if len(points) else (np.empty(0), np.empty(0, dtype=np.int64))
    return node.astype(np.int64), far < OFF_NODE


def _build_node_tree(loaded: LoadedMap) -> Any:
    from scipy.spatial import cKDTree

    return cKDTree(_stack_poses(loaded.sumo.graph.lanes))


def _stack_poses(of: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Places in which headings count as metres, ``(N, 4)``."""
    x, y, hdg = (np.asarray(column, dtype=np.float64) for column in (of.x, of.y, of.hdg))
    return np.column_stack([x, y, _HEADING * np.cos(hdg), _HEADING * np.sin(hdg)])


class _PlacedBodies(NamedTuple):
    x: Any
    y: Any
    hdg: Any


def _make_snapshot(rows: pl.DataFrame, time: float, tree: Any, lights: LightView) -> Snapshot:
    import polars as pl

    near = rows.filter((pl.col("time") > time - 0.01) & (pl.col("time") < time + 0.01))
    node, good = _nearest_nodes(tree, near)
    names = [str(category) for category in Category]
    category = np.array([names.index(category) for category in near["category"]], dtype=np.int64)
    braking = braking_of(rows, time, near["id"].to_list())
    speed = near["speed"].to_numpy().astype(np.float64)
    return Snapshot(node[good], category[good], speed[good], braking[good], lights)


def braking_of(rows: pl.DataFrame, time: float, ids: Sequence[str]) -> Any:
    """Strongest deceleration of each vehicle within two seconds, m/s²; NaN where it has left."""
    import polars as pl

    soon = rows.filter(
        (pl.col("time") > time - 0.01) & (pl.col("time") < time + BRAKING_SECONDS + 0.01)
    )
    strongest = (
        soon.sort("id", "time")
        .with_columns(
            ((pl.col("speed").diff() / pl.col("time").diff()).over("id") * -1.0).alias("braking")
        )
        .group_by("id")
        .agg(pl.col("braking").max())
    )
    found = dict(zip(strongest["id"].to_list(), strongest["braking"].to_list(), strict=True))
    values = [found.get(vehicle) for vehicle in ids]
    return np.array(
        [np.nan if value is None else max(value, 0.0) for value in values], dtype=np.float64
    )


def light_logs(run: Run) -> dict[str, LightLog]:
    import polars as pl

    from odscen.runs.layout import LIGHT_STATES_FILE

    file = run.folder / LIGHT_STATES_FILE
    logs: dict[str, LightLog] = {}
    if file.is_file():
        for light, time, state in (
            pl.read_parquet(file).sort("time").select("light", "time", "state").iter_rows()
        ):
            logs.setdefault(light, []).append((time, state))
    return logs
