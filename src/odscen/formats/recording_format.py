"""Runs as recorded traffic in published schemas: INTERACTION, levelX and NGSIM.

Ten frames in a second. What these schemas derive from other road users or from lanes (neighbours,
headways, lane numbers) is not written.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError
from odscen.formats.base import WINDOW_OPTIONS, ExportNotes, Format, FormatOption

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import polars as pl

    from odscen.formats.base import ExportFiles, ExportSource

_RATE: Final = 10
_DIGITS: Final = 4
_WALKS, _RIDES = "pedestrian", "bicycle"
_MOST_TURN: Final = 0.35
"""Radians from the x axis from which on highD's boxes along x are no bodies any more."""


def write_recording(source: ExportSource) -> ExportFiles:
    """Tables of all road users of a run, and which number is who.

    Raises
    ------
    InputError
        If it is no run, has nobody whom the schema knows, or there is no such schema.
    """
    import polars as pl

    from odscen.formats.recordings.record import WINDOW, seconds_option
    from odscen.formats.recordings.track_grid import ExportWindow, instants, tracks_of
    from odscen.formats.tracks.recorded_traffic import complete_tracks

    schema = source.options.get("schema", "interaction")
    if schema not in _WRITERS:
        raise InputError(f"schema is one of {', '.join(_WRITERS)}, not {schema!r}")
    if source.recorded is None:
        raise InputError("this format says what happened in a run: name the folder of one")
    window = ExportWindow(*(seconds_option(source.options, name) for name in WINDOW))
    times = instants(source.recorded, window)
    tracks = tracks_of(source, source.recorded, times)
    there = [
        pl.DataFrame(
            {
                "id": tracks.ids[row],
                "kind": tracks.categories[row],
                "time": times[tracks.valid[row]],
                **{
                    name: getattr(tracks, name)[row][tracks.valid[row]]
                    for name in ("x", "y", "hdg", "speed")
                },
            }
        ).with_columns(
            length=pl.lit(float(tracks.length[row])), width=pl.lit(float(tracks.width[row]))
        )
        for row in range(len(tracks.ids))
    ]
    notes = ExportNotes()
    rows = complete_tracks(pl.concat(there), "odscen", step=1.0 / _RATE).rows.with_columns(
        pl.col("category").cast(pl.String), pl.col("length", "width").cast(pl.Float64)
    )
    known = _KNOWN.get(schema)
    if known is not None:
        for category, count in (
            rows.filter(~pl.col("category").is_in(known))
            .group_by("category")
            .agg(pl.col("id").n_unique())
            .sort("category")
            .rows()
        ):
            notes.left_out.append((f"{count} of category {category}", f"{schema} has none"))
        rows = rows.filter(pl.col("category").is_in(known))
    if schema == "highd":
        across = pl.col("hdg").sin().abs().max().over("id") > _MOST_TURN
        turned = rows.filter(across)["id"].n_unique()
        if turned:
            why = "they drive across x, and highD has boxes along it"
            notes.left_out.append((f"{turned} road users", why))
        rows = rows.filter(~across)
    if not rows.height:
        raise InputError(f"no road user of the run can be written as {schema}")
    first = (
        rows.group_by("id").agg(pl.col("time").min()).sort("time", "id").with_row_index("number")
    )
    rows = rows.join(first.select("id", number=pl.col("number") + 1), on="id", how="left")
    rows = rows.with_columns(frame=(pl.col("time") * _RATE).round().cast(pl.Int64))
    rows = rows.with_columns(
        vx=pl.col("speed") * pl.col("hdg").cos(),
        vy=pl.col("speed") * pl.col("hdg").sin(),
        ax=pl.col("acceleration") * pl.col("hdg").cos(),
        ay=pl.col("acceleration") * pl.col("hdg").sin(),
        frames=pl.len().over("id"),
    ).sort("number", "frame")
    files = _WRITERS[schema](rows)
    numbers = {str(number): name for name, number in rows.select("id", "number").unique().rows()}
    listed = json.dumps(dict(sorted(numbers.items(), key=lambda item: int(item[0]))), indent=2)
    return {
        **{name: table.write_csv(float_precision=_DIGITS) for name, table in files.items()},
        "road_users.json": listed + "\n",
        **notes.files("recording"),
    }


def _write_interaction(rows: pl.DataFrame) -> Mapping[str, pl.DataFrame]:
    import polars as pl

    on_foot = pl.col("category").is_in((_WALKS, _RIDES))
    stamps = (pl.col("frame").alias("frame_id"), (pl.col("frame") * 100).alias("timestamp_ms"))
    motion = ("x", "y", "vx", "vy")
    files = {
        "vehicle_tracks_000.csv": rows.filter(~on_foot).select(
            pl.col("number").alias("track_id"),
            *stamps,
            pl.col("category").alias("agent_type"),
            *motion,
            pl.col("hdg").alias("psi_rad"),
            *("length", "width"),
        ),
        "pedestrian_tracks_000.csv": rows.filter(on_foot).select(
            ("P" + pl.col("number").cast(pl.String)).alias("track_id"),
            *stamps,
            pl.lit("pedestrian/bicycle").alias("agent_type"),
            *motion,
        ),
    }
    return {name: table for name, table in files.items() if table.height}


def _meta_of(rows: pl.DataFrame, track: str, *more: pl.Expr) -> pl.DataFrame:
    import polars as pl

    return (
        rows.group_by("number")
        .agg(
            pl.col("frame").min().alias("initialFrame"),
            pl.col("frame").max().alias("finalFrame"),
            pl.len().alias("numFrames"),
            *(pl.col(name).first() for name in ("width", "length", "category")),
            *more,
        )
        .sort("number")
        .rename({"number": track})
    )


def _recording_meta(rows: pl.DataFrame) -> dict[str, object]:
    on_foot = rows.filter(rows["category"].is_in((_WALKS, _RIDES)))["number"].n_unique()
    total = rows["number"].n_unique()
    seconds = rows["time"].to_numpy()
    duration = float(seconds.max() - seconds.min())
    return {
        "locationId": 0,
        "frameRate": _RATE,
        "duration": round(duration, 3),
        "numTracks": total,
        "numVehicles": total - on_foot,
        "numVRUs": on_foot,
    }


def _write_ind(rows: pl.DataFrame) -> Mapping[str, pl.DataFrame]:
    """Columns of inD; pedestrians and cyclists have no size there."""
    import polars as pl

    names = {
        "pedestrian": "pedestrian",
        "bicycle": "bicycle",
        "truck": "truck_bus",
        "bus": "truck_bus",
    }
    sized = ~pl.col("category").is_in((_WALKS, _RIDES))
    rows = rows.with_columns(
        pl.when(sized).then(pl.col(name)).otherwise(0.0).alias(name) for name in ("length", "width")
    )
    tracks = rows.select(
        pl.lit(0).alias("recordingId"),
        pl.col("number").alias("trackId"),
        pl.col("frame"),
        (pl.col("frame") - pl.col("frame").min().over("number")).alias("trackLifetime"),
        pl.col("x").alias("xCenter"),
        pl.col("y").alias("yCenter"),
        (pl.col("hdg").degrees() % 360.0).alias("heading"),
        *("width", "length"),
        *(pl.col(f"v{k}").alias(f"{k}Velocity") for k in "xy"),
        *(pl.col(f"a{k}").alias(f"{k}Acceleration") for k in "xy"),
        pl.col("speed").alias("lonVelocity"),
        pl.lit(0.0).alias("latVelocity"),
        pl.col("acceleration").alias("lonAcceleration"),
        pl.lit(0.0).alias("latAcceleration"),
    )
    meta = _meta_of(rows, "trackId").with_columns(
        pl.col("category").replace(names).alias("class"), recordingId=pl.lit(0)
    )
    order = ("recordingId", "trackId", "initialFrame", "finalFrame", "numFrames")
    return {
        "00_tracks.csv": tracks,
        "00_tracksMeta.csv": meta.select(*order, "width", "length", "class"),
        "00_recordingMeta.csv": pl.DataFrame({"recordingId": 0, **_recording_meta(rows)}),
    }


def _write_highd(rows: pl.DataFrame) -> Mapping[str, pl.DataFrame]:
    """Columns of highD: corners of boxes along x, y downwards."""
    import polars as pl

    tracks = rows.select(
        "frame",
        pl.col("number").alias("id"),
        (pl.col("x") - pl.col("length") / 2.0).alias("x"),
        (-pl.col("y") - pl.col("width") / 2.0).alias("y"),
        pl.col("length").alias("width"),
        pl.col("width").alias("height"),
        pl.col("vx").alias("xVelocity"),
        (-pl.col("vy")).alias("yVelocity"),
        pl.col("ax").alias("xAcceleration"),
        (-pl.col("ay")).alias("yAcceleration"),
    )
    names = {"car": "Car", "van": "Car", "motorcycle": "Car", "truck": "Truck", "bus": "Truck"}
    # 2 is the lower carriageway, which leads along x.
    way = pl.when(pl.col("hdg").cos().mean() > 0.0).then(2).otherwise(1).alias("drivingDirection")
    meta = _meta_of(rows, "id", way).select(
        "id",
        pl.col("length").alias("width"),
        pl.col("width").alias("height"),
        *("initialFrame", "finalFrame", "numFrames"),
        pl.col("category").replace(names).alias("class"),
        "drivingDirection",
    )
    return {
        "01_tracks.csv": tracks,
        "01_tracksMeta.csv": meta,
        "01_recordingMeta.csv": pl.DataFrame({"id": 1, **_recording_meta(rows)}),
    }


def _write_ngsim(rows: pl.DataFrame) -> Mapping[str, pl.DataFrame]:
    """Columns of NGSIM: the middle of the front, in feet."""
    import polars as pl

    from odscen.formats.tracks.table_schemas import FOOT

    classes = {"motorcycle": 1, "car": 2, "van": 2, "truck": 3, "bus": 3}
    half = pl.col("length") / 2.0
    return {
        "ngsim.csv": rows.select(
            pl.col("number").alias("Vehicle_ID"),
            pl.col("frame").alias("Frame_ID"),
            pl.col("frames").alias("Total_Frames"),
            (pl.col("frame") * 100).alias("Global_Time"),
            ((pl.col("x") + half * pl.col("hdg").cos()) / FOOT).alias("Local_X"),
            ((pl.col("y") + half * pl.col("hdg").sin()) / FOOT).alias("Local_Y"),
            (pl.col("length") / FOOT).alias("v_Length"),
            (pl.col("width") / FOOT).alias("v_Width"),
            pl.col("category").replace_strict(classes, return_dtype=pl.Int64).alias("v_Class"),
            (pl.col("speed") / FOOT).alias("v_Vel"),
            (pl.col("acceleration") / FOOT).alias("v_Acc"),
        )
    }


_DRIVEN: Final = ("car", "van", "motorcycle", "truck", "bus")
_KNOWN: Final[Mapping[str, tuple[str, ...]]] = {"highd": _DRIVEN, "ngsim": _DRIVEN}
"""Categories that a schema has; all of them if it is not listed."""
_WRITERS: Final[Mapping[str, Callable[[pl.DataFrame], Mapping[str, pl.DataFrame]]]] = {
    "interaction": _write_interaction,
    "ind": _write_ind,
    "highd": _write_highd,
    "ngsim": _write_ngsim,
}

FORMAT = Format(
    id="recording",
    title="Recorded traffic (INTERACTION, levelX, NGSIM)",
    label="a run as recorded traffic, in the schema of INTERACTION, inD, highD or NGSIM",
    of=("run",),
    write=write_recording,
    options=(
        *WINDOW_OPTIONS,
        FormatOption("schema", "Whose columns it has.", tuple(_WRITERS), "interaction"),
    ),
)
