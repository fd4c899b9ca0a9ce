"""Drivers learned from SUMO's: runs that record what they see and do, training, and the error."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.app.learned.recorded_data import RECORDER, record_replays
from odscen.app.learned.snapshot_data import town_of, traffic_scenario
from odscen.app.maps import load_map
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, SimulationError
from odscen.base.given_files import as_path
from odscen.base.text_files import write_file
from odscen.base.version import __version__
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.behaviour.imitation_driver import BINS, learned_driver, network_bytes
from odscen.learning.reference.traffic_model import softmax
from odscen.records.outcomes import RunStatus
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.distributions import stream

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.given_files import GivenPath
    from odscen.formats.tracks.recorded_traffic import RecordedTraffic
    from odscen.learning.fill import Array
    from odscen.maps.store import Workspace

_DENSITY = (4.0, 14.0)
"""Vehicles per kilometre of lane."""


class DrivingError(NamedTuple):
    """How far accelerations are off, root mean square, m/s^2, on one map.

    ``constant``: of a driver that keeps its speed.
    """

    map_name: str
    rows: int
    learned: float
    constant: float


def learn_driving(
    workspace: Workspace,
    maps: Sequence[str],
    out: GivenPath,
    *,
    hold_out: Sequence[str] = (),
    runs: int = 3,
    duration: float = 200.0,
    seed: int = 0,
    recordings: Mapping[str, RecordedTraffic] | None = None,
    told: Callable[[str], None] | None = None,
) -> tuple[DrivingError, ...]:
    """Record SUMO's drivers on maps, or those of recordings, learn from them, write the weights.

    Parameters
    ----------
    maps
        Of the workspace.
    out
        File of weights.
    hold_out
        Towns that are only recorded to measure the error on; without any it is that of training.
    runs, duration
        Of each map, and seconds of each.
    recordings
        By name, in place of runs; all lie on the one map that is named. The first 70 % of the time
        of each are learned from, and the error is that on the rest.

    Raises
    ------
    InputError
        If recordings lie on several maps, or nothing is left to learn from.
    SimulationError
        If a run fails.
    """
    if recordings:
        if len(maps) != 1:
            raise InputError(f"recordings lie on one map, not on {len(maps)}", element="map")
        replays = {
            name: record_replays(workspace, maps[0], tracks, name=name)
            for name, tracks in recordings.items()
        }
        if told is not None:
            for name, parts in replays.items():
                told(f"{name}: {sum(len(x) for part in parts for x, _ in part):,} seen")
        learned = [arrays for first, _ in replays.values() for arrays in first]
        rest = {name: rest for name, (_, rest) in replays.items()}
        about: dict[str, Any] = {"recordings": sorted(recordings), "maps": list(maps)}
        return _learn_and_measure(learned, rest, out, about, seed)
    recorded = {}
    for name in maps:
        recorded[name] = [_record_driving(workspace, name, seed + k, duration) for k in range(runs)]
        if told is not None:
            told(f"{name}: {sum(len(x) for x, _ in recorded[name]):,} seen")
    kept = [name for name in maps if town_of(name) not in hold_out]
    rows = [arrays for name in kept for arrays in recorded[name]]
    measured = {name: recorded[name] for name in maps if name not in kept} or recorded
    return _learn_and_measure(rows, measured, out, {"maps": kept, "runs": runs}, seed)


def _learn_and_measure(
    learned: Sequence[tuple[Array, FloatArray]],
    measured: Mapping[str, Sequence[tuple[Array, FloatArray]]],
    out: GivenPath,
    about: Mapping[str, Any],
    seed: int,
) -> tuple[DrivingError, ...]:
    rows = [arrays for arrays in learned if len(arrays[0])]
    if not rows:
        raise InputError(
            "nothing is left to learn from: no maps, or all are held out", element="hold-out"
        )
    x, acceleration = (np.concatenate([row[k] for row in rows]) for k in (0, 1))
    network = learned_driver(x, acceleration, np.random.default_rng(seed))
    facts = {**about, "rows": len(x), "seed": seed, "odscen": __version__}
    write_file(as_path(out), network_bytes(network, facts))
    found = []
    for name, parts in measured.items():
        if not parts:
            continue
        x, acceleration = (np.concatenate([arrays[k] for arrays in parts]) for k in (0, 1))
        guess = softmax(network(x)) @ BINS
        found.append(
            DrivingError(
                name,
                len(x),
                _root_mean_square(guess - acceleration),
                _root_mean_square(acceleration),
            )
        )
    return tuple(found)


def _record_driving(
    workspace: Workspace, name: str, seed: int, duration: float
) -> tuple[Array, FloatArray]:
    """What drivers of a run with background traffic saw, and how they accelerated."""
    density = float(stream(seed, "density", name).uniform(*_DENSITY))
    loaded = load_map(workspace.map(name))
    scenario = traffic_scenario(loaded, seed=seed, density=density, duration=duration)
    with scratch_folder() as folder:
        file = folder / "seen.npz"
        settings = RunSettings(
            recording=Recording(emissions=False),
            behaviour=BehaviourDoor(name=RECORDER, options={"file": str(file)}),
        )
        checked = check_run(
            workspace, scenario, name=f"{name}-{seed:04d}", out=folder, settings=settings
        )
        (run,) = run_all([checked], reports=False)
        if run.status is not RunStatus.COMPLETED:
            raise SimulationError(f"{name}: {run.summary['error']}")
        with np.load(file) as arrays:
            return arrays["x"].astype(np.float32), arrays["acceleration"]


def _root_mean_square(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
