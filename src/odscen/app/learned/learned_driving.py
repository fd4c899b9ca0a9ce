"""Drivers learned from SUMO's: runs that record what they see and do, training, and the error."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

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
    from collections.abc import Callable, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.given_files import GivenPath
    from odscen.learning.fill import Array
    from odscen.maps.store import Workspace

RECORDER = "odscen.learning.behaviour.imitation_driver:DrivingRecorder"
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
    told: Callable[[str], None] | None = None,
) -> tuple[DrivingError, ...]:
    """Record SUMO's drivers on maps, learn from them, and write the weights.

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

    Raises
    ------
    InputError
        If nothing is left to learn from.
    SimulationError
        If a run fails.
    """
    recorded = {}
    for name in maps:
        recorded[name] = [_record_driving(workspace, name, seed + k, duration) for k in range(runs)]
        if told is not None:
            told(f"{name}: {sum(len(x) for x, _ in recorded[name]):,} seen")
    kept = [name for name in maps if town_of(name) not in hold_out]
    rows = [arrays for name in kept for arrays in recorded[name] if len(arrays[0])]
    if not rows:
        raise InputError(
            "nothing is left to learn from: no maps, or all are held out", element="hold-out"
        )
    x, acceleration = (np.concatenate([row[k] for row in rows]) for k in (0, 1))
    network = learned_driver(x, acceleration, np.random.default_rng(seed))
    about = {"maps": kept, "runs": runs, "rows": len(x), "seed": seed, "odscen": __version__}
    write_file(as_path(out), network_bytes(network, about))
    measured = [name for name in maps if name not in kept] or kept
    found = []
    for name in measured:
        x, acceleration = (np.concatenate([arrays[k] for arrays in recorded[name]]) for k in (0, 1))
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
