"""Environments of Gymnasium and PettingZoo, by the libraries' own checks."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test

from odscen.app.environments.ego_environment import EgoEnvironment
from odscen.app.environments.traffic_environment import TrafficEnvironment
from odscen.base.errors import InputError
from tests.sumo.story_case import MIDDLE, document, node_at, workspace

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

MOTORWAY = "motorway_weave"


def scene(*, ego: bool = True, until: float = 2.0) -> Scenario:
    goal = node_at(MOTORWAY, 900.0, MIDDLE)
    actors = [
        {
            "id": name, "category": "car", "spawn": node_at(MOTORWAY, x, MIDDLE), "goal": goal,
            "speed": 20.0, "initial_speed": 20.0, "ego": ego and name == "behind",
        }
        for name, x in (("behind", 300.0), ("ahead", 360.0))
    ]  # fmt: skip
    return document(MOTORWAY, actors, [], until=until)


@pytest.mark.slow
def test_the_ego_passes_the_check_of_gymnasium() -> None:
    env = EgoEnvironment(workspace(), scene())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it advises of spaces from -1 to 1
        check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.slow
def test_the_ego_brakes_as_it_is_told_and_the_episode_ends_with_the_run() -> None:
    env = EgoEnvironment(workspace(), scene(until=1.0))
    seen, _ = env.reset(seed=1)
    speeds, over = [float(seen[0]) * 20.0], False
    while not over:
        seen, reward, terminated, over, _ = env.step(np.array([-2.0], dtype=np.float32))
        assert not terminated
        assert over or 0.0 < reward <= 1.0
        speeds.append(float(seen[0]) * 20.0)
    env.close()
    np.testing.assert_allclose(np.diff(speeds[:8]), -0.2, atol=1e-3)


@pytest.mark.slow
def test_traffic_passes_the_check_of_pettingzoo() -> None:
    env = TrafficEnvironment(workspace(), scene(until=1.0))
    assert sorted(env.possible_agents) == ["ahead", "behind"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parallel_api_test(env, num_cycles=20)
    env.close()


def test_without_an_ego_there_is_nobody_to_drive() -> None:
    env = EgoEnvironment(workspace(), scene(ego=False))
    with pytest.raises(InputError, match="has 0 egos"):
        env.reset(seed=1)
    env.close()
