"""Signal programs on the junction: who has green in each stage, and where the detectors lie."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from odscen.base.markup import Markup, element, number
from odscen.records.light_programs import stage_spans

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.arrays import Bounds, FloatArray
    from odscen.drawing.map_drawing import Lines, MapDrawing
    from odscen.records.light_programs import (
        LightProgram,
        ShownDetector,
        ShownGroup,
        ShownPlan,
        StageSpan,
    )


_KINDS = {
    "walked": ("sidewalk", "curb"),
    "paved": ("road", "bus", "bicycle", "shoulder", "parking", "restricted"),
}
"""Kinds of areas by the class of their shape, in the order they are painted."""

_SEAM = 0.05
"""Metres by which areas grow, so that none is left between two that touch."""

_TOLERANCE = 0.15
"""Metres by which an outline may be off."""


class PictureFrame(NamedTuple):
    """From metres of the OpenDRIVE frame to pixels of a square picture.

    Attributes
    ----------
    x0, y1
        Metres at the upper left corner.
    scale
        Pixels per metre.
    side
        Pixels.
    """

    x0: float
    y1: float
    scale: float
    side: float

    @classmethod
    def around(
        cls, points: Sequence[tuple[float, float]], *, side: float, margin: float
    ) -> PictureFrame:
        """Square with all points (x, y in metres, at least one) ``margin`` pixels from its rim."""
        xs, ys = [x for x, _ in points], [y for _, y in points]
        span = max(max(xs) - min(xs), max(ys) - min(ys), 1.0)
        scale = (side - 2.0 * margin) / span
        x0 = (min(xs) + max(xs)) / 2.0 - side / 2.0 / scale
        y1 = (min(ys) + max(ys)) / 2.0 + side / 2.0 / scale
        return cls(x0, y1, scale, side)

    @property
    def bounds(self) -> Bounds:
        """What is in the picture, metres."""
        span = self.side / self.scale
        return self.x0, self.y1 - span, self.x0 + span, self.y1

    def point(self, x: float, y: float) -> tuple[float, float]:
        """Pixels of a point in metres."""
        return (x - self.x0) * self.scale, (self.y1 - y) * self.scale

    def path(self, points: Sequence[tuple[float, float]] | FloatArray) -> str:
        """``d`` of a path through points in metres."""
        return "M" + " L".join(
            f"{number(x, 1)} {number(y, 1)}" for x, y in (self.point(*point) for point in points)
        )


def junction_ground(drawing: MapDrawing, frame: PictureFrame) -> Markup:
    """Outlines of carriageways and sidewalks in a picture, and its stop lines.

    Shapes have the classes ``paved``, ``walked`` and ``stop-line``; whoever shows them has colours
    for these.
    """
    from shapely import box

    bounds = frame.bounds
    near = drawing.clipped(bounds)
    window = box(*bounds)
    shapes = []
    for name, kinds in _KINDS.items():
        rings = [
            ring for area in near.areas if area.kind in kinds for ring in _each_line(area.rings)
        ]
        if outline := _outline_of_rings(rings, window, frame):
            shapes.append(element("path", d=outline, class_=name))
    shapes += [
        element("path", d=frame.path(line), class_="stop-line")
        for line in _each_line(near.stop_lines.touching(bounds))
    ]
    return element("g", *shapes, class_="ground")


def _each_line(lines: Lines) -> Iterator[FloatArray]:
    for begin, end in zip(lines.start[:-1].tolist(), lines.start[1:].tolist(), strict=True):
        yield lines.xy[begin:end]


def _outline_of_rings(rings: Sequence[FloatArray], window: object, frame: PictureFrame) -> str:
    """Outline of all rings together inside of the window; empty if there is nothing."""
    import shapely

    areas = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings if len(ring) > 2]
    if not areas:
        return ""
    whole = shapely.union_all(shapely.buffer(np.array(areas), _SEAM, join_style="mitre"))
    inside = shapely.simplify(shapely.intersection(whole, window), _TOLERANCE)
    parts = [part for part in shapely.get_parts(inside) if part.geom_type == "Polygon"]
    rings_of = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return " ".join(f"{frame.path(shapely.get_coordinates(ring)[:-1])} Z" for ring in rings_of)


SIDE, SITE = 132.0, 380.0
"""Pixels of the picture of a stage, and of that of the whole junction."""

_MARGIN = 12.0
_SITE_MARGIN = 30.0
_APPROACH, _BUS_APPROACH = 6.0, 25.0
"""Metres before the stop lines that a picture shows at least, without and with areas for buses."""

_LABEL_AT = 5.0
"""Metres before the stop line at which a group is named."""

_LOOP_WIDTH, _BAND_WIDTH = 2.2, 2.8
"""Metres of a loop and of an area for buses across the lane."""
_ROOM = 22.0
"""Pixels from the middle of a name to that of another beside it."""

_MOVEMENT_KINDS = {"G": "green", "g": "permissive"}


class StagePicture(NamedTuple):
    """A stage as a picture, and what is said below it."""

    stage: StageSpan
    picture: Markup
    words: str
    detail: str


def stage_words(stage: StageSpan) -> str:
    """``stage 1: 20 s``, or ``stage 2: 10 to 15 s``."""
    if stage.most > stage.least:
        return f"stage {stage.id}: {number(stage.least, 1)} to {number(stage.most, 1)} s"
    return f"stage {stage.id}: {number(stage.seconds, 1)} s"


def detector_label(light: LightProgram, detector: ShownDetector) -> str:
    """Name in the scenario, else ``L4`` of the loop ``J1.loop.4`` and ``C0`` of ``J1.call.0``.

    Areas that see buses have one name together.
    """
    if detector.name or detector.bus:
        return detector.name or "buses"
    kind, _, count = detector.id.removeprefix(f"{light.id}.").partition(".")
    return f"{kind[:1].upper()}{count}" if count else detector.id


def detector_purpose(detector: ShownDetector) -> str:
    """What it does for which stages: ``prolongs stage 1``."""
    what = "calls" if detector.call else "priority in" if detector.bus else "prolongs"
    return f"{what} stage {', '.join(detector.stages)}"


class JunctionPictures:
    """Pictures of one light, all on the same ground.

    Parameters
    ----------
    drawing
        Of the map, for the shape of the junction; without it there are movements only.
    ident
        Id of the ground in the document that the pictures are for.
    """

    def __init__(
        self, light: LightProgram, drawing: MapDrawing | None = None, *, ident: str = "ground"
    ) -> None:
        self._light = light
        self._drawing = drawing
        self._ident = ident
        points = list(_points_to_show(light, _APPROACH))
        self._frame = PictureFrame.around(points, side=SIDE, margin=_MARGIN) if points else None

    def ground(self) -> Markup | None:
        """Picture without a size that the others refer to; once in the document, before them."""
        if self._frame is None or self._drawing is None:
            return None
        shape = element("g", junction_ground(self._drawing, self._frame), id=self._ident)
        return element("svg", element("defs", shape), width=0, height=0, aria_hidden="true",
                       class_="grounds")  # fmt: skip

    def stages(self, plan: ShownPlan) -> list[StagePicture]:
        """One picture for each stage of a plan; none if the ways of movements are not known."""
        frame = self._frame
        if frame is None:
            return []
        return [self._draw_stage(stage, frame) for stage in stage_spans(plan)]

    def site(self) -> Markup | None:
        """The whole junction: movements with the names of their groups, and detectors."""
        light = self._light
        loops = [detector for detector in light.detectors if detector.place and not detector.bus]
        areas = [
            detector for detector in light.detectors if len(detector.place) > 1 and detector.bus
        ]
        approach = _BUS_APPROACH if areas else _APPROACH
        points = [*_points_to_show(light, approach), *(p for loop in loops for p in loop.place)]
        if self._frame is None:
            return None
        frame = PictureFrame.around(points, side=SITE, margin=_SITE_MARGIN)
        ground = None if self._drawing is None else junction_ground(self._drawing, frame)
        count = len(light.detectors)
        words = f"Junction {', '.join(light.junctions)}: {len(light.groups)} signal groups"
        words += f", {count} detectors" if count else ""
        shapes = [
            shape for group in light.groups for _, shape in _draw_movements(group, frame, None)
        ]
        return element(
            "svg",
            element("title", words),
            ground,
            *(_bus_area(light, area, frame) for area in areas),
            *shapes,
            *(_draw_loop(light, loop, frame) for loop in loops),
            *(_group_name(group, frame) for group in light.groups if any(group.paths)),
            *_detector_names(light, loops, frame),
            viewBox=f"0 0 {number(SITE)} {number(SITE)}",
            width=SITE,
            height=SITE,
            role="img",
            class_="picture site-picture",
        )

    def _draw_stage(self, stage: StageSpan, frame: PictureFrame) -> StagePicture:
        light = self._light
        words, names = stage_words(stage), " ".join(stage.groups(light))
        shapes = [
            draw_movement
            for group in light.groups
            for draw_movement in _draw_movements(group, frame, stage.state)
        ]
        ground = None
        if self._drawing is not None:
            ground = element("use", href=f"#{self._ident}")
        gives_way = " ".join(stage.groups(light, "g"))
        description = f"{words}; green: {names}" + (
            f"; gives way: {gives_way}" if gives_way else ""
        )
        picture = element(
            "svg",
            element("title", description),
            ground,
            *(shape for kind, shape in shapes if kind == "red"),
            *(shape for kind, shape in shapes if kind != "red"),
            viewBox=f"0 0 {number(SIDE)} {number(SIDE)}",
            width=SIDE,
            height=SIDE,
            role="img",
            class_="picture stage-picture",
        )
        return StagePicture(stage, picture, words, names + (" on call" if stage.on_call else ""))


def _points_to_show(light: LightProgram, approach: float) -> Iterator[tuple[float, float]]:
    """Points that have to be in a picture: paths, with the last metres before their stop lines."""
    for group in light.groups:
        for path in group.paths:
            yield from path
            if len(path) > 1 and not group.walk:
                yield _point_before(path, approach)
                (x0, y0), (x1, y1) = path[-2:]
                yield _point_before(((x1, y1), (x0, y0)), approach)


def _point_before(path: Sequence[tuple[float, float]], away: float) -> tuple[float, float]:
    """So many metres before the first point of a path, straight on."""
    (x0, y0), (x1, y1) = path[:2]
    length = max(hypot(x1 - x0, y1 - y0), 1e-9)
    return x0 - (x1 - x0) / length * away, y0 - (y1 - y0) / length * away


def _draw_movements(
    group: ShownGroup, frame: PictureFrame, state: str | None
) -> Iterator[tuple[str, Markup]]:
    """What each movement shows, and its line and head; without a state they show ``any``."""
    for link, path in zip(group.links, group.paths, strict=True):
        kind = "any" if state is None else _MOVEMENT_KINDS.get(state[link], "red")
        style = f"movement {kind}" + (" walk" if group.walk else "")
        if len(path) > 1:
            yield kind, element("path", d=frame.path(path), class_=style)
            if kind != "red" and not group.walk:
                yield kind, _draw_head(path, frame, kind)


def _draw_head(path: Sequence[tuple[float, float]], frame: PictureFrame, kind: str) -> Markup:
    """Triangle at the end of a movement."""
    (x0, y0), (x1, y1) = path[-2:]
    length = max(hypot(x1 - x0, y1 - y0), 1e-9)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    size = 7.0 / frame.scale
    tip = (x1 + ux * size * 0.6, y1 + uy * size * 0.6)
    left = (x1 - ux * size * 0.6 - uy * size * 0.5, y1 - uy * size * 0.6 + ux * size * 0.5)
    right = (x1 - ux * size * 0.6 + uy * size * 0.5, y1 - uy * size * 0.6 - ux * size * 0.5)
    return element("path", d=f"{frame.path([tip, left, right])} Z", class_=f"arrow {kind}")


def _draw_loop(light: LightProgram, detector: ShownDetector, frame: PictureFrame) -> Markup:
    """A loop in its lane, or a circle where people wait."""
    title = _detector_title(light, detector)
    if detector.call:
        x, y = frame.point(*detector.place[0])
        return element("circle", title, cx=x, cy=y, r=5, class_="loop call",
                       data_detector=detector.id)  # fmt: skip
    (x0, y0), (x1, y1) = detector.place[0], detector.place[-1]
    length = max(hypot(x1 - x0, y1 - y0), 1e-9)
    # A loop of two metres must be seen in a picture of a hundred.
    longer = max(6.0 / frame.scale - length, 0.0) / 2.0
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    nx, ny = -uy * _LOOP_WIDTH / 2.0, ux * _LOOP_WIDTH / 2.0
    a = x0 - ux * longer, y0 - uy * longer
    b = x1 + ux * longer, y1 + uy * longer
    corners = [(a[0] + nx, a[1] + ny), (b[0] + nx, b[1] + ny),
               (b[0] - nx, b[1] - ny), (a[0] - nx, a[1] - ny)]  # fmt: skip
    return element("path", title, d=f"{frame.path(corners)} Z", class_="loop",
                   data_detector=detector.id)  # fmt: skip


def _bus_area(light: LightProgram, area: ShownDetector, frame: PictureFrame) -> Markup:
    """A band along the lane; the picture may end before it does."""
    band = shapely.LineString(area.place).buffer(_BAND_WIDTH / 2.0, cap_style="flat")
    ring = shapely.get_coordinates(shapely.get_exterior_ring(band))
    return element("path", _detector_title(light, area), d=f"{frame.path(ring[:-1])} Z",
                   class_="bus-area", data_detector=area.id)  # fmt: skip


def _detector_title(light: LightProgram, detector: ShownDetector) -> Markup:
    words = f"{detector_label(light, detector)}: {detector_purpose(detector)}"
    return element("title", words)


def _group_name(group: ShownGroup, frame: PictureFrame) -> Markup:
    """Name beside the stop lines of a group; of a crossing in its middle."""
    ends = [path for path in group.paths if len(path) > 1]
    if group.walk:
        path = ends[0]
        x, y = (path[0][0] + path[-1][0]) / 2.0, (path[0][1] + path[-1][1]) / 2.0
    else:
        places = [_point_before(path, _LABEL_AT) for path in ends]
        x = sum(x for x, _ in places) / len(places)
        y = sum(y for _, y in places) / len(places)
    at_x, at_y = frame.point(x, y)
    return element("text", group.id, x=at_x, y=at_y + 4.0, text_anchor="middle", class_="group")


def _detector_names(
    light: LightProgram, detectors: Sequence[ShownDetector], frame: PictureFrame
) -> Iterator[Markup]:
    """Names of detectors behind them, those of one detector in several lanes once."""
    named: dict[str, list[ShownDetector]] = {}
    for detector in detectors:
        named.setdefault(detector_label(light, detector), []).append(detector)
    taken: list[tuple[float, float]] = []
    for label, some in named.items():
        ends = [frame.point(*detector.place[0]) for detector in some]
        x, y = (sum(values) / len(ends) for values in zip(*ends, strict=True))
        anchor = "middle"
        # Away from the junction: above or below, or where a road leads to the side, beside.
        across, along = x - frame.side / 2.0, y - frame.side / 2.0
        if abs(across) > abs(along) and not some[0].call:
            anchor = "start" if across > 0.0 else "end"
            x, y = x + (7.0 if across > 0.0 else -7.0), y + 4.0
        else:
            step = -1.0 if along < 0.0 else 1.0
            y += 4.0 + 12.0 * step
            while any(abs(x - other) < _ROOM and abs(y - at) < 11.0 for other, at in taken):
                y += 12.0 * step
        taken.append((x, y))
        yield element("text", label, x=x, y=y, text_anchor=anchor, class_="detector")
