"""An agent that has learned to switch traffic lights, its policy, and how it learns.

One small network looks at each stage of a light on its own and says how much it is worth to be
green; the shares of the stages are the softmax of that. So one agent fits lights of any number of
stages and lanes, and maps that it has not seen. It learns by proximal policy optimisation (PPO;
Schulman et al., 2017) with generalised advantages (Schulman et al., 2016), in numpy.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from odscen.base.errors import InputError, in_file
from odscen.base.given_arrays import arrays_from_npz
from odscen.base.given_files import as_path, read_given
from odscen.base.stored_files import documents
from odscen.base.text_files import write_file
from odscen.learning.behaviour.light_model import DECISION_INTERVAL
from odscen.learning.behaviour.max_pressure import stage_pressure
from odscen.learning.reference.traffic_model import (
    MOST_WEIGHTS,
    SmallNetwork,
    new_network,
    softmax,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.base.given_files import GivenPath
    from odscen.learning.behaviour.light_model import (
        LightFacts,
        LightObservation,
        LightScene,
        LightsObservation,
    )
    from odscen.learning.fill import Array

FEATURES = (
    "vehicles served", "queue served", "waiting served", "speed lost served", "queue elsewhere",
    "speed lost elsewhere", "pressure", "is shown", "green so far", "seconds of the change",
    "least green", "may not switch",
)  # fmt: skip
"""Of each stage in :func:`stage_features`, each about 0 to 1."""
_HIDDEN = 32
_NEVER = np.float32(-1e9)
"""Worth of a stage that is not there."""


def stage_features(facts: LightFacts, seen: LightObservation) -> Array:
    """What there is to know of each stage: :data:`FEATURES`, shape ``(P, 12)``, float32."""
    serves = np.array(facts.serves, dtype=np.float64)
    others = 1.0 - serves
    stages = len(facts.stages)
    shown = np.arange(stages) == seen.stage
    change = np.array(facts.change)[seen.stage] if seen.stage >= 0 else np.zeros(stages)
    columns = (
        serves @ seen.vehicles / 10.0,
        serves @ seen.queue / 10.0,
        np.minimum(serves @ seen.waiting / 300.0, 3.0),
        serves @ seen.lost / 10.0,
        others @ seen.queue / 10.0,
        others @ seen.lost / 10.0,
        stage_pressure(facts, seen) / 10.0,
        shown,
        shown * min(seen.since, 90.0) / 30.0,
        change / 10.0,
        np.array(facts.least_green) / 20.0,
        np.full(stages, not seen.may_switch),
    )
    return np.stack(columns, axis=1).astype(np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class SignalAgent:
    """What has been learned.

    Attributes
    ----------
    policy
        Worth of a stage from its features.
    about
        How it was trained.
    """

    policy: SmallNetwork
    about: Mapping[str, Any] = field(default_factory=dict)

    def choose(self, facts: LightFacts, seen: LightObservation) -> int:
        """Stage of a light that is worth most."""
        return int(np.argmax(self.policy(stage_features(facts, seen))[:, 0]))

    def save(self, path: GivenPath) -> Path:
        """Write it as ``.npz``, which ``signal-agent`` reads; the path."""
        file = as_path(path)
        write_file(file, self.to_bytes())
        return file

    def to_bytes(self) -> bytes:
        """Inverse of :meth:`from_bytes`; the same bytes for the same agent."""
        stream = io.BytesIO()
        arrays: dict[str, Any] = {f"w{k}": part for k, part in enumerate(self.policy.weights)}
        np.savez(stream, about=np.array(json.dumps(dict(self.about))), **arrays)
        return stream.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes, *, file: str) -> Self:
        """Read an agent.

        Raises
        ------
        InputError
            If it is none.
        """
        arrays = arrays_from_npz(data, file=file, most=MOST_WEIGHTS)
        with in_file(file), documents("an agent for lights", RecursionError):
            about = dict(json.loads(str(arrays["about"])))
            policy = SmallNetwork.from_arrays(arrays, "w", inputs=len(FEATURES), outputs=1)
            return cls(policy, about)

    @classmethod
    def read(cls, path: GivenPath) -> Self:
        """Read an agent from a file.

        Raises
        ------
        InputError
            If it cannot be read, or is no agent.
        """
        file = as_path(path)
        return cls.from_bytes(read_given(file, most=MOST_WEIGHTS), file=str(file))


@dataclass(frozen=True, slots=True)
class SignalAgentModel:
    """Traffic lights by an agent that has learned to switch them (PPO).

    Attributes
    ----------
    agent
        Its file, see :meth:`SignalAgent.save`.
    """

    agent: str = ""

    def __post_init__(self) -> None:
        if not self.agent:
            raise InputError("it needs the file of an agent, as the setting agent=FILE")
        SignalAgent.read(self.agent)  # refused before anything runs

    @property
    def interval(self) -> float:
        """Seconds between two choices: those that agents are trained with."""
        return DECISION_INTERVAL

    def init_lights(
        self, rng: np.random.Generator, scene: LightScene
    ) -> tuple[SignalAgent, LightScene]:
        """Read the agent."""
        del rng
        return SignalAgent.read(self.agent), scene

    def switch(
        self, observation: LightsObservation, state: tuple[SignalAgent, LightScene]
    ) -> list[int]:
        """Choose the stage of each light that is worth most."""
        agent, scene = state
        return [
            agent.choose(facts, seen)
            for facts, seen in zip(scene.lights, observation.lights, strict=True)
        ]


# Learning


@dataclass(frozen=True, slots=True, eq=False)
class LightEpisode:
    """What one light went through: ``T`` choices.

    Attributes
    ----------
    features
        ``(T, P, F)``.
    free
        ``(T,)``: whether there was a choice.
    chosen
        ``(T,)``: stage.
    logp
        ``(T,)``: logarithm of the share that it had.
    rewards
        ``(T,)``: of the time until the next choice.
    """

    features: Array
    free: BoolArray
    chosen: IntArray
    logp: FloatArray
    rewards: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class PpoSettings:
    """Settings of the learner.

    Attributes
    ----------
    discount
        Of a reward for each choice that it comes later.
    trace
        Lambda of the generalised advantages.
    clip
        By how much shares may change in one update before they count no more.
    epochs, batch
        How often the rows of an update are gone through, and by how many at a time.
    rate
        Step length of Adam; it falls to a tenth over the training.
    entropy
        Worth of undecided shares; it falls to nothing over the training.
    """

    discount: float = 0.93
    trace: float = 0.9
    clip: float = 0.2
    epochs: int = 10
    batch: int = 64
    rate: float = 3e-3
    entropy: float = 0.01


class PpoLearner:
    """Learns a policy from episodes.

    Parameters
    ----------
    updates
        How often it is going to :meth:`learn`.
    """

    def __init__(
        self, rng: np.random.Generator, *, updates: int, settings: PpoSettings | None = None
    ) -> None:
        self.policy = new_network(len(FEATURES), _HIDDEN, 1, rng)
        self._value = new_network(2 * len(FEATURES), _HIDDEN, 1, rng)
        self._rng = rng
        self._settings = settings or PpoSettings()
        self._updates, self._done = updates, 0
        self._adams = _Adam(self.policy), _Adam(self._value)
        self._rewards: list[FloatArray] = []

    def draw(self, features: Array) -> tuple[int, float]:
        """Draw a stage by its share; the stage, and the logarithm of the share."""
        shares = softmax(self.policy(features)[:, 0][None].astype(np.float64))[0]
        stage = min(int(np.searchsorted(shares.cumsum(), self._rng.random())), len(shares) - 1)
        return stage, float(np.log(max(shares[stage], 1e-12)))

    def learn(self, episodes: Sequence[LightEpisode]) -> None:
        """Improve the policy by what episodes of it have come to."""
        settings = self._settings
        left = 1.0 - self._done / max(self._updates, 1)
        self._done += 1
        # Less their mean and over their spread: else values would learn a constant first.
        self._rewards += [x.rewards for x in episodes]
        known = np.concatenate(self._rewards)
        level, spread = float(known.mean()), float(known.std()) + 1e-8
        episodes = [replace(x, rewards=(x.rewards - level) / spread) for x in episodes]
        widest = max(x.features.shape[1] for x in episodes)
        pools = [_pool_features(x.features) for x in episodes]
        found = [
            self._estimate_advantages(x, pool) for x, pool in zip(episodes, pools, strict=True)
        ]
        advantage = np.concatenate([pair[0] for pair in found])
        target = np.concatenate([pair[1] for pair in found]).astype(np.float32)
        pooled = np.concatenate(pools)
        features = np.concatenate([_widen_features(x.features, widest) for x in episodes])
        there = np.concatenate(
            [np.tile(np.arange(widest) < x.features.shape[1], (len(x.free), 1)) for x in episodes]
        )
        chosen = np.concatenate([x.chosen for x in episodes])
        logp = np.concatenate([x.logp for x in episodes])
        free = np.flatnonzero(np.concatenate([x.free for x in episodes]))
        own = advantage[free]
        advantage = (advantage - own.mean()) / (own.std() + 1e-8) if len(own) else advantage
        rate = settings.rate * (0.1 + 0.9 * left)
        for _ in range(settings.epochs):
            for rows in self._draw_batches(free):
                self._improve_policy(
                    features[rows], there[rows], chosen[rows], logp[rows], advantage[rows],
                    rate=rate, entropy=settings.entropy * left,
                )  # fmt: skip
            for rows in self._draw_batches(np.arange(len(target))):
                layers = self._value.layers(pooled[rows])
                error = (layers[-1] - target[rows, None]) / np.float32(len(rows))
                self._value = self._adams[1].step(self._value, layers, error, rate)

    def _draw_batches(self, rows: IntArray) -> list[IntArray]:
        order = self._rng.permutation(rows)
        size = self._settings.batch
        return [order[k : k + size] for k in range(0, len(order), size)]

    def _estimate_advantages(
        self, episode: LightEpisode, pooled: Array
    ) -> tuple[FloatArray, FloatArray]:
        """Advantages of what was chosen, and what the values should have been."""
        settings = self._settings
        values = self._value(pooled)[:, 0].astype(np.float64)
        advantages = np.zeros(len(values))
        following, rest = values[-1], 0.0  # an episode is cut off, its traffic goes on
        for k in range(len(values) - 1, -1, -1):
            error = episode.rewards[k] + settings.discount * following - values[k]
            rest = error + settings.discount * settings.trace * rest
            advantages[k], following = rest, values[k]
        return advantages, advantages + values

    def _improve_policy(
        self,
        features: Array,
        there: BoolArray,
        chosen: IntArray,
        logp: FloatArray,
        advantage: FloatArray,
        *,
        rate: float,
        entropy: float,
    ) -> None:
        r"""One step up the clipped objective.

        Of a row with ratio r and advantage A it is min(r A, clip(r, 1 - c, 1 + c) A) + e H; by the
        worth of stage k it changes by r A (1_chosen - p_k) where it is not clipped, and by
        -e p_k (log p_k + H).
        """
        count, width, size = features.shape
        layers = self.policy.layers(features.reshape(-1, size))
        worth = np.where(there, layers[-1].reshape(count, width), _NEVER).astype(np.float64)
        shares = softmax(worth)
        logs = np.log(np.maximum(shares, 1e-12))
        rows = np.arange(count)
        ratio = np.exp(logs[rows, chosen] - logp)
        clip = self._settings.clip
        held = np.where(advantage > 0, ratio > 1.0 + clip, ratio < 1.0 - clip)
        pull = np.where(held, 0.0, ratio * advantage)
        hit = np.zeros_like(shares)
        hit[rows, chosen] = 1.0
        undecided = -(shares * logs).sum(axis=1, keepdims=True)
        rise = pull[:, None] * (hit - shares) - entropy * shares * (logs + undecided)
        error = np.where(there, -rise, 0.0).reshape(-1, 1).astype(np.float32) / np.float32(count)
        self.policy = self._adams[0].step(self.policy, layers, error, rate)


class _Adam:
    """Moments of one network (Kingma and Ba, 2015); gradients are at most 1 long in all."""

    def __init__(self, network: SmallNetwork) -> None:
        self._first = [np.zeros_like(weight) for weight in network.weights]
        self._second = [np.zeros_like(weight) for weight in network.weights]
        self._steps = 0

    def step(
        self, network: SmallNetwork, layers: tuple[Array, ...], error: Array, rate: float
    ) -> SmallNetwork:
        self._steps += 1
        gradients = network.gradients(layers, error)
        length = float(np.sqrt(sum(float((part**2).sum()) for part in gradients)))
        weights = []
        for k, gradient in enumerate(gradients):
            part = gradient / max(length, 1.0)
            self._first[k] = 0.9 * self._first[k] + 0.1 * part
            self._second[k] = 0.999 * self._second[k] + 0.001 * part**2
            mean = self._first[k] / (1.0 - 0.9**self._steps)
            spread = np.sqrt(self._second[k] / (1.0 - 0.999**self._steps)) + 1e-8
            weights.append((network.weights[k] - rate * mean / spread).astype(np.float32))
        return SmallNetwork(tuple(weights))


def _pool_features(features: Array) -> Array:
    """What is known of a light as a whole: means over its stages, and the stage that is shown."""
    shown = features[:, :, FEATURES.index("is shown")] > 0.5
    return np.concatenate(
        [features.mean(axis=1), (features * shown[:, :, None]).sum(axis=1)], axis=1
    )


def _widen_features(features: Array, width: int) -> Array:
    return np.pad(features, ((0, 0), (0, width - features.shape[1]), (0, 0)))
