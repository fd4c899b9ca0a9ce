"""Environments of lights: as sumo-rl's users know them, by the libraries' own checks."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from pettingzoo.test import parallel_api_test

from odscen import edit, rl
from odscen.app.environments.light_tasks import REWARDS, named_reward
from odscen.base.errors import InputError
from odscen.learning.behaviour.light_model import LightObservation
from tests.sumo.story_case import entry, loaded, workspace

CROSSING = "signal_crossing"


def rush(name: str = CROSSING, until: float = 40.0, trips: int = 40) -> Any:
    entry(name)
    graph = loaded(name).sumo.graph
    empty = edit.new_scenario(graph, name="rush", roi=graph.segments.ids)
    timed = edit.set_simulation(empty, duration=until)
    return edit.set_background(timed, graph, background="all", trips=trips)


def play(env: Any, *, seed: int) -> list[float]:
    seen, _ = env.reset(seed=seed)
    rewards, over, step = [float(seen.sum())], False, 0
    while not over:
        seen, reward, _, over, _ = env.step(step // 3 % 2)
        rewards += [reward, float(seen.sum())]
        step += 1
    return rewards


@pytest.mark.slow
def test_an_episode_has_a_choice_every_five_seconds_and_is_the_same_by_seed() -> None:
    env = rl.SignalEnvironment(workspace(), rush())
    assert env.action_space.n == 2
    assert env.observation_space.shape == (2 + 1 + 2 * 12,)
    first, again, other = (play(env, seed=seed) for seed in (3, 3, 4))
    env.close()
    assert first == again
    assert first != other
    # 40 s: at 0, 5, ... 35 s, and the end.
    assert len(first) == 1 + 2 * 8


@pytest.mark.slow
def test_one_light_passes_the_check_of_gymnasium_and_goes_in_its_vectors() -> None:
    env = rl.SignalEnvironment(workspace(), rush())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(env, skip_render_check=True)
    env.close()
    several = SyncVectorEnv([lambda: rl.SignalEnvironment(workspace(), rush())] * 2)
    found = []
    for _ in range(2):
        seen, _ = several.reset(seed=5)
        for _ in range(3):
            seen, rewards, *_ = several.step(np.array([1, 0]))
        found.append((seen.tobytes(), rewards.tobytes()))
    several.close()
    assert seen.shape == (2, 27)
    assert found[0] == found[1]


@pytest.mark.slow
def test_all_lights_pass_the_check_of_pettingzoo() -> None:
    env = rl.SignalsEnvironment(workspace(), rush("town_5x5"))
    assert len(env.possible_agents) == 6
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parallel_api_test(env, num_cycles=12)
    env.close()


def test_rewards_are_those_of_sumo_rl_and_the_time_that_is_lost() -> None:
    def seen(waiting: float, queue: float, lost: float) -> LightObservation:
        one = (np.array([value, 0.0]) for value in (4.0, queue, waiting, lost))
        return LightObservation(0, 9.0, True, *one, leaving=np.array([1.0]))  # type: ignore[misc]

    facts: Any = None
    before, now = seen(250.0, 3.0, 3.5), seen(200.0, 1.0, 2.0)
    found = {name: reward(facts, before, now) for name, reward in REWARDS.items()}
    assert found == {"diff-waiting-time": 0.5, "queue": -1.0, "pressure": -3.0, "delay": -0.2}
    with pytest.raises(InputError, match="there is no reward 'speed'; there are diff-waiting"):
        named_reward("speed")


def test_a_light_and_a_stage_that_are_not_there_are_refused() -> None:
    with pytest.raises(InputError, match="there is no light '7'; there are J10001"):
        rl.SignalEnvironment(workspace(), rush(), light="7")
    with pytest.raises(InputError, match="map 'motorway_weave' has no light"):
        rl.SignalEnvironment(workspace(), rush("motorway_weave"))
    env = rl.SignalEnvironment(workspace(), rush(), light="10001")
    with pytest.raises(InputError, match="has stages 0 to 1, not 2"):
        env.step(2)


@pytest.mark.slow
def test_training_gives_the_same_agent_by_seed_and_a_run_with_it(tmp_path: Any) -> None:
    said: list[rl.TrainedEpisode] = []
    agents = [
        rl.train_signals(workspace(), [rush()], episodes=3, batch=2, seed=seed, told=said.append)
        for seed in (1, 1, 2)
    ]
    assert agents[0].to_bytes() == agents[1].to_bytes() != agents[2].to_bytes()
    assert [episode.number for episode in said] == [0, 1, 2] * 3
    assert all(episode.reward < 0.0 for episode in said)
    file = agents[0].save(tmp_path / "agent.npz")
    assert rl.SignalAgent.read(file).to_bytes() == agents[0].to_bytes()
    compared = rl.compare_controls(workspace(), rush(), agent=file, seeds=(1, 2))
    assert [runs.control for runs in compared] == [
        "fixed", "webster", "actuated", "max-pressure", "agent",
    ]  # fmt: skip
    assert all(runs.difference.runs == 2 and runs.difference.a for runs in compared)
