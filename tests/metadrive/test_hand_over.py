"""What MetaDrive's process is given."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.app.running.runs import check_file, prepare_run
from odscen.metadrive.hand_over import SIDEWAYS, drives_of, speed_along, write_job
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.tracked_run import SumoTracks

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.maps.store import Workspace


def step(time: float, index: list[int], x: list[float]) -> Any:
    """Road users on a line."""
    zero = np.zeros(len(index))
    values = dict.fromkeys(("y", "z", "hdg", "speed"), zero)
    return SimpleNamespace(time=time, index=np.array(index), x=np.array(x), **values)


def test_the_speed_that_is_wanted_falls_before_a_bend_and_in_it() -> None:
    straight = np.column_stack([np.arange(0.0, 100.0), np.zeros(100)])
    angle = np.linspace(0.0, np.pi / 2, 40)
    bend = np.column_stack([100.0 + 10.0 * np.sin(angle), 10.0 - 10.0 * np.cos(angle)])
    xy = np.concatenate([straight, bend])
    wanted = speed_along(xy, np.full(len(xy), 14.0))
    assert wanted[0] == 14.0
    assert wanted[120] == pytest.approx(np.sqrt(SIDEWAYS * 10.0), rel=0.02)
    slowing = wanted[60:100]
    assert (np.diff(slowing) <= 1e-9).all()
    # v^2 falls by at most 2 a d
    assert np.diff(slowing**2).min() >= -2.0 * 2.0 * 1.0 - 1e-3


def test_one_who_stands_wants_the_limit_and_bends_are_not_seen_in_its_noise() -> None:
    xy = np.array([[0.0, 0.0], [0.0, 0.0], [1e-9, 0.0], [0.5, 0.0]])
    assert speed_along(xy, np.full(4, 8.0)).tolist() == [8.0] * 4


def test_a_job_has_users_states_ways_and_the_lanes_near_them(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    checked = check_file(workspace, sampled, settings=RunSettings(until=30.0))
    plan = prepare_run(checked).plan
    number = next(k for k, actor in enumerate(plan.actors) if actor.category == "car")
    walker = next(k for k, actor in enumerate(plan.actors) if actor.category == "pedestrian")
    actors = list(plan.actors)
    actors[number] = replace(actors[number], ego=True)
    plan = replace(plan, actors=tuple(actors))
    drives = drives_of(plan, ego="idm", traffic="replay")
    assert [drive for drive in drives if drive != "replay"] == ["idm"]
    assert drives_of(plan, ego="replay", traffic="tracking")[walker] == "replay"
    steps = [step(0.0, [number], [0.0]), step(0.5, [number, walker], [4.0, 9.0])]
    steps.append(step(1.0, [walker], [9.5]))
    tracks = SumoTracks.of(steps)
    on = checked.run_map
    write_job(
        tmp_path,
        plan=plan,
        tracks=tracks,
        drives=drives,
        lanes=(),
        graph=on.graph.lanes,
        assets=on.assets,
        grip=0.7,
    )
    job = json.loads((tmp_path / "job.json").read_text(encoding="utf-8"))
    stored = np.load(tmp_path / "job.npz")
    assert job["steps"] == round(30.0 / plan.step_length)
    user = job["users"][number]
    assert (user["id"], user["body"], user["drive"]) == (plan.actors[number].id, "vehicle", "idm")
    assert user["arrives"], "it is there no more at the end"
    assert not job["users"][walker]["arrives"]
    assert user["grip"] == 0.7
    assert user["height"] > 1.0
    assert stored["start"].tolist() == [0, 1, 3, 4]
    assert stored["row"].tolist() == [number, number, walker, walker]
    assert stored["path_start"].tolist() == [0, 2]
    assert stored["path_time"].tolist() == [0.0, 0.5]
    assert (stored["path_speed"] > 1.0).all()
    assert stored["lane_start"].tolist() == [0]
