"""A SUMO project: its configuration, and the network, routes and additional files that it names.

The network becomes a map with that network, fixed-time programs of additional files are put into
it, detectors and districts become parts of the scenario, and options those of its simulation. All
else stays what it is: SUMO's own files, which run with the scenario
(:mod:`odscen.scenario.document.sumo_document`).
Source: sumo.dlr.de/docs/Basics/Using_the_Command_Line_Applications.html, "Configuration files".
"""

from __future__ import annotations

import re
from collections import Counter
from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
from lxml import etree
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from odscen.base.errors import InputError, in_file
from odscen.base.given_files import MOST
from odscen.base.shown import shown
from odscen.base.unpacking import GZIP, unpack_gzip
from odscen.base.xml_reading import read_xml
from odscen.formats.base import ElementReport, FileContent
from odscen.lanegraph.query import node_id
from odscen.scenario import edits
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import Simulation
from odscen.scenario.document.sumo_document import SumoFile, SumoProject
from odscen.scenario.edits.demand_edits import put_parts
from odscen.sumo.realize.project_files import OPTIONS, allowed_options, seconds_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.formats.base import GivenFile, ImportMap, ImportSource
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap

SUMO_SEED: Final = 23423
"""Seed of SUMO where a configuration names none."""
AFTER: Final = 7200.0
"""Seconds after the last departure at which a run ends, where a project has no end."""
_SHORT: Final = {
    "n": "net-file", "net": "net-file", "r": "route-files", "routes": "route-files",
    "a": "additional-files", "additional": "additional-files", "b": "begin", "e": "end",
}  # fmt: skip
_OWN_OPTIONS: Final = frozenset((
    "net-file", "route-files", "additional-files", "begin", "end", "step-length", "seed",
    "time-to-teleport", "lateral-resolution", "default.action-step-length", "pedestrian.model",
))  # fmt: skip
"""Options that the scenario has as parts of its own."""
_TIMES: Final = ("begin", "end", "step-length", "time-to-teleport", "lateral-resolution")
_UNSUPPORTED: Final = (
    (
        re.compile("mesosim"), "approximated",
        "each vehicle moves by SUMO's microscopic model, so times and queues are others than those "
        "of its mesoscopic one",
    ),
    (re.compile("meso-.*"), "ignored", "of the mesoscopic model, which is not in use"),
    (
        re.compile("load-state.*"), "approximated",
        "states are not loaded: the run begins with an empty road",
    ),
    (
        re.compile("weight-files|astar.*distances?"), "approximated",
        "travel times of files are not read: routes that SUMO finds are those of an empty road",
    ),
    (
        re.compile("remote-port|num-clients"), "approximated",
        "no other program takes part: what it would do by TraCI does not happen",
    ),
    (
        re.compile(r"device\.fcd-replay\..*"), "approximated",
        "trajectories of files are not replayed",
    ),
    (re.compile(r"device\.ssm\..*"), "ignored", "odscen measures conflicts itself"),
)  # fmt: skip
"""Options that would change what happens and are not handed on: what becomes of them, and why."""
_EMBEDS: Final = ("variableSpeedSign", "rerouter")
"""Elements whose ``file`` is read, and not written."""
_ROOTS: Final = frozenset(("configuration", "sumoConfiguration", "sumoGuiConfiguration"))
_MOST_INCLUDES: Final = 20
_USUAL_NAMES: Final = frozenset(("run", "sumo", "config", "simulation", "scenario", "test", "osm"))
"""What configurations are called whatever is in them: their scenario takes the map's name."""


class _ReadFile(NamedTuple):
    name: str
    kind: Literal["routes", "additional"]
    root: etree._Element
    text: str


def read_sumo_project(source: ImportSource) -> FileContent:
    """Read a configuration (``.sumocfg``), or a network alone, as a scenario.

    Raises
    ------
    InputError
        If a file is missing, is no XML, or the network no SUMO network; names file and element.
    """
    content = _unpack_content(source.file.read())
    with in_file(source.file.where):
        root = read_xml(content, huge=True)
    report = ElementReport(source.file.name)
    if root.tag == "net":
        on_map = _bring_network(source, source.file, content, [], report)
        scenario = _empty_scenario(source, on_map, SUMO_SEED, report)
        return FileContent(scenario, lists=report.lists)
    if root.tag not in _ROOTS:
        raise InputError(
            f"this is no SUMO configuration: its root element is <{str(root.tag)[:40]}>"
            f"{_explain_root(str(root.tag))}",
            file=source.file.where,
        )
    options = _read_options(root)
    _check_numbers(options, source.file.where)
    net_name = options.get("net-file")
    if not net_name:
        raise InputError("the configuration names no net-file", file=source.file.where)
    files = [
        *_read_files(source, options, "additional-files", "additional"),
        *_read_files(source, options, "route-files", "routes"),
    ]
    net_file = source.file.other(net_name)
    programs = _take_programs(files, report)
    on_map = _bring_network(source, net_file, _unpack_content(net_file.read()), programs, report)
    begin = seconds_of(options.get("begin")) or 0.0
    seed = int(options.get("seed") or SUMO_SEED)
    scenario = _empty_scenario(source, on_map, max(0, min(seed, 2**31 - 1)), report)
    project = SumoProject(
        begin=begin,
        options=allowed_options({n: v for n, v in options.items() if n not in _OWN_OPTIONS}),
        files=tuple(_pack_file(file) for file in files if len(file.root)),
    )
    scenario = scenario.model_copy(
        update={
            "sumo": project,
            "simulation": _read_simulation(options, files, report, begin=begin),
        }
    )
    if begin:
        study = scenario.study.model_copy(update={"warm_up": float(np.ceil(begin))})
        scenario = scenario.model_copy(update={"study": study})
    scenario = _add_zones(scenario, on_map.sumo_map, files, report)
    scenario = _add_detectors(scenario, on_map.sumo_map, files, report)
    _report_files(files, report)
    _report_options(options, report)
    return FileContent(scenario, lists=report.lists)


def _unpack_content(content: bytes) -> bytes:
    return unpack_gzip(content, most=MOST) if content.startswith(GZIP) else content


def _explain_root(root: str) -> str:
    if root in ("routes", "additional", "add"):
        return "; open the .sumocfg that names this file"
    if root.endswith("onfiguration"):
        return ", which is of another program of SUMO; open that of sumo itself"
    return ""


def _read_options(root: etree._Element) -> dict[str, str]:
    """All options with values, by their long names, whatever section they are in."""
    options: dict[str, str] = {}
    for element in root.iter():
        if isinstance(element.tag, str) and element is not root:
            value = element.get("value", element.get("v"))
            if value is None and not len(element) and not element.attrib:
                value = (element.text or "").strip() or None  # <end>3600</end> is taken, too
            if value is not None:
                options[_SHORT.get(element.tag, element.tag)] = value.strip()
    return options


def _check_numbers(options: Mapping[str, str], file: str) -> None:
    """Refuse times and a seed that are none."""
    for name in _TIMES:
        value = options.get(name)
        if value and seconds_of(value) is None:
            raise InputError(
                f"{shown(value)} is no time: seconds, or h:m:s", element=name, file=file
            )
    seed = options.get("seed")
    if seed and not re.fullmatch(r"[+-]?\d+", seed):
        raise InputError(f"{shown(seed)} is no whole number", element="seed", file=file)


def _read_files(
    source: ImportSource,
    options: Mapping[str, str],
    option: str,
    kind: Literal["routes", "additional"],
) -> Iterator[_ReadFile]:
    for named in re.split(r"\s*,\s*|\s+(?=\S+\.xml)", options.get(option, "").strip()):
        if not named:
            continue
        given = source.file.other(named)
        content = _unpack_content(given.read())
        with in_file(given.where):
            root = read_xml(content, huge=True)
            changed = _embed_includes(root, given, 0)
        encoding = (root.getroottree().docinfo.encoding or "UTF-8").upper()
        if changed or encoding not in ("UTF-8", "ASCII", "US-ASCII"):
            text = etree.tostring(root, encoding="unicode") + "\n"
        else:
            text = content.decode("utf-8-sig")
        bare = re.sub(r"[^A-Za-z0-9_.+=-]", "_", named.replace("\\", "/").rpartition("/")[2])
        yield _ReadFile(bare.removesuffix(".gz").lstrip(".+=-") or "file.xml", kind, root, text)


def _embed_includes(root: etree._Element, file: GivenFile, depth: int) -> bool:
    """Put in what a file includes, so that it needs no other; whether there was anything."""
    changed = False
    for element in list(root.iter("include", *_EMBEDS)):
        named = element.get("href") if element.tag == "include" else element.get("file")
        if not named:
            continue
        if depth > _MOST_INCLUDES:
            raise InputError("files include each other without an end", element=str(element.tag))
        other = file.other(named)
        with in_file(other.where):
            inner = read_xml(_unpack_content(other.read()), huge=True)
            _embed_includes(inner, other, depth + 1)
        changed = True
        parent = element.getparent()
        if element.tag == "include" and parent is not None:
            for child in list(inner):
                element.addprevious(child)
            parent.remove(element)
        else:
            del element.attrib["file"]
            element.extend(list(inner))
    return changed


# ---------------------------------------------------------------------------- the network


def _take_programs(files: list[_ReadFile], report: ElementReport) -> list[etree._Element]:
    """Programs of additional files that a network can have; they are taken out of these.

    Those with detectors or conditions of their own stay where they are, as SUMO knows of these only
    when it reads the file.
    """
    programs: list[etree._Element] = []
    for index, file in enumerate(files):
        logics = [
            logic
            for logic in file.root.iterchildren("tlLogic")
            if logic.get("type", "static") == "static"
            or (
                logic.get("type") == "actuated"
                and logic.find("param") is None
                and logic.find("condition") is None
            )
        ]
        if not logics:
            continue
        for logic in logics:
            label = f"tlLogic {logic.get('id')}, program {logic.get('programID')}"
            phases = len(logic.findall("phase"))
            cycle = sum(float(p.get("duration") or 0) for p in logic.iterchildren("phase"))
            report.add(
                "taken",
                label,
                f"{phases} phases, cycle {cycle:g} s: the program in force of the map's network",
                line=_line_of(logic),
            )
            file.root.remove(logic)
            programs.append(logic)
        text = etree.tostring(file.root, encoding="unicode") + "\n"
        files[index] = file._replace(text=text)
    return programs


def _line_of(element: etree._Element) -> int:
    line = element.sourceline
    return line if isinstance(line, int) else 0


def _bring_network(
    source: ImportSource,
    file: GivenFile,
    content: bytes,
    programs: Sequence[etree._Element],
    report: ElementReport,
) -> ImportMap:
    """The map of a network with programs put in."""
    with in_file(file.where):
        if programs:
            content, strangers = _insert_programs(content, programs)
            for name in strangers:
                report.add("ignored", f"tlLogic {name}", "the network has no such light")
        if source.bring_network is None:
            raise InputError("a SUMO network cannot be made a map here")
        on_map = source.bring_network(file.name, content)
    edges = sum(not lanes[0].internal for lanes in on_map.sumo_map.net.edge_lanes.values())
    report.add(
        "taken",
        f"network {file.name}",
        f"map {on_map.name}, with {edges} edges and {len(on_map.sumo_map.lights)} lights; the "
        "network is used as it is",
    )
    return on_map


def _insert_programs(content: bytes, programs: Sequence[etree._Element]) -> tuple[bytes, list[str]]:
    """A network with further programs, and lights that it does not have."""
    root = read_xml(content, huge=True)
    known = {logic.get("id") for logic in root.iterchildren("tlLogic")}
    last = root.findall("tlLogic")[-1] if known else None
    strangers = []
    for logic in programs:
        if last is None or logic.get("id") not in known:
            strangers.append(str(logic.get("id")))
            continue
        for old in root.iterchildren("tlLogic"):
            same = old.get("id") == logic.get("id")
            if same and old.get("programID") == logic.get("programID") and old is not last:
                root.remove(old)
        copy = deepcopy(logic)
        copy.tail = "\n    "
        last.addnext(copy)
        last = copy
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8"), strangers


# ---------------------------------------------------------------------------- the scenario


def _empty_scenario(
    source: ImportSource, on_map: ImportMap, seed: int, report: ElementReport
) -> Scenario:
    """A scenario on the largest part of the map whose segments are connected."""
    graph = on_map.sumo_map.graph
    ids = graph.segments.ids
    if not len(graph.lanes.x):
        raise InputError(
            "the network has no road: odscen has rails and waterways only beside roads, and plain "
            "sumo -c runs it",
            file=source.file.where,
        )
    one, other = graph.segments.adjacency.T
    links = coo_array((np.ones(len(one)), (one, other)), shape=(len(ids), len(ids)))
    _, part = connected_components(links, directed=False)
    sizes = np.bincount(part, weights=graph.segments.lengths)
    inside = part == int(np.argmax(sizes))
    if not inside.all():
        report.add(
            "approximated",
            "region",
            f"{len(ids) - int(inside.sum())} of {len(ids)} segments are not connected to the rest; "
            "they are not in the region of interest, but SUMO's traffic is there all the same",
        )
    return edits.new_scenario(
        graph,
        name=on_map.name if source.name.lower() in _USUAL_NAMES else source.name,
        roi=[str(name) for name, within in zip(ids, inside.tolist(), strict=True) if within],
        seed=seed,
        description="A SUMO project.",
    )


def _read_simulation(
    options: Mapping[str, str], files: Sequence[_ReadFile], report: ElementReport, *, begin: float
) -> Simulation:
    end = seconds_of(options.get("end"))
    if end is None or end <= begin:
        end = float(np.ceil(_last_departure(files) + AFTER))
        report.add(
            "approximated",
            "end",
            f"the project has none; the run ends when the road is empty, at {end:g} s at most",
        )
    step = seconds_of(options.get("step-length")) or 1.0
    if step > 1.0:
        report.add("approximated", "step-length", f"{step:g} s; steps are of 1 s at most")
        step = 1.0
    teleport = seconds_of(options.get("time-to-teleport"))
    fields: dict[str, Any] = {"duration": end, "step_length": step}
    if teleport is not None or options.get("time-to-teleport", "").startswith("-"):
        fields["teleport_after"] = max(teleport or 0.0, 0.0)
    for option, name in (
        ("lateral-resolution", "lateral_resolution"),
        ("default.action-step-length", "action_step"),
    ):
        value = seconds_of(options.get(option))
        if value:
            fields[name] = value
    if options.get("pedestrian.model") == "nonInteracting":
        fields["pedestrians"] = "nonInteracting"
    elif options.get("pedestrian.model") not in (None, "striping"):
        reason = f"{options['pedestrian.model']}: people walk by SUMO's model striping"
        report.add("approximated", "pedestrian.model", reason)
    return validated(Simulation, fields)


def _last_departure(files: Sequence[_ReadFile]) -> float:
    last = 0.0
    for file in files:
        for element in file.root.iterchildren("vehicle", "trip", "person", "flow", "personFlow"):
            for name in ("depart", "end"):
                last = max(last, seconds_of(element.get(name)) or 0.0)
            # A flow without an end lasts for as many departures as it has.
            number, period = (seconds_of(element.get(n)) for n in ("number", "period"))
            if number and period and element.get("end") is None:
                last = max(last, (seconds_of(element.get("begin")) or 0.0) + number * period)
    return min(last, 1e8)


def _pack_file(file: _ReadFile) -> SumoFile:
    counts = Counter(str(e.tag) for e in file.root if isinstance(e.tag, str))
    return SumoFile.of(file.name, file.kind, file.text, dict(sorted(counts.items())))


def _clean_part_id(name: str | None) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", name or "").strip("-._")[:64]


def _add_zones(
    scenario: Scenario, sumo_map: SumoMap, files: Sequence[_ReadFile], report: ElementReport
) -> Scenario:
    graph, roi = sumo_map.graph, frozenset(scenario.roi)
    parts: dict[str, dict[str, Any]] = {}
    for file in files:
        for taz in file.root.iter("taz"):
            edges = (taz.get("edges") or "").split()
            edges += [part.get("id", "") for part in taz.iterchildren("tazSource", "tazSink")]
            ends = (sumo_map.edge_ends.get(edge) for edge in edges)
            segments = dict.fromkeys(
                str(graph.segments.ids[int(graph.lanes.segment[node])])
                for pair in ends
                if pair is not None
                for node in pair
            )
            name = _clean_part_id(taz.get("id"))
            inside = tuple(segment for segment in segments if segment in roi)
            if inside and name:
                parts[name] = {"segments": inside}
                report.add("taken", f"taz {taz.get('id')}", f"zone {name}", line=_line_of(taz))
    return put_parts(scenario, graph, "zones", parts) if parts else scenario


def _add_detectors(
    scenario: Scenario, sumo_map: SumoMap, files: Sequence[_ReadFile], report: ElementReport
) -> Scenario:
    places = sumo_map.lane_places
    row_of = {lane: row for row, lane in enumerate(places.lanes)}
    detectors: dict[str, dict[str, Any]] = {}
    for file in files:
        for loop in file.root.iter("inductionLoop", "e1Detector"):
            name, lane = _clean_part_id(loop.get("id")), loop.get("lane", "")
            pos = seconds_of(loop.get("pos")) or 0.0
            nodes = np.flatnonzero(places.lane == row_of.get(lane, -2))
            if not name or not len(nodes):
                report.add(
                    "ignored",
                    f"{loop.tag} {loop.get('id')}",
                    f"no lane of the map is under {shown(lane)}; SUMO has it all the same",
                    line=_line_of(loop),
                )
                continue
            if pos < 0:
                pos += sumo_map.net.lanes[lane].length
            node = int(nodes[int(np.argmin(np.abs(places.pos[nodes] - pos)))])
            detectors[name] = {"id": name, "nodes": (str(node_id(sumo_map.graph, node)),)}
            reason = f"detector {name} of the study"
            report.add("taken", f"{loop.tag} {loop.get('id')}", reason, line=_line_of(loop))
    if not detectors:
        return scenario
    return edits.set_study(scenario, sumo_map.graph, detectors=list(detectors.values()))


def _report_files(files: Sequence[_ReadFile], report: ElementReport) -> None:
    for file in files:
        counts = Counter(str(e.tag) for e in file.root if isinstance(e.tag, str))
        for tag, number in sorted(counts.items()):
            report.add("taken", f"{file.name}: {number} x {tag}", "runs on as SUMO's own file")


def _report_options(options: Mapping[str, str], report: ElementReport) -> None:
    for name, value in sorted(options.items()):
        if name in _OWN_OPTIONS:
            continue
        own = ((become, why) for pattern, become, why in _UNSUPPORTED if pattern.fullmatch(name))
        become, why = next(own, ("", ""))
        if OPTIONS.fullmatch(name):
            report.add("taken", f"option {name}", f"{value}, handed on to SUMO")
        elif become and value.lower() not in ("false", "0", "off", "no"):
            report.add(become, f"option {name}", f"{value}: {why}")
        else:
            reason = f"{value}: it names a file, or shows something; odscen has outputs of its own"
            report.add("ignored", f"option {name}", reason)
