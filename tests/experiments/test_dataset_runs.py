"""Datasets: shards that the format's readers take, splits by town, a card, and kills."""

from __future__ import annotations

import hashlib
import json
import pickle
import shutil
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.app.exchange.dataset_exports import ARRAYS, STATISTICS, STATISTICS_FILE, dataset_map
from odscen.app.generation import generate
from odscen.base.errors import ConflictError, InputError, ScenarioError
from odscen.base.given_arrays import npz_bytes
from odscen.experiments.dataset_plan import DatasetPlan, read_dataset_plan
from odscen.experiments.datasets import make_dataset
from odscen.experiments.work import LocalExecutor, Outcome
from odscen.formats.recordings.tfrecord import tfrecord
from odscen.formats.scenarionet_format import pickled
from odscen.scenario.document.problems import validated
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.experiments.study_case import WARM, place
from tests.sumo.story_case import entry

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from odscen.experiments.work import Orders

SAMPLE = {"maps": ["signal_crossing", "t_junction_signs"], "count": 3}


def plan(**parts: Any) -> DatasetPlan:
    data = {
        "name": "towns",
        "licence": "CC-BY-4.0",
        "splits": {"train": ["signal*"], "test": ["t_*"]},
        "study": {"sample": [SAMPLE], "run": {"until": 10.0}},
        **parts,
    }
    return validated(DatasetPlan, data)


@dataclass
class MadeUpExports:
    """Gives rows and small files instead of runs; dies after ``most``."""

    most: int | None = None
    ran: list[str] = field(default_factory=list)

    def outcomes(self, orders: Orders) -> Iterator[list[Outcome]]:
        while (order := orders.next(2)) is not None:
            for run, _ in reversed(order.runs):
                if len(self.ran) == self.most:
                    raise KeyboardInterrupt
                self.ran.append(run.name)
                seed = int(run.scenario[-1])
                row = {"status": "completed", "planned": float(seed), "usable": "usable"}
                if run.scenario == "t_junction_signs-0000":
                    row = {"status": "failed", "detail": "out of luck"}
                    yield [Outcome(run.name, row)]
                    continue
                name = run.name.replace("/", "-")
                sha256 = order.sources[run.scenario].map_sha256
                exports = {
                    one: _files(one, name, run.scenario[:-5], sha256) for one in order.formats
                }
                numbers = {
                    "tracks": 3,
                    "seconds": 9.0,
                    "metres": 45.0,
                    "speeds": [30, *9 * [0], 60],
                }
                most = {"agents": seed, "lights": seed, "steps": 9 - seed, "lanes": 24}
                said = {"seconds": 10.0, "most": most, "categories": {"car": numbers}}
                exports[STATISTICS] = {STATISTICS_FILE: json.dumps(said).encode()}
                yield [Outcome(run.name, row, None, exports)]


def _files(form: str, name: str, map_name: str, sha256: str) -> dict[str, bytes]:
    if form == ARRAYS:
        shared = dataset_map(place(), map_name, sha256)
        about = {"format": "odscen-arrays", "version": 2, "map": map_name, "map_sha256": sha256}
        about |= {"run": name, "scenario": name[:-20], "seed": 1, "recorded_step": 0.1}
        about |= {"interpolated": False}
        about |= {"map_file": shared.file, "map_file_sha256": shared.sha256}
        arrays = {
            "about": np.array(json.dumps(about)),
            "time": np.array([0.0, 0.1]),
            "agent_id": np.array(["a", "b"]),
            "agent_state": np.arange(20.0).reshape(2, 2, 5),
            "light_color": np.zeros((0, 2), dtype=np.uint8),
        }
        return {f"{name}.npz": npz_bytes(arrays, deflated=True)}
    if form == "waymo":
        listed = json.dumps({"run": name}).encode()
        return {f"{name}.tfrecord": tfrecord([name.encode()]), f"{name}.export.json": listed}
    index = {f"sd_{name}.pkl": {"id": name}}
    return {
        f"sd_{name}.pkl": pickled({"id": name}),
        "dataset_summary.pkl": pickled(index),
        "dataset_mapping.pkl": pickled(dict.fromkeys(index, "")),
    }


@pytest.fixture(autouse=True)
def _maps() -> None:
    entry("signal_crossing")
    entry("t_junction_signs")


def made(out: Path, asked: DatasetPlan, executor: Any) -> Any:
    return make_dataset(place(), asked, out, executor, beside=out)


def contents(out: Path) -> dict[str, bytes]:
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file() and path.name != "journal.jsonl"
    }


@pytest.mark.slow
def test_a_dataset_that_was_killed_twice_is_that_of_one_go(tmp_path: Path) -> None:
    asked = plan(formats=["pyg", "scenarionet", "waymo", "webdataset", "huggingface"], shard=2)
    killed, ran = tmp_path / "killed", []
    for most in (2, 3):
        executor = MadeUpExports(most=most)
        with pytest.raises(KeyboardInterrupt):
            made(killed, asked, executor)
        ran += executor.ran
        assert not (killed / "README.md").exists()
    run = next((killed / "staged" / "scenarionet").iterdir())
    (run / ".dataset_mapping.pkl.1.part").write_bytes(b"half of")  # as a kill leaves it
    last = MadeUpExports()
    made(killed, asked, last)
    assert sorted(ran + last.ran) == sorted({*ran, *last.ran})
    whole = tmp_path / "whole"
    made(whole, asked, MadeUpExports())
    assert contents(killed) == contents(whole)
    before = contents(whole)
    nothing = MadeUpExports()
    made(whole, asked, nothing)
    assert (nothing.ran, contents(whole)) == ([], before)


def test_a_plan_that_is_refused_leaves_the_folder_to_another(tmp_path: Path) -> None:
    out = tmp_path / "made"
    with pytest.raises(InputError, match="no pattern matches map"):
        made(out, plan(splits={"train": ["signal*"]}), MadeUpExports())
    with pytest.raises(InputError, match="no map matches"):
        made(out, plan(study={"sample": [{"maps": ["none"]}]}), MadeUpExports())
    assert not out.exists()
    made(out, plan(), MadeUpExports())
    with pytest.raises(ConflictError, match="another plan"):
        made(out, plan(licence="MIT"), MadeUpExports())


def test_shards_are_by_split_and_of_the_size_asked_for(tmp_path: Path) -> None:
    asked = plan(formats=["pyg", "scenarionet", "waymo"], shard=2, keep_if=["planned >= 1"])
    facts = made(tmp_path, asked, MadeUpExports())
    names = sorted(contents(tmp_path))
    junction, crossing = (
        entry(name).sha256[:12] for name in ("t_junction_signs", "signal_crossing")
    )
    shards = [name for name in names if "/pyg/" in name]
    assert sorted(shards, key=lambda name: (name[:4], "maps" in name)) == [
        "test/pyg/shard-00000/t_junction_signs-0001-as-designed-seed-1.npz",
        "test/pyg/shard-00000/t_junction_signs-0002-as-designed-seed-1.npz",
        f"test/pyg/shard-00000/maps/t_junction_signs-{junction}.npz",
        "train/pyg/shard-00000/signal_crossing-0001-as-designed-seed-1.npz",
        "train/pyg/shard-00000/signal_crossing-0002-as-designed-seed-1.npz",
        f"train/pyg/shard-00000/maps/signal_crossing-{crossing}.npz",
    ]
    assert facts.left_out == {"failed: out of luck": 1, "not planned >= 1": 1}
    assert not (tmp_path / "staged").exists()
    index = pickle.loads(
        (tmp_path / "test/scenarionet/shard-00000/dataset_summary.pkl").read_bytes()
    )
    assert [one["id"][:21] for one in index.values()] == [
        "t_junction_signs-0001", "t_junction_signs-0002",
    ]  # fmt: skip
    records = (tmp_path / "train/waymo/shard-00000/scenarios.tfrecord").read_bytes()
    one, two = (f"signal_crossing-000{n}-as-designed-seed-1".encode() for n in (1, 2))
    assert records == tfrecord([one, two])


def test_the_card_has_maps_splits_versions_and_what_was_left_out(tmp_path: Path) -> None:
    made(tmp_path, plan(keep_if=["planned >= 1"]), MadeUpExports())
    card = (tmp_path / "README.md").read_text("utf-8")
    said = json.loads((tmp_path / "dataset.json").read_text("utf-8"))
    assert "Licence: CC-BY-4.0" in card
    # Of 90 states 30 stand and 60 have up to 5 m/s; two runs of three cars in each split.
    assert "| train | car | 6 | 0.01 | 0.1 | 5.0 | 5.0 | 5.0 | 33 |" in card
    row = "| signal_crossing | train | 2 | 20 | 2 | 6 | 0.01 | 0.1 | 5.0 | 5.0 | 5.0 | 33 |"
    assert row in card
    picture = f"pictures/signal_crossing-{entry('signal_crossing').sha256[:12]}.svg"
    assert f"![signal_crossing]({picture})" in card
    assert (tmp_path / picture).read_text("utf-8").startswith("<")
    assert "| 1 | failed: out of luck |" in card
    assert [(one["name"], one["split"]) for one in said["maps"]] == [
        ("signal_crossing", "train"), ("t_junction_signs", "test"),
    ]  # fmt: skip
    assert said["maps"][0]["sha256"] == entry("signal_crossing").sha256
    assert [(one["split"], one["runs"]) for one in said["splits"]] == [("train", 2), ("test", 2)]
    for one in said["files"]:
        content = (tmp_path / one["path"]).read_bytes()
        assert (len(content), hashlib.sha256(content).hexdigest()) == (one["bytes"], one["sha256"])


def test_an_export_that_was_deleted_in_between_is_said(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path, plan(), MadeUpExports(most=2))
    gone = min((tmp_path / "staged" / ARRAYS).iterdir())
    shutil.rmtree(gone)
    with pytest.raises(InputError, match=f"what run {gone.name} was exported to is not there"):
        made(tmp_path, plan(), MadeUpExports())


def test_runs_that_would_have_one_name_are_refused(tmp_path: Path) -> None:
    made_here = tmp_path / "scenarios"
    for name in ("cut", "cut-in"):
        settings = GenerationSettings(map_name="signal_crossing", seed=1)
        (file,) = generate(place(), settings=settings, out=made_here / name)
        file.rename(made_here / f"{name}.scenario.json")
    edits = WARM["edits"]
    variants = [{"name": name, "edits": edits} for name in ("in-rain", "rain")]
    study = {"scenarios": [f"scenarios/{name}.scenario.json" for name in ("cut", "cut-in")]}
    asked = plan(study={**study, "variant": variants, "run": {"until": 10.0}})
    with pytest.raises(InputError, match="would both be 'cut-in-rain-seed-1'"):
        made(tmp_path, asked, MadeUpExports())
    assert not (tmp_path / "plan.json").exists()


def test_another_plan_in_the_same_folder_is_refused(tmp_path: Path) -> None:
    made(tmp_path, plan(), MadeUpExports())
    with pytest.raises(ConflictError, match="another plan"):
        made(tmp_path, plan(licence="MIT"), MadeUpExports())


def test_a_map_without_a_split_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no pattern matches map 't_junction_signs'"):
        made(tmp_path, plan(splits={"train": ["signal*"]}), MadeUpExports())


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"formats": []}, "formats"),
        ({"formats": ["pyg", "pyg"]}, "a format twice"),
        ({"keep_if": ["luck > 3"]}, "keep_if: .*no column 'luck'"),
        ({"licence": ""}, "licence"),
        ({"compress": ["waymo"]}, "compress has waymo, which is not in formats"),
        ({"compress": ["pyg"]}, "compress"),
        ({"splits": {"study": ["*"]}}, "study is a folder of every dataset"),
        ({"formats": ["huggingface"], "shard": 1001}, "at most 1000 runs fit in memory"),
        (
            {"formats": ["huggingface"], "splits": {"hold-out": ["t_*"], "hold_out": ["*"]}},
            "cannot tell names apart",
        ),
        ({"study": {"sample": [SAMPLE], "run": {"trajectories": False}}}, "trajectories"),
    ],
)
def test_a_wrong_plan_is_refused(parts: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        plan(**parts)


@pytest.mark.slow
def test_recordings_of_real_runs_are_in_the_shards(tmp_path: Path) -> None:
    import numpy as np

    file = tmp_path / "plan.json"
    sample = {"maps": ["signal_crossing"], "count": 1, "fill": 0.3}
    study = {"sample": [sample], "seeds": 2, "run": {"until": 10.0}}
    data = {"name": "d", "licence": "CC0-1.0", "study": study}
    data["formats"] = ["pyg", "waymo", "scenarionet"]
    file.write_text(json.dumps(data), encoding="utf-8")
    facts = made(tmp_path / "out", read_dataset_plan(file), LocalExecutor(place(), 2))
    assert facts.left_out == {}
    indexes = tmp_path / "out/train/scenarionet/shard-00000/dataset_summary.pkl"
    index = pickle.loads(indexes.read_bytes())
    assert [len(one["ts"]) for one in index.values()] == [96, 96]
    shard = tmp_path / "out/train/pyg/shard-00000"
    with np.load(shard / "signal_crossing-0000-as-designed-seed-2.npz") as arrays:
        assert json.loads(str(arrays["about"]))["seed"] == 2
        assert np.diff(arrays["time"]) == pytest.approx(0.1)
        assert 9.0 < np.ptp(arrays["time"]) <= 10.0
        assert arrays["agent_state"].shape[1] == len(arrays["time"])
        assert len(arrays["agent_id"]) == facts.table["planned"][1]
    index = json.loads((tmp_path / "out/train/waymo/shard-00000/index.json").read_text("utf-8"))
    assert [len(one["scenarios"]) for one in index["runs"]] == [2, 2]
