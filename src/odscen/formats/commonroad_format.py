"""CommonRoad 2020a: lanelets, traffic lights, road users and a planning problem as XML.

https://commonroad.in.tum.de, ``XML_commonRoad_XSD.xsd`` of commonroad-io. That schema has every
obstacle begin at instant 0; who comes later waits beside the map at that instant only.
"""

from __future__ import annotations

import json
import re
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple
from xml.sax.saxutils import quoteattr

from odscen.formats.base import WINDOW_OPTIONS, Format

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.base.arrays import FloatArray
    from odscen.formats.base import ExportFiles, ExportSource
    from odscen.formats.recordings.run_recording import (
        CrosswalkElement,
        LaneElement,
        LaneSignals,
        MapElements,
        RunRecording,
        Tracks,
    )

_DATE = "2026-01-01"
"""The same run gives the same file on any day."""
_AUTHOR = "odscen"
_TYPES = {"van": "car"}
"""CommonRoad's obstacle types, where they are not called as categories are."""
_COLORS = ("inactive", "red", "yellow", "green")
_DIRECTIONS = {"s": "straight", "l": "left", "L": "left", "t": "left", "r": "right", "R": "right"}
_WAITING = (100.0, 5.0)
"""Metres beside the map, and from one to the next, at which those who come later wait."""
_GOAL_MARGIN = 2.0
"""Metres around the body that a planning problem's goal has on each side."""
_MAX_SPEED = "274"


class _Ids(NamedTuple):
    """First number of each kind of element; a number is given once in a file."""

    lanes: int
    crosswalks: int
    signs: int
    lights: int
    obstacles: int
    problem: int


class _Presence(NamedTuple):
    """Instants in a row in which a road user was there."""

    row: int
    first: int
    last: int


def write_commonroad_files(source: ExportSource) -> ExportFiles:
    """One scenario of the whole run, and which obstacle is who.

    Raises
    ------
    InputError
        If there are no road users, or too much, in the run.
    """
    from odscen.formats.recordings.record import recording_of

    recording = recording_of(source)
    bounds = source.of_map.made("commonroad", lambda: _write_bounds(recording.elements))
    elements, tracks = recording.elements, recording.tracks
    stretches = list(_presence_stretches(tracks))
    limits = sorted({lane.speed_limit for lane in elements.lanes if 0 < lane.speed_limit < 1e3})
    lights = _group_equal_signals(recording.signals)
    counts = (len(elements.lanes), len(elements.crosswalks), len(limits), len(lights))
    starts = [1]
    for count in (*counts, len(stretches)):
        starts.append(starts[-1] + count)
    ids = _Ids(*starts)
    text = "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            _write_root(recording),
            "<location><geoNameId>-999</geoNameId><gpsLatitude>999</gpsLatitude>"
            "<gpsLongitude>999</gpsLongitude></location>",
            "<scenarioTags><simulated/></scenarioTags>",
            *_write_lanelets(recording, ids, limits, lights, bounds),
            *(
                _write_crosswalk(crosswalk, ids.crosswalks + k)
                for k, crosswalk in enumerate(elements.crosswalks)
            ),
            *(_write_sign(limit, ids.signs + k) for k, limit in enumerate(limits)),
            *(
                _write_light(light, recording.signals, ids.lights + k)
                for k, light in enumerate(lights)
            ),
            *_write_obstacles(recording, stretches, ids),
            _planning_problem(recording, ids.problem),
            "</commonRoad>\n",
        ]
    )
    description = _describe_export(recording, stretches, ids, len(lights))
    return {
        f"{recording.name}.xml": text,
        f"{recording.name}.export.json": json.dumps(description, indent=2, ensure_ascii=False)
        + "\n",
    }


def benchmark_id(name: str) -> str:
    """Name of a benchmark of the country Zamunda, which stands for none: letters and digits."""
    return f"ZAM_{re.sub('[^A-Za-z0-9]', '', name) or 'Map'}-1_1_T-1"


def _write_root(recording: RunRecording) -> str:
    about = {
        "commonRoadVersion": "2020a",
        "benchmarkID": benchmark_id(recording.map_name),
        "date": _DATE,
        "author": _AUTHOR,
        "affiliation": _AUTHOR,
        "source": f"SUMO run {recording.name} of {recording.scenario}",
        "timeStepSize": "0.1",
    }
    return f"<commonRoad {' '.join(f'{key}={quoteattr(value)}' for key, value in about.items())}>"


def _describe_export(
    recording: RunRecording, stretches: list[_Presence], ids: _Ids, lights: int
) -> dict[str, object]:
    tracks = recording.tracks
    leading = tracks.leading(0)
    return {
        "format": "commonroad",
        "run": recording.name,
        "map": recording.map_name,
        "begin": float(recording.times[0]),
        "step": 0.1,
        "recorded_step": recording.recorded_step,
        "interpolated": recording.interpolated,
        "lanes": len(recording.elements.lanes),
        "lights": lights,
        "planning_problem": tracks.ids[leading] if leading >= 0 else None,
        "obstacles": [
            {
                "id": ids.obstacles + k,
                "road_user": tracks.ids[stretch.row],
                "first_step": stretch.first,
                "last_step": stretch.last,
            }
            for k, stretch in enumerate(stretches)
        ],
    }


# ---------------------------------------------------------------------------- lanelets and lights
def _write_bounds(elements: MapElements) -> list[str]:
    """Borders of each lane."""
    return [
        _write_bound("leftBound", lane.left) + _write_bound("rightBound", lane.right)
        for lane in elements.lanes
    ]


def _write_lanelets(
    recording: RunRecording,
    ids: _Ids,
    limits: list[float],
    lights: list[list[int]],
    bounds: list[str],
) -> Iterator[str]:
    at_approach: dict[int, list[int]] = {}
    for k, rows in enumerate(lights):
        at_approach.setdefault(int(recording.signals.approach[rows[0]]), []).append(ids.lights + k)
    for row, lane in enumerate(recording.elements.lanes):
        own = at_approach.get(row, [])
        sign = ids.signs + limits.index(lane.speed_limit) if lane.speed_limit in limits else None
        yield "".join(
            [
                f'<lanelet id="{ids.lanes + row}">',
                bounds[row],
                *(f'<predecessor ref="{ids.lanes + entry}"/>' for entry in lane.entries),
                *(f'<successor ref="{ids.lanes + number}"/>' for number in lane.exits),
                _write_adjacent("adjacentLeft", lane, lane.left_lane, ids, beyond=lane.keeps_right),
                _write_adjacent(
                    "adjacentRight", lane, lane.right_lane, ids, beyond=not lane.keeps_right
                ),
                _stop_line(lane, own),
                f"<laneletType>{_lanelet_type(lane)}</laneletType>",
                "<userOneWay>vehicle</userOneWay>",
                "" if sign is None else f'<trafficSignRef ref="{sign}"/>',
                *(f'<trafficLightRef ref="{number}"/>' for number in own),
                "</lanelet>",
            ]
        )


def _lanelet_type(lane: LaneElement) -> str:
    if lane.junction:
        return "intersection"
    if lane.kind == "bus":
        return "busLane"
    return {"motorway": "interstate", "rural": "country", "": "unknown"}.get(
        lane.road_type, "urban"
    )


def _write_adjacent(name: str, lane: LaneElement, row: int, ids: _Ids, *, beyond: bool) -> str:
    if row >= 0:
        return f'<{name} ref="{ids.lanes + row}" drivingDir="same"/>'
    if beyond and lane.opposite >= 0:
        return f'<{name} ref="{ids.lanes + lane.opposite}" drivingDir="opposite"/>'
    return ""


def _write_bound(name: str, points: FloatArray) -> str:
    return f"<{name}>{''.join(_write_point(point) for point in points)}</{name}>"


def _write_point(point: FloatArray) -> str:
    x, y, z = point
    return f"<point><x>{x:.4f}</x><y>{y:.4f}</y><z>{z:.4f}</z></point>"


def _stop_line(lane: LaneElement, lights: list[int]) -> str:
    if not lights:
        return ""
    refs = "".join(f'<trafficLightRef ref="{light}"/>' for light in lights)
    ends = "".join(_write_point(side[-1]) for side in (lane.left, lane.right))
    return f"<stopLine>{ends}<lineMarking>solid</lineMarking>{refs}</stopLine>"


def _write_crosswalk(crosswalk: CrosswalkElement, number: int) -> str:
    import numpy as np

    start, end = crosswalk.axis
    ahead = (end - start) / max(float(np.hypot(*(end - start)[:2])), 1e-6)
    side = np.array([-ahead[1], ahead[0], 0.0]) * (0.5 * crosswalk.width)
    return "".join(
        [
            f'<lanelet id="{number}">',
            _write_bound("leftBound", crosswalk.axis + side),
            _write_bound("rightBound", crosswalk.axis - side),
            "<laneletType>crosswalk</laneletType>",
            "<userBidirectional>pedestrian</userBidirectional></lanelet>",
        ]
    )


def _write_sign(limit: float, number: int) -> str:
    return (
        f'<trafficSign id="{number}"><trafficSignElement><trafficSignID>{_MAX_SPEED}'
        f"</trafficSignID><additionalValue>{limit:.4f}</additionalValue></trafficSignElement>"
        "<virtual>true</virtual></trafficSign>"
    )


def _group_equal_signals(signals: LaneSignals) -> list[list[int]]:
    """Rows of signals that are one light: same approach and turn, and the same colours always."""
    keys = [
        (int(approach), _DIRECTIONS.get(turn, "all"), color.tobytes())
        for approach, turn, color in zip(signals.approach, signals.turn, signals.color, strict=True)
    ]
    found: dict[tuple[int, str, bytes], list[int]] = {}
    for row, key in enumerate(keys):
        found.setdefault(key, []).append(row)
    return list(found.values())


def _write_light(rows: list[int], signals: LaneSignals, number: int) -> str:
    """A light whose cycle is what it showed during the run, instant by instant."""
    colors = signals.color[rows[0]].tolist()
    cycle = "".join(
        f"<cycleElement><duration>{len(list(same))}</duration><color>{_COLORS[color]}</color>"
        "</cycleElement>"
        for color, same in groupby(colors)
    )
    direction = _DIRECTIONS.get(signals.turn[rows[0]], "all")
    return (
        f'<trafficLight id="{number}"><cycle>{cycle}</cycle><position>'
        f"{_write_point(signals.stop[rows[0]])}</position><direction>{direction}</direction>"
        "<active>true</active></trafficLight>"
    )


# ---------------------------------------------------------------------------- road users
def _presence_stretches(tracks: Tracks) -> Iterator[_Presence]:
    import numpy as np

    for row, valid in enumerate(tracks.valid):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], valid.astype(np.int8), [0]])))
        for first, after in edges.reshape(-1, 2).tolist():
            yield _Presence(row, first, after - 1)


def _write_obstacles(
    recording: RunRecording, stretches: list[_Presence], ids: _Ids
) -> Iterator[str]:
    tracks = recording.tracks
    borders = [lane.left for lane in recording.elements.lanes]
    left = min(float(line[:, 0].min()) for line in borders) - _WAITING[0]
    below = min(float(line[:, 1].min()) for line in borders)
    for k, stretch in enumerate(stretches):
        category = tracks.categories[stretch.row]
        if stretch.first == 0:
            begins = _write_state("initialState", tracks, stretch.row, 0)
        else:
            begins = _write_pose("initialState", left, below + k * _WAITING[1], 0.0, 0, 0.0)
        # A trajectory has a state at least, and none of them is at instant 0.
        later = range(max(stretch.first, 1), stretch.last + 1)
        states = [_write_state("state", tracks, stretch.row, instant) for instant in later]
        if not states:
            states = [_write_state("state", tracks, stretch.row, 0, at=1)]
        yield "".join(
            [
                f'<dynamicObstacle id="{ids.obstacles + k}">',
                f"<type>{_TYPES.get(category, category)}</type>",
                f"<shape><rectangle><length>{tracks.length[stretch.row]:.4f}</length>",
                f"<width>{tracks.width[stretch.row]:.4f}</width></rectangle></shape>",
                begins,
                f"<trajectory>{''.join(states)}</trajectory></dynamicObstacle>",
            ]
        )


def _write_state(
    name: str, tracks: Tracks, row: int, instant: int, *, at: int | None = None
) -> str:
    x, y, hdg, speed = (
        float(values[row, instant]) for values in (tracks.x, tracks.y, tracks.hdg, tracks.speed)
    )
    return _write_pose(name, x, y, hdg, instant if at is None else at, speed)


def _write_pose(name: str, x: float, y: float, hdg: float, instant: int, speed: float) -> str:
    return (
        f"<{name}><position><point><x>{x:.4f}</x><y>{y:.4f}</y></point></position>"
        f"<orientation><exact>{hdg:.6f}</exact></orientation><time><exact>{instant}</exact></time>"
        f"<velocity><exact>{speed:.4f}</exact></velocity></{name}>"
    )


def _planning_problem(recording: RunRecording, number: int) -> str:
    """From the first to the last state of the ego; without one, of the vehicle that moves most."""
    import numpy as np

    tracks = recording.tracks
    row = max(tracks.leading(0), 0)
    there = np.flatnonzero(tracks.valid[row])
    first, last = int(there[0]), int(there[-1])
    x, y, hdg, speed = (values[row] for values in (tracks.x, tracks.y, tracks.hdg, tracks.speed))
    end = max(last - first, 1)
    return (
        f'<planningProblem id="{number}"><initialState><position><point><x>{x[first]:.4f}</x>'
        f"<y>{y[first]:.4f}</y></point></position><velocity><exact>{speed[first]:.4f}</exact>"
        f"</velocity><orientation><exact>{hdg[first]:.6f}</exact></orientation>"
        "<yawRate><exact>0.0</exact></yawRate><slipAngle><exact>0.0</exact></slipAngle>"
        "<time><exact>0</exact></time></initialState><goalState><time>"
        f"<intervalStart>0</intervalStart><intervalEnd>{end}</intervalEnd></time><position>"
        f"<rectangle><length>{tracks.length[row] + 2 * _GOAL_MARGIN:.4f}</length>"
        f"<width>{tracks.width[row] + 2 * _GOAL_MARGIN:.4f}</width>"
        f"<orientation>{hdg[last]:.6f}</orientation><center><x>{x[last]:.4f}</x>"
        f"<y>{y[last]:.4f}</y></center></rectangle></position></goalState></planningProblem>"
    )


FORMAT = Format(
    id="commonroad",
    title="CommonRoad",
    label="a run as a CommonRoad 2020a scenario",
    of=("run",),
    write=write_commonroad_files,
    options=WINDOW_OPTIONS,
    needs_roads=True,
)
