"""Exports of runs for learners, read by plain readers; ``make test-interchange`` has others."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import pickle
import re
import shutil
import struct
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from lxml import etree, html

from odscen.app.exchange.dataset_exports import ARRAYS, dataset_contents, dataset_map
from odscen.app.exchange.exports import (
    contents_of,
    export,
    export_run,
    export_runs,
    run_contents,
    run_source,
)
from odscen.app.exchange.recorded_traffic import read_recorded_traffic
from odscen.app.running import reports
from odscen.app.running.batches import run_many
from odscen.base.errors import DamagedError, InputError
from odscen.base.text_files import write_file
from odscen.formats import list_formats
from odscen.formats.base import RecordedRun
from odscen.formats.recordings.tfrecord import read_tfrecord
from odscen.formats.recordings.track_grid import ExportWindow, instants, tracks_of
from odscen.formats.tracks.osi_trace import osi_fields, read_osi_trace
from odscen.learning.hetero_data import read_arrays
from odscen.maps.store import Workspace
from odscen.records.run_plan import Plan
from odscen.reports import replay
from odscen.runs.finished_run import Run
from odscen.runs.recorded import read_light_states
from odscen.runs.run_settings import RunSettings

FORMATS = ("pyg", "scenarionet", "waymo", "commonroad", "osi", "html")
SECONDS = 9.6
DOCUMENT = Path(__file__).parents[2] / "docs" / "learning-formats.md"
States = dict[tuple[str, int], tuple[float, float, float]]


@pytest.fixture(scope="module")
def run(workspace: Workspace, sampled: Path) -> Run:
    settings = RunSettings(until=SECONDS, step_length=0.1)
    return run_many(workspace, [sampled], settings=settings, reports=False)[0]


@pytest.fixture(scope="module")
def recorded(run: Run) -> States:
    """Pose of each road user at each tenth of a second."""
    table = run.trajectories()
    return {
        (str(name), round(time * 10)): (x, y, hdg)
        for name, time, x, y, hdg in table.select("id", "time", "x", "y", "hdg").iter_rows()
    }


@pytest.fixture(scope="module")
def exports(workspace: Workspace, run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("exports")
    for name in FORMATS:
        export_run(workspace, run.folder, out / name, to=name)
    return out


def test_formats_written_together_have_the_bytes_of_each_alone(
    workspace: Workspace, run: Run, exports: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = {name: {} for name in FORMATS}
    monkeypatch.setattr("odscen.opendrive.parse.parse", None)  # the map has been read by then
    for name, files_of in run_contents(run_source(workspace, run.folder), whole).items():
        alone = {one.name: one.read_bytes() for one in (exports / name).iterdir()}
        assert contents_of(files_of) == alone, name


def test_arrays_whose_map_lies_beside_say_the_same(
    workspace: Workspace, run: Run, exports: Path, tmp_path: Path
) -> None:
    whole = read_arrays(_file(exports, "pyg/*.npz"))
    light = tmp_path / "light.npz"
    (content,) = dataset_contents(workspace, run.folder, [ARRAYS])[ARRAYS].values()
    light.write_bytes(content)
    shared = dataset_map(workspace, run.summary["map"], run.summary["map_sha256"])
    write_file(tmp_path / shared.file, shared.content)
    found = read_arrays(light)
    assert found.keys() == whole.keys()
    assert np.abs(found["agent_state"] - whole["agent_state"]).max() <= 0.5 / 16384
    for name in whole.keys() - {"about", "agent_state"}:
        assert found[name].dtype == whole[name].dtype
        assert np.array_equal(found[name], whole[name], equal_nan=whole[name].dtype.kind == "f")


def test_numbers_of_a_recording_are_those_of_its_states(workspace: Workspace, run: Run) -> None:
    said = json.loads(dataset_contents(workspace, run.folder, [])["statistics"]["statistics.json"])
    table = run.trajectories()
    speeds = table["speed"].cast(float)
    of_all = said["categories"].values()
    assert said["most"]["agents"] == table["id"].n_unique()
    assert said["most"]["steps"] == table["time"].n_unique()
    assert sum(one["tracks"] for one in of_all) == table["id"].n_unique()
    assert sum(sum(one["speeds"]) for one in of_all) == table.height
    assert sum(one["speeds"][0] for one in of_all) == (speeds < 0.1).sum()
    metres = sum(one["metres"] for one in of_all)
    assert metres == pytest.approx(speeds.sum() * 0.1, abs=0.1 * len(of_all))


def _file(exports: Path, pattern: str) -> Path:
    (file,) = exports.glob(pattern)
    return file


def _same(found: States, recorded: States, *, within: float) -> None:
    assert found.keys() == recorded.keys()
    one, other = (
        np.array([states[key] for key in sorted(recorded)]) for states in (found, recorded)
    )
    assert np.hypot(*(one - other)[:, :2].T).max() <= within
    assert np.abs(np.angle(np.exp(1j * (one - other)[:, 2]))).max() <= 1e-5


# ---------------------------------------------------------------------------- PyTorch Geometric
@pytest.mark.slow
def test_the_arrays_have_every_recorded_state(exports: Path, recorded: States) -> None:
    arrays = read_arrays(_file(exports, "pyg/*.npz"))
    steps = np.round(arrays["time"] * 10).astype(int)
    found = {
        (str(name), int(step)): tuple(arrays["agent_state"][row, k, [0, 1, 3]])
        for row, name in enumerate(arrays["agent_id"])
        for k, step in enumerate(steps)
        if arrays["agent_valid"][row, k]
    }
    _same(found, recorded, within=1e-9)
    assert json.loads(str(arrays["about"]))["interpolated"] is False


@pytest.mark.slow
def test_the_arrays_are_those_of_the_document(exports: Path) -> None:
    arrays = read_arrays(_file(exports, "pyg/*.npz"))
    hold_against_document(arrays, "Arrays of a run")


def test_the_arrays_of_a_scenario_are_those_of_the_document(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    (file,) = export(workspace, sampled, tmp_path, to="arrays")
    hold_against_document(read_arrays(file), "Arrays of a scenario")


def hold_against_document(arrays: dict[str, Any], heading: str) -> None:
    """Names, types and dimensions of arrays are those of a section's tables."""
    section = DOCUMENT.read_text().partition(f"## {heading}\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (`.+?`) \| `([^`]+)` \| (\w+) \|", section, re.MULTILINE)
    named = {
        name: (shape, kind) for names, shape, kind in rows for name in re.findall(r"`(\w+)`", names)
    }
    assert named.keys() == arrays.keys()
    kinds = {"U": "text", "b": "bool", "f": "float64"}
    for name, (shape, kind) in named.items():
        dtype = arrays[name].dtype
        assert kind == kinds.get(dtype.kind, str(dtype)), name
        axes = [one for one in shape.strip("()").split(",") if one.strip()]
        assert arrays[name].ndim == len(axes), name


def test_edges_of_the_arrays_name_rows_that_are_there(exports: Path) -> None:
    arrays = read_arrays(_file(exports, "pyg/*.npz"))
    lanes = len(arrays["lane_key"])
    assert arrays["node_edge"].max() < len(arrays["node"])
    assert arrays["lane_edge"].max() < lanes
    assert arrays["node_lane"].max() == lanes - 1
    assert 0 <= arrays["light_lane"].min() <= arrays["light_lane"].max() < lanes
    for name in ("lane", "line", "road_edge", "crosswalk"):
        start = arrays[f"{name}_point_start"]
        assert start[-1] == len(arrays[f"{name}_point"])
        assert (np.diff(start) >= 2).all()


def test_a_lane_begins_where_the_one_before_it_ends(exports: Path) -> None:
    arrays = read_arrays(_file(exports, "pyg/*.npz"))
    start, points = arrays["lane_point_start"], arrays["lane_point"]
    before, after = arrays["lane_edge"]
    gaps = points[start[before + 1] - 1] - points[start[after]]
    for part in (slice(0, 3), slice(3, 6), slice(6, 9)):  # centre, left and right border
        assert np.linalg.norm(gaps[:, part], axis=1).max() < 0.02
    # The left border is on the left of the driving direction.
    ahead = points[start[:-1] + 1, :2] - points[start[:-1], :2]
    left = points[start[:-1], 3:5] - points[start[:-1], :2]
    assert (ahead[:, 0] * left[:, 1] - ahead[:, 1] * left[:, 0] > 0).all()


def test_some_lights_show_green_and_never_all(exports: Path) -> None:
    arrays = read_arrays(_file(exports, "pyg/*.npz"))
    color = arrays["light_color"]
    assert color.shape == (12, len(arrays["time"]))
    assert set(np.unique(color)) <= {1, 2, 3}
    # Of four legs with three movements each, two opposite ones have green at a time.
    assert ((color == 3).sum(axis=0) <= 6).all()
    assert (color == 3).any(axis=1).sum() >= 6


# ---------------------------------------------------------------------------- ScenarioNet
def test_the_scenario_description_has_every_recorded_state(exports: Path, recorded: States) -> None:
    scenario = pickle.loads(_file(exports, "scenarionet/sd_*.pkl").read_bytes())
    assert {
        "id",
        "version",
        "length",
        "tracks",
        "dynamic_map_states",
        "map_features",
        "metadata",
    } == set(scenario)
    found = {
        (name, step): (*track["state"]["position"][step, :2], track["state"]["heading"][step])
        for name, track in scenario["tracks"].items()
        for step in np.flatnonzero(track["state"]["valid"]).tolist()
    }
    _same(found, recorded, within=1e-9)
    for name, track in scenario["tracks"].items():
        assert track["metadata"]["object_id"] == name
        away = ~track["state"]["valid"]
        for values in track["state"].values():
            assert len(values) == scenario["length"]
            assert not values[away].any()
            assert values.flags.writeable
    assert len(scenario["dynamic_map_states"]) == 12
    assert scenario["dynamic_map_states"].keys() <= scenario["map_features"].keys()


def test_the_pickle_names_nothing_but_arrays_and_plain_values(exports: Path) -> None:
    import pickletools

    data = _file(exports, "scenarionet/sd_*.pkl").read_bytes()
    strings: list[str] = []
    called = set()
    for opcode, argument, _ in pickletools.genops(data):
        if isinstance(argument, str):
            strings.append(argument)
        if opcode.name == "STACK_GLOBAL":
            called.add(tuple(strings[-2:]))
    assert called == {("numpy", "ndarray"), ("builtins", "bytearray")}


# ---------------------------------------------------------------------------- Waymo
def _fields(data: bytes) -> Iterator[tuple[int, Any]]:
    """Fields of a message: numbers as integers, or the bytes they take."""
    at = 0

    def number() -> int:
        nonlocal at
        value = shift = 0
        while True:
            value |= (data[at] & 127) << shift
            at, shift = at + 1, shift + 7
            if data[at - 1] < 128:
                return value

    while at < len(data):
        tag = number()
        if tag & 7 == 0:
            yield tag >> 3, number()
            continue
        size = {1: 8, 5: 4}.get(tag & 7) or (number() if tag & 7 == 2 else 0)
        yield tag >> 3, data[at : at + size]
        at += size


def _all(data: bytes, field: int) -> list[Any]:
    return [value for number, value in _fields(data) if number == field]


@pytest.mark.slow
def test_the_tfrecord_has_every_recorded_state_in_scenarios_of_91_instants(
    exports: Path, recorded: States
) -> None:
    notes = json.loads(_file(exports, "waymo/*.json").read_text())
    names = {number: name for name, number in notes["ids"].items()}
    records = list(read_tfrecord(_file(exports, "waymo/*.tfrecord").read_bytes()))
    # 9.6 s are 9.1 s, and 9.1 s that end with the run.
    assert [one["begin"] for one in notes["scenarios"]] == [
        0.0,
        pytest.approx(SECONDS - 9.0, abs=0.11),
    ]
    found: States = {}
    for record, about in zip(records, notes["scenarios"], strict=True):
        assert len(_all(record, 1)) == len(_all(record, 7)) == 91
        assert _all(record, 10) == [10]
        tracks = _all(record, 2)
        assert len(tracks) == about["tracks"]
        for track in tracks:
            states = _all(track, 3)
            assert len(states) == 91
            for step, state in enumerate(states):
                values = dict(_fields(state))
                if values[11]:
                    place = np.frombuffer(values[2] + values[3], dtype="<f8")
                    hdg = float(np.frombuffer(values[8], dtype="<f4")[0])
                    key = names[_all(track, 1)[0]], round(about["begin"] * 10) + step
                    found[key] = (float(place[0]), float(place[1]), hdg)
    _same(found, recorded, within=1e-9)
    features = [{field for field, _ in _fields(one)} - {1} for one in _all(records[0], 8)]
    assert features.count({3}) == notes["lanes"]
    assert {field for one in features for field in one} == {3, 4, 5, 8}


# ---------------------------------------------------------------------------- CommonRoad
def test_the_commonroad_file_has_every_recorded_state(exports: Path, recorded: States) -> None:
    document = etree.parse(_file(exports, "commonroad/*.xml"))
    notes = json.loads(_file(exports, "commonroad/*.json").read_text())
    found: States = {}
    for one in notes["obstacles"]:
        (obstacle,) = document.xpath(f"dynamicObstacle[@id='{one['id']}']")
        states = obstacle.xpath("initialState | trajectory/state")
        rows = {
            int(state.findtext("time/exact")): tuple(
                float(state.findtext(path))
                for path in ("position/point/x", "position/point/y", "orientation/exact")
            )
            for state in states
        }
        own = range(one["first_step"], one["last_step"] + 1)
        assert rows.keys() == {0, *own}  # who comes later is beside the map at instant 0
        found |= {(one["road_user"], step): rows[step] for step in own}
    _same(found, recorded, within=1e-4)


def test_lights_of_commonroad_show_each_instant_of_the_run(exports: Path) -> None:
    document = etree.parse(_file(exports, "commonroad/*.xml"))
    instants = len(read_arrays(_file(exports, "pyg/*.npz"))["time"])
    lights = document.findall("trafficLight")
    assert len(lights) >= 4
    for light in lights:
        durations = [int(one.text) for one in light.iterfind("cycle/cycleElement/duration")]
        colors = [one.text for one in light.iterfind("cycle/cycleElement/color")]
        assert sum(durations) == instants
        assert all(one != other for one, other in pairwise(colors))


# ---------------------------------------------------------------------------- OSI
def test_the_osi_trace_has_every_recorded_state(exports: Path, run: Run, recorded: States) -> None:
    said = json.loads(_file(exports, "osi/*.export.json").read_text())
    names = {str(number): name for name, number in said["ids"].items()}
    read = read_osi_trace(_file(exports, "osi/*.osi"), 0.0, math.inf).rows
    found = {
        (names[number], round(time * 10)): (x, y, hdg)
        for number, time, x, y, hdg in read.select("id", "time", "x", "y", "hdg").iter_rows()
    }
    _same(found, recorded, within=1e-9)
    plan = json.loads((run.folder / "plan.json").read_text())
    users = {user["id"]: user for user in plan["actors"]}
    for number, category, length, width in (
        read.select("id", "category", "length", "width").unique().iter_rows()
    ):
        user = users[names[number]]
        assert category == user["category"]
        assert (length, width) == pytest.approx((user["length"], user["width"]), abs=1e-6)
    assert (said["frames"], said["step"]) == (len({step for _, step in recorded}), 0.1)
    assert _file(exports, "osi/*.xodr").name == f"{run.summary['map']}.xodr"


def test_the_osi_trace_shows_one_bulb_of_each_light(exports: Path) -> None:
    said = json.loads(_file(exports, "osi/*.export.json").read_text())
    content = _file(exports, "osi/*.osi").read_bytes()
    (size,) = struct.unpack_from("<I", content)
    lights = [value for field, value in osi_fields(content[4 : 4 + size]) if field == 7]
    classified = {}
    for light in lights:
        parts = dict(osi_fields(light))
        color = dict(osi_fields(parts[3]))
        classified[dict(osi_fields(parts[1]))[1]] = (color[1], color[3] == 3)
    assert len(lights) == 3 * len(said["traffic_lights"]) > 0
    for light in said["traffic_lights"]:
        bulbs = [classified[bulb] for bulb in light["ids"]]
        assert [kind for kind, _ in bulbs] == [2, 3, 4]  # red, yellow, green
        assert sum(lit for _, lit in bulbs) == 1


@pytest.mark.slow
def test_an_mcap_trace_has_the_same_messages_and_describes_them(
    workspace: Workspace, run: Run, exports: Path, tmp_path: Path
) -> None:
    reader = pytest.importorskip("mcap.reader")
    files = export_run(workspace, run.folder, tmp_path, to="osi", options={"container": "mcap"})
    trace = next(file for file in files if file.suffix == ".mcap")
    plain = read_osi_trace(_file(exports, "osi/*.osi"), 0.0, math.inf).rows
    assert read_osi_trace(trace, 0.0, math.inf).rows.equals(plain)
    with trace.open("rb") as stream:
        opened = reader.make_reader(stream)
        summary = opened.get_summary()
        (metadata,) = opened.iter_metadata()
        times = [message.log_time for _, _, message in opened.iter_messages()]
    (schema,) = summary.schemas.values()
    (channel,) = summary.channels.values()
    assert (schema.name, schema.encoding) == ("osi3.GroundTruth", "protobuf")
    assert channel.metadata["net.asam.osi.trace.channel.osi_version"] == "3.7.0"
    assert (metadata.name, metadata.metadata["version"]) == ("net.asam.osi.trace", "3.7.0")
    assert times == [round(time * 1e9) for time in sorted(set(plain["time"].to_list()))]
    # The names of the schema's messages and of the first field of each.
    (file,) = [dict_of for _, dict_of in osi_fields(schema.data)]
    messages = [list(osi_fields(value)) for number, value in osi_fields(file) if number == 4]
    named = {
        dict(parts)[1]: [dict(osi_fields(v)) for n, v in parts if n == 2] for parts in messages
    }
    truth = {field[3]: field[1] for field in named[b"GroundTruth"]}
    assert truth[2] == b"timestamp"
    assert truth[5] == b"moving_object"
    again = export_run(
        workspace, run.folder, tmp_path / "b", to="osi", options={"container": "mcap"}
    )
    assert next(file for file in again if file.suffix == ".mcap").read_bytes() == trace.read_bytes()
    with pytest.raises(InputError, match="container is osi or mcap, not 'zip'"):
        export_run(workspace, run.folder, tmp_path / "c", to="osi", options={"container": "zip"})


def test_a_long_run_is_no_single_osi_trace(
    workspace: Workspace, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("odscen.formats.osi_format.MOST_STATES", 3)
    with pytest.raises(InputError, match=r"choose a part of the run with --begin and --end"):
        export_run(workspace, run.folder, tmp_path / "whole", to="osi")
    assert not (tmp_path / "whole").exists()
    part = {"begin": "0", "end": "0"}
    monkeypatch.setattr("odscen.formats.osi_format.MOST_STATES", 200)
    files = export_run(workspace, run.folder, tmp_path / "part", to="osi", options=part)
    trace = next(file for file in files if file.suffix == ".osi")
    assert read_osi_trace(trace, 0.0, math.inf).rows["time"].unique().to_list() == [0.0]


# ---------------------------------------------------------------------------- all of them
@pytest.mark.parametrize("to", FORMATS)
def test_the_same_run_gives_the_same_bytes(
    to: str, workspace: Workspace, run: Run, exports: Path, tmp_path: Path
) -> None:
    files = export_run(workspace, run.folder, tmp_path, to=to)
    assert [one.read_bytes() for one in files] == [
        (exports / to / one.name).read_bytes() for one in files
    ]


def test_a_part_of_a_run_has_its_instants_only(
    workspace: Workspace, run: Run, tmp_path: Path
) -> None:
    window = {"begin": "2", "end": "4.05"}
    (file,) = export_run(workspace, run.folder, tmp_path, to="pyg", options=window)
    arrays = read_arrays(file)
    assert arrays["time"].tolist() == [round(2 + 0.1 * k, 6) for k in range(21)]
    assert arrays["agent_state"].shape[1] == arrays["light_color"].shape[1] == 21


@pytest.mark.parametrize(
    ("window", "words"),
    [({"begin": "soon"}, "soon"), ({"end": "nan"}, "nan"), ({"begin": "900"}, "no instant")],
)
def test_a_window_that_cannot_be_is_refused(
    window: dict[str, str], words: str, workspace: Workspace, run: Run, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=words):
        export_run(workspace, run.folder, tmp_path, to="waymo", options=window)


@pytest.mark.slow
def test_of_a_folder_of_runs_each_is_written_into_a_folder_of_its_own(
    workspace: Workspace, run: Run, exports: Path, tmp_path: Path
) -> None:
    runs = tmp_path / "runs"
    for name in ("a", "b"):
        shutil.copytree(run.folder, runs / name)
    (runs / "notes").mkdir()
    files = export_runs(workspace, runs, tmp_path / "out", to="pyg")
    assert [one.relative_to(tmp_path / "out").as_posix() for one in files] == ["a/a.npz", "b/b.npz"]
    one, alone = read_arrays(files[0]), read_arrays(_file(exports, "pyg/*.npz"))
    assert np.array_equal(one["agent_state"], alone["agent_state"])
    assert export_runs(workspace, run.folder, tmp_path / "one", to="pyg")[0].parent.name == "one"


@pytest.mark.parametrize("to", [one for one in FORMATS if one != "pyg"])
def test_a_scenario_that_has_not_run_is_refused(
    to: str, workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="folder"):
        export(workspace, sampled, tmp_path, to=to)
    assert "scenario" not in list_formats()[to].of


# ---------------------------------------------------------------------------- the clock
def _thinned(run: Run, every: int) -> RecordedRun:
    from odscen.app.exchange.exports import _read_recorded

    recorded = _read_recorded(run)
    ticks = (pl.col("time") * 10).round().cast(pl.Int64)
    rows = recorded.rows.filter(ticks % every == 0)
    return replace(recorded, rows=rows, step=every / 10)


def test_half_a_second_between_records_is_bridged_and_said(
    workspace: Workspace, run: Run, sampled: Path
) -> None:
    from odscen.app.exchange.exports import _make_source
    from odscen.app.scenarios import read_scenario

    source = _make_source(workspace, read_scenario(sampled), "run", {})
    fine, coarse = _thinned(run, 1), _thinned(run, 5)
    times = instants(coarse, ExportWindow())
    exact, bridged = (tracks_of(source, one, times) for one in (fine, coarse))
    assert bridged.ids == exact.ids
    both = exact.valid & bridged.valid
    assert both.sum() > 0.9 * exact.valid.sum()
    off = np.hypot(exact.x - bridged.x, exact.y - bridged.y)[both]
    # Turns, braking and lane changes, which take three seconds: none is a step aside.
    assert np.quantile(off, 0.99) < 0.35
    assert 0.0 < off.max() < 0.5
    assert off.mean() < 0.06


def test_a_gap_in_what_was_recorded_is_not_bridged(
    workspace: Workspace, run: Run, sampled: Path
) -> None:
    from odscen.app.exchange.exports import _make_source
    from odscen.app.scenarios import read_scenario

    source = _make_source(workspace, read_scenario(sampled), "run", {})
    recorded = _thinned(run, 5)
    name = recorded.rows["id"][0]
    gone = (pl.col("id") == name) & pl.col("time").is_between(1.9, 3.1)
    recorded = replace(recorded, rows=recorded.rows.filter(~gone))
    times = instants(recorded, ExportWindow())
    tracks = tracks_of(source, recorded, times)
    valid = tracks.valid[tracks.ids.index(name)]
    there = {round(time, 1) for time in times[valid].tolist()}
    assert {1.5, 3.5} <= there
    assert not there & {1.6, 2.0, 2.5, 3.0, 3.4}


# ------------------------------------------------------------------------------- damaged files
RUN_FORMATS = ("openscenario", *FORMATS)


@pytest.mark.parametrize("to", RUN_FORMATS)
def test_shifted_trajectories_are_not_exported(
    workspace: Workspace, run: Run, tmp_path: Path, to: str
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(run.folder, folder)
    (file,) = folder.glob("traj*.parquet")
    pl.read_parquet(file).with_columns(pl.col("^vehicle_x|person_x$") + 100.0).write_parquet(file)
    with pytest.raises(DamagedError, match=r"trajectories\.parquet: expected sha256"):
        export_run(workspace, folder, tmp_path / "out", to=to)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("to", RUN_FORMATS)
@pytest.mark.parametrize("sealed", [True, False])
def test_a_damaged_table_is_named_with_and_without_checksums(
    workspace: Workspace, run: Run, tmp_path: Path, to: str, sealed: bool
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(run.folder, folder)
    (folder / "signal_states.parquet").write_bytes(b"PAR1 is no table PAR1")
    if not sealed:  # as of earlier versions
        (folder / "SHA256SUMS").unlink()
    with pytest.raises(InputError, match=r"signal_states\.parquet") as raised:
        export_run(workspace, folder, tmp_path / "out", to=to)
    assert isinstance(raised.value, DamagedError) is sealed


def test_records_that_a_run_has_not_written_itself_are_refused(run: Run, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(run.folder, folder)
    (folder / "trajectories").mkdir()
    shutil.copyfile(folder / "trajectories.parquet", folder / "trajectories" / "part-0001.parquet")
    with pytest.raises(DamagedError, match=r"part-0001\.parquet: expected no such file"):
        Run.open(folder)


# ------------------------------------------------------------------------- recorded traffic
@pytest.mark.parametrize(
    ("schema", "file", "categories"),
    [
        ("interaction", "vehicle_tracks_000.csv", None),
        ("ind", "00_tracks.csv", None),
        ("highd", "01_tracks.csv", {"car", "van", "truck", "bus", "motorcycle"}),
        ("ngsim", "ngsim.csv", {"car", "van", "truck", "bus", "motorcycle"}),
    ],
)
def test_recorded_traffic_is_read_back_within_a_centimetre(
    workspace: Workspace,
    run: Run,
    recorded: States,
    schema: str,
    file: str,
    categories: set[str] | None,
    tmp_path: Path,
) -> None:
    export_run(workspace, run.folder, tmp_path, to="recording", options={"schema": schema})
    names = json.loads((tmp_path / "road_users.json").read_text(encoding="utf-8"))
    back = read_recorded_traffic(tmp_path / file).rows
    found = {
        (names[re.sub("^P|/.*", "", name)], round(time * 10)): (x, y, hdg, length or 0.0)
        for name, time, x, y, hdg, length in back.select(
            "id", "time", "x", "y", "hdg", "length"
        ).iter_rows()
    }
    known = dict(run.trajectories().select("id", "category").unique().iter_rows())
    expected = {key for key in recorded if categories is None or str(known[key[0]]) in categories}
    if schema == "highd":  # those that drive along x all the time
        across = {key[0] for key, state in recorded.items() if abs(np.sin(state[2])) > 0.35}
        expected = {key for key in expected if key[0] not in across}
    assert found.keys() == expected
    assert len(expected) > 50
    for key, (x, y, hdg, length) in found.items():
        was = recorded[key]
        # NGSIM has the middle of the front and no heading: that place is what comes back.
        half = length / 2.0 if schema == "ngsim" else 0.0
        front = (x + half * np.cos(hdg), y + half * np.sin(hdg))
        there = (was[0] + half * np.cos(was[2]), was[1] + half * np.sin(was[2]))
        assert front == pytest.approx(there, abs=0.01), key


def test_a_schema_that_is_none_is_refused(workspace: Workspace, run: Run, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="schema is one of interaction, ind, highd, ngsim"):
        export_run(workspace, run.folder, tmp_path, to="recording", options={"schema": "kitti"})


# ---------------------------------------------------------------------------- One page
def _replayed(exports: Path) -> tuple[str, dict[str, Any]]:
    page = _file(exports, "html/*.html").read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="replay-data">(.+?)</script>', page)
    assert data is not None
    return page, json.loads(data[1])


def test_the_page_replays_every_recorded_state(exports: Path, recorded: States) -> None:
    _, data = _replayed(exports)
    begin, step = data["begin"], data["step"]
    found = {
        (piece["id"], round((begin + (piece["frame"] + row) * step) * 10)): tuple(place)
        for piece in data["pieces"]
        for row, place in enumerate(
            np.cumsum(np.reshape(piece["moves"], (-1, 3)), axis=0) / (100.0, 100.0, 100.0)
        )
    }
    assert found.keys() == recorded.keys()
    differences = np.array([found[key] for key in recorded]) - np.array(list(recorded.values()))
    assert np.abs(differences[:, :2]).max() <= 0.005 + 1e-9
    assert np.abs(np.angle(np.exp(1j * differences[:, 2]))).max() <= 0.005 + 1e-9


def test_the_page_shows_what_the_lights_showed(exports: Path, run: Run) -> None:
    _, data = _replayed(exports)
    states = read_light_states(run.folder)
    assert states is not None
    recorded = states.select("time", "state").rows()
    shown = [
        (time, state)
        for light in data["lights"]
        for time, state in zip(light["times"], light["states"], strict=True)
    ]
    assert len(data["lights"]) == states["light"].n_unique() > 0
    assert sorted(shown) == sorted(recorded)
    for light in data["lights"]:
        letters = [letter for *_, own in light["heads"] for letter in own]
        assert letters
        assert max(letters) < len(light["states"][0])


def test_the_page_needs_nothing_else_and_runs_only_its_own_scripts(exports: Path) -> None:
    page, _ = _replayed(exports)
    root = html.fromstring(page)
    assert not root.xpath("//@src | //link/@href")
    assert all(link.startswith("#") for link in root.xpath("//a/@href"))
    (policy,) = root.xpath("//meta[@http-equiv]/@content")
    allowed = set(re.findall(r"'sha256-([^']+)'", policy))
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    digests = {base64.b64encode(hashlib.sha256(one.encode()).digest()).decode() for one in scripts}
    built = (files("odscen") / reports.SCENERY_SCRIPT).is_file()
    assert len(scripts) == 2 + built
    assert allowed == digests


def test_the_page_has_the_ground_of_three_dimensions_around_what_moved(
    workspace: Workspace, run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    script = tmp_path / "scenery.js"
    script.write_text("/* draws */", encoding="utf-8")
    monkeypatch.setattr(reports, "SCENERY_SCRIPT", script)  # as if the page were built
    rows = run.trajectories()
    export_run(workspace, run.folder, tmp_path / "out", to="html")
    page = _file(tmp_path, "out/*.html").read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="replay-ground">(.+?)</script>', page)
    assert data is not None
    ground = json.loads(data[1])
    assert "/* draws */" in page
    low_x, low_y, high_x, high_y = ground["drawing"]["bounds"]
    assert low_x < rows["x"].min() < rows["x"].max() < high_x
    assert low_y < rows["y"].min() < rows["y"].max() < high_y
    nodes, heights = ground["nodes"], ground["heights"]
    assert len(nodes["x"]) == len(nodes["hdg"]) == len(heights["z"])
    assert len(nodes["walks"]["x"]) == len(heights["walks"])
    assert ground["weather"]["sun_altitude_angle"] > 0
    monkeypatch.setattr(reports, "SCENERY_SCRIPT", tmp_path / "not-built.js")
    export_run(workspace, run.folder, tmp_path / "plain", to="html")
    plain = _file(tmp_path, "plain/*.html").read_text(encoding="utf-8")
    assert "replay-view" not in plain
    assert "replay-view" in page


def test_a_long_replay_keeps_every_nth_instant(monkeypatch: pytest.MonkeyPatch, run: Run) -> None:
    rows = run.trajectories()
    monkeypatch.setattr(replay, "MOST_PLACES", rows.height // 3)
    users = Plan.from_json((run.folder / "plan.json").read_text()).actors
    values = replay.replay_values(users, rows, None, step=0.1)
    assert values is not None
    assert (values["thinned"], values["every"]) == (True, pytest.approx(0.4))
    data = json.loads(values["data"])
    kept = sum(len(piece["moves"]) // 3 for piece in data["pieces"])
    assert rows.height / 5 < kept < rows.height / 3
