"""Vehicles driven by models in real runs: exactly as asked, given back, and the same each time."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.learning.behaviour.behaviour_model import BehaviourDoor, DrivingKind
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.worker.behaviour.behaviour_doors import open_behaviour
from tests.sumo.conftest import start_killed_workers
from tests.sumo.story_case import MIDDLE, document, entry, loaded, node_at
from tests.sumo.worker.behaviour.models import HERE

if TYPE_CHECKING:
    from odscen.runs.finished_run import Run

MOTORWAY = "motorway_weave"
ROOT = str(Path(__file__).parents[4])
RECORDS = ("trajectories.parquet", "events.json", "actors.json")
SERVE = """
import sys
sys.path.insert(0, {!r})
from odscen.learning.behaviour.behaviour_messages import serve
from tests.sumo.worker.behaviour import models
serve(models.{})
"""


def driven(out: Path, *, until: float = 4.0, slices: float | None = None, **door: Any) -> Run:
    """Two cars at 20 m/s, 60 m apart, driven by a model if one is named."""
    goal = node_at(MOTORWAY, 900.0, MIDDLE)
    actors = [
        {
            "id": name, "category": "car", "spawn": node_at(MOTORWAY, x, MIDDLE), "goal": goal,
            "speed": 20.0, "initial_speed": 20.0,
        }
        for name, x in (("behind", 300.0), ("ahead", 360.0))
    ]  # fmt: skip
    scenario = document(MOTORWAY, actors, [], until=until)
    settings = RunSettings(slice_length=slices, behaviour=BehaviourDoor(**door) if door else None)
    net = entry(MOTORWAY).checked("net")
    return run_prepared(prepare(scenario, loaded(MOTORWAY).sumo, net, settings=settings), out)


def track(run: Run, name: str) -> pl.DataFrame:
    assert run.status == "completed", run.summary["error"]
    return run.trajectories().filter(pl.col("id") == name)


def only(kind: DrivingKind, value: float, *, vehicle: str = "ahead") -> dict[str, Any]:
    options = {"vehicle": vehicle, "kind": float(kind), "value": value}
    return {"name": f"{HERE}:Only", "options": options}


@pytest.mark.slow
def test_a_model_that_controls_nobody_leaves_every_byte_as_it_is(tmp_path: Path) -> None:
    driven(tmp_path / "plain")
    run = driven(tmp_path / "seen", name=f"{HERE}:Nobody")
    assert run.summary["behaviour"] == f"{HERE}:Nobody"
    for name in RECORDS:
        assert (tmp_path / "plain" / name).read_bytes() == (run.folder / name).read_bytes(), name


@pytest.mark.slow
def test_an_observation_that_is_kept_holds_what_it_showed(tmp_path: Path) -> None:
    run = driven(tmp_path / "kept", name=f"{HERE}:Keeper")
    assert run.status == "completed", run.summary["error"]


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_and_idm_drives(tmp_path: Path) -> None:
    options = {"spread": 0.1, "headway": 3.0}
    one, two = (driven(tmp_path / n, name="idm", options=options) for n in "ab")
    for name in RECORDS:
        assert (one.folder / name).read_bytes() == (two.folder / name).read_bytes(), name
    plain = driven(tmp_path / "plain")
    assert track(plain, "behind")["x"][-1] - track(one, "behind")["x"][-1] > 1.0


@pytest.mark.slow
def test_an_unchecked_speed_is_the_speed_and_then_sumo_drives_again(tmp_path: Path) -> None:
    run = driven(tmp_path / "run", **only(DrivingKind.SPEED_UNCHECKED, 3.0))
    rows = track(run, "ahead")
    during = rows.filter(pl.col("time").is_between(1.05, 2.95))["speed"].to_numpy()
    np.testing.assert_allclose(during, 3.0, atol=0.011)
    assert rows["speed"][-1] > 4.0


@pytest.mark.slow
def test_a_checked_speed_does_not_run_into_the_vehicle_ahead(tmp_path: Path) -> None:
    fast = driven(tmp_path / "checked", **only(DrivingKind.SPEED, 40.0, vehicle="behind"))
    hit = driven(tmp_path / "blind", **only(DrivingKind.SPEED_UNCHECKED, 60.0, vehicle="behind"))
    assert "collision" not in fast.events()["kind"].to_list()
    assert "collision" in hit.events()["kind"].to_list()


@pytest.mark.slow
def test_a_place_on_the_lane_is_taken(tmp_path: Path) -> None:
    rows = track(driven(tmp_path / "run", **only(DrivingKind.LANE_POSITION, 0.5)), "ahead")
    during = rows.filter(pl.col("time").is_between(1.05, 2.95))["x"].to_numpy()
    np.testing.assert_allclose(np.diff(during), 0.5, atol=0.02)


@pytest.mark.slow
def test_a_pose_is_that_of_the_centre_of_the_body_off_the_road_too(tmp_path: Path) -> None:
    rows = track(driven(tmp_path / "run", **only(DrivingKind.POSE, 400.0)), "ahead")
    during = rows.filter(pl.col("time").is_between(1.05, 2.95))
    time = during["time"].to_numpy()
    np.testing.assert_allclose(during["x"].to_numpy(), 400.0 + time - 1.0, atol=0.011)
    np.testing.assert_allclose(during["y"].to_numpy(), -20.0, atol=0.011)
    np.testing.assert_allclose(during["hdg"].to_numpy(), 0.5, atol=0.002)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("raise", "act failed: ZeroDivisionError('kaputt')"),
        ("lane", "vehicle 'ahead': there is no lane 1000000"),
    ],
)
def test_what_cannot_be_ends_the_run_with_instant_and_value(
    tmp_path: Path, what: str, words: str
) -> None:
    run = driven(tmp_path / "run", name=f"{HERE}:Wrong", options={"what": what}, until=1.5)
    assert run.status == "failed"
    first = str(run.summary["error"]).splitlines()[0]
    assert first == f"behaviour {HERE}:Wrong at 1 s: {words}"


@pytest.mark.slow
def test_a_program_over_a_pipe_drives_as_the_class_does(tmp_path: Path) -> None:
    script = tmp_path / "drive.py"
    script.write_text(SERVE.format(ROOT, "Only('ahead', 1, 3.0)"))
    run = driven(tmp_path / "piped", command=f"{sys.executable} {script}")
    own = driven(tmp_path / "own", **only(DrivingKind.SPEED_UNCHECKED, 3.0))
    for name in RECORDS:
        assert (own.folder / name).read_bytes() == (run.folder / name).read_bytes(), name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import sys; print('no licence', file=sys.stderr); sys.exit(4)", "exit code 4: no lic"),
        ("import time; time.sleep(60)", "it took more than 0.5 s for a step"),
    ],
)
def test_a_program_that_dies_or_hangs_fails_the_run_with_a_reason(
    tmp_path: Path, code: str, words: str
) -> None:
    command = f'{sys.executable} -c "{code}"'
    limit = 0.5 if "sleep(60)" in code else 20.0
    run = driven(tmp_path / "run", until=1.0, command=command, time_limit=limit)
    assert run.status == "failed"
    assert words in run.summary["error"]


@pytest.mark.slow
def test_the_class_and_the_program_of_the_documents_drive(tmp_path: Path) -> None:
    text = (Path(__file__).parents[4] / "docs" / "behaviour.md").read_text(encoding="utf-8")
    blocks = [part.partition("```")[0] for part in text.split("```python\n")[1:]]
    careless, program = tmp_path / "careless.py", tmp_path / "program.py"
    careless.write_text(blocks[0], encoding="utf-8")
    program.write_text(blocks[1], encoding="utf-8")
    one = driven(tmp_path / "one", name=f"{careless}:Careless", until=1.0)
    assert one.status == "completed", one.summary["error"]
    other = driven(tmp_path / "other", command=f"{sys.executable} {program}")
    assert track(other, "ahead")["speed"][-1] < 12.0


@pytest.mark.slow
def test_a_long_run_that_was_killed_ends_with_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    door: dict[str, Any] = {"name": "idm", "options": {"spread": 0.1}}
    whole = driven(tmp_path / "whole", slices=2.0, until=6.0, **door)
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        patch.setenv("KILL_AFTER_SLICE", "2")
        assert driven(tmp_path / "killed", slices=2.0, until=6.0, **door).status == "failed"
    assert resume(tmp_path / "killed").status == "completed"
    parts = sorted(one.name for one in (whole.folder / "trajectories").iterdir())
    assert len(parts) == 3
    for name in ("events.json", "actors.json", *(f"trajectories/{part}" for part in parts)):
        killed = (tmp_path / "killed" / name).read_bytes()
        assert (whole.folder / name).read_bytes() == killed, name


@pytest.mark.parametrize(
    ("door", "words"),
    [
        (BehaviourDoor(name="imm"), "there is no behaviour 'imm'; 'idm', 'imitation', "),
        (BehaviourDoor(name="idm", options={"hedway": 1.0}), "it cannot be made"),
        (
            BehaviourDoor(name=f"{HERE}:Misdescribed"),
            f"^{HERE}:Misdescribed: its `options` are no JSON Schema",
        ),
        (BehaviourDoor(name="odscen:Workspace"), "cannot be made|has no method"),
        (BehaviourDoor(name="nowhere.py:Driver"), "cannot be imported"),
        (BehaviourDoor(command="no-such-program x"), "there is no such program"),
        (BehaviourDoor(name="idm", command="cat"), "by its name or as a command, not both"),
    ],
)
def test_a_model_that_cannot_be_made_is_refused_before_the_run(
    door: BehaviourDoor, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        open_behaviour(door, 0)


def test_an_attribute_called_options_that_offers_nothing_is_the_models_own() -> None:
    door = BehaviourDoor(name=f"{HERE}:Unrelated", options={"gap": 2.0})
    assert vars(open_behaviour(door, 0)) == {"options": {"gap": 2.0}}


def test_in_meso_nobody_is_driven() -> None:
    with pytest.raises(InputError, match="in meso no model can drive"):
        RunSettings(meso=True, behaviour=BehaviourDoor(name="idm"))
    settings = RunSettings(behaviour=BehaviourDoor(name="idm", options={"headway": 2.0}))
    assert RunSettings.from_dict(settings.to_dict()) == settings
