"""Shards whose runs share the arrays of their map, as plain readers see them; and what is wrong."""

from __future__ import annotations

import gzip
import io
import json
import shutil
import tarfile
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from odscen.app.exchange.dataset_exports import dataset_map
from odscen.base.checksums import file_digest
from odscen.base.errors import ConflictError, InputError
from odscen.base.given_arrays import npz_bytes
from odscen.experiments import dataset_shards
from odscen.experiments.dataset_shards import ShardSource, write_shards
from odscen.formats.pyg_format import SharedMap
from odscen.formats.recordings.tfrecord import read_tfrecord
from odscen.learning.hetero_data import read_arrays
from odscen.learning.run_datasets import open_dataset
from tests.experiments.study_case import place
from tests.experiments.test_dataset_runs import MadeUpExports, contents, made, plan
from tests.sumo.story_case import entry

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

FORMATS = ["pyg", "webdataset", "huggingface", "waymo"]
RUNS = [f"signal_crossing-000{number}-as-designed-seed-1" for number in range(3)]


@pytest.fixture(scope="module")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dataset")
    entry("signal_crossing")
    entry("t_junction_signs")
    made(out, plan(formats=FORMATS, compress=["waymo"], shard=2), MadeUpExports())
    return out


@pytest.fixture
def dataset(made_once: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made_once, tmp_path / "dataset")


def crossing() -> SharedMap:
    return dataset_map(place(), "signal_crossing", entry("signal_crossing").sha256)


def test_a_shard_has_the_map_of_its_runs_once(made_once: Path) -> None:
    shared = crossing()
    for number, runs in enumerate((RUNS[:2], RUNS[2:])):
        shard = made_once / "train" / "pyg" / f"shard-0000{number}"
        names = sorted(path.relative_to(shard).as_posix() for path in shard.rglob("*.npz"))
        assert names == [shared.file, *(f"{run}.npz" for run in runs)]
        assert (shard / shared.file).read_bytes() == shared.content
    found = read_arrays(made_once / "train" / "pyg" / "shard-00001" / f"{RUNS[2]}.npz")
    assert len(found["node"]) == len(entry("signal_crossing").graph().lanes.x)
    assert found["agent_id"].tolist() == ["a", "b"]
    assert "map_about" not in found


def test_tar_files_have_the_pair_of_each_run_together(made_once: Path) -> None:
    folder = made_once / "train" / "webdataset"
    with tarfile.open(folder / "shard-00000.tar") as archive:
        members = archive.getmembers()
        names = [one.name for one in members]
        first = archive.extractfile(members[0])
        assert first is not None
        said = json.loads(first.read())
    assert names == [f"{run}.{ending}" for run in RUNS[:2] for ending in ("json", "npz")]
    assert {(one.mtime, one.uid, one.uname) for one in members} == {(0, 0, "")}
    assert (said["run"], said["map"], said["seed"]) == (RUNS[0], "signal_crossing", 1)
    assert said["figures"]["split"] == "train"
    assert (folder / said["map_file"]).read_bytes() == crossing().content


def test_a_row_of_parquet_is_a_run_and_one_of_maps_is_a_map(made_once: Path) -> None:
    folder = made_once / "train" / "huggingface"
    rows = pl.read_parquet(folder / "shard-*.parquet")
    assert rows["run"].to_list() == RUNS
    assert np.array(rows["agent_state"][1].to_list()).tolist() == (
        np.arange(20.0).reshape(2, 2, 5).tolist()
    )
    assert rows.schema["light_color"] == pl.List(pl.List(pl.UInt8))
    maps = pl.read_parquet(folder / "maps" / "*.parquet")
    assert maps["map_sha256"].to_list() == [entry("signal_crossing").sha256]
    graph = entry("signal_crossing").graph().lanes
    assert [node[0] for node in maps["node"][0].to_list()] == graph.x.tolist()


def test_the_card_begins_with_what_hugging_face_reads(made_once: Path) -> None:
    head = (made_once / "README.md").read_text("utf-8").split("---\n")[1]
    assert head.splitlines()[3:] == [
        "configs:",
        "- config_name: runs",
        "  default: true",
        "  data_files:",
        "  - split: train",
        '    path: "train/huggingface/shard-*.parquet"',
        "  - split: test",
        '    path: "test/huggingface/shard-*.parquet"',
        "- config_name: maps",
        "  data_files:",
        "  - split: train",
        '    path: "train/huggingface/maps/*.parquet"',
        "  - split: test",
        '    path: "test/huggingface/maps/*.parquet"',
    ]


def test_waymo_can_be_compressed(made_once: Path, tmp_path: Path) -> None:
    packed = made_once / "train" / "waymo" / "shard-00000" / "scenarios.tfrecord.gz"
    plain = tmp_path / "plain.tfrecord"
    plain.write_bytes(gzip.decompress(packed.read_bytes()))
    assert list(read_tfrecord(plain.read_bytes())) == [run.encode() for run in RUNS[:2]]
    assert packed.read_bytes()[4:8] == bytes(4)  # no clock


@pytest.mark.parametrize("form", ["pyg", "webdataset"])
def test_a_dataset_is_read_one_run_at_a_time(made_once: Path, form: str) -> None:
    runs = open_dataset(str(made_once), split="train", form=form)
    assert len(runs) == 3
    said = [json.loads(str(arrays["about"]))["run"] for arrays in runs]
    assert said == RUNS
    assert runs[2]["lane_point"].shape[1] == 9
    assert runs.sizes == {"agents": 2, "lights": 2, "steps": 9, "lanes": 24}
    light = open_dataset(made_once, split="test", form=form, with_map=False, transform=len)
    assert list(light) == [5, 5]
    assert light.sizes == {"agents": 2, "lights": 2, "steps": 8}


def _cut_tar(dataset: Path) -> None:
    file = dataset / "train" / "webdataset" / "shard-00000.tar"
    file.write_bytes(file.read_bytes()[:2200])


def _empty_tar(dataset: Path) -> None:
    (dataset / "train" / "webdataset" / "shard-00001.tar").write_bytes(b"")


def _lose_shard(dataset: Path) -> None:
    (dataset / "train" / "webdataset" / "shard-00001.tar").unlink()


def _lose_facts(dataset: Path) -> None:
    (dataset / "dataset.json").unlink()


def _break_facts(dataset: Path) -> None:
    (dataset / "dataset.json").write_text("[1]")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (_cut_tar, r"shard-00000\.tar: it (ends within|cannot be read)"),
        (_empty_tar, r"shard-00001\.tar: it cannot be read as a tar file"),
        (_lose_shard, r"train has 3 runs by dataset\.json, its shards have 2"),
        (_lose_facts, r"no complete dataset is here: it has no dataset\.json"),
        (_break_facts, r"dataset\.json: it does not say what the dataset has"),
    ],
)
def test_a_spoiled_dataset_is_not_opened(
    dataset: Path, spoil: Callable[[Path], None], words: str
) -> None:
    spoil(dataset)
    with pytest.raises(InputError, match=words):
        open_dataset(dataset, form="webdataset")


def test_an_unknown_split_or_format_is_refused(made_once: Path) -> None:
    with pytest.raises(InputError, match="no split 'validation': train, test"):
        open_dataset(made_once, split="validation")
    with pytest.raises(InputError, match="huggingface is not read here"):
        open_dataset(made_once, form="huggingface")
    with pytest.raises(InputError, match="it has pyg, webdataset, huggingface, waymo; pyg and"):
        open_dataset(made_once, form="osi")


def test_a_map_that_is_missing_or_another_one_is_said(dataset: Path) -> None:
    shard = dataset / "train" / "pyg" / "shard-00000"
    file = shard / crossing().file
    runs = open_dataset(dataset)
    file.write_bytes(crossing().content[:-1])
    with pytest.raises(InputError, match=rf"{RUNS[0]}.*is not the one that it was written with"):
        runs[0]
    file.unlink()
    with pytest.raises(InputError, match=rf"{RUNS[0]}.*signal_crossing-.*npz is not there"):
        runs[0]
    assert "node" not in open_dataset(dataset, with_map=False)[0]


@pytest.mark.parametrize(
    "named", ["../secret.npz", "maps/../../x.npz", "/etc/x.npz", "maps/.x.npz", 7, None]
)
def test_a_run_names_no_file_outside_of_its_shard(dataset: Path, named: object) -> None:
    shard = dataset / "train" / "pyg" / "shard-00000"
    about = {"format": "odscen-arrays", "version": 2, "map_file": named}
    about["map_file_sha256"] = "0" * 64
    file = shard / "odd.npz"
    file.write_bytes(npz_bytes({"about": np.array(json.dumps(about))}))
    with pytest.raises(InputError, match=r"map_file is .*, not a file in maps/"):
        read_arrays(file)


def test_what_is_no_map_is_no_map_though_its_checksum_fits(dataset: Path) -> None:
    shard = dataset / "train" / "pyg" / "shard-00000"
    run = shard / f"{RUNS[0]}.npz"
    with np.load(run) as arrays:
        about = json.loads(str(arrays["about"]))
    about["map_file"] = f"maps/{run.name}"
    shutil.copy(run, shard / "maps")
    about["map_file_sha256"] = file_digest(run)
    odd = shard / "odd.npz"
    odd.write_bytes(npz_bytes({"about": np.array(json.dumps(about))}))
    with pytest.raises(InputError, match="these are no arrays of a map"):
        read_arrays(odd)


def _stage(folder: Path, run: str, map_name: str, sha256: str, shared: SharedMap) -> None:
    about = {
        "format": "odscen-arrays", "version": 2, "run": run, "scenario": run, "seed": 1,
        "map": map_name, "map_sha256": sha256, "recorded_step": 0.1, "interpolated": False,
        "map_file": shared.file, "map_file_sha256": shared.sha256,
    }  # fmt: skip
    own = folder / "arrays" / run
    own.mkdir(parents=True)
    (own / f"{run}.npz").write_bytes(npz_bytes({"about": np.array(json.dumps(about))}))


def _shared(name: str, sha256: str) -> SharedMap:
    about = {"format": "odscen-map-arrays", "version": 1, "map": name, "map_sha256": sha256}
    content = npz_bytes({"map_about": np.array(json.dumps(about))})
    return SharedMap(f"maps/{name}-{sha256[:12]}.npz", content, f"{sha256[0]}" * 64)


def test_two_maps_of_one_name_are_two_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dataset_shards, "dataset_map", lambda _, *key: _shared(*key))
    for run, sha256 in (("one", "a" * 64), ("two", "b" * 64)):
        _stage(tmp_path / "staged", run, "town", sha256, _shared("town", sha256))
    source = ShardSource(place(), tmp_path / "staged", {})
    for form in ("pyg", "webdataset", "huggingface"):
        write_shards(tmp_path / form, source, ["one", "two"], form=form, size=2)
        files = sorted(path.stem for path in tmp_path.glob(f"{form}/**/maps/*"))
        assert files == [f"town-{'a' * 12}", f"town-{'b' * 12}"]


def test_a_map_that_was_built_anew_in_between_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dataset_shards, "dataset_map", lambda _, *key: _shared(*key))
    other = _shared("town", "a" * 64)._replace(sha256="c" * 64)
    _stage(tmp_path / "staged", "one", "town", "a" * 64, other)
    source = ShardSource(place(), tmp_path / "staged", {})
    with pytest.raises(ConflictError, match=r"one\.npz: the arrays of map 'town' are others now"):
        write_shards(tmp_path / "pyg", source, ["one"], form="pyg", size=2)
    assert not list(tmp_path.glob("pyg/shard-*"))


def test_keys_of_samples_have_no_dots_and_are_each_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dataset_shards, "dataset_map", lambda _, *key: _shared(*key))
    runs = ["cut.in", "cut_in", "Größe v1.2"]
    for run in runs:
        _stage(tmp_path / "staged", run, "town", "a" * 64, _shared("town", "a" * 64))
    source = ShardSource(place(), tmp_path / "staged", {"cut.in": {"mean_delay": float("nan")}})
    write_shards(tmp_path / "out", source, runs, form="webdataset", size=9)
    with tarfile.open(tmp_path / "out" / "shard-00000.tar") as archive:
        names = archive.getnames()
        said: Any = archive.extractfile(names[0])
        assert json.load(io.TextIOWrapper(said))["figures"] == {"mean_delay": None}
    assert [name.partition(".") for name in names[::2]] == [
        ("cut_in", ".", "json"), ("cut_in-2", ".", "json"), ("Größe v1_2", ".", "json"),
    ]  # fmt: skip


def test_a_split_without_runs_is_empty(tmp_path: Path) -> None:
    splits = {"train": ["*"], "test": ["none"]}
    made(tmp_path, plan(formats=FORMATS, splits=splits), MadeUpExports())
    assert len(open_dataset(tmp_path, split="test")) == 0
    assert not [name for name in contents(tmp_path) if name.startswith("test/")]
    assert "split: test" not in (tmp_path / "README.md").read_text("utf-8")
