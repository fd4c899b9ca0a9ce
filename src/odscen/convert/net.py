"""A SUMO network read from its ``.net.xml``, with shapes moved into the OpenDRIVE frame.

Source: sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html. Only what odscen needs is read; ids are
kept as they are and never taken apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from odscen.errors import NetconvertError
from odscen.ids import SumoEdgeId, SumoLaneId

FloatArray = NDArray[np.float64]

NORMAL = "normal"
INTERNAL = "internal"
CROSSING = "crossing"
WALKING_AREA = "walkingarea"


VCLASSES = frozenset(
    {"private", "emergency", "authority", "army", "vip", "pedestrian", "passenger", "hov", "taxi"}
    | {"bus", "coach", "delivery", "truck", "trailer", "motorcycle", "moped", "bicycle", "evehicle"}
    | {"tram", "rail_urban", "rail", "rail_electric", "rail_fast", "ship", "container", "cable_car"}
    | {"subway", "aircraft", "wheelchair", "scooter", "drone", "custom1", "custom2"}
)
"""SUMO's vehicle classes (sumo.dlr.de/docs/Vehicle_Type_Parameter_Defaults.html)."""


@dataclass(frozen=True, slots=True, eq=False)
class NetLane:
    """One ``<lane>``.

    Attributes
    ----------
    index
        0 is the outermost lane (the rightmost in right-hand traffic).
    length
        ``length`` of the file, metres: what SUMO's positions run to, whatever the shape measures.
    allowed
        Vehicle classes that may use the lane; ``None`` for all.
    shape
        Shape ``(K, 3)``, metres, OpenDRIVE frame (``netOffset`` taken away); z is 0 in flat nets.
    """

    id: SumoLaneId
    edge: SumoEdgeId
    index: int
    length: float
    speed: float
    width: float
    allowed: frozenset[str] | None
    shape: FloatArray

    def allows(self, vclass: str) -> bool:
        """Whether vehicles of a class may use the lane."""
        return self.allowed is None or vclass in self.allowed


@dataclass(frozen=True, slots=True)
class NetEdge:
    """One ``<edge>``; ``function`` is normal, internal, crossing, walkingarea or connector."""

    id: SumoEdgeId
    function: str
    from_junction: str
    to_junction: str
    lanes: tuple[SumoLaneId, ...]
    crosses: tuple[SumoEdgeId, ...] = ()


class NetConnection(NamedTuple):
    """One ``<connection>``; ``via`` is the internal lane, ``tl`` the traffic light, or empty."""

    from_lane: SumoLaneId
    to_lane: SumoLaneId
    via: SumoLaneId
    tl: str
    link_index: int
    direction: str


class NetJunction(NamedTuple):
    """One ``<junction>`` that is not internal."""

    id: str
    type: str
    x: float
    y: float


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """A SUMO network.

    Attributes
    ----------
    net_offset
        SUMO position minus OpenDRIVE position, metres.
    boundary
        ``convBoundary``: x_min, y_min, x_max, y_max in SUMO's frame, metres.
    tl_logics
        Ids of the traffic-light programs.
    """

    net_offset: tuple[float, float]
    boundary: tuple[float, float, float, float]
    lefthand: bool
    edges: dict[SumoEdgeId, NetEdge]
    lanes: dict[SumoLaneId, NetLane]
    connections: tuple[NetConnection, ...]
    junctions: dict[str, NetJunction]
    tl_logics: tuple[str, ...]

    @classmethod
    def parse(cls, content: bytes) -> Net:
        """Read a ``.net.xml``.

        Raises
        ------
        NetconvertError
            If it is not a complete SUMO network.
        """
        parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)
        try:
            root = etree.fromstring(content, parser)
            return _read(root)
        except (etree.XMLSyntaxError, LookupError, ValueError) as error:
            msg = f"netconvert's network cannot be read: {type(error).__name__}: {error}"
            raise NetconvertError(msg) from error

    def counts(self) -> dict[str, int]:
        """Numbers for the catalogue; edges and lanes are those outside junctions."""
        functions = [edge.function for edge in self.edges.values()]
        return {
            "edges": functions.count(NORMAL),
            "lanes": sum(
                len(edge.lanes) for edge in self.edges.values() if edge.function == NORMAL
            ),
            "junctions": len(self.junctions),
            "tl_logics": len(self.tl_logics),
            "crossings": functions.count(CROSSING),
            "walking_areas": functions.count(WALKING_AREA),
        }


def _read(root: etree._Element) -> Net:
    location = root.find("location")
    if location is None:
        msg = "<location> is missing"
        raise ValueError(msg)
    offset = [float(value) for value in _text(location, "netOffset").split(",")]
    bounds = [float(value) for value in _text(location, "convBoundary").split(",")]
    edges, lanes = _edges(root, (offset[0], offset[1]))
    junctions = [
        NetJunction(_text(e, "id"), _text(e, "type"), float(_text(e, "x")), float(_text(e, "y")))
        for e in root.iterfind("junction")
        if e.get("type") != INTERNAL
    ]
    return Net(
        net_offset=(offset[0], offset[1]),
        boundary=(bounds[0], bounds[1], bounds[2], bounds[3]),
        lefthand=root.get("lefthand") == "true",
        edges=edges,
        lanes=lanes,
        connections=tuple(_connections(root, edges)),
        junctions={junction.id: junction for junction in junctions},
        tl_logics=tuple(dict.fromkeys(_text(e, "id") for e in root.iterfind("tlLogic"))),
    )


def _text(element: etree._Element, name: str) -> str:
    value = element.get(name)
    if value is None:
        msg = f"attribute {name} of <{element.tag}> is missing"
        raise KeyError(msg)
    return value


def _allowed(allow: str | None, disallow: str | None) -> frozenset[str] | None:
    """Vehicle classes by the attributes ``allow`` and ``disallow``; without both everybody."""
    if allow is not None:
        classes = frozenset(allow.split())
        return None if "all" in classes else classes
    if disallow is not None:
        classes = frozenset(disallow.split())
        return frozenset() if "all" in classes else VCLASSES - classes
    return None


def _edges(
    root: etree._Element, offset: tuple[float, float]
) -> tuple[dict[SumoEdgeId, NetEdge], dict[SumoLaneId, NetLane]]:
    edges: dict[SumoEdgeId, NetEdge] = {}
    elements: list[tuple[SumoEdgeId, etree._Element]] = []
    for element in root.iterfind("edge"):
        edge_id = SumoEdgeId(_text(element, "id"))
        own = element.findall("lane")
        elements.extend((edge_id, lane) for lane in own)
        edges[edge_id] = NetEdge(
            edge_id,
            element.get("function", NORMAL),
            element.get("from", ""),
            element.get("to", ""),
            tuple(SumoLaneId(_text(lane, "id")) for lane in own),
            tuple(SumoEdgeId(crossed) for crossed in element.get("crossingEdges", "").split()),
        )
    shapes = _shapes([_text(lane, "shape") for _, lane in elements], offset)
    permissions: dict[tuple[str | None, str | None], frozenset[str] | None] = {}
    lanes: dict[SumoLaneId, NetLane] = {}
    for (edge_id, lane), shape in zip(elements, shapes, strict=True):
        given = (lane.get("allow"), lane.get("disallow"))
        if given not in permissions:
            permissions[given] = _allowed(*given)
        lane_id = SumoLaneId(_text(lane, "id"))
        lanes[lane_id] = NetLane(
            lane_id,
            edge_id,
            int(_text(lane, "index")),
            float(_text(lane, "length")),
            float(_text(lane, "speed")),
            float(lane.get("width", "3.2")),
            permissions[given],
            shape,
        )
    return edges, lanes


def _shapes(texts: list[str], offset: tuple[float, float]) -> list[FloatArray]:
    """Shapes from their texts, all numbers in one go: a town has some 100,000 of them."""
    texts = [_even(text) for text in texts]
    counts = [text.count(" ") + 1 for text in texts]
    widths = [text.count(",") // count + 1 for text, count in zip(texts, counts, strict=True)]
    numbers = np.fromstring(" ".join(texts).replace(",", " "), sep=" ", dtype=np.float64)
    if not np.isfinite(numbers).all():
        msg = "a lane's shape is not finite"
        raise ValueError(msg)
    shapes: list[FloatArray] = []
    start = 0
    for count, width in zip(counts, widths, strict=True):
        shape = np.zeros((count, 3))
        shape[:, :width] = numbers[start : start + count * width].reshape(count, width)
        shape[:, :2] -= offset
        shapes.append(shape)
        start += count * width
    return shapes


def _even(text: str) -> str:
    """Write out heights of zero, which SUMO leaves out even within a shape."""
    if text.count(",") % (text.count(" ") + 1) == 0:
        return text
    return " ".join(f"{p},0" if p.count(",") == 1 else p for p in text.split(" "))


def _connections(root: etree._Element, edges: dict[SumoEdgeId, NetEdge]) -> list[NetConnection]:
    def lane(edge: str, index: str) -> SumoLaneId:
        return edges[SumoEdgeId(edge)].lanes[int(index)]

    return [
        NetConnection(
            lane(_text(e, "from"), _text(e, "fromLane")),
            lane(_text(e, "to"), _text(e, "toLane")),
            SumoLaneId(e.get("via", "")),
            e.get("tl", ""),
            int(e.get("linkIndex", "-1")),
            e.get("dir", ""),
        )
        for e in root.iterfind("connection")
    ]
