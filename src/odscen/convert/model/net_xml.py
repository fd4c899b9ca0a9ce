"""Text of ``.net.xml``: what a :class:`~odscen.convert.model.net.Net` is in SUMO's words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import numpy as np

from odscen.convert.model.curve_speed import HEAVY_CLASSES
from odscen.convert.model.extended_greens import EXTENDED_PARAMS, longer_by
from odscen.convert.model.net import DIGITS, INTERNAL, NORMAL
from odscen.convert.model.net_shapes import border

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from odscen.base.arrays import FloatArray
    from odscen.convert.model.net import Net, NetEdge, NetJunction, NetLink, TrafficLight
    from odscen.convert.model.net_shapes import LinkPath

VERSION = "1.20"
"""Version of the network format."""


def net_xml(net: Net) -> bytes:
    """Text of ``net.net.xml``; the same network gives the same bytes."""
    return _NetworkWriter(net).whole()


def _curve_type(speed: float) -> str:
    """Type of edges where trucks and buses are slower: SUMO knows restrictions of types only."""
    return f"curve-{speed:.2f}"


class _NetworkWriter:
    def __init__(self, net: Net) -> None:
        self._net = net

    def whole(self) -> bytes:
        net = self._net
        x0, y0, x1, y1 = net.boundary
        offset = f"{net.offset[0]:.2f},{net.offset[1]:.2f}"
        lines = [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<net version="{VERSION}" junctionCornerDetail="5"'
            + (' lefthand="true"' if net.lefthand else "")
            + (' walkingareas="true"' if net.counts()["walking_areas"] else "")
            + ' limitTurnSpeed="5.50">',
            f'    <location netOffset="{offset}" convBoundary="{x0},{y0},{x1},{y1}"'
            ' origBoundary="-10000000000.00,-10000000000.00,10000000000.00,10000000000.00"'
            ' projParameter="!"/>',
        ]
        inner = [edge for edge in net.edges if edge.function != NORMAL]
        outer = [edge for edge in net.edges if edge.function == NORMAL]
        for speed in sorted({edge.heavy_speed for edge in net.edges} - {math.inf}):
            lines.append(f'    <type id="{_curve_type(speed)}">')
            lines += [
                f'        <restriction vClass="{name}" speed="{speed:.2f}"/>'
                for name in HEAVY_CLASSES
            ]
            lines.append("    </type>")
        for edge in (*inner, *outer):
            lines += self._edge_lines(edge)
        for light in net.lights:
            lines += _light_lines(light)
        for junction in net.junctions:
            lines += self._junction_lines(junction)
        for junction in net.inner_junctions:
            lines += self._junction_lines(junction)
        paths = net.link_paths()
        inside = {edge.id for edge in inner}
        for link in net.links:
            own = None if link.source in inside or link.via is None else paths[link.via]
            lines.append(self._link_lines(link, own))
        for nodes, edges in net.roundabouts:
            lines.append(f'    <roundabout nodes="{" ".join(nodes)}" edges="{" ".join(edges)}"/>')
        lines += ["</net>", ""]
        return "\n".join(lines).encode()

    def _edge_lines(self, edge: NetEdge) -> Iterator[str]:
        ends = f' from="{edge.start}" to="{edge.end}"' if edge.function == NORMAL else ""
        kind = f' function="{edge.function}"' if edge.function != NORMAL else ""
        rank = f' priority="{edge.priority}"' if edge.function == NORMAL else ""
        name = f' name="{_quote_attribute(edge.name)}"' if edge.name else ""
        curve = "" if edge.heavy_speed == math.inf else f' type="{_curve_type(edge.heavy_speed)}"'
        crossed = f' crossingEdges="{" ".join(edge.crosses)}"' if edge.crosses else ""
        shape, custom = "", ' customShape="1"'
        if edge.function == NORMAL:
            inmost, side = edge.lanes[-1], -0.5 if self._net.lefthand else 0.5
            shape = f' shape="{self._format_shape(border(inmost.shape, side * inmost.width))}"'
        elif edge.function == INTERNAL:
            custom = ""
        yield f'    <edge id="{edge.id}"{ends}{kind}{rank}{curve}{name}{crossed}{shape}>'
        for lane in edge.lanes:
            change = "" if lane.change_left else ' changeLeft="emergency"'
            change += "" if lane.change_right else ' changeRight="emergency"'
            kind = f' type="{lane.type}"' if lane.type else ""
            text = (
                f'        <lane id="{lane.id}" index="{lane.index}"'
                f' allow="{" ".join(sorted(lane.allowed))}"{change} speed="{lane.speed:.2f}"'
                f' length="{lane.length:.{DIGITS}f}" width="{lane.width:.2f}"{kind}{custom}'
                f' shape="{self._format_shape(lane.shape)}"'
            )
            if lane.xodr:
                yield text + ">"
                xodr = _quote_attribute(" ".join(lane.xodr))
                yield f'            <param key="origId" value="{xodr}"/>'
                yield "        </lane>"
            else:
                yield text + "/>"
        yield "    </edge>"

    def _junction_lines(self, junction: NetJunction) -> Iterator[str]:
        x, y = junction.place[0] + self._net.offset[0], junction.place[1] + self._net.offset[1]
        z = "" if self._net.flat else f' z="{junction.place[2]:.{DIGITS}f}"'
        custom = "" if junction.type == INTERNAL else ' customShape="1"'
        text = (
            f'    <junction id="{junction.id}" type="{junction.type}"{custom} x="{x:.{DIGITS}f}"'
            f' y="{y:.{DIGITS}f}"{z} incLanes="{" ".join(junction.incoming)}"'
            f' intLanes="{" ".join(junction.inner)}" shape="{self._format_shape(junction.outline)}"'
        )
        if not junction.requests and not junction.xodr:
            yield text + "/>"
            return
        yield text + ">"
        count = len(junction.requests)
        for index, request in enumerate(junction.requests):
            yield (
                f'        <request index="{index}"'
                f' response="{_format_bits(request.yields_to, count)}"'
                f' foes="{_format_bits(request.foes, count)}" cont="{int(request.waits_inside)}"/>'
            )
        if junction.xodr:
            yield f'        <param key="opendrive" value="{_quote_attribute(junction.xodr)}"/>'
        yield "    </junction>"

    def _link_lines(self, link: NetLink, path: LinkPath | None) -> str:
        via = f' via="{link.via}"' if link.via else ""
        light = f' tl="{link.light}" linkIndex="{link.light_index}"' if link.light else ""
        kept = ""
        if path is not None:
            waits = "" if path.waits_at is None else f' contPos="{path.waits_at:.{DIGITS}f}"'
            kept = f'{waits} speed="{path.speed:.2f}" shape="{self._format_shape(path.shape)}"'
        sight = "" if link.visibility is None else f' visibility="{link.visibility:g}"'
        return (
            f'    <connection from="{link.source}" to="{link.target}" fromLane="{link.source_lane}"'
            f' toLane="{link.target_lane}"{via}{light}{sight} dir="{link.direction}"'
            f' state="{link.state}"{kept}/>'
        )

    def _format_shape(self, shape: FloatArray) -> str:
        points = shape + np.array([*self._net.offset, 0.0])
        if self._net.flat:
            return " ".join([f"{x:.4f},{y:.4f}" for x, y, _ in points.tolist()])
        return " ".join([f"{x:.4f},{y:.4f},{z:.4f}" for x, y, z in points.tolist()])


def _light_lines(light: TrafficLight) -> Iterator[str]:
    """Lines of one ``<tlLogic>``."""
    more = longer_by(light.phases, sum(phase.duration for phase in light.phases))
    kind = "actuated" if more else "static"
    yield (
        f'    <tlLogic id="{light.id}" type="{kind}" programID="{light.program}"'
        f' offset="{light.offset:g}">'
    )
    for phase in light.phases:
        bounds = ""
        if more and phase.most > phase.least:
            longest = phase.duration + more
            bounds = f' minDur="{phase.duration:g}" maxDur="{longest:g}"'
        name = f' name="{_quote_attribute(phase.name)}"' if phase.name else ""
        yield f'        <phase duration="{phase.duration:g}" state="{phase.state}"{bounds}{name}/>'
    for index, signals in enumerate(light.signals):
        if signals:
            value = _quote_attribute(" ".join(signals))
            yield f'        <param key="linkSignalID:{index}" value="{value}"/>'
    for key, value in (EXTENDED_PARAMS if more else {}).items():
        yield f'        <param key="{key}" value="{value}"/>'
    yield "    </tlLogic>"


def _format_bits(indices: Iterable[int], count: int) -> str:
    """Indices as SUMO writes them: the last letter is link 0."""
    letters = ["0"] * count
    for index in indices:
        letters[count - 1 - index] = "1"
    return "".join(letters)


def _quote_attribute(text: str) -> str:
    """Text of an attribute on one line."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return escape(plain, {'"': "&quot;"})
