"""A ``.net.xml`` as its file says, for :mod:`odscen.convert.verify.fidelity`; nothing looked up.

A reader of its own, so that the check shares nothing with what wrote the network. Ids serve only to
follow references within the file. Source: sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html.
"""

from __future__ import annotations

from collections import defaultdict
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.errors import InputError
from odscen.base.xml_reading import read_xml

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from lxml import etree

    from odscen.base.arrays import FloatArray


MOTOR_CLASSES = (
    *("passenger", "bus", "taxi", "hov", "truck", "trailer", "delivery", "motorcycle"),
    "emergency",
)
"""A lane open to one of these is a driving lane."""


@dataclass(frozen=True, slots=True, eq=False)
class NetFileLane:
    """One ``<lane>``; ``shape`` is ``(K, 2)``, metres, OpenDRIVE frame (netOffset taken away)."""

    id: str
    function: str
    width: float
    shape: FloatArray
    drives: bool
    cars: bool
    walks: bool


class NetFileLink(NamedTuple):
    """One ``<connection>``; lanes by id; what is absent is empty, or -1."""

    source: str
    target: str
    via: str
    tl: str
    link_index: int


class NetFileJunction(NamedTuple):
    """One ``<junction>`` but the internal ones.

    ``foes[i]`` are the links that conflict with i, ``yields[i]`` those that it gives way to.
    """

    id: str
    type: str
    incoming: tuple[str, ...]
    foes: dict[int, frozenset[int]]
    yields: dict[int, frozenset[int]]


class NetFileProgram(NamedTuple):
    """One ``<tlLogic>``; ``states`` has the state of each phase, a letter per link index."""

    tl: str
    states: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class NetConnections:
    """What leads where in a network; ``functions`` of edges, by the ids of their lanes."""

    functions: dict[str, str]
    links: tuple[NetFileLink, ...]
    junctions: tuple[NetFileJunction, ...]

    def request_rows(self) -> dict[str, list[NetFileLink]]:
        """Links of each junction (by its id) in the order of its ``<request>`` rows.

        As SUMO counts them: by incoming lane, then in the order of the connections in the file;
        of the walking areas only the links onto crossings.
        """
        leaving: dict[str, list[NetFileLink]] = defaultdict(list)
        for link in self.links:
            leaving[link.source].append(link)
        return {
            junction.id: [
                link
                for lane in junction.incoming
                for link in leaving[lane]
                if self._is_requested(link)
            ]
            for junction in self.junctions
        }

    def _is_requested(self, link: NetFileLink) -> bool:
        source, target = self.functions[link.source], self.functions[link.target]
        if source == "walkingarea":
            return target == "crossing"
        return target != "walkingarea"


@dataclass(frozen=True, slots=True, eq=False)
class NetFile(NetConnections):
    """What the check needs of a network; ``lanes`` by id, in the order of the file."""

    left_hand: bool
    lanes: dict[str, NetFileLane]
    programs: tuple[NetFileProgram, ...]

    def driving(self, *functions: str) -> list[NetFileLane]:
        """Lanes that motor vehicles may use, of edges of the given functions."""
        return [ln for ln in self.lanes.values() if ln.drives and ln.function in functions]


def read_net(content: bytes, *, offset: tuple[float, float] | None = None) -> NetFile:
    """Read a ``.net.xml``.

    Parameters
    ----------
    offset
        SUMO position minus OpenDRIVE position, metres; the file's netOffset if not given.

    Raises
    ------
    InputError
        If it is not a complete SUMO network.
    """
    root = read_xml(content, huge=True)
    known = read_connections(root)
    with _refuse_unreadable():
        return NetFile(
            functions=known.functions,
            links=known.links,
            junctions=known.junctions,
            left_hand=root.get("lefthand") == "true",
            lanes=_read_lanes(root, offset),
            programs=tuple(
                NetFileProgram(
                    _required_text(logic, "id"),
                    tuple(_required_text(p, "state") for p in logic.iterfind("phase")),
                )
                for logic in root.iterfind("tlLogic")
            ),
        )


def read_connections(root: etree._Element) -> NetConnections:
    """Read what leads where alone: with all shapes it takes twice as long.

    Raises
    ------
    InputError
        If it is not a complete SUMO network.
    """
    with _refuse_unreadable():
        edges: dict[str, dict[str, str]] = {}
        functions: dict[str, str] = {}
        for edge in root.iterfind("edge"):
            ids = edges.setdefault(_required_text(edge, "id"), {})
            for lane in edge.iterfind("lane"):
                lane_id = ids[_required_text(lane, "index")] = _required_text(lane, "id")
                functions[lane_id] = edge.get("function", "normal")
        return NetConnections(
            functions, tuple(_read_links(root, edges, functions)), tuple(_read_junctions(root))
        )


@contextmanager
def _refuse_unreadable() -> Iterator[None]:
    try:
        yield
    except (LookupError, ValueError) as error:
        raise InputError(
            f"the SUMO network cannot be read: {type(error).__name__}: {error}"
        ) from error


def _read_lanes(root: etree._Element, given: tuple[float, float] | None) -> dict[str, NetFileLane]:
    location = root.find("location")
    if location is None:
        raise ValueError("<location> is missing")
    text = _required_text(location, "netOffset")
    offset = np.array(given or [float(part) for part in text.split(",")])
    lanes: dict[str, NetFileLane] = {}
    for edge in root.iterfind("edge"):
        for lane in edge.iterfind("lane"):
            lane_id = _required_text(lane, "id")
            lanes[lane_id] = NetFileLane(
                id=lane_id,
                function=edge.get("function", "normal"),
                width=float(lane.get("width", "3.2")),
                shape=_parse_shape(_required_text(lane, "shape"), offset),
                drives=any(_lane_allows(lane, vclass) for vclass in MOTOR_CLASSES),
                cars=_lane_allows(lane, "passenger"),
                walks=_lane_allows(lane, "pedestrian"),
            )
    return lanes


def _parse_shape(text: str, offset: FloatArray) -> FloatArray:
    shape = np.array([[float(part) for part in xyz.split(",")[:2]] for xyz in text.split()])
    shape = shape - offset
    if shape.ndim != 2 or not np.isfinite(shape).all():
        raise ValueError(f"{text[:40]!r} is not the shape of a lane")
    return shape


def _required_text(element: etree._Element, name: str) -> str:
    value = element.get(name)
    if value is None:
        raise KeyError(f"attribute {name} of <{element.tag}> is missing")
    return value


def _lane_allows(lane: etree._Element, vclass: str) -> bool:
    allow, disallow = lane.get("allow"), lane.get("disallow")
    if allow is not None:
        return bool({"all", vclass} & set(allow.split()))
    return disallow is None or not {"all", vclass} & set(disallow.split())


def _read_links(
    root: etree._Element, edges: dict[str, dict[str, str]], known: Mapping[str, str]
) -> Iterator[NetFileLink]:
    for link in root.iterfind("connection"):
        via = link.get("via", "")
        if via and via not in known:
            raise ValueError(f"connection via {via}, which is no lane")
        source = edges[_required_text(link, "from")]
        if link.get("fromLane") not in source and known.get(next(iter(source.values()), "")) != (
            "normal"
        ):
            # Networks have inner lanes that were taken out with their connections left; SUMO
            # passes over these, too.
            continue
        yield NetFileLink(
            edges[_required_text(link, "from")][_required_text(link, "fromLane")],
            edges[_required_text(link, "to")][_required_text(link, "toLane")],
            via,
            link.get("tl", ""),
            int(link.get("linkIndex", "-1")),
        )


def _read_junctions(root: etree._Element) -> Iterator[NetFileJunction]:
    for junction in root.iterfind("junction"):
        if junction.get("type") == "internal":
            continue
        requests = list(junction.iterfind("request"))
        yield NetFileJunction(
            _required_text(junction, "id"),
            junction.get("type", ""),
            tuple(junction.get("incLanes", "").split()),
            {
                int(_required_text(r, "index")): _links_of(_required_text(r, "foes"))
                for r in requests
            },
            {
                int(_required_text(r, "index")): _links_of(_required_text(r, "response"))
                for r in requests
            },
        )


def _links_of(bits: str) -> frozenset[int]:
    """Links that a row of a request names; the last letter stands for link 0."""
    return frozenset(k for k, letter in enumerate(reversed(bits)) if letter == "1")
