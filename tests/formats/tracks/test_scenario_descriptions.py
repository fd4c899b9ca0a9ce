"""ScenarioNet's scenarios are read without unpickling, and hostile pickles are refused."""

from __future__ import annotations

import io
import os
import pickle
import pickletools
import struct
from collections import OrderedDict, defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import odscen
from odscen.app.exchange.exports import export_run
from odscen.formats.tracks.plain_pickle import PickledArray, read_plain_pickle

ROOT = Path(__file__).parents[3]


def plain(value: Any) -> Any:
    """The value with arrays of NumPy in place of those of a pickle."""
    if isinstance(value, PickledArray):
        return value.values
    if isinstance(value, dict):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(plain(part) for part in value)
    return value


def assert_same(found: Any, given: Any) -> None:
    if isinstance(given, np.ndarray):
        assert found.dtype == given.dtype
        assert found.shape == given.shape
        assert np.array_equal(found, given)
    elif isinstance(given, dict):
        assert list(found) == list(given)
        for key in given:
            assert_same(found[key], given[key])
    elif isinstance(given, (list, tuple)):
        assert type(found) is type(given)
        assert len(found) == len(given)
        for one, other in zip(found, given, strict=True):
            assert_same(one, other)
    else:
        assert found == given
        assert type(found) is type(given) or isinstance(given, np.generic)


SHARED = np.arange(6, dtype=np.float32).reshape(2, 3)
VALUES: dict[str, Any] = {
    "numbers": [0, -1, 255, 70_000, 2**40, -(2**70), 1.5, float("inf"), True, False, None],
    "text": ["", "ü", "x" * 300, b"\x00\xff"],
    "tuples": [(), (1,), (1, 2), (1, 2, 3), (1, 2, 3, 4)],
    "nested": {"a": {"b": [{"c": ()}]}, 7: "seven", (1, "x"): 2},
    "shared": [SHARED, SHARED, {"again": SHARED}],
    "arrays": [
        np.array([True, False]), np.zeros((0, 3), np.float64), np.arange(5, dtype=">i4"),
        np.asfortranarray(np.arange(12.0).reshape(3, 4)), np.array(2.5), np.array(["ab", "c"]),
    ],
    "scalars": [np.float32(1.5), np.int64(7), np.bool_(True), np.str_("lane")],
}  # fmt: skip


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_plain_values_and_arrays_are_read_as_they_were_written(protocol: int) -> None:
    found = plain(read_plain_pickle(pickle.dumps(VALUES, protocol=protocol)))
    assert_same(found, VALUES)
    kinds = {"a", "b"}
    more = {"set": kinds, "ordered": OrderedDict(x=1), "default": defaultdict(int, y=2)}
    found = read_plain_pickle(pickle.dumps(more, protocol=protocol))
    assert found == {"set": {"a", "b"}, "ordered": {"x": 1}, "default": {"y": 2}}
    # What is remembered may be asked for in any order.
    optimised = pickletools.optimize(pickle.dumps(VALUES, protocol=protocol))
    assert_same(plain(read_plain_pickle(optimised)), VALUES)


class Runs:
    """Runs a command when it is unpickled."""

    def __init__(self, call: Any, *arguments: Any) -> None:
        self._call = call, arguments

    def __reduce__(self) -> Any:
        return self._call


class Custom:
    """A class of a program."""

    def __init__(self) -> None:
        self.x = 1


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_what_would_run_something_is_refused_with_its_name_and_place(
    protocol: int, tmp_path: Path
) -> None:
    witness = tmp_path / "run"
    for hostile, name in (
        (Runs(os.system, f"touch {witness}"), "system"),
        (Runs(eval, f"open({str(witness)!r}, 'w')"), "eval"),
        (Runs(getattr, "x", "upper"), "getattr"),
        (Custom(), "Custom" if protocol >= 2 else "_reconstructor"),
    ):
        data = pickle.dumps({"tracks": {"a": hostile}}, protocol=protocol)
        with pytest.raises(odscen.InputError, match=name) as refused:
            read_plain_pickle(data)
        assert refused.value.element is not None
        position = int(refused.value.element.removeprefix("byte "))
        assert 0 < position < len(data)
        (file := tmp_path / "sd_hostile.pkl").write_bytes(data)
        with pytest.raises(odscen.InputError, match=r"sd_hostile\.pkl.*nothing of a pickle is run"):
            odscen.read_recorded_traffic(file)
    assert not witness.exists()


def test_arrays_that_are_not_what_they_say_are_refused() -> None:
    raw = b"\x00" * 16
    name = b"cnumpy\nndarray\n"

    def call(shape: Any, kind: Any, data: Any) -> bytes:
        arguments = pickle.dumps((shape, kind, data), protocol=2)[2:-1]
        return b"\x80\x02" + name + arguments + b"R."

    assert read_plain_pickle(call((4,), "<f4", raw)).values.tolist() == [0.0] * 4
    for shape, kind, data, words in (
        ((5,), "<f4", raw, "has 16 bytes"),
        ((-4,), "<f4", raw, "no whole numbers"),
        ((2**62, 2**62), "<f4", raw, "has 16 bytes"),
        ((2,), "O", raw, "numbers and text are read"),
        ((2,), "<M8[s]", raw, "numbers and text are read"),
        ((2,), "f4,f4", raw, "numbers and text are read|type"),
        ((2,), "<V8", raw, "numbers and text are read"),
        ((16,), "<U0", raw, "no size|type"),
        ((2,), "x" * 50, raw, "no type"),
        ((2,), "<f8", [1, 2], "no bytes"),
    ):
        with pytest.raises(odscen.InputError, match=words):
            read_plain_pickle(call(shape, kind, data))


def bomb(depth: int) -> bytes:
    """A tuple of a tuple of a tuple, each there twice: a word that takes 2^depth to say."""
    return b"\x80\x02)" + b"2\x86" * depth


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"not a pickle",
        b"\x80\x02.",
        b"\x80\x02K\x01K\x02.",
        b"\x80\x02(K\x01.",
        b"\x80\x02h\x05.",
        b"\x80\x02K\x01a.",
        b"\x80\x02}K\x01s.",
        b"\x80\x02K\x01R.",
        b"\x80\x02](K\x01u.",
        b"\x80\x04\x8c\x02os\x8c\x06system\x93\x8c\x02id\x85R.",
        b"cposix\nsystem\n(S'id'\ntR.",
        b"(cos\nsystem\nS'id'\no.",
        b"(S'id'\nios\nsystem\n.",
        b"\x80\x02Pid\n.",
        b"\x80\x02K\x01Q.",
        b"\x80\x02\x82\x01.",
        b"\x80\x05\x97.",
        b"\x80\x03}]K\x01s.",
        b"\x80\x02B" + struct.pack("<I", 2**31) + b"abc.",
        b"\x80\x02X" + struct.pack("<I", 4) + b"\xff\xfe\xff\xff.",
        b"I" + b"9" * 10_000 + b"\n.",
        bomb(60) + b"K\x01\x86.",
        b"\x80\x02}" + bomb(60)[2:] + b"K\x01s.",
        b"\x80\x02c__builtin__\nset\n(" + bomb(60)[2:] + b"l\x85R.",
        b"\x80\x02cnumpy\nndarray\n" + bomb(60)[2:] + b"X\x02\x00\x00\x00f4C\x00\x87R.",
        b"\x80\x04" + bomb(60)[2:] + bomb(60)[2:] + b"\x93.",
        b"\x80\x02}X\x06\x00\x00\x00tracks}K\x01}X\x05\x00\x00\x00state" + bomb(60)[2:] + b"sss.",
    ],
)
def test_damaged_and_hostile_pickles_end_in_an_error_and_soon(data: bytes, tmp_path: Path) -> None:
    (file := tmp_path / "sd_x.pkl").write_bytes(data)
    with pytest.raises(odscen.InputError, match=r"sd_x\.pkl"):
        odscen.read_recorded_traffic(file)


def test_the_same_bytes_cannot_be_made_many() -> None:
    buffer = io.BytesIO()
    buffer.write(b"\x80\x02c_codecs\nencode\nq\x000X" + struct.pack("<I", 10_000_000))
    buffer.write(b"x" * 10_000_000 + b"q\x01" + b"X\x06\x00\x00\x00latin1\x86q\x020")
    buffer.write(b"h\x00h\x02R" * 1000 + b".")
    with pytest.raises(odscen.InputError, match="more of its bytes"):
        read_plain_pickle(buffer.getvalue())


def waymo_scenario() -> dict[str, Any]:
    """As scenarionet/converter/waymo/utils.py writes one: 3 s, of which the first is missing."""
    count = 31
    t = np.arange(count) * 0.1
    valid = t > 0.95

    def state(x: Any, y: Any, vx: float, vy: float, size: tuple[float, float, float]) -> Any:
        position = np.stack([x, y, np.zeros(count)], axis=1).astype(np.float32)
        return {
            "position": position,
            **{
                name: np.full(count, value, np.float32)
                for name, value in zip(("length", "width", "height"), size, strict=True)
            },
            "heading": np.full(count, np.arctan2(vy, vx), np.float32),
            "velocity": np.tile(np.array([vx, vy], np.float32), (count, 1)),
            "valid": valid,
        }

    lights = [None] * 10 + ["LANE_STATE_ARROW_STOP"] * 11 + ["LANE_STATE_GO"] * 10
    tracks = {
        "11": ("VEHICLE", state(5.0 + 10.0 * t, np.zeros(count), 10.0, 0.0, (4.6, 1.9, 1.5))),
        "12": (
            "PEDESTRIAN",
            state(np.full(count, 30.0), -4.0 + 1.5 * t, 0.0, 1.5, (0.8, 0.8, 1.7)),
        ),
        "13": ("CYCLIST", state(np.full(count, 40.0), 5.0 * t, 0.0, 5.0, (1.8, 0.7, 1.8))),
        "14": ("TRAFFIC_CONE", state(np.full(count, 1.0), t, 0.0, 0.1, (0.4, 0.4, 0.8))),
    }
    return {
        "id": "abc",
        "version": "MetaDrive v0.4.2.3",
        "length": count,
        "tracks": {
            name: {"type": kind, "state": own, "metadata": {"type": kind, "object_id": name}}
            for name, (kind, own) in tracks.items()
        },
        "dynamic_map_states": {
            "205": {"type": "TRAFFIC_LIGHT", "lane": 205, "state": {"object_state": lights}}
        },
        "map_features": {"205": {"type": "LANE_SURFACE_STREET", "polyline": np.zeros((9, 3))}},
        "metadata": {
            "ts": t.astype(np.float32), "sdc_id": "11", "dataset": "waymo", "coordinate": "waymo",
            "number_summary": {"object_types": {"VEHICLE", "PEDESTRIAN"}},
        },
    }  # fmt: skip


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_scenarios_of_waymo_become_tracks_with_lights(protocol: int, tmp_path: Path) -> None:
    file = tmp_path / "sd_waymo_v1.2_abc.pkl"
    file.write_bytes(pickle.dumps(waymo_scenario(), protocol=protocol))
    recorded = odscen.read_recorded_traffic(file)
    kinds = dict(
        recorded.rows.group_by("id").agg(pl.col("category").first().cast(pl.String)).iter_rows()
    )
    assert kinds == {"11": "car", "12": "pedestrian", "13": "bicycle", "14": None}
    car = recorded.rows.filter(pl.col("id") == "11")
    assert (car["time"].min(), car["time"].max()) == pytest.approx((1.0, 3.0))
    assert car["x"].to_numpy() == pytest.approx(5.0 + 10.0 * car["time"].to_numpy(), abs=1e-5)
    assert car["speed"].to_numpy() == pytest.approx(10.0)
    assert float(car["length"][0]) == pytest.approx(4.6)
    walker = recorded.rows.filter(pl.col("id") == "12")
    assert walker["hdg"].to_numpy() == pytest.approx(np.pi / 2.0)
    assert recorded.signals is not None
    assert recorded.signals["light"].unique().to_list() == ["205"]
    assert recorded.signals["color"].to_list() == ["red"] * 11 + ["green"] * 10
    assert recorded.schema == "scenarionet"
    part = odscen.read_recorded_traffic(file, window="1.5..2")
    assert part.rows["time"].unique().len() == 6


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("position", np.zeros((4, 3)), r"track '11', position: it is of shape \(4, 3\)"),
        ("position", "x", "track '11', position: it is no array of numbers"),
        ("velocity", np.zeros(31), r"velocity: it is of shape \(31,\)"),
        ("heading", [None] * 31, "heading: it is no array of numbers"),
        ("valid", None, "valid: it is no array of numbers"),
    ],
)
def test_a_field_that_is_wrong_is_named(field: str, value: Any, words: str, tmp_path: Path) -> None:
    scenario = waymo_scenario()
    scenario["tracks"]["11"]["state"][field] = value
    (file := tmp_path / "sd_x.pkl").write_bytes(pickle.dumps(scenario))
    with pytest.raises(odscen.InputError, match=words):
        odscen.read_recorded_traffic(file)


def test_an_index_is_not_taken_for_a_scenario(tmp_path: Path) -> None:
    (file := tmp_path / "dataset_summary.pkl").write_bytes(pickle.dumps({"sd_a.pkl": {}}))
    with pytest.raises(odscen.InputError, match=r"an index of scenarios; give one of its sd_\*"):
        odscen.read_recorded_traffic(file)


@pytest.mark.slow
def test_a_run_that_was_exported_is_read_again_within_a_centimetre(tmp_path: Path) -> None:
    store = odscen.Workspace.open(tmp_path / "workspace")
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    run = odscen.run(
        store,
        ROOT / "suites" / "scenarios" / "signal_crossing.scenario.json",
        out=tmp_path / "run",
        settings=odscen.RunSettings(until=40.0, step_length=0.1),
    )
    export_run(store, run.folder, tmp_path / "out", to="scenarionet")
    (file,) = (tmp_path / "out").glob("sd_*.pkl")
    found = odscen.read_recorded_traffic(file)
    given = odscen.read_recorded_traffic(run.folder).rows
    begin = float(given["time"].min())  # type: ignore[arg-type]
    both = found.rows.with_columns(moment=((pl.col("time") + begin) * 10).round()).join(
        given.with_columns(moment=(pl.col("time") * 10).round()), on=["id", "moment"], suffix="_run"
    )
    assert both.height == given.height == found.rows.height
    for name in ("x", "y"):
        assert float((both[name] - both[f"{name}_run"]).abs().max()) < 0.01
    turn = (both["hdg"] - both["hdg_run"]).to_numpy()
    assert np.abs(np.arctan2(np.sin(turn), np.cos(turn))).max() < 1e-3
    assert float((both["speed"] - both["speed_run"]).abs().mean()) < 0.2
    assert (both["category"].cast(pl.String) == both["category_run"].cast(pl.String)).all()
    assert found.signals is not None
    assert found.signals["light"].n_unique() == 12
