"""A driver that has learned from SUMO's how to accelerate, and the recorder of its examples.

From what each vehicle sees (:func:`sight`) two hidden layers give the shares of accelerations in
bins of 0.5 m/s^2; it takes their mean, and with ``sampled`` one drawn by these shares. Lane changes
and right of way stay SUMO's. ``odscen learn driver`` makes the weights.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.errors import in_file
from odscen.base.given_arrays import arrays_from_npz
from odscen.base.given_files import as_path, read_given
from odscen.learning.behaviour.behaviour_model import DrivingAction, LightAhead
from odscen.learning.behaviour.intelligent_driver import desired_speeds
from odscen.learning.offered_options import offered
from odscen.learning.reference.traffic_model import (
    MOST_WEIGHTS,
    SmallNetwork,
    new_network,
    softmax,
    trained,
)

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.learning.behaviour.behaviour_model import BehaviourScene, RoadObservation
    from odscen.learning.fill import Array


BINS = np.arange(-6.0, 4.01, 0.5)
"""Middles of the bins of accelerations, m/s^2."""
FEATURES = (
    "speed", "desired speed", "gap", "speed of the leader", "near", "distance to the lane's end",
    "red", "yellow", "green", "limit of the next lane", "length of the body", "standing",
)  # fmt: skip
"""Of :func:`sight`, each about 0 to 1."""
_SHIPPED = "imitation_driver.npz"
_FAR, _FAST, _HIDDEN = 100.0, 20.0, 32


class ImitationState(NamedTuple):
    """The scene, and what chance there is."""

    scene: BehaviourScene
    rng: np.random.Generator


@dataclass(frozen=True, slots=True)
class ImitationDriver:
    """A small network that has learned from SUMO's drivers how to accelerate.

    Attributes
    ----------
    weights
        File of weights; those that ship if not given.
    sampled
        Draws accelerations instead of taking their mean.
    """

    weights: str = ""
    sampled: bool = offered(
        False, "Accelerations drawn", meaning="else the mean of what was learned"
    )

    def __post_init__(self) -> None:
        _network_of(self.weights)  # refused before anything runs

    def init(self, rng: np.random.Generator, scene: BehaviourScene) -> tuple[Any, ...]:
        """Read the weights."""
        return _network_of(self.weights), ImitationState(scene, rng)

    def act(
        self, observation: RoadObservation, state: tuple[Any, ...]
    ) -> tuple[DrivingAction, BoolArray]:
        """Speeds after the next step."""
        network, (scene, rng) = state
        shares = softmax(network(sight(observation, scene)))
        faster = shares @ BINS
        if self.sampled:
            drawn = rng.random(len(observation))[:, None]
            place = np.minimum((shares.cumsum(axis=1) < drawn).sum(axis=1), len(BINS) - 1)
            faster = BINS[place]
        speed = np.maximum(observation.speed + faster * scene.step_length, 0.0)
        return DrivingAction(speed=speed.astype(np.float64)), observation.lane >= 0


def sight(seen: RoadObservation, scene: BehaviourScene) -> Array:
    """What each vehicle sees: :data:`FEATURES`, shape ``(N, 12)``, float32."""
    wanted = desired_speeds(seen, scene, scene.speed_factor)
    gap = np.clip(seen.gap, 0.0, _FAR)
    leading = np.where(seen.leader >= 0, np.append(seen.speed, 0.0)[seen.leader], _FAST)
    rest = np.clip(np.where(seen.lane >= 0, scene.lane_length[seen.lane] - seen.pos, _FAR), 0, _FAR)
    onward = seen.ahead[:, 0]
    following = np.where(onward >= 0, scene.lane_limit[onward], 0.0)
    columns = (
        seen.speed / _FAST,
        wanted / _FAST,
        gap / _FAR,
        leading / _FAST,
        np.exp(-gap / 10.0),
        rest / _FAR,
        (seen.light == LightAhead.RED) * np.exp(-rest / 30.0),
        (seen.light == LightAhead.YELLOW) * np.exp(-rest / 30.0),
        (seen.light == LightAhead.GREEN) * np.exp(-rest / 30.0),
        following / _FAST,
        scene.vehicle_length[seen.index] / 10.0,
        seen.speed < 0.1,
    )
    return np.stack(columns, axis=1).astype(np.float32)


def learned_driver(
    x: Array, acceleration: FloatArray, rng: np.random.Generator, *, epochs: int = 12
) -> SmallNetwork:
    """Train a network on what drivers saw and how they then accelerated, m/s^2."""
    target = np.clip(np.round((acceleration - BINS[0]) / 0.5), 0, len(BINS) - 1).astype(np.int64)
    network = new_network(x.shape[1], _HIDDEN, len(BINS), rng)
    return trained(network, x, target, rng, epochs=epochs)


def network_bytes(network: SmallNetwork, about: dict[str, Any]) -> bytes:
    """Weights as a file."""
    stream = io.BytesIO()
    arrays: dict[str, Any] = {f"w{k}": one for k, one in enumerate(network.weights)}
    np.savez(stream, about=np.array(json.dumps(about)), **arrays)
    return stream.getvalue()


def network_from_bytes(data: bytes, *, file: str) -> SmallNetwork:
    """Inverse of :func:`network_bytes`.

    Raises
    ------
    InputError
        If they are no weights of this model.
    """
    arrays = arrays_from_npz(data, file=file, most=MOST_WEIGHTS)
    with in_file(file):
        return SmallNetwork.from_arrays(arrays, "w", inputs=len(FEATURES), outputs=len(BINS))


def _network_of(weights: str) -> SmallNetwork:
    """Network of a file; the one that ships if none is named."""
    data = read_given(as_path(weights), most=MOST_WEIGHTS) if weights else shipped_weights()
    return network_from_bytes(data, file=weights or _SHIPPED)


def shipped_weights() -> bytes:
    """Weights that ship."""
    return files("odscen.learning.behaviour").joinpath(_SHIPPED).read_bytes()


@dataclass
class DrivingRecorder:
    """The model; writes ``x`` (what was seen), ``acceleration`` and ``speed`` when the run is over.

    Attributes
    ----------
    file
        ``.npz`` file to write.
    every
        Of so many steps one is recorded.
    lights
        Whether lights are seen.
    """

    file: str
    every: float = 4.0
    lights: bool = True
    _steps: int = 0
    _before: tuple[Int32Array, FloatArray, Array] | None = None
    _rows: list[tuple[Array, FloatArray, FloatArray]] = field(default_factory=list)

    def init(self, rng: np.random.Generator, scene: BehaviourScene) -> BehaviourScene:
        """Begin."""
        del rng
        return scene

    def act(
        self, observation: RoadObservation, state: BehaviourScene
    ) -> tuple[DrivingAction, BoolArray]:
        """Remember what is seen, and in the next step what came of it."""
        seen = observation
        if self._before is not None:
            index, speed, x = self._before
            _, old, new = np.intersect1d(index, seen.index, return_indices=True)
            faster = (seen.speed[new] - speed[old]) / state.step_length
            self._rows.append((x[old], faster, speed[old]))
        due = self._steps % max(int(self.every), 1) == 0
        self._before = (seen.index, seen.speed, self._sense_road(seen, state)) if due else None
        self._steps += 1
        return DrivingAction(speed=seen.speed), np.zeros(len(seen), dtype=np.bool_)

    def _sense_road(self, seen: RoadObservation, scene: BehaviourScene) -> Array:
        x = sight(seen, scene)
        if not self.lights:
            x[:, [FEATURES.index(color) for color in ("red", "yellow", "green")]] = 0.0
        return x

    def close(self) -> None:
        """Write it, if there is any."""
        if not self._rows:
            return
        names = ("x", "acceleration", "speed")
        columns = [np.concatenate([row[k] for row in self._rows]) for k in range(3)]
        with Path(self.file).open("wb") as stream:
            arrays: dict[str, Any] = dict(zip(names, columns, strict=True))
            np.savez(stream, **arrays)
