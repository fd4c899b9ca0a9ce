"""Files of a SUMO project in a run: what SUMO reads, and what is planned of their road users.

The files run as they are. What could write or read elsewhere on the disk is taken out of them, as a
scenario may come from anywhere: outputs keep the bare name of their file, and options are of the
kinds in :data:`OPTIONS`. Source:
sumo.dlr.de/docs/Definition_of_Vehicles,_Vehicle_Types,_and_Routes.html.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Final

from lxml import etree

from odscen.base.categories import DEFAULT_BODY, Body, Category
from odscen.base.errors import InputError, in_file
from odscen.base.xml_reading import read_xml
from odscen.convert.imported.net_import import stage_numbers
from odscen.convert.model.net import STAGE, Phase
from odscen.lanegraph.query import node_id
from odscen.records.run_plan import PlannedActor
from odscen.runs import layout

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.document.sumo_document import SumoFile, SumoProject
    from odscen.sumo.realize.sumo_map import SumoMap

OPTIONS: Final = re.compile(
    r"default\.(speeddev|action-step-length|carfollowmodel|emergencydecel|departspeed|departlane)"
    r"|no-internal-links|emergency-insert|keep-after-arrival|startup-wait-threshold|junction-taz"
    r"|step-method\.ballistic|extrapolate-departpos|threads|scale(-suffix)?"
    r"|random(-depart-offset)?|thread-rngs"
    r"|time-to-teleport\.[a-z.-]+|time-to-impatience|waiting-time-memory|max-depart-delay"
    r"|max-num-(vehicles|persons|teleports)|sloppy-insert|eager-insert|insertion-checks|route-steps"
    r"|ignore-(route-errors|accidents|junction-blocker)|collision\.[a-z.-]+"
    r"|intermodal-collision\.[a-z-]+|emergencydecel\.[a-z-]+|parking\.maneuver|use-stop-(ended|started)"
    r"|lanechange\.[a-z.-]+|overhead-wire\.[a-z-]+|tls\.[a-z_.-]+|railsignal[a-z.-]*"
    r"|railway\.max-train-length|slope-centered|replay-rerouting|weight-attribute"
    r"|emissions\.volumetric-fuel|phemlight-(year|temperature)"
    r"|pedestrian\.(striping\.[a-z.-]+|jupedsim\.[a-z.-]+|remote\.[a-z-]+|timegap-crossing)"
    r"|persontrip\.[a-z.-]+|ride\.stop-tolerance|mapmatch\.[a-z-]+"
    r"|routing-algorithm|weights\.(random-factor(\.dynamic)?|reversal-penalty|priority-factor|turnaround-penalty|minor-penalty"
    r"|tls-penalty|separate-turns)|astar\.landmark-distance|routing-threads"
    r"|device\.(rerouting|emissions|battery|elechybrid|taxi|glosa|tripinfo|vehroute|bluelight|toc"
    r"|driverstate|stationfinder|friction|fcd|example|btreceiver|btsender|person-device)\."
    r"(?!.*(file|output))[A-Za-z0-9._-]+"
    r"|person-device\.(?!.*(file|output))[A-Za-z0-9._-]+"
)
"""Options of SUMO that change what happens and name no file."""

_WRITES: Final = frozenset(("file", "output", "dest", "outfile", "imgFile", "trajectory-output"))
"""Attributes that name a file to be written, or a picture."""
_RESERVED: Final = frozenset(
    value for name, value in vars(layout).items() if name.endswith("_FILE")
)
"""Names of files of a run."""
_CLASSES: Final[dict[str, Category]] = {
    "passenger": Category.CAR, "private": Category.CAR, "taxi": Category.CAR, "hov": Category.CAR,
    "evehicle": Category.CAR, "ignoring": Category.CAR, "vip": Category.CAR,
    "authority": Category.CAR, "army": Category.TRUCK, "custom1": Category.CAR,
    "custom2": Category.CAR, "emergency": Category.VAN, "delivery": Category.VAN,
    "truck": Category.TRUCK, "trailer": Category.TRUCK, "bus": Category.BUS, "coach": Category.BUS,
    "tram": Category.BUS, "rail": Category.BUS, "rail_urban": Category.BUS,
    "rail_electric": Category.BUS, "rail_fast": Category.BUS, "subway": Category.BUS,
    "cable_car": Category.BUS, "motorcycle": Category.MOTORCYCLE, "moped": Category.MOTORCYCLE,
    "bicycle": Category.BICYCLE, "scooter": Category.BICYCLE, "pedestrian": Category.PEDESTRIAN,
    "wheelchair": Category.PEDESTRIAN,
}  # fmt: skip
"""Category that figures have vehicles of a class in; odscen has no rails, which are with buses."""
_LENGTHS: Final = {
    "coach": 14.0, "trailer": 16.5, "moped": 2.1, "tram": 22.0, "rail": 67.5, "rail_urban": 109.5,
    "rail_electric": 200.0, "rail_fast": 200.0, "subway": 109.5, "emergency": 6.5, "scooter": 1.2,
}  # fmt: skip
MOST_LISTED = 500_000
"""Road users of a project in the plan."""


@dataclass(frozen=True, slots=True)
class ProjectFiles:
    """What a run has of a project.

    Attributes
    ----------
    routes, additional
        Names of files in the order in which SUMO reads them.
    texts
        By name.
    actors
        Road users that are known before the run, in order of departure.
    notes
        What the plan does not know of.
    stops
        Whether lines have stops.
    """

    routes: tuple[str, ...]
    additional: tuple[str, ...]
    texts: dict[str, str]
    actors: tuple[PlannedActor, ...]
    notes: tuple[str, ...]
    stops: bool


def project_files(
    project: SumoProject, sumo_map: SumoMap, *, until: float, taken: Iterable[str]
) -> ProjectFiles:
    """Files of a project for a run.

    Parameters
    ----------
    until
        End of the run, s: who departs later is not planned.
    taken
        Names of files that the run has already.

    Raises
    ------
    InputError
        If a file is damaged, or no XML.
    """
    names = _free_names(project.files, set(taken))
    texts: dict[str, str] = {}
    reader = _UserReader(sumo_map, project.begin, until)
    roots = []
    for file, name in zip(project.files, names, strict=True):
        with in_file(file.name):
            text = file.text
            root = read_xml(text, huge=True)
            texts[name] = _neutralise_paths(root, text)
            roots.append((file, root))
    # Additional files come first in SUMO, so types and routes of any file are known to all.
    for _, root in roots:
        reader.read_types(root)
    for file, root in roots:
        with in_file(file.name):
            reader.read_users(root, file.name, sorted_only=file.kind == "routes")
    reader.note_early()
    return ProjectFiles(
        tuple(n for n, f in zip(names, project.files, strict=True) if f.kind == "routes"),
        tuple(n for n, f in zip(names, project.files, strict=True) if f.kind == "additional"),
        texts,
        reader.actors(),
        tuple(reader.notes),
        any(root.find("busStop") is not None for _, root in roots),
    )


def lights_in_force(project: SumoProject, lights: Sequence[SumoLight]) -> tuple[SumoLight, ...]:
    """Lights with the programs that files of a project give them: raw phases, as they are.

    Of several programs it is that which a WAUT begins with, or else the last.
    """
    programs: dict[str, list[etree._Element]] = {}
    starts: dict[str, str] = {}
    for file in project.files:
        if file.kind != "additional" or not file.elements.get("tlLogic"):
            continue
        with in_file(file.name):
            root = read_xml(file.text, huge=True)
        for logic in root.iterchildren("tlLogic"):
            programs.setdefault(logic.get("id", ""), []).append(logic)
        plans = {waut.get("id"): waut.get("startProg", "") for waut in root.iterchildren("WAUT")}
        for at in root.iterchildren("wautJunction"):
            starts[at.get("junctionID", "")] = plans.get(at.get("wautID"), "")
    running_lights = []
    for light in lights:
        own = programs.get(light.id, [])
        start = [logic for logic in own if logic.get("programID", "0") == starts.get(light.id)]
        for logic in (start or own)[-1:]:
            rows = list(logic.iterchildren("phase"))
            states = [row.get("state", "") for row in rows]
            if not rows or {len(state) for state in states} != {len(light.phases[0].state)}:
                continue
            stages = stage_numbers(states)
            phases = tuple(
                Phase(
                    _read_number(row.get("duration")) or 0.0,
                    state,
                    f"{STAGE}{stage}" if stage else "",
                    *_phase_bounds(row),
                )
                for row, state, stage in zip(rows, states, stages, strict=True)
            )
            offset = _read_number(logic.get("offset")) or 0.0
            light = light._replace(phases=phases, offset=offset)  # noqa: PLW2901
        running_lights.append(light)
    return tuple(running_lights)


def _phase_bounds(phase: etree._Element) -> tuple[float, float]:
    """Bounds of a phase that vehicles may prolong; 0 and 0 where the file has none."""
    least, most = _read_number(phase.get("minDur")), _read_number(phase.get("maxDur"))
    if least is None or most is None or least == most:
        return 0.0, 0.0
    return least, most


def allowed_options(options: Mapping[str, str]) -> dict[str, str]:
    """Options of a project that are handed on to SUMO."""
    return {name: value for name, value in options.items() if OPTIONS.fullmatch(name)}


def _free_names(files: Sequence[SumoFile], taken: set[str]) -> list[str]:
    names = []
    for file in files:
        name = file.name
        while name in taken:
            name = f"project.{name}"
        taken.add(name)
        names.append(name)
    return names


def _neutralise_paths(root: etree._Element, text: str) -> str:
    """The text, unless it names files elsewhere: these are then beside it."""
    changed = False
    for element in root.iter():
        if not isinstance(element.tag, str):
            continue
        if element.tag == "include":
            raise InputError(
                "<include> is not possible here; put its content in", element="include"
            )
        for name in _WRITES.intersection(element.attrib):
            value = str(element.get(name))
            bare = PurePosixPath(value.replace("\\", "/")).name.replace(":", "_")
            if bare in ("stdout", "stderr", "-", "/dev/null", ""):
                bare = "NUL"
            if bare in _RESERVED:
                bare = f"project.{bare}"
            if bare != value:
                element.set(name, bare)
                changed = True
    if not changed:
        return text
    return etree.tostring(root, encoding="unicode") + "\n"


@dataclass(frozen=True, slots=True)
class _Type:
    category: Category
    body: Body
    speed: float = math.inf


_CAR = _Type(Category.CAR, DEFAULT_BODY[Category.CAR])
_USERS = ("vehicle", "trip", "flow", "person", "personFlow")
_FLOWS = ("flow", "personFlow")


class _UserReader:
    """Reads vehicles, trips, flows and persons, as far as they are known before SUMO runs."""

    def __init__(self, sumo_map: SumoMap, begin: float, until: float) -> None:
        self.notes: list[str] = []
        self._map = sumo_map
        self._begin = begin
        self._until = until
        self._early: list[str] = []
        self._types: dict[str, _Type] = {"DEFAULT_VEHTYPE": _CAR}
        self._routes: dict[str, tuple[str, ...]] = {}
        self._actors: list[PlannedActor] = []
        self._seen: set[str] = set()
        self._unlisted = 0
        walker = Category.PEDESTRIAN
        self._types["DEFAULT_PEDTYPE"] = _Type(walker, DEFAULT_BODY[walker])

    def actors(self) -> tuple[PlannedActor, ...]:
        """Who was found, in order of departure."""
        return tuple(sorted(self._actors, key=lambda actor: (actor.depart, actor.id)))

    def read_types(self, root: etree._Element) -> None:
        """Read types, distributions of them, and routes by name."""
        for element in root.iter("vType"):
            self._types[element.get("id", "")] = _read_type(element)
        for element in root.iter("vTypeDistribution"):
            members = [self._types[m.get("id", "")] for m in element.iter("vType")]
            members += [self._types[n] for n in _split_words(element, "vTypes") if n in self._types]
            if members:
                self._types[element.get("id", "")] = members[0]
        for element in root.iter("route"):
            if element.get("id"):
                self._routes[str(element.get("id"))] = tuple(_split_words(element, "edges"))
        for element in root.iter("routeDistribution"):
            inner = [tuple(_split_words(route, "edges")) for route in element.iter("route")]
            inner += [self._routes[n] for n in _split_words(element, "routes") if n in self._routes]
            if inner and element.get("id"):
                self._routes[str(element.get("id"))] = inner[0]

    def read_users(self, root: etree._Element, file: str, *, sorted_only: bool) -> None:
        """Read who is on the road; with ``sorted_only`` those whom SUMO takes from a route file.

        SUMO reads route files on the way, and ignores whoever would depart before the one that
        stands before it.
        """
        for element in self._read_users(root, file, sorted_only=sorted_only):
            if len(self._actors) >= MOST_LISTED:
                self.notes.append(f"only the first {MOST_LISTED} road users are in the plan")
                return
            name = element.get("id", "")
            edges = self._edges_of(element)
            kind = self._types.get(element.get("type", ""), _CAR)
            if element.tag in ("person", "personFlow"):
                kind = self._types.get(element.get("type", ""), self._types["DEFAULT_PEDTYPE"])
            if element.tag in _FLOWS:
                self._add_flow(element, name, edges, kind)
                continue
            depart = seconds_of(element.get("depart"))
            if depart is None:
                depart = self._until  # triggered by another: not due at any known time
            self._add_user(name, depart, edges, kind, flow=None, appears=element.get("depart"))

    def note_early(self) -> None:
        """Note who is left out as SUMO leaves them out, because the simulation begins later."""
        if self._early:
            self.notes.append(
                f"SUMO leaves out {len(self._early)} that depart before it begins at "
                f"{self._begin:g} s, {self._early[0]!r} the first"
            )

    def _read_users(
        self, root: etree._Element, file: str, *, sorted_only: bool
    ) -> Iterator[etree._Element]:
        """Vehicles, flows and persons of a file without those that SUMO ignores, who are noted."""
        latest = -math.inf
        ignored: list[str] = []
        for element in root.iterchildren(*_USERS):
            flow = element.tag in _FLOWS
            depart = seconds_of(element.get("begin", "0") if flow else element.get("depart"))
            if sorted_only and depart is not None:
                if depart < latest:
                    ignored.append(f"{element.tag} '{element.get('id', '')}'")
                    continue
                latest = depart
            yield element
        if ignored:
            self.notes.append(
                f"{file}: SUMO ignores {len(ignored)} that depart before those above them, "
                f"{ignored[0]} the first; sort the file by departure, for example with "
                "sort_routes.py"
            )

    def _edges_of(self, element: etree._Element) -> tuple[str, ...]:
        """Edges of a route, or of a trip those that it names."""
        if element.get("route"):
            return self._routes.get(str(element.get("route")), ())
        inner = element.find("route")
        if inner is None and element.find("routeDistribution") is not None:
            inner = element.find("routeDistribution/route")
        if inner is not None:
            return tuple(_split_words(inner, "edges"))
        if element.tag in ("person", "personFlow"):
            stage = next(iter(element.iterchildren("walk", "ride", "personTrip")), None)
            if stage is None:
                return ()
            if stage.get("route"):
                return self._routes.get(str(stage.get("route")), ())
            edges = _split_words(stage, "edges") or [
                *_split_words(stage, "from"),
                *_split_words(stage, "to"),
            ]
            return tuple(edges)
        return (
            *_split_words(element, "from"),
            *_split_words(element, "via"),
            *_split_words(element, "to"),
        )

    def _add_flow(
        self, element: etree._Element, name: str, edges: tuple[str, ...], kind: _Type
    ) -> None:
        begin = seconds_of(element.get("begin")) or 0.0
        end = seconds_of(element.get("end"))
        last = min(self._until, math.inf if end is None else end)
        number = _read_number(element.get("number"))
        period = _read_number(element.get("period"))
        hourly = next(
            (v for k in ("vehsPerHour", "perHour") if (v := _read_number(element.get(k)))), None
        )
        if hourly:
            period = 3600.0 / hourly
        if period is None and number and end is not None:
            period = (end - begin) / number
        if not period or period <= 0.0:
            self.notes.append(
                f"flow {name} is drawn by SUMO: its road users are in the run, and in figures by "
                "place, but not in the list of road users"
            )
            return
        early = 0
        for index in range(MOST_LISTED):
            depart = begin + index * period
            if depart >= last - 1e-9 or (number is not None and index >= number):
                break
            if depart < self._begin:
                early += 1  # SUMO numbers the others from 0 on
                continue
            self._add_user(f"{name}.{index - early}", depart, edges, kind, flow=name)

    def _add_user(
        self,
        name: str,
        depart: float,
        edges: tuple[str, ...],
        kind: _Type,
        *,
        flow: str | None,
        appears: str | None = None,
    ) -> None:
        if depart < self._begin:
            self._early.append(name)  # SUMO leaves out who is due before it begins
            return
        if depart > self._until or name in self._seen:
            return
        self._seen.add(name)
        triggered = appears is not None and seconds_of(appears) is None
        start, end = self._find_node(edges), self._find_node(tuple(reversed(edges)), last=True)
        lanes = self._map.graph.lanes
        net = self._map.net
        whole = bool(edges) and all(edge in net.edge_lanes for edge in edges)
        whole = whole and all(
            net.ends[before][1] == net.ends[after][0] for before, after in pairwise(edges)
        )
        lengths = [net.edge_lanes[edge][0] for edge in edges] if whole else []
        self._actors.append(
            PlannedActor(
                id=name,
                category=kind.category.value,
                spawn=edges[0] if start is None and edges else self._node_name(start),
                goal=(edges[-1] if edges else None) if end is None else self._node_name(end),
                depart=round(depart, 3),
                length=kind.body.length,
                width=kind.body.width,
                x=0.0 if start is None else round(float(lanes.x[start]), 3),
                y=0.0 if start is None else round(float(lanes.y[start]), 3),
                z=0.0 if start is None else round(float(lanes.z[start]), 3),
                hdg=0.0 if start is None else round(float(lanes.hdg[start]), 6),
                route_length=round(sum(lane.length for lane in lengths), 2) if whole else None,
                free_flow_time=round(
                    sum(lane.length / max(min(lane.speed, kind.speed), 0.1) for lane in lengths), 2
                )
                if whole
                else None,
                flow=flow,
                appears=triggered,
                from_file=True,
            )
        )

    def _find_node(self, edges: tuple[str, ...], *, last: bool = False) -> int | None:
        """Node at the begin of the first edge that the map has, or at its end."""
        for edge in edges:
            ends = self._map.edge_ends.get(edge)
            if ends is not None:
                return ends[1] if last else ends[0]
        return None

    def _node_name(self, node: int | None) -> str:
        return "" if node is None else str(node_id(self._map.graph, node))


def _read_type(element: etree._Element) -> _Type:
    vclass = element.get("vClass", "passenger")
    category = _CLASSES.get(vclass, Category.CAR)
    usual = DEFAULT_BODY[category]
    length = _read_number(element.get("length")) or _LENGTHS.get(vclass, usual.length)
    width = _read_number(element.get("width")) or usual.width
    speed = _read_number(element.get("maxSpeed")) or math.inf
    return _Type(category, Body(length, width, usual.height), speed)


def _split_words(element: etree._Element, name: str) -> list[str]:
    return (element.get(name) or "").split()


def _read_number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def seconds_of(text: str | None) -> float | None:
    """Seconds of a time of SUMO, also as ``h:m:s`` or ``d:h:m:s``; ``None`` of words."""
    if text and ":" in text:
        parts = text.split(":")
        try:
            values = [float(part) for part in parts]
        except ValueError:
            return None
        scale = (86_400.0, 3600.0, 60.0, 1.0)[-len(values) :]
        return sum(v * s for v, s in zip(values, scale, strict=True)) if len(values) <= 4 else None
    return _read_number(text)
