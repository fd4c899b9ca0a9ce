"""Tables of tracks in published schemas, CSV or Parquet, recognised by their columns.

levelX (highD; inD, rounD, exiD), INTERACTION, SinD, NGSIM, Argoverse 2, omega-prime, and tables
with columns that are named. Only the columns that are needed are read, and only the rows of the
window. A large file is copied once, as Parquet with what is needed of it, and made tracks of a part
of the road users at a time, so that it may be larger than the memory.
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import polars as pl

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, in_file
from odscen.base.shown import shown, shown_id
from odscen.formats.tracks.osi_trace import OSI_OBJECTS, OSI_VEHICLE, OSI_VEHICLES
from odscen.formats.tracks.recorded_traffic import RecordedTraffic, complete_tracks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from odscen.formats.base import GivenFile

Types = dict[str, "pl.DataType | type[pl.DataType]"]

FOOT: Final = 0.3048
"""Metres; NGSIM measures in feet."""
_SAME = 1e-6
"""Seconds by which a frame may miss the window and still be of it."""
_LISTED = 12
"""Values that a message lists at most."""
LARGE_TABLE: Final = 100_000_000
"""Bytes of a table from which on it is read in parts."""
_PACKED: Final = 4
"""Bytes of text for each byte of Parquet, about."""
_ROWS_OF_PART: Final = 1_500_000
_ROLES: Final[tuple[str, ...]] = (
    *("time", "id", "x", "y", "hdg", "speed", "acceleration", "length", "width", "kind"),
    *("vx", "vy", "ax", "ay"),
)
"""What a column of a table can be named to be."""


class TimeWindow(NamedTuple):
    """Part of a recording, s as its file counts them."""

    begin: float = -math.inf
    end: float = math.inf


@dataclass(frozen=True, slots=True)
class TrackFile:
    """A table that is to be read.

    Attributes
    ----------
    file
        The file, with those beside it.
    columns
        Their names as the file has them.
    options
        What was chosen, by name.
    window
        Rows outside are left out.
    used
        Columns that have been read.
    copy
        Of a large file, from which rows are then read part by part.
    """

    file: GivenFile
    columns: tuple[str, ...]
    options: Mapping[str, str]
    window: TimeWindow
    used: set[str] = field(default_factory=set)
    copy: TableCopy | None = None

    @property
    def step(self) -> float | None:
        """Seconds between two frames, once a part has shown them."""
        return None if self.copy is None else self.copy.step

    def read(
        self,
        columns: Types,
        *expressions: pl.Expr,
        where: pl.Expr | None = None,
    ) -> pl.DataFrame:
        """Rows of the window with these expressions of columns of these types."""
        if self.copy is not None and self.copy.is_made:
            return self.copy.rows()
        table = _scan_table(self.file, columns)
        if where is not None:
            table = table.filter(where)
        for expression in (*expressions, *(() if where is None else (where,))):
            self.used.update(expression.meta.root_names())
        _refuse_missing_columns(self.file, self.used, self.columns)
        inside = pl.col("time").is_between(self.window.begin - _SAME, self.window.end + _SAME)
        inside |= ~pl.col("time").is_finite()  # a row of no time is refused later, and not lost
        wanted = table.select(expressions).filter(inside)
        if self.copy is None:
            return _collect_table(self.file, columns, wanted)
        _collect_table(self.file, columns, wanted, into=self.copy.path)
        self.copy.cut()
        return self.copy.rows()

    def beside(self, ending: str, other: str) -> GivenFile:
        """The file whose name ends otherwise.

        Raises
        ------
        InputError
            If this one's name does not have the ending.
        """
        stem, found, rest = self.file.name.rpartition(ending)
        if not found:
            raise InputError(
                f"the name of such a table ends with {ending}, as that of the files beside it does",
                file=self.file.name,
            )
        return self.file.other(f"{stem}{other}{rest}")


class TableCopy:
    """What is needed of a large table, on the disk, and which road users are read now.

    Parameters
    ----------
    path
        Where it is written, as Parquet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.step: float | None = None
        self._parts: list[pl.Series] = []
        self._part = 0

    @property
    def is_made(self) -> bool:
        """Whether the file has been copied."""
        return bool(self._parts)

    @property
    def is_last(self) -> bool:
        """Whether no road users are left for another part."""
        return self._part + 1 >= len(self._parts)

    @property
    def share(self) -> float:
        """Share of the parts that have been read."""
        return (self._part + 1) / max(len(self._parts), 1)

    def next_part(self) -> None:
        """Read the next part from now on."""
        self._part += 1

    def cut(self) -> None:
        """Cut its road users into parts, in the order in which tracks are sorted."""
        table = pl.scan_parquet(self.path)
        counts = (
            table.group_by(self._find_key()).agg(pl.len().alias("rows")).collect(engine="streaming")
        )
        counts = counts.sort(pl.col(self._find_key()).cast(pl.String))
        before = pl.col("rows").cum_sum() - pl.col("rows")
        counts = counts.with_columns(part=before // _ROWS_OF_PART)
        cut = counts.partition_by("part", maintain_order=True) or [counts]
        self._parts = [part[self._find_key()] for part in cut]

    def rows(self) -> pl.DataFrame:
        """Rows of the road users of this part."""
        own, key = self._parts[self._part], pl.col(self._find_key())
        here = key.is_in(own.drop_nulls().implode())
        if own.null_count():  # who has no id is refused later, and not lost
            here |= key.is_null()
        return pl.scan_parquet(self.path).filter(here).collect(engine="streaming")

    def refuse_again(self, ids: pl.Series) -> None:
        """Refuse road users of a file beside it who have the ids of others in this one.

        Raises
        ------
        InputError
            If there is one; names it.
        """
        known = pl.concat([part.cast(pl.String) for part in self._parts])
        twice = ids.unique().sort().filter(ids.unique().sort().is_in(known.implode()))
        if len(twice):
            raise InputError("it is in both files", element=f"road user {twice[0]}")

    def _find_key(self) -> str:
        columns = pl.scan_parquet(self.path).collect_schema().names()
        return next(name for name in ("number", "id") if name in columns)


class TableSchema(NamedTuple):
    """A published schema: the columns by which it is recognised, and what reads it."""

    id: str
    needed: frozenset[str]
    read: Callable[[TrackFile], RecordedTraffic]


def read_track_table(
    file: GivenFile, options: Mapping[str, str], window: TimeWindow
) -> Iterator[RecordedTraffic]:
    """Read a table of tracks; a large one gives parts, each with all of its road users.

    Raises
    ------
    InputError
        If no schema has its columns, or a value is none that its column can have; names the file,
        the column and the row.
    """
    with ExitStack() as stack:
        stack.enter_context(in_file(file.name))
        given = TrackFile(file, _columns_of(file), options, window)
        if _size_of(file) > LARGE_TABLE:
            folder = stack.enter_context(scratch_folder())
            given = replace(given, copy=TableCopy(folder / "rows.parquet"))
        while True:
            recorded = _read_with_schema(given)
            unused = [name for name in given.columns if name not in given.used]
            yield replace(recorded, unused=tuple(unused))
            if given.copy is None or given.copy.is_last:
                return
            given.copy.step = recorded.step
            given.copy.next_part()


def _size_of(file: GivenFile) -> int:
    try:
        size = file.on_disk.stat().st_size
    except OSError:
        return 0
    return size * (_PACKED if file.name.lower().endswith(".parquet") else 1)


def has_track_columns(file: GivenFile) -> bool:
    """Whether a table has the columns of a schema that is known."""
    columns = set(_columns_of(file))
    is_ngsim = {name.lower() for name in columns} >= _NGSIM_COLUMNS
    return is_ngsim or any(schema.needed <= columns for schema in SCHEMAS)


def _read_with_schema(given: TrackFile) -> RecordedTraffic:
    if given.options.get("columns"):
        return _read_named_columns(given)
    columns = set(given.columns)
    if {name.lower() for name in columns} >= _NGSIM_COLUMNS:
        return _read_ngsim(given)
    for schema in SCHEMAS:
        if schema.needed <= columns:
            return schema.read(given)
    known = ", ".join(("ngsim", *(schema.id for schema in SCHEMAS)))
    raise InputError(
        f"its columns are those of no schema that is known ({known}); there are "
        f"{_list_names(given.columns)}. Name them: --option columns=time=TIME,id=ID,x=X,y=Y"
    )


# ----------------------------------------------------------------------------- reading a table


def _scan_table(file: GivenFile, types: Types) -> pl.LazyFrame:
    try:
        if file.name.lower().endswith(".parquet"):
            return pl.scan_parquet(file.on_disk)
        return pl.scan_csv(file.on_disk, schema_overrides=types, infer_schema=False)
    except (pl.exceptions.PolarsError, ValueError, OSError) as error:
        raise InputError(f"not a table: {_what_is_said(error)}", file=file.name) from error


def _columns_of(file: GivenFile) -> tuple[str, ...]:
    try:
        return tuple(_scan_table(file, {}).collect_schema().names())
    except (pl.exceptions.PolarsError, OSError) as error:
        raise InputError(f"not a table: {_what_is_said(error)}", file=file.name) from error


def _collect_table(
    file: GivenFile, types: Types, table: pl.LazyFrame, *, into: Path | None = None
) -> pl.DataFrame:
    """Read it in pieces; what cannot be read is looked for in a second reading, as text.

    With ``into`` it is written there, and nothing is given.
    """
    try:
        if into is None:
            return table.collect(engine="streaming")
        table.sink_parquet(into, compression="lz4")
        return pl.DataFrame()
    except (pl.exceptions.PolarsError, OSError) as error:
        _refuse_wrong_value(file, types)
        raise InputError(f"it cannot be read: {_what_is_said(error)}", file=file.name) from error


def _refuse_wrong_value(file: GivenFile, types: Types) -> None:
    if file.name.lower().endswith(".parquet"):
        return
    text = pl.scan_csv(file.on_disk, infer_schema=False, row_index_name="row")
    for name, kind in types.items():
        value = pl.col(name)
        wrong = value.is_not_null() & value.cast(kind, strict=False).is_null()
        try:
            found = text.filter(wrong).select("row", name).head(1).collect(engine="streaming")
        except (pl.exceptions.PolarsError, OSError):
            return  # a file whose rows are no rows; polars has said where
        if found.height:
            row, given = found.row(0)
            raise InputError(
                f"{shown(given)} is not a number",
                file=file.name,
                # The titles are line 1.
                element=f"line {row + 2} > column {name}",
            )


def _what_is_said(error: Exception) -> str:
    """The first line of a message: what follows are hints for programmers, and the query."""
    return str(error).partition("\n")[0]


def _list_names(names: Sequence[object]) -> str:
    listed = ", ".join(shown_id(str(name)) for name in names[:_LISTED])
    return listed + (", ..." if len(names) > _LISTED else "")


_F: Final = pl.Float64
_I: Final = pl.Int64


def _columns_if_there(given: TrackFile, *names: str) -> list[pl.Expr]:
    return [pl.col(name) for name in names if name in given.columns]


def _with_file_beside(
    given: TrackFile,
    rows: pl.DataFrame,
    prefixes: tuple[str, str],
    read: Callable[[TrackFile], pl.DataFrame],
) -> pl.DataFrame:
    """Rows with those of the file that has the other road users of the same recording."""
    name = given.file.name
    if given.copy is not None and not given.copy.is_last:
        return rows
    for own, other in (prefixes, prefixes[::-1]):
        if not name.startswith(own):
            continue
        try:
            file = given.file.other(other + name.removeprefix(own))
        except InputError:
            return rows  # of files that were sent, only this one was
        if file.on_disk.is_file():
            with in_file(file.name):
                columns = _columns_of(file)
                more = read(TrackFile(file, columns, given.options, given.window))
                if given.copy is not None:
                    given.copy.refuse_again(more["id"])
            return pl.concat([rows, more], how="diagonal")
    return rows


# ------------------------------------------------------------------------ INTERACTION and SinD


def _read_interaction(given: TrackFile) -> RecordedTraffic:
    """interaction-dataset.com: vehicles and, in a file beside it, pedestrians and cyclists."""
    rows = _with_file_beside(
        given, _interaction_rows(given), ("vehicle_tracks", "pedestrian_tracks"), _interaction_rows
    )
    return complete_tracks(rows, "interaction", step=given.step)


def _interaction_rows(given: TrackFile) -> pl.DataFrame:
    numbers = ("timestamp_ms", "x", "y", "vx", "vy", "psi_rad", "length", "width")
    return given.read(
        {name: _F for name in numbers if name in given.columns},
        pl.col("track_id").cast(pl.String).alias("id"),
        (pl.col("timestamp_ms") / 1000.0).alias("time"),
        pl.col("agent_type").alias("kind"),
        *_columns_if_there(given, "x", "y", "vx", "vy", "length", "width"),
        *(column.alias("hdg") for column in _columns_if_there(given, "psi_rad")),
        where=_chosen_part(given, "case_id", "case"),
    )


def _chosen_part(given: TrackFile, column: str, option: str) -> pl.Expr | None:
    """Rows of one of several recordings that a file has, each with its own time."""
    if column not in given.columns or (given.copy is not None and given.copy.is_made):
        return None
    parts = _collect_table(given.file, {}, _scan_table(given.file, {}).select(column).unique())
    known = sorted(map(str, parts[column].drop_nulls()), key=lambda part: (len(part), part))
    chosen = given.options.get(option) or (known[0] if len(known) == 1 else "")
    if chosen not in known:
        raise InputError(
            f"it has {len(known)} recordings, each with its own time; choose one with "
            f"--option {option}=NAME: {_list_names(known)}",
            element=f"column {column}",
        )
    return pl.col(column).cast(pl.String) == chosen


_SIND_COLORS: Final = {"0": "red", "1": "green", "3": "yellow"}


def _read_sind(given: TrackFile) -> RecordedTraffic:
    """github.com/SOTIF-AVLab/SinD: vehicles, pedestrians, and what lights showed."""
    rows = _with_file_beside(given, _sind_rows(given), ("Veh_", "Ped_"), _sind_rows)
    try:
        lights = given.file.other("Traffic_Lights.csv")
        signals = _read_sind_lights(lights) if lights.on_disk.is_file() else None
    except InputError:
        if given.file.name != given.file.where:
            raise
        signals = None  # of files that were sent, it was not
    return complete_tracks(rows, "sind", step=given.step, signals=signals)


def _sind_rows(given: TrackFile) -> pl.DataFrame:
    numbers = (*("timestamp_ms", "x", "y", "vx", "vy", "ax", "ay", "yaw_rad", "length", "width"),)
    return given.read(
        {name: _F for name in numbers if name in given.columns},
        pl.col("track_id").alias("id"),
        (pl.col("timestamp_ms") / 1000.0).alias("time"),
        pl.col("agent_type").alias("kind"),
        *_columns_if_there(given, "x", "y", "vx", "vy", "ax", "ay", "length", "width"),
        *(column.alias("hdg") for column in _columns_if_there(given, "yaw_rad")),
    )


def _read_sind_lights(file: GivenFile) -> pl.DataFrame:
    """What lights showed; a row before the first frame has no time, but a number of its frame."""
    types: Types = {"RawFrameID": _F, "timestamp(ms)": _F}
    with in_file(file.name):
        rows = _collect_table(file, types, _scan_table(file, types))
        lights = [name for name in rows.columns if name not in types]
        if not types.keys() <= set(rows.columns) or not lights:
            named = _list_names(rows.columns)
            raise InputError(
                f"no column RawFrameID, timestamp(ms) or of a light; there are {named}"
            )
        known = rows.drop_nulls("timestamp(ms)").sort("RawFrameID")
        if known["RawFrameID"].n_unique() < 2:
            raise InputError("fewer than two frames have a time", element="column timestamp(ms)")
        first, last = known.row(0, named=True), known.row(-1, named=True)
        frames = last["RawFrameID"] - first["RawFrameID"]
        per_frame = (last["timestamp(ms)"] - first["timestamp(ms)"]) / frames
        before = first["timestamp(ms)"] + per_frame * (pl.col("RawFrameID") - first["RawFrameID"])
        states = rows.select(
            (pl.col("timestamp(ms)").fill_null(before) / 1000.0).alias("time"), *lights
        ).unpivot(lights, index="time", variable_name="light", value_name="color")
        wrong = states.filter(~pl.col("color").is_in(list(_SIND_COLORS)).fill_null(value=False))
        if wrong.height:
            time, light, color = wrong.row(0)
            raise InputError(
                f"{shown(color)} at {time:g} s is none of 0 (red), 1 (green) and 3 (yellow)",
                element=f"column {light}",
            )
    return states.with_columns(pl.col("color").replace(_SIND_COLORS)).sort("light", "time")


# -------------------------------------------------------------------------------------- levelX


def _read_highd(given: TrackFile) -> RecordedTraffic:
    """levelxdata.com, highD: upper left corners of boxes along x, on pictures, so y downwards."""
    rate, kinds = _read_levelx_files(given, "id", ("drivingDirection",))
    numbers = (
        *("frame", "x", "y", "width", "height"),
        *("xVelocity", "yVelocity", "xAcceleration", "yAcceleration"),
    )
    rows = given.read(
        {"id": _I, **dict.fromkeys(numbers, _F)},
        pl.col("id"),
        (pl.col("frame") / rate).alias("time"),
        (pl.col("x") + pl.col("width") / 2.0).alias("x"),
        -(pl.col("y") + pl.col("height") / 2.0).alias("y"),
        pl.col("xVelocity").alias("vx"),
        -pl.col("yVelocity").alias("vy"),
        pl.col("xAcceleration").alias("ax"),
        -pl.col("yAcceleration").alias("ay"),
        pl.col("width").alias("length"),
        pl.col("height").alias("width"),
    )
    rows = _with_kind(rows.join(kinds, on="id", how="left"), given)
    # 1 is the upper carriageway, which is driven to the left of the picture.
    along = pl.when(pl.col("drivingDirection") == 1).then(-1.0).otherwise(1.0)
    turned = pl.arctan2(pl.col("vy"), pl.col("vx"))
    rows = rows.with_columns(
        pl.col("id").cast(pl.String),
        pl.when(pl.col("vx") * along > 0.0)
        .then(turned)
        .otherwise(pl.arctan2(pl.lit(0.0), along))
        .alias("hdg"),
    )
    return complete_tracks(rows, "highd", step=1.0 / rate)


def _read_ind(given: TrackFile) -> RecordedTraffic:
    """levelxdata.com, inD, rounD and exiD: centres and headings in degrees."""
    rate, kinds = _read_levelx_files(given, "trackId", ())
    names = {"xVelocity": "vx", "yVelocity": "vy", "xAcceleration": "ax", "yAcceleration": "ay"}
    numbers = ("frame", "xCenter", "yCenter", "heading", "length", "width", *names)
    rows = given.read(
        {"trackId": _I, **dict.fromkeys(numbers, _F)},
        pl.col("trackId").alias("id"),
        (pl.col("frame") / rate).alias("time"),
        pl.col("xCenter").alias("x"),
        pl.col("yCenter").alias("y"),
        pl.col("heading").radians().alias("hdg"),
        pl.col("length", "width"),
        *(pl.col(name).alias(new) for name, new in names.items()),
    )
    rows = _with_kind(rows.join(kinds, on="id", how="left"), given)
    rows = rows.with_columns(pl.col("id").cast(pl.String))
    return complete_tracks(rows, "levelx", step=1.0 / rate)


def _read_levelx_files(
    given: TrackFile, track: str, more: tuple[str, ...]
) -> tuple[float, pl.DataFrame]:
    """Frames in a second, and what each road user is, of the two files beside the tracks."""
    meta = given.beside("_tracks", "_recordingMeta")
    with in_file(meta.name):
        types: Types = {"frameRate": _F}
        _refuse_missing_columns(meta, types)
        rates = _collect_table(meta, types, _scan_table(meta, types))["frameRate"]
        if len(rates) != 1 or not rates[0] or not 0.0 < rates[0] < 1e4:
            found = _list_names(rates.to_list())
            raise InputError(
                f"frameRate is {found or 'not there'}, not one number of frames in 1 s"
            )
    users = given.beside("_tracks", "_tracksMeta")
    with in_file(users.name):
        types = {track: _I, **dict.fromkeys(more, _I)}
        _refuse_missing_columns(users, {**types, "class": pl.String})
        columns = [pl.col(track).alias("id"), pl.col("class").alias("kind"), *map(pl.col, more)]
        kinds = _collect_table(users, types, _scan_table(users, types).select(columns))
        twice = kinds.filter(pl.col("id").is_duplicated())
        if twice.height:
            raise InputError(f"{twice['id'][0]} is there twice", element=f"column {track}")
    return float(rates[0]), kinds


def _refuse_missing_columns(
    file: GivenFile, needed: Iterable[str], columns: Sequence[str] | None = None
) -> None:
    columns = _columns_of(file) if columns is None else columns
    missing = sorted(set(needed) - set(columns))
    if missing:
        raise InputError(
            f"no column {' and '.join(missing)}; there are {_list_names(columns)}", file=file.name
        )


def _with_kind(rows: pl.DataFrame, given: TrackFile) -> pl.DataFrame:
    unknown = rows.filter(pl.col("kind").is_null())
    if unknown.height:
        raise InputError(
            f"road user {unknown['id'][0]} of {given.file.name} is not in it",
            file=given.beside("_tracks", "_tracksMeta").name,
        )
    return rows


# --------------------------------------------------------------------- NGSIM and Argoverse 2

_NGSIM_COLUMNS: Final = frozenset(
    {
        *("vehicle_id", "frame_id", "total_frames", "global_time", "local_x", "local_y"),
        *("v_length", "v_width", "v_class", "v_vel", "v_acc"),
    }
)
_NGSIM_KINDS: Final = {1: "motorcycle", 2: "car", 3: "truck"}


def _read_ngsim(given: TrackFile) -> RecordedTraffic:
    """Next Generation Simulation of the FHWA, in feet: x across the road, y along it.

    Places are those of the middle of the front. Numbers of vehicles are given again in a file: a
    vehicle is one number and one count of frames.
    """
    name_of = {name.lower(): name for name in given.columns}
    numbers = (
        *("frame_id", "total_frames", "global_time", "local_x", "local_y"),
        *("v_vel", "v_acc", "v_length", "v_width"),
    )
    rows = given.read(
        {name_of["vehicle_id"]: _I, name_of["v_class"]: _I, **{name_of[n]: _F for n in numbers}},
        pl.col(name_of["vehicle_id"]).alias("number"),
        pl.col(name_of["total_frames"]).cast(_I).alias("frames"),
        (pl.col(name_of["frame_id"]) / 10.0).alias("time"),
        pl.col(name_of["v_class"]).alias("class"),
        *(
            (pl.col(name_of[name]) * FOOT).alias(new)
            for name, new in {
                "local_x": "x",
                "local_y": "y",
                "v_vel": "speed",
                "v_acc": "acceleration",
                "v_length": "length",
                "v_width": "width",
            }.items()
        ),
        where=_chosen_part(given, name_of.get("location", ""), "location"),
    )
    wrong = rows.filter(~pl.col("class").is_in(list(_NGSIM_KINDS)).fill_null(value=False))
    if wrong.height:
        row = wrong.row(0, named=True)
        raise InputError(
            f"{row['class']} of vehicle {row['number']} is none of 1 (motorcycle), 2 (car) and "
            "3 (truck)",
            element=f"column {name_of['v_class']}",
        )
    again = pl.col("frames").n_unique().over("number") > 1
    text = pl.col("number").cast(pl.String)
    rows = rows.with_columns(
        pl.when(again)
        .then(text + "/" + pl.col("frames").cast(pl.String))
        .otherwise(text)
        .alias("id"),
        pl.col("class").replace_strict(_NGSIM_KINDS, return_dtype=pl.String).alias("kind"),
    ).drop("number", "frames", "class")
    return complete_tracks(rows, "ngsim", step=0.1, from_front=True)


def _read_argoverse(given: TrackFile) -> RecordedTraffic:
    """Argoverse 2 motion forecasting: ten frames in a second, and no sizes."""
    rows = given.read(
        {},
        pl.col("track_id").alias("id"),
        (pl.col("timestep") / 10.0).alias("time"),
        pl.col("object_type").alias("kind"),
        pl.col("position_x").alias("x"),
        pl.col("position_y").alias("y"),
        pl.col("heading").alias("hdg"),
        pl.col("velocity_x").alias("vx"),
        pl.col("velocity_y").alias("vy"),
        # 0 is a track that is a fragment.
        (pl.col("object_category") == 0).alias("fragment"),
    )
    return complete_tracks(rows, "argoverse2", step=0.1)


# -------------------------------------------------------------- omega-prime and named columns


def _read_omega_prime(given: TrackFile) -> RecordedTraffic:
    """github.com/ika-rwth-aachen/omega-prime: OSI's moving objects as a table."""
    whole = dict.fromkeys(("total_nanos", "idx", "type", "subtype"), _I)
    number = ("x", "y", "yaw", "vel_x", "vel_y", "acc_x", "acc_y", "length", "width")
    rows = given.read(
        {**whole, **dict.fromkeys(number, _F)},
        pl.col("idx").cast(pl.String).alias("id"),
        (pl.col("total_nanos") / 1e9).alias("time"),
        pl.when(pl.col("type") == OSI_VEHICLE)
        .then(pl.col("subtype").replace_strict(OSI_VEHICLES, default="other"))
        .otherwise(pl.col("type").replace_strict(OSI_OBJECTS, default="other"))
        .alias("kind"),
        pl.col("x", "y", "length", "width"),
        pl.col("yaw").alias("hdg"),
        *(
            pl.col(name).alias(new)
            for name, new in zip(number[3:7], ("vx", "vy", "ax", "ay"), strict=True)
        ),
    )
    return complete_tracks(rows, "omega-prime", step=given.step)


def _read_own_table(given: TrackFile) -> RecordedTraffic:
    """Tracks as odscen writes them, or any table whose columns have these names."""
    named: dict[str, tuple[str, float]] = {
        role: (role, 1.0) for role in _ROLES if role in given.columns
    }
    if "category" in given.columns:
        named["kind"] = ("category", 1.0)
    return _read_roles(given, named, "tracks")


def _read_named_columns(given: TrackFile) -> RecordedTraffic:
    """A table whose columns are named: ``time=ms*0.001,id=vehicle,x=east,y=north``."""
    named: dict[str, tuple[str, float]] = {}
    for part in given.options["columns"].split(","):
        role, equals, column = (word.strip() for word in part.partition("="))
        name, times, factor = (word.strip() for word in column.rpartition("*"))
        if not times:
            name, factor = column, "1"
        where = f"--option columns > {part.strip()}"
        if not equals or role not in _ROLES:
            raise InputError(f"it is not ROLE=COLUMN of one of {', '.join(_ROLES)}", element=where)
        if name not in given.columns:
            raise InputError(
                f"no column {name}; there are {_list_names(given.columns)}", element=where
            )
        try:
            named[role] = name, float(factor)
        except ValueError:
            raise InputError(f"{factor!r} is not a number", element=where) from None
    missing = [role for role in ("time", "x", "y") if role not in named]
    if missing:
        raise InputError(f"--option columns names no {' and '.join(missing)}")
    return _read_roles(given, named, "table")


def _read_roles(
    given: TrackFile, named: Mapping[str, tuple[str, float]], schema: str
) -> RecordedTraffic:
    for pair in (("vx", "vy"), ("ax", "ay")):
        if len(named.keys() & set(pair)) == 1:
            raise InputError(f"{' and '.join(pair)} belong together, and one of them is missing")
    texts = ("id", "kind")
    types: Types = {column: _F for role, (column, _) in named.items() if role not in texts}
    rows = given.read(
        types,
        *((pl.col(column) * by).alias(r) for r, (column, by) in named.items() if r not in texts),
        *(
            pl.col(column).cast(pl.String).alias(r)
            for r, (column, _) in named.items()
            if r in texts
        ),
        *(pl.lit(value).alias(role) for role, value in _USUAL.items() if role not in named),
    )
    return complete_tracks(rows, schema, step=given.step)


_USUAL: Final = {"id": "1", "kind": "car"}

SCHEMAS: Final = (
    TableSchema(
        "argoverse2",
        frozenset({"track_id", "timestep", "object_type", "object_category", "position_x"}),
        _read_argoverse,
    ),
    TableSchema(
        "omega-prime",
        frozenset({"total_nanos", "idx", "x", "y", "yaw", "vel_x", "type", "subtype"}),
        _read_omega_prime,
    ),
    TableSchema(
        "levelx",
        frozenset({"trackId", "frame", "xCenter", "yCenter", "heading", "xVelocity"}),
        _read_ind,
    ),
    TableSchema(
        "highd",
        frozenset({"id", "frame", "x", "y", "width", "height", "xVelocity", "yVelocity"}),
        _read_highd,
    ),
    TableSchema(
        "sind",
        frozenset({"track_id", "timestamp_ms", "agent_type", "x", "y", "vx", "vy", "ax", "ay"}),
        _read_sind,
    ),
    TableSchema(
        "interaction",
        frozenset({"track_id", "timestamp_ms", "agent_type", "x", "y", "vx", "vy"}),
        _read_interaction,
    ),
    TableSchema("tracks", frozenset({"time", "x", "y"}), _read_own_table),
)
"""The first whose columns are all there is that of a file. NGSIM has them in any letters."""
