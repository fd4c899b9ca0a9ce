"""Dynamic obstacles of CommonRoad scenarios as tracks.

commonroad.in.tum.de, ``XML_commonRoad_XSD.xsd`` of commonroad-io: versions 2018b and 2020a.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import polars as pl

from odscen.base.errors import InputError
from odscen.base.shown import shown
from odscen.base.xml_reading import read_xml
from odscen.formats.tracks.recorded_traffic import RecordedTraffic, complete_tracks

if TYPE_CHECKING:
    from lxml import etree

_SCHEMA = {
    "id": pl.String,
    "time": pl.Float64,
    "kind": pl.String,
    "x": pl.Float64,
    "y": pl.Float64,
    "hdg": pl.Float64,
    "speed": pl.Float64,
    "length": pl.Float64,
    "width": pl.Float64,
}


def read_commonroad_obstacles(content: bytes, begin: float, end: float) -> RecordedTraffic:
    """Obstacles that move, from one second to another; who stays where it is has one state.

    Raises
    ------
    InputError
        If it is no CommonRoad scenario, or a number of a state is missing or none.
    """
    root = read_xml(content, huge=True)
    if root.tag != "commonRoad":
        raise InputError(f"its root element is <{root.tag}>, not <commonRoad>")
    try:
        step = float(root.get("timeStepSize", ""))
    except ValueError:
        step = math.nan
    if not 0.0 < step < 1e3:
        value = shown(root.get("timeStepSize"))
        raise InputError(f"timeStepSize is {value}, not seconds", element="commonRoad")
    rows: list[tuple[object, ...]] = []
    skipped = 0
    for obstacle in root.iter("obstacle", "dynamicObstacle"):
        if obstacle.tag == "obstacle" and obstacle.findtext("role") != "dynamic":
            skipped += 1
            continue
        where = f"{obstacle.tag} {obstacle.get('id')}"
        kind = (obstacle.findtext("type") or "unknown").strip()
        length, width = _size_of(obstacle, where)
        states = [*obstacle.iter("initialState"), *obstacle.iterfind("trajectory/state")]
        for state in states:
            time = step * _number_of(state, "time", where)
            if begin <= time <= end:
                rows.append(
                    (
                        str(obstacle.get("id")),
                        round(time, 6),
                        kind,
                        _number_of(state, "position/point/x", where, inside=False),
                        _number_of(state, "position/point/y", where, inside=False),
                        _number_of(state, "orientation", where),
                        _number_of(state, "velocity", where, missing=math.nan),
                        length,
                        width,
                    )
                )
    notes = (f"{skipped} obstacles are static, and no road users",) if skipped else ()
    tracks = pl.DataFrame(rows, schema=_SCHEMA, orient="row").with_columns(
        pl.col("speed").fill_nan(0.0)
    )
    return complete_tracks(tracks, "commonroad", step=step, notes=notes)


def _size_of(obstacle: etree._Element, where: str) -> tuple[float | None, float | None]:
    if obstacle.find("shape/rectangle") is not None:
        names = ("shape/rectangle/length", "shape/rectangle/width")
        length, width = (_number_of(obstacle, name, where, inside=False) for name in names)
        return length, width
    if obstacle.find("shape/circle") is not None:
        across = 2.0 * _number_of(obstacle, "shape/circle/radius", where, inside=False)
        return across, across
    return None, None  # a polygon


def _number_of(
    state: etree._Element,
    name: str,
    where: str,
    *,
    inside: bool = True,
    missing: float | None = None,
) -> float:
    """Number of an element, or of its ``exact``, or the middle of its interval."""
    texts = [state.findtext(f"{name}/exact" if inside else name)]
    if inside and texts == [None]:
        ends = ("intervalStart", "intervalEnd")
        texts = [state.findtext(f"{name}/{end}") for end in ends]
    if texts[0] is None and missing is not None and state.find(name) is None:
        return missing
    try:
        numbers = [float(text or "") for text in texts]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{name} is {shown(texts[0])}, not a number", element=where)
    return sum(numbers) / len(numbers)
