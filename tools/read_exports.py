"""Read exports with independent readers: ``python -m tools.read_exports [FORMAT ...]``.

Each reader has an environment of its own in ``build/interchange``, made once, with pinned versions.
Scenarios of the runs go through a ``HeteroData`` and back, and must have the same bytes.
Runs of three maps, and a dataset of them, are exported in each format, read there, and compared
with what the runs recorded: each track, each position, all lanes. ``--maps FOLDER`` takes all maps
of a folder instead of three that ship. The table goes to ``build/interchange/results.json`` as
well.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from odscen.app.exchange.exports import export, export_run
from odscen.app.generation import generate
from odscen.app.running.batches import run_many
from odscen.app.scenarios import read_scenario
from odscen.experiments.dataset_plan import DatasetPlan
from odscen.experiments.datasets import folder_name, make_dataset
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.layout import SCENARIO_FILE
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.problems import validated
from odscen.scenario.sampling.generation_settings import GenerationSettings

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build" / "interchange"
SHIPPED = ("signal_crossing", "town_5x5", "rural_hills")
FARTHEST = 0.05
"""Metres that a position may be off."""
EXACT_METRES, EXACT_RADIANS = 0.001, math.radians(0.01)
"""The same where positions are written as they are, and headings."""
STEP = 0.1


@dataclass(frozen=True)
class Reader:
    """What is installed for a format, as lists of arguments of pip, and the end of its files.

    ``{site}`` is the folder of the environment's packages; ``of`` names the reader that shares its
    environment. ``format`` is what is exported, unless it is called as the reader, ``options`` how.
    One ``of_dataset`` is given the folder of a whole dataset in place of an export.
    """

    ending: str
    packages: tuple[tuple[str, ...], ...]
    of: str | None = None
    format: str | None = None
    options: tuple[tuple[str, str], ...] = ()
    exact: bool = False
    of_dataset: bool = False


READERS = {
    # Its packages ask for Python 3.10 and TensorFlow; its messages need neither.
    "waymo": Reader(
        ".tfrecord",
        (
            ("protobuf==3.20.3",),
            (
                "--no-deps", "--only-binary=:all:", "--python-version=3.10", "--target={site}",
                "waymo-open-dataset-tf-2-12-0==1.6.7",
            ),
        ),
    ),
    "commonroad": Reader(
        ".xml", (("commonroad-io==2024.3", "commonroad-drivability-checker==2025.4.0"),)
    ),
    # From PyPI torch brings 6 GB for graphics cards: name PyTorch's index of CPU builds to pip, by
    # PIP_INDEX_URL, when this environment is made.
    "pyg": Reader(
        ".npz",
        (
            ("torch==2.13.0",),
            ("numpy==2.4.6", "torch-geometric==2.8.0"),
        ),
    ),
    "arrays": Reader(".npz", (), of="pyg"),
    "scenarionet": Reader("", (("metadrive-simulator==0.4.3",),)),
    "osi": Reader(".osi", (("omega-prime==0.3.7", "betterosi==0.9.0"),), exact=True),
    "osi-utilities": Reader(
        ".osi", (("asam-osi-utilities==0.4.0", "osi-python==3.8.0"),), format="osi", exact=True
    ),
    "osi-mcap": Reader(
        ".mcap", (), of="osi-utilities", format="osi", options=(("container", "mcap"),), exact=True
    ),
    "huggingface": Reader("", (("datasets==5.2.0",),), of_dataset=True),
    # torch's DataLoader and JAX, by odscen.datasets.
    "batches": Reader(
        "",
        (("torch==2.13.0",), ("jax==0.10.2", "webdataset==1.0.2", "typing-extensions")),
        of_dataset=True,
    ),
    "webdataset": Reader("", (), of="batches", of_dataset=True),
}  # fmt: skip


SCRIPTS = {"osi-utilities": "osi_utilities", "osi-mcap": "osi_utilities"}
"""Readers whose script is not called as they are."""


def environment(name: str) -> Path:
    """Python of a reader's environment; it is made if it is not there."""
    name = READERS[name].of or name
    folder = BUILD / name
    python, ready = folder / "bin" / "python", folder / "ready"
    wanted = json.dumps(READERS[name].packages)
    if not ready.is_file() or ready.read_text() != wanted:
        print(f"Setting up the reader of {name} in {folder} ...", file=sys.stderr)
        venv.create(folder, with_pip=True, clear=True)
        site = folder / "lib" / f"python3.{sys.version_info[1]}" / "site-packages"
        for packages in READERS[name].packages:
            words = [word.format(site=site) for word in packages]
            quiet = ["--quiet", "--disable-pip-version-check"]
            subprocess.run([python, "-m", "pip", "install", *quiet, *words], check=True)
        ready.write_text(wanted)
    return python


def recorded_runs(
    maps: list[Path], *, seconds: float, fill: float, each: int = 1
) -> list[tuple[Workspace, Run]]:
    """So many runs of each map with a step of 0.1 s."""
    workspace = Workspace.open(BUILD / "workspace")
    settings = RunSettings(until=seconds, step_length=STEP)
    runs = []
    for file in maps:
        name = f"{file.parent.name}-{file.stem}" if file.parent.name != "maps" else file.stem
        if name not in {entry.name for entry in workspace.maps()}:
            workspace.add_map(file, name=name)
        sampled = GenerationSettings(map_name=name, seed=7, fill=fill, roi_segments=40, count=each)
        paths = generate(workspace, settings=sampled)
        made = run_many(workspace, paths, settings=settings, reports=False)
        runs += [(workspace, run) for run in made]
    return runs


def recorded_dataset(runs: list[tuple[Workspace, Run]], *, seconds: float, fill: float) -> Path:
    """Folder of a dataset in the formats of arrays: two runs of each map, with their folders."""
    workspace, _ = runs[0]
    out = BUILD / "dataset"
    shutil.rmtree(out, ignore_errors=True)
    maps = sorted({str(run.summary["map"]) for _, run in runs})
    plan = {
        "name": "interchange",
        "licence": "CC0-1.0",
        "formats": ["pyg", "webdataset", "huggingface"],
        "splits": {"test": maps[:1], "train": ["*"]},
        "shard": 3,
        "study": {
            "sample": [{"maps": maps, "count": 2, "fill": fill}],
            "run": {"until": seconds, "step_length": STEP},
            "keep": "all",
        },
    }
    make_dataset(workspace, validated(DatasetPlan, plan), out)
    return out


def read_whole(name: str, workspace: Workspace, folder: Path) -> Iterator[dict[str, Any]]:
    """Read a dataset, and compare each run of it."""
    rows_file = folder / "read.json"
    counts = _told(name, folder, rows_file)
    rows = json.loads(rows_file.read_text())
    rows_file.unlink()
    runs = {
        folder_name(path.parent.relative_to(folder / "study" / "runs").as_posix()): path.parent
        for path in sorted((folder / "study" / "runs").rglob("summary.json"))
    }
    entries = {entry.sha256: entry for entry in workspace.maps()}
    used = {str(Run.open(one).summary["map_sha256"]) for one in runs.values()}
    lanes = sorted(len(entries[one].graph().lanes.lanes.keys) for one in used)
    for run, own in runs.items():
        yield {
            "format": name, "run": run, "runs": counts["runs"], "expected_runs": len(runs),
            "map_lanes": sorted(counts["map_lanes"]), "expected_map_lanes": lanes,
            **compare(Run.open(own), name, rows.get(run, []), {}),
        }  # fmt: skip


def come_back(workspace: Workspace, run: Run) -> dict[str, Any]:
    """Scenario of a run as arrays, through a ``HeteroData``, and as a document again."""
    file = run.folder / SCENARIO_FILE
    (exported,) = export(workspace, file, BUILD / "exports" / "arrays", to="arrays")
    back = exported.with_name(f"{run.folder.name}.back.npz")
    counts = _told("arrays", exported, back)
    same = dumps(read_scenario(back)).encode() == file.read_bytes()
    expected = len(workspace.map_for(run.summary["map"], run.summary["map_sha256"]).graph().lanes.x)
    return {
        "format": "arrays", "run": run.folder.name, **counts, "same_bytes": same,
        "expected_nodes": expected,
    }  # fmt: skip


def _told(name: str, file: Path, out: Path) -> dict[str, Any]:
    """Let a reader read a file in its environment; what it says at the end."""
    script = ROOT / "tools" / "readers" / f"{SCRIPTS.get(name, name)}_reader.py"
    done = subprocess.run(
        [environment(name), script, file, out],
        check=False,
        stdout=subprocess.PIPE,
        text=True,
        env={"PYTHONPATH": str(ROOT / "src"), "HOME": str(BUILD), "PATH": "/usr/bin:/bin"},
    )
    if done.returncode:
        raise SystemExit(f"{name} cannot read {file}")
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def read(name: str, workspace: Workspace, run: Run) -> dict[str, Any]:
    """Export a run, read it, and compare; counts and the largest error."""
    out = BUILD / "exports" / name / run.folder.name
    reader = READERS[name]
    to, options = reader.format or name, dict(reader.options)
    files = export_run(workspace, run.folder, out, to=to, options=options)
    ending = reader.ending
    file = next(one for one in files if one.name.endswith(ending)) if ending else out
    rows_file = out / "read.json"
    counts = _told(name, file, rows_file)
    graph = workspace.map_for(run.summary["map"], run.summary["map_sha256"]).graph()
    counts["expected_lanes"] = len(graph.lanes.lanes.keys)
    rows = json.loads(rows_file.read_text())
    rows_file.unlink()
    notes = next((json.loads(one.read_text()) for one in files if "export" in one.name), {})
    return {"format": name, "run": run.folder.name, **counts, **compare(run, name, rows, notes)}


def compare(run: Run, name: str, rows: list[list[Any]], notes: dict[str, Any]) -> dict[str, Any]:
    """How far what was read is from what was recorded."""
    table = run.trajectories()
    begin = float(table["time"].min())  # type: ignore[arg-type]
    columns = (table[one].to_list() for one in ("id", "time", "x", "y", "hdg"))
    truth = {
        (one, round((time - begin) / STEP)): (x, y, hdg)
        for one, time, x, y, hdg in zip(*columns, strict=True)
    }
    found = dict(_named(name, rows, notes, begin))
    missing = truth.keys() - found.keys()
    extra = found.keys() - truth.keys()
    farthest, turned = 0.0, 0.0
    for key in truth.keys() & found.keys():
        (x, y, hdg), (x2, y2, hdg2) = truth[key], found[key]
        farthest = max(farthest, ((x - x2) ** 2 + (y - y2) ** 2) ** 0.5)
        turned = max(turned, abs(math.remainder(hdg - hdg2, math.tau)))
    return {
        "recorded_tracks": len({one for one, _ in truth}),
        "recorded_states": len(truth),
        "read_tracks": len({one for one, _ in found}),
        "missing_states": len(missing),
        "extra_states": len(extra),
        "max_error_m": round(farthest, 6),
        "max_error_rad": round(turned, 6),
    }


def _named(name: str, rows: list[list[Any]], notes: dict[str, Any], begin: float) -> Any:
    """Poses by road user and instant of the run."""
    if name == "waymo":
        names = {number: one for one, number in notes["ids"].items()}
        first = {
            one["scenario_id"]: round((one["begin"] - begin) / STEP) for one in notes["scenarios"]
        }
        for scenario, number, step, *pose in rows:
            yield (names[number], first[scenario] + step), pose
    elif (READERS[name].format or name) == "osi":
        names = {number: one for one, number in notes["ids"].items()}
        for number, time, *pose in rows:
            yield (names[number], round((time - begin) / STEP)), pose
    elif name == "commonroad":
        obstacles = {one["id"]: one for one in notes["obstacles"]}
        for number, step, *pose in rows:
            one = obstacles[number]
            if one["first_step"] <= step <= one["last_step"]:
                yield (one["road_user"], step), pose
    else:
        for road_user, step, *pose in rows:
            yield (road_user, step), pose


def check(result: dict[str, Any]) -> list[str]:
    """What is wrong with a result."""
    if result["format"] == "arrays":
        nodes = result["node"] == result["expected_nodes"]
        return [
            words
            for words, well in (("other bytes", result["same_bytes"]), ("other nodes", nodes))
            if not well
        ]
    if READERS[result["format"]].of_dataset:
        return _check_whole(result)
    never = ("missing_states", "extra_states", "states_missed_by_checker")
    wrong = [f"{one} {result[one]}" for one in never if result.get(one)]
    if result["read_tracks"] != result["recorded_tracks"]:
        wrong.append(f"{result['read_tracks']} of {result['recorded_tracks']} tracks")
    lanes = result.get("lanes", result.get("lanelets", []))  # a trace has its map beside it
    for count in lanes if isinstance(lanes, list) else [lanes]:
        walks = result.get("crosswalks", 0)
        if count - walks != result["expected_lanes"]:
            wrong.append(f"{count - walks} of {result['expected_lanes']} lanes")
    exact = READERS[result["format"]].exact
    if exact and result["max_error_rad"] > EXACT_RADIANS:
        wrong.append(f"{result['max_error_rad']} rad off")
    if result["max_error_m"] > (EXACT_METRES if exact else FARTHEST):
        wrong.append(f"{result['max_error_m']} m off")
    return wrong


def _check_whole(result: dict[str, Any]) -> list[str]:
    """What is wrong with a run of a dataset."""
    wrong = [f"{one} {result[one]}" for one in ("missing_states", "extra_states") if result[one]]
    wrong += [
        f"{result[one]} {one}, not {result[f'expected_{one}']}"
        for one in ("runs", "map_lanes")
        if result[one] != result[f"expected_{one}"]
    ]
    off = (("m", EXACT_METRES), ("rad", EXACT_RADIANS))
    return wrong + [
        f"{result[f'max_error_{unit}']} {unit} off"
        for unit, most in off
        if result[f"max_error_{unit}"] > most
    ]


def main() -> int:
    """Read all; 1 if something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("formats", nargs="*", choices=[[], *READERS], metavar="FORMAT")
    parser.add_argument("--maps", type=Path, nargs="+", help="OpenDRIVE files")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--fill", type=float, default=0.1)
    parser.add_argument("--each", type=int, default=1, help="runs of each map")
    given = parser.parse_args()
    maps = given.maps or [ROOT / "maps" / f"{name}.xodr" for name in SHIPPED]
    runs = recorded_runs(maps, seconds=given.seconds, fill=given.fill, each=given.each)
    results, failed = [], False
    names = given.formats or list(READERS)
    dataset = None
    if any(READERS[name].of_dataset for name in names):
        dataset = recorded_dataset(runs, seconds=given.seconds, fill=given.fill)
    for name in names:
        for result in _read_by(name, runs, dataset):
            wrong = check(result)
            failed |= bool(wrong)
            print(f"{name} {result['run']}: {'; '.join(wrong) or 'ok'}", json.dumps(result))
            results.append(result)
    (BUILD / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    return int(failed)


def _read_by(
    name: str, runs: list[tuple[Workspace, Run]], dataset: Path | None
) -> Iterator[dict[str, Any]]:
    if READERS[name].of_dataset and dataset is not None:
        yield from read_whole(name, runs[0][0], dataset)
        return
    for workspace, run in runs:
        yield come_back(workspace, run) if name == "arrays" else read(name, workspace, run)


if __name__ == "__main__":
    sys.exit(main())
