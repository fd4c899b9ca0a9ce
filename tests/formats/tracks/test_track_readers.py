"""Recorded traffic in published schemas becomes one table of tracks, or a clear error."""

from __future__ import annotations

import math
import re
import struct
from pathlib import Path

import polars as pl
import pytest

from odscen.app.exchange.recorded_traffic import read_recorded_traffic
from odscen.base.errors import InputError

SHARED = Path(__file__).parents[4] / "shared" / "recordings"

HIGHD = {
    "01_recordingMeta.csv": "id,frameRate,locationId\n1,25,2\n",
    "01_tracksMeta.csv": "id,width,height,class,drivingDirection\n"
    "1,4.0,2.0,Car,2\n2,12.0,2.5,Truck,1\n",
    "01_tracks.csv": "frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration,yAcceleration\n"
    "1,1,10,20,4,2,25,0.5,0.1,0\n2,1,11,20.02,4,2,25,0.5,0.1,0\n"
    "1,2,100,8,12,2.5,-20,0,-0.5,0\n2,2,99.2,8,12,2.5,0,0,-0.5,0\n",
}
IND = {
    "00_recordingMeta.csv": "recordingId,locationId,frameRate\n0,4,25.0\n",
    "00_tracksMeta.csv": "recordingId,trackId,initialFrame,width,length,class\n"
    "0,7,0,1.8,4.5,car\n0,8,0,0,0,pedestrian\n",
    "00_tracks.csv": "recordingId,trackId,frame,trackLifetime,xCenter,yCenter,heading,width,length,"
    "xVelocity,yVelocity,xAcceleration,yAcceleration,lonVelocity\n"
    "0,7,0,0,1,-2,270,1.8,4.5,0,-5,0,1,5\n0,7,1,1,1,-2.2,270,1.8,4.5,0,-5,0,1,5\n"
    "0,8,0,0,3,4,0,0,0,1,0,0,0,1\n",
}
NGSIM = (
    "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,v_Length,"
    "v_Width,v_Class,v_Vel,v_Acc,Lane_ID\n"
    "2,13,2,1118846980200,16.4,100,0,0,14.5,4.9,2,40,1,2\n"
    "2,14,2,1118846980300,16.4,104,0,0,14.5,4.9,2,40,1,2\n"
    "2,900,3,1118847069000,16.4,50,0,0,50,8,3,30,0,1\n"
    "2,901,3,1118847069100,16.4,53,0,0,50,8,3,30,0,1\n"
    "2,904,3,1118847069400,16.4,62,0,0,50,8,3,30,0,1\n"
)
INTERACTION = (
    "track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy,psi_rad,length,width\n"
    "1,1,100,car,1,2,3,4,0.9273,4,1.8\n1,2,200,car,1.3,2.4,3,4,0.9273,4,1.8\n"
)
PEDESTRIANS = (
    "track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy\n"
    "P1,1,100,pedestrian/bicycle,0,0,0,-1.2\nP1,2,200,pedestrian/bicycle,0,-0.12,0,-1.2\n"
    "P2,1,100,pedestrian/bicycle,0,0,6,0\nP2,2,200,pedestrian/bicycle,0.6,0,6,0\n"
)


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / list(files)[-1]


def state(rows: pl.DataFrame, name: str, k: int = 0) -> dict[str, float]:
    return rows.filter(pl.col("id") == name).row(k, named=True)


def test_boxes_of_highd_are_centres_with_y_upwards(tmp_path: Path) -> None:
    recorded = read_recorded_traffic(write(tmp_path, HIGHD))
    assert (recorded.schema, recorded.step, recorded.rows.height) == ("highd", 0.04, 4)
    car = state(recorded.rows, "1")
    assert (car["time"], car["x"], car["y"]) == pytest.approx((0.04, 12.0, -21.0))
    assert (car["length"], car["width"], car["category"]) == (4.0, 2.0, "car")
    assert car["hdg"] == pytest.approx(math.atan2(-0.5, 25.0))
    assert car["speed"] == pytest.approx(math.hypot(0.5, 25.0))
    truck = state(recorded.rows, "2", 1)  # it is stopped, and looks where its carriageway leads
    assert (truck["x"], truck["y"], truck["category"]) == (pytest.approx(105.2), -9.25, "truck")
    assert abs(truck["hdg"]) == pytest.approx(math.pi)
    assert truck["acceleration"] == pytest.approx(0.5)


def test_headings_of_ind_are_degrees_and_pedestrians_have_no_size(tmp_path: Path) -> None:
    rows = read_recorded_traffic(write(tmp_path, IND)).rows
    car = state(rows, "7", 1)
    assert (car["time"], car["x"], car["y"], car["speed"]) == pytest.approx((0.04, 1, -2.2, 5))
    assert (car["hdg"], car["acceleration"]) == pytest.approx((-math.pi / 2, -1.0))
    assert (car["length"], car["category"]) == (4.5, "car")
    walker = state(rows, "8")
    assert (walker["length"], walker["category"]) == (None, "pedestrian")


def test_ngsim_is_feet_from_the_front_and_a_number_given_again_is_another(tmp_path: Path) -> None:
    recorded = read_recorded_traffic(write(tmp_path, {"ngsim.csv": NGSIM}))
    assert recorded.schema == "ngsim"
    car = state(recorded.rows, "2/2")
    assert car["time"] == pytest.approx(1.3)
    assert (car["x"], car["y"]) == pytest.approx((16.4 * 0.3048, (100 - 7.25) * 0.3048))
    assert (car["hdg"], car["speed"]) == pytest.approx((math.pi / 2, 40 * 0.3048))
    truck = recorded.rows.filter(pl.col("id") == "2/3")
    assert truck["category"].to_list() == ["truck"] * 3
    assert truck["quality"].to_list() == ["recorded", "recorded", "after_gap"]


def test_pedestrians_of_interaction_come_from_the_file_beside(tmp_path: Path) -> None:
    files = {"pedestrian_tracks_000.csv": PEDESTRIANS, "vehicle_tracks_000.csv": INTERACTION}
    recorded = read_recorded_traffic(write(tmp_path, files))
    summary = recorded.summary()
    assert summary["categories"] == {"bicycle": 1, "car": 1, "pedestrian": 1}
    assert state(recorded.rows, "P1")["hdg"] == pytest.approx(-math.pi / 2)
    assert state(recorded.rows, "1")["speed"] == pytest.approx(5.0)
    other = read_recorded_traffic(tmp_path / "pedestrian_tracks_000.csv")
    assert other.rows.equals(recorded.rows)


def test_one_case_of_several_is_chosen(tmp_path: Path) -> None:
    lines = INTERACTION.splitlines()
    text = "\n".join(
        ["case_id," + lines[0], *(f"{case},{line}" for case in (4, 5) for line in lines[1:])]
    )
    file = write(tmp_path, {"challenge.csv": text})
    assert read_recorded_traffic(file, part="5").rows.height == 2
    with pytest.raises(InputError, match=r"2 recordings, each with its own time.*: 4, 5"):
        read_recorded_traffic(file)


def test_named_columns_have_factors_and_a_window_leaves_rows_out(tmp_path: Path) -> None:
    text = "ms,veh,east,north,yaw_deg\n" + "".join(
        f"{100 * k},b-7,{k},{0.5 * k},26.565\n" for k in range(50)
    )
    file = write(tmp_path, {"own.csv": text})
    columns = "time=ms*0.001, id=veh, x=east, y=north, hdg=yaw_deg*0.017453292519943295"
    recorded = read_recorded_traffic(file, window="1..0:02", columns=columns)
    assert recorded.rows["time"].to_list() == pytest.approx([1.0 + 0.1 * k for k in range(11)])
    assert state(recorded.rows, "b-7")["hdg"] == pytest.approx(0.46365, abs=1e-4)
    assert state(recorded.rows, "b-7", 5)["speed"] == pytest.approx(10.0 * math.hypot(1, 0.5))
    assert state(recorded.rows, "b-7", 5)["acceleration"] == pytest.approx(0.0, abs=1e-9)


def with_text(files: dict[str, str], name: str, old: str, new: str) -> dict[str, str]:
    return {key: text.replace(old, new) if key == name else text for key, text in files.items()}


@pytest.mark.parametrize(
    ("files", "words"),
    [
        (
            {"a_000.csv": INTERACTION.replace("1.3,2.4", "x,2.4")},
            r"a_000.csv: line 3 > column x: 'x' is not a number",
        ),
        (
            {"a_000.csv": INTERACTION.replace("1.3,2.4", ",2.4")},
            r"a_000.csv: road user 1 at 0.2 s: x is None, not a finite number",
        ),
        (
            {"a_000.csv": INTERACTION.replace("2,200", "2,100")},
            r"road user 1 at 0.1 s: it is at \(1, 2\) and at \(1.3, 2.4\)",
        ),
        (
            {"a_000.csv": INTERACTION.replace("1.3,2.4", "1e308,2.4")},
            r"a_000.csv: road user 1 at 0.2 s: x is 1e\+308, not a number up to 1e\+08",
        ),
        (
            {"a_000.csv": INTERACTION.replace("2,200", "2,nan")},
            r"a_000.csv: road user 1 at nan s: time is nan, not a finite number",
        ),
        (
            {"a_000.csv": INTERACTION.replace("1,2,200", ",2,200")},
            r"a_000.csv: road user at 0.2 s: it has no id",
        ),
        (with_text(HIGHD, "01_tracksMeta.csv", "2,12.0", "3,12.0"), "road user 2 .* is not in it"),
        (
            with_text(HIGHD, "01_recordingMeta.csv", "25", "fast"),
            r"01_recordingMeta.csv: line 2 > column frameRate: 'fast' is not a number",
        ),
        ({"00_tracks.csv": IND["00_tracks.csv"]}, r"00_recordingMeta.csv: not a table"),
        ({"n.csv": NGSIM.replace(",3,30,", ",9,30,")}, "v_Class: 9 of vehicle 2 is none of 1"),
        (
            {"a.csv": "when,where\n1,2\n"},
            r"a.csv: its columns are those of no .*when, where",
        ),
        (
            {"a.csv": ",".join(f"column-{n}" for n in range(100_000)) + "\n1\n"},
            r"column-11, \.\.\.\. Name them",
        ),
        ({"a.csv": ""}, "a.csv: not a table"),
        ({"a.csv": INTERACTION.splitlines()[0]}, "no road user is in it"),
    ],
)
def test_what_is_wrong_names_file_place_and_value(
    files: dict[str, str], words: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as error:
        read_recorded_traffic(write(tmp_path, files))
    assert re.search(words, str(error.value)), str(error.value)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ("time=ms,x=east,y=up", "no column up; there are ms, east, north"),
        ("time=ms*fast,x=east,y=north", "'fast' is not a number"),
        ("time=ms,x=east", "names no y"),
        ("when=ms", "it is not ROLE=COLUMN of one of time, id, x"),
    ],
)
def test_a_wrong_naming_of_columns_is_said(columns: str, words: str, tmp_path: Path) -> None:
    file = write(tmp_path, {"own.csv": "ms,east,north\n1,2,3\n"})
    with pytest.raises(InputError, match=words):
        read_recorded_traffic(file, columns=columns)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (pl.lit(None).alias("position_x"), "x is None, not a finite number"),
        (pl.lit(None).alias("track_id"), "it has no id"),
        (pl.lit("a").alias("position_y"), "it is of type String, not a number"),
        (pl.lit([1.0]).alias("heading"), r"it is of type List(Float64), not a number"),
        (pl.lit(b"a").alias("object_type"), "it is of type Binary, not text or a number"),
        (pl.lit("a").alias("timestep"), "it cannot be read: division with 'String'"),
        (pl.lit(["a"]).alias("track_id"), r"it is of type List(String), not text or a number"),
    ],
)
def test_columns_of_other_types_are_refused(changed: pl.Expr, words: str, tmp_path: Path) -> None:
    table = pl.DataFrame({"track_id": ["1", "1"], "timestep": [0, 1], "object_category": [3, 3]})
    zeros = ("position_x", "position_y", "heading", "velocity_x", "velocity_y")
    table = table.with_columns(pl.lit("vehicle").alias("object_type"))
    table = table.with_columns(pl.lit(0.0).alias(name) for name in zeros)
    table.write_parquet(tmp_path / "good.parquet")
    assert read_recorded_traffic(tmp_path / "good.parquet").rows.height == 2
    table.with_columns(changed).write_parquet(tmp_path / "scene.parquet")
    with pytest.raises(InputError, match=re.escape(words)):
        read_recorded_traffic(tmp_path / "scene.parquet")


@pytest.mark.parametrize("kind", [pl.Boolean, pl.Decimal(20, 2), pl.Int8, pl.Float32])
def test_numbers_of_any_type_are_read(kind: pl.DataType, tmp_path: Path) -> None:
    table = pl.DataFrame({"track_id": ["1", "1"], "timestep": [0, 1], "object_category": [3, 3]})
    table = table.with_columns(pl.lit("vehicle").alias("object_type"))
    ones = ("position_x", "position_y", "heading", "velocity_x", "velocity_y")
    table.with_columns(pl.lit(1).cast(kind).alias(name) for name in ones).write_parquet(
        tmp_path / "scene.parquet"
    )
    found = read_recorded_traffic(tmp_path / "scene.parquet").rows.row(0, named=True)
    assert (found["x"], found["hdg"], found["speed"]) == (1.0, 1.0, pytest.approx(math.sqrt(2.0)))


def test_a_message_on_many_names_is_short(tmp_path: Path) -> None:
    rates = "id,frameRate,locationId\n" + "1,25,2\n" * 5000
    file = write(
        tmp_path, {**HIGHD, "01_recordingMeta.csv": rates, "01_tracks.csv": HIGHD["01_tracks.csv"]}
    )
    with pytest.raises(InputError, match=r"frameRate is 25\.0, 25\.0") as raised:
        read_recorded_traffic(tmp_path / "01_tracks.csv")
    assert len(str(raised.value)) < 500
    names = ",".join(f"column{n}" for n in range(5000))
    (tmp_path / "01_recordingMeta.csv").write_text(f"{names}\n", encoding="utf-8")
    with pytest.raises(InputError, match="no column") as raised:
        read_recorded_traffic(file)
    assert len(str(raised.value)) < 500


def test_lights_of_one_frame_are_refused(tmp_path: Path) -> None:
    head = "track_id,timestamp_ms,agent_type,x,y,vx,vy,ax,ay,yaw_rad,length,width\n"
    write(tmp_path, {"Veh_smoothed_tracks.csv": f"{head}1,0,car,0,0,1,0,0,0,0,4,1.8\n"})
    lights = {"Traffic_Lights.csv": "RawFrameID,timestamp(ms),light 1\n7,0,1\n7,1000,3\n"}
    write(tmp_path, lights)
    with pytest.raises(InputError, match="fewer than two frames have a time"):
        read_recorded_traffic(tmp_path / "Veh_smoothed_tracks.csv")


def test_a_file_beside_of_other_columns_is_named(tmp_path: Path) -> None:
    head = "track_id,timestamp_ms,agent_type,x,y,vx,vy,ax,ay,yaw_rad,length,width\n"
    write(tmp_path, {"Veh_smoothed_tracks.csv": f"{head}1,0,car,0,0,1,0,0,0,0,4,1.8\n"})
    write(tmp_path, {"Ped_smoothed_tracks.csv": "a" * 3000 + "\n1\n"})
    with pytest.raises(
        InputError, match=r"Ped_smoothed_tracks\.csv: no column agent_type"
    ) as raised:
        read_recorded_traffic(tmp_path / "Veh_smoothed_tracks.csv")
    assert len(str(raised.value)) < 500


def test_an_offset_beyond_all_maps_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path, {"tracks.csv": "time,id,x,y\n0,a,0,0\n1,a,1,0\n"})
    with pytest.raises(InputError, match="an offset is at most 1e"):
        read_recorded_traffic(file, columns="time=time,id=id,x=x,y=y", offset="1e308,0")


def test_a_column_of_nothing_that_need_not_be_there_counts_as_missing(tmp_path: Path) -> None:
    rows = {"id": ["1", "1"], "time": [0.0, 0.1], "x": [0.0, 1.0], "y": [0.0, 0.0]}
    table = pl.DataFrame({**rows, "hdg": [0.0, 0.0], "speed": [10.0, 10.0]})
    table = table.with_columns(pl.lit(None).alias("length"), pl.lit("car").alias("kind"))
    table.write_parquet(tmp_path / "scene.parquet")
    columns = {"columns": "time=time,id=id,x=x,y=y,hdg=hdg,length=length,kind=kind"}
    found = read_recorded_traffic(tmp_path / "scene.parquet", **columns).rows
    assert found["length"].to_list() == [None, None]


def test_a_pickle_is_no_table_and_is_not_opened(tmp_path: Path) -> None:
    file = tmp_path / "scenario.pkl"
    file.write_bytes(b"\x80\x04cos\nsystem\n(S'touch pwned'\ntR.")
    with pytest.raises(InputError, match=r"scenario.pkl"):
        read_recorded_traffic(file)


# ------------------------------------------------------------------------------- OSI traces


def field(number: int, content: bytes) -> bytes:
    return bytes((number << 3 | 2, len(content))) + content


def vector(*values: float) -> bytes:
    return b"".join(
        bytes(((k + 1) << 3 | 1,)) + struct.pack("<d", value) for k, value in enumerate(values)
    )


def truth(seconds: int, x: float) -> bytes:
    """A GroundTruth of one lorry that is 8 m long."""
    base = field(1, vector(8.0, 2.5, 3.0)) + field(2, vector(x, -4.0, 0.0))
    base += field(3, vector(0.0, 0.0, 0.25)) + field(4, vector(3.0, 4.0))
    moving = field(1, b"\x08\x2a") + field(2, base) + b"\x18\x02" + field(6, b"\x08\x07")
    return field(2, bytes((8, seconds))) + field(5, moving)


def test_moving_objects_of_osi(tmp_path: Path) -> None:
    messages = [truth(1, 10.0), truth(2, 13.0)]
    file = tmp_path / "trace.osi"
    file.write_bytes(b"".join(struct.pack("<I", len(part)) + part for part in messages))
    rows = read_recorded_traffic(file).rows
    assert rows["time"].to_list() == [1.0, 2.0]
    lorry = state(rows, "42", 1)
    assert (lorry["x"], lorry["y"], lorry["hdg"], lorry["speed"]) == (13.0, -4.0, 0.25, 5.0)
    assert (lorry["length"], lorry["width"], lorry["category"]) == (8.0, 2.5, "truck")
    view = tmp_path / "20260101T000000Z_sv_370_2.osi"
    inside = field(7, messages[0])
    view.write_bytes(struct.pack("<I", len(inside)) + inside)
    assert read_recorded_traffic(view).rows.height == 1
    endless = b"\x08" + b"\xff" * 100_000
    view.write_bytes(struct.pack("<I", len(endless)) + endless)
    with pytest.raises(
        InputError, match="message 1 at byte 4: it is no message of OSI: a number has"
    ):
        read_recorded_traffic(view)
    file.write_bytes(file.read_bytes()[:-5])
    with pytest.raises(InputError, match=r"trace.osi: message 2 at byte \d+: it has \d+ of its"):
        read_recorded_traffic(file)


@pytest.mark.parametrize("packing", ["NONE", "ZSTD", "LZ4"])
def test_mcap_is_read_as_osi_is(packing: str, tmp_path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    file = tmp_path / "trace.mcap"
    with file.open("wb") as stream:
        writer = writer_module.Writer(
            stream, compression=getattr(writer_module.CompressionType, packing)
        )
        writer.start()
        schema = writer.register_schema("osi3.GroundTruth", "protobuf", b"")
        channel = writer.register_channel("ground_truth", "protobuf", schema)
        for seconds in (1, 2):
            writer.add_message(channel, seconds, truth(seconds, 10.0 * seconds), seconds)
        writer.finish()
    assert read_recorded_traffic(file).rows["x"].to_list() == [10.0, 20.0]
    file.write_bytes(b"no MCAP at all, whatever its ending says")
    with pytest.raises(InputError, match=r"trace\.mcap: it is no MCAP"):
        read_recorded_traffic(file)


def test_values_of_no_body_are_taken_as_none(tmp_path: Path) -> None:
    text = INTERACTION.replace("3,4,0.9273,4,1.8\n1,2", "1e200,inf,1e308,1e30,nan\n1,2")
    rows = read_recorded_traffic(write(tmp_path, {"a_000.csv": text})).rows
    first = state(rows, "1")
    assert (first["speed"], first["length"], first["width"]) == (pytest.approx(5.0), None, None)
    assert first["hdg"] == pytest.approx(0.9273, abs=1e-4)


COMMONROAD = """<commonRoad timeStepSize="0.1">
<dynamicObstacle id="31"><type>truck</type>
<shape><rectangle><length>9</length><width>2.5</width></rectangle></shape>
<initialState><position><point><x>1</x><y>2</y></point></position>
<orientation><exact>0.5</exact></orientation><time><exact>0</exact></time>
<velocity><intervalStart>7</intervalStart><intervalEnd>9</intervalEnd></velocity></initialState>
<trajectory><state><position><point><x>1.7</x><y>2.4</y></point></position>
<orientation><exact>0.5</exact></orientation><time><exact>1</exact></time>
<velocity><exact>8</exact></velocity></state></trajectory></dynamicObstacle></commonRoad>"""


def test_obstacles_of_commonroad(tmp_path: Path) -> None:
    file = write(tmp_path, {"s.xml": COMMONROAD})
    rows = read_recorded_traffic(file).rows
    lorry = state(rows, "31")
    assert (lorry["speed"], lorry["length"], lorry["category"]) == (8.0, 9.0, "truck")
    assert state(rows, "31", 1)["time"] == 0.1
    file.write_text(COMMONROAD.replace("<y>2.4</y>", "<y>far</y>"), encoding="utf-8")
    with pytest.raises(InputError, match=r"dynamicObstacle 31: position/point/y is 'far'"):
        read_recorded_traffic(file)


# ------------------------------------------------------------------- files as others wrote them


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recordings of ../shared")
@pytest.mark.parametrize(
    ("name", "categories", "rows", "end"),
    [
        ("interaction/vehicle_tracks_000.csv", {"car": 2}, 170, 10.0),
        ("sind/Ped_smoothed_tracks.csv", {"pedestrian": 16}, 3419, 834.134),
        (
            "av2/scenario_0a1e6f0a.parquet",
            {"car": 32, "other": 14, "pedestrian": 12},
            2434,
            10.9,
        ),
        ("commonroad/USA_Lanker-1_1_T-1.xml", {"car": 24}, 938, 4.0),
        ("commonroad/USA_US101-3_3_T-1.xml", {"car": 12}, 384, 3.1),
        ("omega-prime/alks_cut-in.osi", {"car": 2}, 610, 10.032),
    ],
)
def test_recordings_of_others(name: str, categories: dict[str, int], rows: int, end: float) -> None:
    recorded = read_recorded_traffic(SHARED / name)
    summary = recorded.summary()
    assert (summary["categories"], summary["rows"]) == (categories, rows)
    assert summary["end"] == pytest.approx(end, abs=1e-3)


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recordings of ../shared")
def test_a_trace_and_the_table_of_it_are_the_same() -> None:
    trace = read_recorded_traffic(SHARED / "omega-prime" / "pedestrian.osi").rows
    table = read_recorded_traffic(SHARED / "omega-prime" / "example.csv").rows
    assert trace["id"].equals(table["id"])
    assert trace["category"].cast(pl.String).equals(table["category"].cast(pl.String))
    for name in ("time", "x", "y", "hdg", "speed", "acceleration", "length", "width"):
        assert trace[name].to_numpy() == pytest.approx(table[name].to_numpy(), abs=1e-6)


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recordings of ../shared")
def test_lights_of_sind_before_the_first_frame_have_a_time() -> None:
    signals = read_recorded_traffic(SHARED / "sind" / "Ped_smoothed_tracks.csv").signals
    assert signals is not None
    first = signals.filter(pl.col("light") == "Traffic light 2")
    assert first["color"].to_list()[:3] == ["green", "yellow", "red"]
    assert first["time"].to_list()[:2] == pytest.approx([-1.6016, 60.4605], abs=1e-3)
