"""Time-space diagram: vehicles along a corridor, and where they were stopped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.arrays import FloatArray, IntArray, offsets, ranges
from odscen.base.markup import Markup, element, number, path_data
from odscen.reports.charts import ChartFrame, chart, clock_axis, legend, text_at, value_axis
from odscen.reports.page_templates import report_section
from odscen.reports.report_words import stretch

if TYPE_CHECKING:
    from collections.abc import Sequence


CRAWLS = 5.0 / 3.6
"""m/s; slower is drawn as queued, as a queue that creeps is one."""

_SHARP = 0.4
"""Units of the drawing by which a simplified line may be off."""


@dataclass(frozen=True, slots=True, eq=False)
class CorridorTraces:
    """Vehicles on a corridor in a stretch of time.

    Attributes
    ----------
    segments
        Of the corridor, in driving direction.
    junctions
        Name, begin and end (metres along the corridor) of each junction on it.
    length
        Of the corridor, metres.
    begin, end
        Of the stretch of time, seconds.
    time, along, speed, piece
        Shape ``(N,)``: seconds, metres along the corridor, m/s; ``piece`` numbers the passages, one
        after the other, in order of time in each.
    vehicles
        How many there were, drawn or not.
    """

    segments: tuple[str, ...]
    junctions: Sequence[tuple[str, float, float]]
    length: float
    begin: float
    end: float
    time: FloatArray
    along: FloatArray
    speed: FloatArray
    piece: IntArray
    vehicles: int


NONE_RECORDED = "There are no trajectories to draw: the run was made without them."


def corridor_section(traces: CorridorTraces | str) -> Markup:
    """Section of the diagram, or of the words why there is none."""
    heading = "Time-space diagram of a corridor"
    explained = (
        "each line is one trajectory: time runs to the right, distance upwards. A steep line is a "
        "fast vehicle; a level red one is queued, below 5 km/h. Grey bands are junctions. Red "
        "wedges that start below a band are queues before it; if they grow from cycle to cycle, "
        "demand exceeds capacity. Lines that pass several bands without red have a green "
        "wave. Lines begin and end where vehicles turn in and off."
    )
    if isinstance(traces, str):
        return report_section(heading, element("p", traces), explained=explained, ident="corridor")
    first, last = traces.segments[0], traces.segments[-1]
    junctions = _counted(len(traces.junctions), "junction")
    extent = (
        f"From {first} to {last}, {number(traces.length, 0)} m through {junctions}, "
        f"{stretch(traces.begin, traces.end)}: {_counted(traces.vehicles, 'vehicle')}."
    )
    through = ", ".join(name for name, _, _ in traces.junctions)
    note = element("p", extent, element("small", f" Junctions: {through}.") if through else None)
    return report_section(heading, note, _diagram(traces), explained=explained, ident="corridor")


def _counted(count: int, what: str) -> str:
    return f"{count:,} {what}{'' if count == 1 else 's'}"


def _diagram(traces: CorridorTraces) -> Markup:
    frame = ChartFrame(
        clock_axis(traces.begin, traces.end),
        value_axis(traces.length, "distance along the corridor, m", tight=True),
        height=460.0,
    )
    left, right = (float(frame.x(value)) for value in (traces.begin, traces.end))
    bands: list[Markup] = []
    names: list[Markup] = []
    labels: list[float] = []
    for name, begin, end in traces.junctions:
        low, high = float(frame.y(begin)), float(frame.y(end))
        bands.append(element("rect", x=left, y=high, width=right - left,
                             height=max(low - high, 1.0), class_="band-of"))  # fmt: skip
        middle = (low + high) / 2 + 4.0
        if all(abs(middle - other) > 14.0 for other in labels):
            labels.append(middle)
            names.append(text_at(right - 4, middle, name, class_="over", text_anchor="end"))
    driven = [
        element("path", d=data, transform="scale(0.1)", class_=f"trace {style}")
        for style, data in zip(("moving", "standing"), _lines(frame, traces), strict=True)
    ]
    words = [("c-moving", "moving vehicle"), ("c-standing", "queued vehicle"),
             ("c-band", "junction")]  # fmt: skip
    return chart(
        frame,
        [*bands, *driven, *names],
        description="Places of vehicles along the corridor over time; red where they are queued",
        keys=legend(words),
    )


def _lines(frame: ChartFrame, traces: CorridorTraces) -> tuple[str, str]:
    """Path data of everything driven and of everything queued, in tenths of the drawing's units."""
    import shapely

    count = len(traces.time)
    if count == 0:
        return "", ""
    slow = traces.speed < CRAWLS
    new_piece = np.concatenate([[True], traces.piece[1:] != traces.piece[:-1]])
    begins = np.flatnonzero(new_piece | np.concatenate([[True], slow[1:] != slow[:-1]]))
    ends = np.append(begins[1:], count)
    # A run of one kind reaches to the first point of the next one of the same passage.
    joined = (ends < count) & ~new_piece[np.minimum(ends, count - 1)]
    sizes = ends - begins + joined
    keep = sizes > 1
    begins, sizes = begins[keep], sizes[keep]
    if len(begins) == 0:
        return "", ""
    rows = ranges(begins, sizes)
    points = np.column_stack([frame.x(traces.time[rows]), frame.y(traces.along[rows])])
    lines = shapely.linestrings(points, indices=np.repeat(np.arange(len(sizes)), sizes))
    lines = shapely.simplify(lines, _SHARP, preserve_topology=False)
    data = []
    for kind in (False, True):
        chosen = lines[slow[begins] == kind]
        xy, index = shapely.get_coordinates(chosen, return_index=True)
        start = offsets(np.bincount(index, minlength=len(chosen)))
        data.append(path_data(xy, start, unit=0.1))
    return data[0], data[1]
