"""A SUMO network from outside as values: read with sumolib, moved into the OpenDRIVE frame.

Ids are kept as they are and never taken apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from lxml import etree

from odscen.base.errors import InputError
from odscen.base.ids import SumoEdgeId, SumoLaneId
from odscen.base.xml_reading import read_xml
from odscen.convert.model.extended_greens import CONTROL_PARAM
from odscen.convert.model.net import CROSSING, NORMAL, STAGE, WALKING_AREA, Phase, Request

if TYPE_CHECKING:
    from collections.abc import Container, Sequence

    from odscen.base.arrays import FloatArray

_SIGNALS = "linkSignalID:"
"""Parameters of a ``<tlLogic>`` that name the OpenDRIVE signals behind a link."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedLane:
    """One ``<lane>``.

    Attributes
    ----------
    length
        What SUMO's positions run to, metres, whatever the shape measures.
    allowed
        Vehicle classes that may use the lane; ``None`` for all.
    shape
        Shape ``(K, 3)``, metres, OpenDRIVE frame; z is 0 in flat networks.
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
class ImportedEdge:
    """One ``<edge>``; ``start`` and ``end`` are junctions, empty within a junction.

    ``crossed`` are the edges that a crossing leads over.
    """

    id: SumoEdgeId
    function: str
    start: str
    end: str
    lanes: tuple[SumoLaneId, ...]
    crossed: tuple[SumoEdgeId, ...] = ()


class ImportedLink(NamedTuple):
    """One ``<connection>``.

    ``via`` is the first internal lane, ``light`` a light, or empty; ``letters`` are the places in
    the light's states: one, two of a crossing that shows each direction its own.
    """

    source: SumoLaneId
    target: SumoLaneId
    via: SumoLaneId
    light: str
    letters: tuple[int, ...] = ()


class ImportedRights(NamedTuple):
    """Right of way in a junction.

    ``incoming`` are its lanes in the order in which it counts links, ``requests`` those of its
    links; none where nobody gives way.
    """

    junction: str
    incoming: tuple[SumoLaneId, ...]
    requests: tuple[Request, ...]


@dataclass(frozen=True, slots=True)
class ImportedLight:
    """One traffic light with the program that SUMO runs: the last one of the file."""

    id: str
    phases: tuple[Phase, ...]
    offset: float
    signals: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class ImportedNet:
    """A SUMO network; ``offset`` is SUMO position minus OpenDRIVE position, metres.

    ``boundary`` is x_min, y_min, x_max, y_max in SUMO's frame, metres; ``lit`` has the right of way
    of junctions with lights.
    """

    offset: tuple[float, float]
    boundary: tuple[float, float, float, float]
    lefthand: bool
    edges: dict[SumoEdgeId, ImportedEdge]
    lanes: dict[SumoLaneId, ImportedLane]
    links: tuple[ImportedLink, ...]
    junctions: int
    lights: tuple[ImportedLight, ...]
    lit: tuple[ImportedRights, ...] = ()

    def function(self, lane: SumoLaneId) -> str:
        """Function of the edge of a lane."""
        return self.edges[self.lanes[lane].edge].function

    def counts(self) -> dict[str, int]:
        """Numbers for the catalogue; edges and lanes are those outside junctions."""
        functions = [edge.function for edge in self.edges.values()]
        normal = [edge for edge in self.edges.values() if edge.function == NORMAL]
        return {
            "edges": len(normal),
            "lanes": sum(len(edge.lanes) for edge in normal),
            "junctions": self.junctions,
            "tl_logics": len(self.lights),
            "crossings": functions.count(CROSSING),
            "walking_areas": functions.count(WALKING_AREA),
        }

    def walk_links(self) -> tuple[tuple[SumoEdgeId, SumoEdgeId], ...]:
        """Pairs of edges between which a person can walk, smaller id first, sorted.

        Through walking areas and crossings where a junction has them; else SUMO lets persons change
        between all edges for walking that meet at the junction.
        """
        special = {CROSSING, WALKING_AREA}
        walkable = {lane.edge for lane in self.lanes.values() if lane.allows("pedestrian")}
        pairs: set[tuple[SumoEdgeId, SumoEdgeId]] = set()
        served: set[str] = set()
        for link in self.links:
            one, other = (self.edges[self.lanes[lane].edge] for lane in link[:2])
            if {one.id, other.id} <= walkable and special & {one.function, other.function}:
                pairs.add((min(one.id, other.id), max(one.id, other.id)))
                served |= {one.end, other.start}
        meeting: dict[str, set[SumoEdgeId]] = {}
        for edge in self.edges.values():
            if edge.function == NORMAL and edge.id in walkable:
                for junction in {edge.start, edge.end} - served:
                    meeting.setdefault(junction, set()).add(edge.id)
        for edges in meeting.values():
            pairs.update(combinations(sorted(edges), 2))
        return tuple(sorted(pairs))


def read_network(content: bytes, *, offset: tuple[float, float] | None = None) -> ImportedNet:
    """Read a ``.net.xml``.

    Parameters
    ----------
    offset
        SUMO position minus OpenDRIVE position, metres; the file's netOffset if not given.

    Raises
    ------
    InputError
        If it is no network of SUMO, not complete, or too old for sumolib.
    """
    root = read_xml(content, huge=True, bare=True)
    if root.tag != "net":
        raise InputError(
            f"the SUMO network cannot be read: its first element is <{root.tag}>, not <net>"
        )
    if root.find("location") is None:
        raise InputError("the SUMO network cannot be read: <location> is missing")
    try:
        return _import_net(
            _with_sumolib(root), lefthand=root.get("lefthand") == "true", given=offset
        )
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        words = f"there is no {error}" if isinstance(error, KeyError) else str(error)
        raise InputError(f"the SUMO network cannot be read: {words}") from error


def _with_sumolib(root: etree._Element) -> Any:
    """Let sumolib's reader see the elements; the parser is ours, without entities and network."""
    from sumolib.net import NetReader

    reader = NetReader(
        withPrograms=True, withInternal=True, withPedestrianConnections=True, withFoes=True
    )
    for event, element in etree.iterwalk(root, events=("start", "end")):
        if event == "start":
            reader.startElement(element.tag, element.attrib)
        else:
            reader.endElement(element.tag)
    reader.endDocument()
    return reader.getNet()


def _import_net(net: Any, *, lefthand: bool, given: tuple[float, float] | None) -> ImportedNet:
    offset = given or tuple(float(value) for value in net.getLocationOffset())
    x0, y0, x1, y1 = (float(value) for value in net._location["convBoundary"].split(","))
    edges: dict[SumoEdgeId, ImportedEdge] = {}
    lanes: dict[SumoLaneId, ImportedLane] = {}
    permissions: dict[frozenset[str], frozenset[str] | None] = {}
    for edge in net.getEdges(withInternal=True):
        own = [_import_lane(edge, lane, offset, permissions) for lane in edge.getLanes()]
        lanes |= {lane.id: lane for lane in own}
        function = edge.getFunction() or NORMAL
        ends = ("", "")
        if function == NORMAL:
            ends = edge.getFromNode().getID(), edge.getToNode().getID()
        name = SumoEdgeId(edge.getID())
        crossed = tuple(SumoEdgeId(other.getID()) for other in edge.getCrossingEdges())
        edges[name] = ImportedEdge(name, function, *ends, tuple(lane.id for lane in own), crossed)
    if not any(edge.function == NORMAL for edge in edges.values()):
        raise ValueError("it has no edges")
    links = _import_links(net, lanes)
    return ImportedNet(
        offset=(offset[0], offset[1]),
        boundary=(x0, y0, x1, y1),
        lefthand=lefthand,
        edges=edges,
        lanes=lanes,
        links=links,
        junctions=len(net.getNodes()),
        lights=tuple(
            _import_light(light) for light in net.getTrafficLights() if light.getPrograms()
        ),
        lit=_import_rights(net, {link.source for link in links if link.light}),
    )


def _import_lane(
    edge: Any,
    lane: Any,
    offset: Sequence[float],
    permissions: dict[frozenset[str], frozenset[str] | None],
) -> ImportedLane:
    shape = np.array(lane.getShape3D(), dtype=np.float64).reshape(-1, 3)
    if not len(shape) or not np.isfinite(shape).all():
        raise ValueError(f"lane {lane.getID()} has no usable shape")
    shape = shape - np.array([*offset, 0.0])
    length, speed, width = float(lane.getLength()), float(lane.getSpeed()), float(lane.getWidth())
    if not (0.0 < length < math.inf and 0.0 <= speed < math.inf and 0.0 <= width < math.inf):
        raise ValueError(
            f"lane {lane.getID()} has no usable length, speed or width: {length, speed, width}"
        )
    classes = frozenset(lane.getPermissions())
    if classes not in permissions:
        permissions[classes] = _permitted_classes(classes)
    return ImportedLane(
        SumoLaneId(lane.getID()),
        SumoEdgeId(edge.getID()),
        int(lane.getIndex()),
        length,
        speed,
        width,
        permissions[classes],
        shape,
    )


def _permitted_classes(classes: frozenset[str]) -> frozenset[str] | None:
    """Vehicle classes of a lane without those that SUMO no longer has; ``None`` for all."""
    from sumolib.net.lane import SUMO_VEHICLE_CLASSES, SUMO_VEHICLE_CLASSES_DEPRECATED

    if "all" in classes or classes >= SUMO_VEHICLE_CLASSES:
        return None
    return classes - frozenset(SUMO_VEHICLE_CLASSES_DEPRECATED)


def _import_links(net: Any, lanes: dict[SumoLaneId, ImportedLane]) -> tuple[ImportedLink, ...]:
    """All connections, by lane in the order of the file."""
    links = []
    for edge in net.getEdges(withInternal=True):
        for lane in edge.getLanes():
            for link in lane.getOutgoing():
                via = SumoLaneId(link.getViaLaneID() or "")
                if via and via not in lanes:
                    raise ValueError(f"connection via {via}, which is no lane")
                source, target = link.getFromLane().getID(), link.getToLane().getID()
                light = link.getTLSID() or ""
                places = link.getTLLinkIndex(), link.getTLLinkIndex2()
                letters = tuple(place for place in places if place >= 0)
                ends = SumoLaneId(source), SumoLaneId(target)
                links.append(ImportedLink(*ends, via, light, letters))
    return tuple(links)


def _import_rights(net: Any, controlled: Container[SumoLaneId]) -> tuple[ImportedRights, ...]:
    """Right of way of the junctions that lanes with lights lead to."""
    rights = []
    for node in net.getNodes():
        incoming = tuple(SumoLaneId(lane) for lane in node._incLanes or ())
        if any(lane in controlled for lane in incoming):
            rows = sorted(node._prohibits)
            if rows != list(range(len(rows))):
                raise ValueError(f"junction {node.getID()} has requests {rows}")
            requests = (
                Request(_parse_bits(node._prohibits[n]), _parse_bits(node._foes[n])) for n in rows
            )
            rights.append(ImportedRights(str(node.getID()), incoming, tuple(requests)))
    return tuple(rights)


def _parse_bits(text: str) -> frozenset[int]:
    """Places of the ones in a row of right of way, counted from its end."""
    return frozenset(n for n, bit in enumerate(reversed(text)) if bit == "1")


def _import_light(light: Any) -> ImportedLight:
    program = list(light.getPrograms().values())[-1]
    phases = program.getPhases()
    params = program.getParams()
    names = [phase.name for phase in phases]
    if not any(name.startswith(STAGE) for name in names):
        stages = stage_numbers([phase.state for phase in phases])
        names = [f"{STAGE}{stage}" if stage else "" for stage in stages]
    count = max((len(phase.state) for phase in phases), default=0)
    # Ours came back: its bounds are those of extended greens, and calls begin earlier.
    extended = params.get(CONTROL_PARAM) == "extended"
    return ImportedLight(
        str(light.getID()),
        tuple(
            Phase(
                float(phase.duration),
                phase.state,
                name,
                *(
                    (0.0, 0.0)
                    if extended
                    else _phase_bounds(
                        float(phase.minDur), float(phase.maxDur), float(phase.duration)
                    )
                ),
            )
            for phase, name in zip(phases, names, strict=True)
        ),
        float(program.getOffset()),
        tuple(tuple(params.get(f"{_SIGNALS}{index}", "").split()) for index in range(count)),
    )


def _phase_bounds(least: float, most: float, duration: float) -> tuple[float, float]:
    """Bounds of a phase that vehicles may prolong; 0 and 0 where the file has none."""
    if least < 0.0 and most < 0.0:
        return 0.0, 0.0
    return (least if least >= 0.0 else duration), (most if most >= 0.0 else duration)


def stage_numbers(states: Sequence[str]) -> list[int]:
    """Count the stages of a program from its states; 0 for the phases between them.

    A stage lets go somebody who was not let go before, and shows nobody yellow. Phases after it
    that only take green away (persons first) are the change to the next one.
    """
    numbers: list[int] = []
    for index, state in enumerate(states):
        before = states[index - 1]
        begins = any(
            now in "Gg" and was not in "Gg" for now, was in zip(state, before, strict=True)
        )
        constant = len(set(states)) == 1 and index == 0 and any(letter in "Gg" for letter in state)
        is_stage = (begins or constant) and not set(state) & set("yYu")
        numbers.append(max(numbers, default=0) + 1 if is_stage else 0)
    return numbers
