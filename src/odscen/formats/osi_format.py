"""Traces of ASAM OSI 3: a ``GroundTruth`` for each record of a run, as ``.osi`` or MCAP.

A ``.osi`` file is messages, each after its length in four bytes, little-endian
(``open-simulation-interface``, ``doc/architecture/trace_file_formats.adoc``). Fields have the
numbers of ``osi_groundtruth.proto``, ``osi_object.proto``, ``osi_trafficlight.proto`` and
``osi_common.proto`` of version 3.7.
"""

from __future__ import annotations

import json
import math
import struct
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError
from odscen.formats.base import WINDOW_OPTIONS, Format, FormatOption

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import polars as pl

    from odscen.formats.base import ExportFiles, ExportSource, RecordedRun
    from odscen.formats.recordings.run_recording import LaneElement, LaneSignals
    from odscen.records.run_plan import PlannedActor

VERSION = (3, 7, 0)
CONTAINERS = ("osi", "mcap")
MOST_STATES = 2_000_000
"""Road users times records; a state takes 190 bytes of the file."""

_VEHICLE, _PEDESTRIAN = 2, 3
"""``MovingObject.Type``."""
_OTHER_VEHICLE = 1
_VEHICLES = {"car": 4, "van": 6, "truck": 7, "bus": 12, "motorcycle": 10, "bicycle": 11}
"""``MovingObject.VehicleClassification.Type``."""
_FIRST_BULB = 1_000_001
"""Ids from here on are those of bulbs: three for each lane with a light."""
_BULBS = ((2, 3.3), (3, 3.0), (4, 2.7))
"""Red, yellow, green: ``TrafficLight.Classification.Color``, and metres above the ground."""
_BULB_SIZE = 0.3
_NO_ICON, _DARK, _LIT = 2, 2, 3
_VECTOR = struct.Struct("<BdBdBd")
"""A message of three doubles: dimension, vector or orientation."""
_X, _Y, _Z = 0x09, 0x11, 0x19
"""Tags of its fields."""
_SAME = 1e-6


def write_osi_trace(source: ExportSource) -> ExportFiles:
    """Write a run as a trace, and what its ids are.

    Raises
    ------
    InputError
        If it is no run, an option is not possible, or the window has no road users, or too many.
    MissingDependencyError
        If it is to be MCAP, and the package to write that is not installed.
    """
    import polars as pl

    from odscen.formats.recordings.osi_mcap import write_mcap
    from odscen.formats.recordings.record import (
        WINDOW,
        elements_of,
        lane_signals,
        movements_of,
        seconds_option,
    )

    container = source.options.get("container", CONTAINERS[0])
    if container not in CONTAINERS:
        raise InputError(f"container is osi or mcap, not {container!r}")
    recorded = source.recorded
    if recorded is None or source.roads is None:
        raise InputError("this format says what happened in a run: name the folder of one")
    begin, end = (seconds_option(source.options, name) for name in WINDOW)
    rows = recorded.rows
    if begin is not None:
        rows = rows.filter(pl.col("time") >= begin - _SAME)
    if end is not None:
        rows = rows.filter(pl.col("time") <= end + _SAME)
    if not rows.height:
        raise InputError("no road users were in the simulation, so there is nothing to export")
    if rows.height > MOST_STATES:
        raise InputError(
            f"the run has {rows.height:,} states of road users; a trace has {MOST_STATES:,} at "
            "most: choose a part of the run with --begin and --end"
        )
    states = _complete_states(source, recorded, rows)
    times = states["time"].unique().sort().to_numpy()
    lanes = elements_of(source.of_map, source.sumo_map, source.roads).lanes
    signals = lane_signals(movements_of(source, lanes), lanes, recorded.states, times)
    here = set(states["id"].unique().to_list())
    users = [user for user in recorded.users if user.id in here]
    number = {user.id: row + 1 for row, user in enumerate(users)}
    ego = next((number[user.id] for user in users if user.ego), 0)
    bodies = {user.id: _body_of(source, user, number[user.id]) for user in users}
    lights, of_map = _encode_lights(signals, lanes), _fields_of_map(source)
    frames: list[tuple[float, bytes]] = []
    instants = enumerate(zip(times.tolist(), _encode_instants(states, bodies), strict=True))
    for instant, (time, (present, objects)) in instants:
        colors = signals.color[:, instant].tolist()
        content = b"".join(
            (
                _encode_version(),
                _encode_time(time),
                _encode_identifier(3, ego) if ego in present else b"",
                objects,
                *(shown[color] for shown, color in zip(lights, colors, strict=True)),
                of_map,
            )
        )
        frames.append((time, content))
    version = ".".join(map(str, VERSION))
    data = {
        "format": "osi",
        "osi_version": version,
        "run": source.name,
        "map": _map_name(source),
        "step": round(recorded.step, 6),
        "frames": len(times),
        "ids": number,
        "traffic_lights": [
            {
                "lane": lanes[approach].key,
                "leads_to": lanes[lane].key,
                "ids": [_FIRST_BULB + 3 * row + bulb for bulb in range(3)],
            }
            for row, (approach, lane) in enumerate(
                zip(signals.approach.tolist(), signals.lane.tolist(), strict=True)
            )
        ],
    }
    if container == "mcap":
        described = f"Ground truth of the run {source.name} of odscen"
        trace = write_mcap(frames, version=version, description=described)
    else:
        trace = b"".join(struct.pack("<I", len(content)) + content for _, content in frames)
    return {
        f"{source.name}.{container}": trace,
        f"{source.name}.export.json": json.dumps(data, indent=2, ensure_ascii=False) + "\n",
        _map_name(source): source.map_file,
    }


def _complete_states(
    source: ExportSource, recorded: RecordedRun, rows: pl.DataFrame
) -> pl.DataFrame:
    """Add what a box has beside what was recorded: height of the ground and acceleration.

    Acceleration is along the heading, from one record to the next one of the same road user.
    """
    import polars as pl

    from odscen.formats.recordings.track_grid import ground_heights

    lengths = {user.id: user.length for user in recorded.users}
    if "z" not in rows.columns:
        rows = rows.with_columns(z=ground_heights(source.sumo_map, rows, lengths))
    apart = pl.col("time").diff().over("id")
    gained = pl.col("speed").diff().over("id") / apart
    return rows.with_columns(
        z=pl.col("z").cast(pl.Float64).fill_null(0.0).fill_nan(0.0),
        acceleration=pl.when(apart <= 1.5 * recorded.step)
        .then(gained)
        .otherwise(0.0)
        .fill_null(0.0),
    ).sort("time", "id", maintain_order=True)


class _Body(NamedTuple):
    """What stays the same of a road user: its id, the fields before and behind its ``base``."""

    number: int
    before: bytes
    size: tuple[float, float, float]
    behind: bytes


def _body_of(source: ExportSource, user: PlannedActor, number: int) -> _Body:
    from odscen.formats.recordings.protobuf_wire import message, whole
    from odscen.formats.recordings.track_grid import body_height

    walks = user.category == "pedestrian"
    behind = whole(3, _PEDESTRIAN if walks else _VEHICLE)
    if not walks:
        behind += message(6, whole(1, _VEHICLES.get(str(user.category), _OTHER_VEHICLE)))
    size = (user.length, user.width, body_height(source, user))
    return _Body(number, _encode_identifier(1, number), size, behind)


def _encode_instants(
    states: pl.DataFrame, bodies: Mapping[str, _Body]
) -> Iterator[tuple[set[int], bytes]]:
    """Who is there at each instant, and their ``moving_object`` fields."""
    from odscen.formats.recordings.protobuf_wire import message

    columns = ("id", "x", "y", "z", "hdg", "speed", "acceleration")
    for _, part in states.group_by("time", maintain_order=True):
        present, objects = set(), []
        for name, x, y, z, hdg, speed, gain in part.select(columns).iter_rows():
            body = bodies[name]
            along, aside = math.cos(hdg), math.sin(hdg)
            base = b"".join(
                message(field, _VECTOR.pack(_X, a, _Y, b, _Z, c))
                for field, (a, b, c) in (
                    (1, body.size),
                    (2, (x, y, z + 0.5 * body.size[2])),
                    (3, (0.0, 0.0, hdg)),
                    (4, (speed * along, speed * aside, 0.0)),
                    (5, (gain * along, gain * aside, 0.0)),
                )
            )
            objects.append(message(5, body.before + message(2, base) + body.behind))
            present.add(body.number)
        yield present, b"".join(objects)


def _encode_lights(
    signals: LaneSignals, lanes: Sequence[LaneElement]
) -> list[tuple[bytes, bytes, bytes, bytes]]:
    """``traffic_light`` fields of each lane with a light, by what it shows."""
    from odscen.formats.recordings.protobuf_wire import message, whole

    found = []
    for row, (approach, stop) in enumerate(
        zip(signals.approach.tolist(), signals.stop, strict=True)
    ):
        last = lanes[approach].centre[-2:]
        facing = math.atan2(*(last[0] - last[1])[[1, 0]])
        shown = []
        for color in range(1 + len(_BULBS)):
            content = b""
            for bulb, (kind, above) in enumerate(_BULBS):
                base = b"".join(
                    message(field, _VECTOR.pack(_X, a, _Y, b, _Z, c))
                    for field, (a, b, c) in (
                        (1, (_BULB_SIZE,) * 3),
                        (2, (stop[0], stop[1], stop[2] + above)),
                        (3, (0.0, 0.0, facing)),
                    )
                )
                mode = _LIT if color == bulb + 1 else _DARK
                classification = whole(1, kind) + whole(2, _NO_ICON) + whole(3, mode)
                bulb_message = _encode_identifier(1, _FIRST_BULB + 3 * row + bulb) + message(
                    2, base
                )
                content += message(7, bulb_message + message(3, classification))
            shown.append(content)
        found.append((shown[0], shown[1], shown[2], shown[3]))
    return found


def _map_name(source: ExportSource) -> str:
    """Of the copy of the map that lies beside the trace."""
    return f"{source.scenario.map.name}.xodr"


def _fields_of_map(source: ExportSource) -> bytes:
    """``proj_string`` and ``map_reference``."""
    from odscen.formats.recordings.protobuf_wire import text

    projection = source.roads.header.geo_reference.strip() if source.roads else ""
    return (text(14, projection) if projection else b"") + text(15, _map_name(source))


def _encode_version() -> bytes:
    from odscen.formats.recordings.protobuf_wire import message, whole

    return message(1, b"".join(whole(k, part) for k, part in enumerate(VERSION, start=1)))


def _encode_time(time: float) -> bytes:
    from odscen.formats.recordings.protobuf_wire import message, whole

    seconds, nanos = divmod(round(time * 1e9), 1_000_000_000)
    return message(2, whole(1, seconds) + whole(2, nanos))


def _encode_identifier(field: int, number: int) -> bytes:
    from odscen.formats.recordings.protobuf_wire import message, whole

    return message(field, whole(1, number))


FORMAT = Format(
    id="osi",
    title="ASAM OSI trace",
    label="ground truth of a run as an ASAM OSI trace (.osi or .mcap)",
    of=("run",),
    write=write_osi_trace,
    options=(
        *WINDOW_OPTIONS,
        FormatOption("container", "What the messages are in.", CONTAINERS, CONTAINERS[0]),
    ),
    needs_roads=True,
)
