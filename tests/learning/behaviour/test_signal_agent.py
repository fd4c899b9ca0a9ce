"""The learner of lights, without a simulation: its gradient, and that it learns what pays."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.base.given_arrays import arrays_from_npz, npz_bytes
from odscen.learning.behaviour.light_model import (
    KEEP,
    LightFacts,
    LightObservation,
    LightScene,
    LightsObservation,
)
from odscen.learning.behaviour.max_pressure import MaxPressure, stage_pressure
from odscen.learning.behaviour.signal_agent import (
    FEATURES,
    LightEpisode,
    PpoLearner,
    SignalAgent,
    stage_features,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

FACTS = LightFacts(
    id="J1",
    junctions=("1",),
    stages=("a", "b", "c"),
    states=("Grr", "rGr", "rrG"),
    least_green=(5.0, 5.0, 8.0),
    change=((0.0, 4.0, 6.0), (4.0, 0.0, 5.0), (6.0, 5.0, 0.0)),
    approaches=(("w_0",), ("n_0", "m_0"), ("e_0",)),
    lengths=(100.0, 80.0, 60.0),
    exits=("s_0", "x_0"),
    serves=((True, False, False), (False, True, False), (False, False, True)),
    leads=((True, False), (True, True), (False, True)),
)


def seen(
    vehicles: Sequence[float], *, stage: int = 0, leaving: Sequence[float] = (0, 0)
) -> LightObservation:
    there = np.array(vehicles, dtype=float)
    return LightObservation(
        stage, 20.0, True, there, there, 10.0 * there, there, np.array(leaving, dtype=float)
    )


def test_pressure_is_what_waits_less_what_stands_behind() -> None:
    assert stage_pressure(FACTS, seen((4, 6, 1), leaving=(2, 4))).tolist() == [2.0, 3.0, -3.0]


def test_max_pressure_changes_only_where_a_change_is_worth_it() -> None:
    model = MaxPressure()
    scene = model.init_lights(np.random.default_rng(0), LightScene(0.5, 0.0, 5.0, (FACTS,)))
    for vehicles, chosen in (((4, 6, 1), KEEP), ((4, 7, 1), 1), ((4, 4, 9), 2)):
        assert model.switch(LightsObservation(0.0, (seen(vehicles),)), scene) == [chosen]


def test_features_are_of_each_stage() -> None:
    found = stage_features(FACTS, seen((4, 6, 1), stage=1))
    assert found.shape == (3, len(FEATURES))
    by_name = dict(zip(FEATURES, found.T.tolist(), strict=True))
    assert by_name["vehicles served"] == pytest.approx([0.4, 0.6, 0.1])
    assert by_name["queue elsewhere"] == pytest.approx([0.7, 0.5, 1.0])
    assert by_name["is shown"] == [0.0, 1.0, 0.0]
    assert by_name["seconds of the change"] == pytest.approx([0.4, 0.0, 0.5])


@pytest.mark.slow
def test_a_policy_learns_to_serve_the_fullest_approach() -> None:
    rng = np.random.default_rng(1)
    learner = PpoLearner(rng, updates=12)

    def play(draws: int) -> LightEpisode:
        rows, chosen, logs, rewards = [], [], [], []
        for _ in range(draws):
            vehicles = rng.integers(0, 10, 3)
            features = stage_features(FACTS, seen(vehicles.tolist()))
            stage, logp = learner.draw(features)
            rows.append(features)
            chosen.append(stage)
            logs.append(logp)
            rewards.append(float(vehicles[stage] == vehicles.max()))
        return LightEpisode(
            np.stack(rows), np.ones(draws, dtype=np.bool_), np.array(chosen), np.array(logs),
            np.array(rewards),
        )  # fmt: skip

    first = play(200)
    learner.learn([first])
    for _ in range(11):
        learner.learn([play(200)])
    agent, hits = SignalAgent(learner.policy), 0
    for _ in range(200):
        vehicles = rng.integers(0, 10, 3)
        hits += vehicles[agent.choose(FACTS, seen(vehicles.tolist()))] == vehicles.max()
    assert first.rewards.mean() < 0.6
    assert hits >= 180


def test_an_agent_is_the_same_after_a_file_and_others_are_refused() -> None:
    agent = SignalAgent(PpoLearner(np.random.default_rng(2), updates=1).policy, {"seed": 2})
    again = SignalAgent.from_bytes(agent.to_bytes(), file="agent.npz")
    assert again.about == {"seed": 2}
    assert again.to_bytes() == agent.to_bytes()
    with pytest.raises(InputError, match=r"agent\.npz: it cannot be read as an \.npz file"):
        SignalAgent.from_bytes(b"PK", file="agent.npz")
    one = io.BytesIO()
    np.save(one, np.ones(3))
    with pytest.raises(InputError, match="a single array"):
        SignalAgent.from_bytes(one.getvalue(), file="agent.npz")
    arrays = arrays_from_npz(agent.to_bytes())
    for about in ("[1]", "[" * 100_000):
        told = npz_bytes({**arrays, "about": np.array(about)})
        with pytest.raises(InputError, match=r"agent\.npz: not an agent for lights"):
            SignalAgent.from_bytes(told, file="agent.npz")
