"""OpenDRIVE text to road model (ASAM OpenDRIVE 1.4 to 1.8).

The parser refuses what it does not understand and never invents: each tolerance is a
:class:`~odscen.opendrive.parse_rules.Rule`, and each use of one is a sentence in
:attr:`OpenDrive.notes <odscen.opendrive.road_model.OpenDrive.notes>`.
"""

from __future__ import annotations

import re
from contextlib import nullcontext
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final, TypeVar

from lxml.etree import tostring

from odscen.base.errors import OpenDriveError, in_file
from odscen.base.shown import shown, shown_id
from odscen.opendrive.parse_checks import check_numbers, find_faults
from odscen.opendrive.parse_junctions import parse_controller, parse_junction
from odscen.opendrive.parse_left_out import RoadFault, leave_out_faulty
from odscen.opendrive.parse_lengths import fit_lengths
from odscen.opendrive.parse_references import check_references
from odscen.opendrive.parse_repairs import (
    free_roads_of_no_junction,
    merge_coincident_roads,
    repair_junction_tables,
)
from odscen.opendrive.parse_road import parse_road
from odscen.opendrive.parse_rules import MAX_BYTES, MAX_TAGS, Notes, Rule, SkippedElements
from odscen.opendrive.parse_xml import (
    CONTROLS,
    Element,
    children,
    load,
    may_have_controls,
    optional_number,
    refusal,
)
from odscen.opendrive.road_model import Controller, Header, Junction, OpenDrive, Road

if TYPE_CHECKING:
    from odscen.base.ids import JunctionId, RoadId

READ: Final = frozenset({"header", "road", "controller", "junction", "userData"})
IGNORED: Final = frozenset({"junctionGroup", "station", "include", "dataQuality"})
NO_HEADER: Final = Header(1, 4, "", None, None, None, None, "", None)
"""What stands for a missing ``<header>``: the oldest version, no bounds, no projection."""
_BYTE_ORDER_MARK: Final = b"\xef\xbb\xbf"
_CRS_TEXT: Final = re.compile(r"proj=|init=|EPSG:|ESRI:|CRS\[|CS\[", re.IGNORECASE)
_DECLARED_ENCODING: Final = re.compile(
    rb"""(?:\xef\xbb\xbf)?<\?xml[^>]*?\sencoding\s*=\s*["']([A-Za-z0-9._-]+)["']"""
)
_LISTS: Final = frozenset({"objects", "object", "outlines", "outline", "signals"})
"""Elements whose children may be alike, or have rules of their own for that."""
K = TypeVar("K")
V = TypeVar("V")


class ReadRoads:
    """Roads that have been read, by their text: a file that is mended has most of them again."""

    def __init__(self) -> None:
        self._known: dict[bytes, tuple[Road, SkippedElements]] = {}

    def read(self, element: Element, notes: Notes) -> Road:
        """Road of an element; one for which tolerances were used is always read anew."""
        text = tostring(element, with_tail=False)
        known = self._known.get(text)
        if known is not None:
            road, skipped = known
            notes.skip_all(skipped)
            return road
        road, skipped, alone = notes.skipped_by(lambda: _parse_road_once_repeated(element, notes))
        if alone:
            self._known[text] = road, skipped
        return road


def parse(text: str | bytes, *, file: str = "", known: ReadRoads | None = None) -> OpenDrive:
    """Road model of an OpenDRIVE file.

    Parameters
    ----------
    text
        The whole file; bytes are decoded as the XML declaration says.
    file
        Name of the file for error messages.
    known
        Roads that have been read before; those that are read now are kept there, too.

    Returns
    -------
    OpenDrive
        Lengths in metres, angles in radians, speeds in m/s; ``notes`` lists all tolerances used.

    Raises
    ------
    OpenDriveError
        If the text is malformed or uses something that is not supported; the message names the
        element and the value.
    """
    with in_file(file) if file else nullcontext():
        notes = Notes()
        root = read_tree(text, notes)
        return _parse_root(root, notes, known)


def read_tree(text: str | bytes, notes: Notes) -> Element:
    """Root element of an OpenDRIVE file, without comments, as :func:`parse` reads it."""
    started = _without_leading_space(text)
    if len(started) != len(text):
        detail = f"{len(text) - len(started)} characters before <?xml are skipped"
        notes.add(Rule.LEADING_SPACE, "map", detail)
    decoded = _decode_as_meant(started, notes)
    root = load(decoded, max_bytes=MAX_BYTES, max_tags=MAX_TAGS)
    if may_have_controls(text):
        _space_controls(root, notes)
    return root


def _without_leading_space(text: str | bytes) -> str | bytes:
    """The text from its XML declaration on: XML permits neither spaces nor comments before it."""
    if isinstance(text, str):
        place = _find_declaration(text.encode("utf-8", "surrogatepass"))
        return text.encode("utf-8", "surrogatepass")[place:].decode("utf-8", "surrogatepass")
    return text[_find_declaration(text) :]


def _find_declaration(data: bytes) -> int:
    """Where the declaration begins, behind spaces and comments; 0 if nothing is before it."""
    mark = len(_BYTE_ORDER_MARK) if data.startswith(_BYTE_ORDER_MARK) else 0
    place = mark
    while place < len(data):
        if data.startswith(b"<?xml", place):
            return place if place > mark else 0
        if data.startswith(b"<!--", place):
            end = data.find(b"-->", place)
            if end < 0:
                return 0
            place = end + 3
        elif data[place : place + 1].isspace():
            place += 1
        else:
            return 0
    return 0


def _decode_as_meant(text: str | bytes, notes: Notes) -> str | bytes:
    """The text itself, or decoded, where its declaration cannot be what its bytes are.

    Windows writes names in its own letters under a declaration of UTF-8, and .NET one of UTF-16
    above text that is none.
    """
    if isinstance(text, str) or b"\0" in text:  # UTF-16 has NUL bytes
        return text
    match = _DECLARED_ENCODING.match(text)
    name = match[1].decode().lower().replace("-", "") if match else "utf8"
    if name not in ("utf8", "utf16"):
        return text
    try:
        decoded, read = text.decode(), "UTF-8"
    except UnicodeDecodeError:
        decoded, read = text.decode("windows-1252", "replace"), "Windows-1252"
    if (name, read) == ("utf8", "UTF-8"):
        return text
    detail = f"the bytes are no {'UTF-16' if name == 'utf16' else 'UTF-8'}; read as {read}"
    notes.add(Rule.ENCODING, "map", detail)
    return decoded.removeprefix("\ufeff")


def _space_controls(root: Element, notes: Notes) -> None:
    """Put spaces for control characters in attributes, and note each."""
    for element in root.iter():
        for name, value in [(str(key), text) for key, text in element.attrib.items()]:
            if CONTROLS.search(str(value)):
                detail = f"{name}={shown(str(value))} has control characters; they are spaces"
                element.set(name, CONTROLS.sub(" ", str(value)))
                notes.add(Rule.CONTROL_CHARACTER, element, detail)


def _parse_root(root: Element, notes: Notes, known: ReadRoads | None) -> OpenDrive:
    if root.tag != "OpenDRIVE":
        raise refusal(root, f"the root element is <{shown_id(str(root.tag))}>, not <OpenDRIVE>")
    groups = children(root)
    for tag, found in groups.items():
        if tag not in READ:
            rule = Rule.IGNORED if tag in IGNORED else Rule.UNKNOWN
            notes.skip(rule, "OpenDRIVE", tag, len(found))
    header = _parse_header(root, _first_of(groups, "header", notes), notes)
    elements = groups.get("road", [])
    if not elements:
        raise refusal(root, "there is no <road>")
    read = _parse_road_once_repeated if known is None else known.read
    roads: dict[RoadId, Road] = {}
    faults: list[RoadFault] = []
    for element in elements:
        try:
            road = read(element, notes)
        except OpenDriveError as error:
            faults.append(RoadFault(element.get("id", ""), error))
        else:
            _add_unique(roads, road.id, road, element, notes)
    twice = next((fault for fault in faults if fault.road in roads), None)
    if twice is not None:
        raise twice.error
    junctions: dict[JunctionId, Junction] = {}
    for element in groups.get("junction", ()):
        try:
            junction = parse_junction(element, roads, notes)
        except OpenDriveError as error:
            detail = f"{error.problem}; the junction is left out, its roads are in none"
            notes.add(Rule.CONNECTION_LEFT_OUT, error.element or element, detail)
            continue
        twin = junctions.get(junction.id)
        if twin is not None and twin != junction and twin.type == junction.type:
            detail = "another junction has the same id; it has the connections of both"
            notes.add(Rule.REPEATED_ELEMENT, element, detail)
            junctions[junction.id] = _join_junctions(twin, junction)
            continue
        _add_unique(junctions, junction.id, junction, element, notes)
    controllers: dict[str, Controller] = {}
    for element in groups.get("controller", ()):
        _add_controller(controllers, element, notes)
    roads, unfit = fit_lengths(roads, notes)
    astray = {fault.road for fault in unfit}
    fit = {road_id: road for road_id, road in roads.items() if road_id not in astray}
    faults += [*unfit, *find_faults(fit)]
    roads = leave_out_faulty(roads, faults, elements, junctions, notes)
    check_numbers(roads, notes)
    roads = merge_coincident_roads(roads, junctions.values(), notes)
    roads, junctions, controllers = check_references(roads, junctions, controllers, notes)
    odr = free_roads_of_no_junction(OpenDrive(header, roads, junctions, controllers), notes)
    odr = repair_junction_tables(odr, notes)
    return replace(odr, notes=notes.sentences())


def _parse_road_once_repeated(element: Element, notes: Notes) -> Road:
    """Read a road; where that fails, read it without elements that repeat the one before."""
    mark = notes.mark()
    try:
        return parse_road(element, notes)
    except OpenDriveError:
        repeated = [
            after
            for parent in element.iter()
            if parent.tag not in _LISTS
            for before, after in pairwise(parent)
            if _are_alike(before, after)
        ]
        if not repeated:
            raise
        notes.return_to(mark)
        for twin in repeated:
            notes.add(Rule.REPEATED_ELEMENT, twin, "it is like the one before it, and counts once")
        for twin in repeated:
            parent = twin.getparent()
            if parent is not None:
                parent.remove(twin)
        return parse_road(element, notes)


def _are_alike(one: Element, other: Element) -> bool:
    """Whether two elements say the same, with all that is in them."""
    return (
        one.tag == other.tag
        and one.attrib == other.attrib
        and (one.text or "").strip() == (other.text or "").strip()
        and len(one) == len(other)
        and all(map(_are_alike, one, other))
    )


def _add_unique(known: dict[K, V], key: K, value: V, element: Element, notes: Notes) -> None:
    if key in known and known[key] == value:
        detail = "another one of that id is like it in everything, and both are one"
        notes.add(Rule.REPEATED_ELEMENT, element, detail)
        return
    if key in known:
        tag = str(element.tag)
        problem = f"there is another {tag} with the id {shown(str(key))}"
        raise refusal(element, f"{problem}: a link to it could mean either")
    known[key] = value


def _join_junctions(one: Junction, other: Junction) -> Junction:
    """A junction with the connections, priorities and controllers of two of one id."""
    return replace(
        one,
        connections=tuple(dict.fromkeys((*one.connections, *other.connections))),
        priorities=tuple(dict.fromkeys((*one.priorities, *other.priorities))),
        controllers=tuple(dict.fromkeys((*one.controllers, *other.controllers))),
    )


def _add_controller(known: dict[str, Controller], element: Element, notes: Notes) -> None:
    """Add a controller, or its signals to the one of its id."""
    try:
        controller = parse_controller(element, notes)
    except OpenDriveError as error:
        detail = f"{error.problem}; the controller is left out"
        notes.add(Rule.SIGNAL_LEFT_OUT, error.element or element, detail)
        return
    same = known.get(controller.id)
    if same is not None:
        detail = "another controller has the same id; it controls the signals of both"
        notes.add(Rule.REPEATED_CONTROLLER, element, detail)
        controls = tuple(dict.fromkeys((*same.controls, *controller.controls)))
        controller = replace(same, controls=controls)
    known[controller.id] = controller


def _parse_header(root: Element, element: Element | None, notes: Notes) -> Header:
    if element is None:
        detail = "there is no <header>; the file is read by the rules of 1.4 to 1.8"
        notes.add(Rule.MISSING_HEADER, root, detail)
        return NO_HEADER
    major, minor = (
        _read_revision(element, *part, notes) for part in (("revMajor", 1), ("revMinor", 4))
    )
    if major != 1 or minor < 0:
        raise refusal(element, f"OpenDRIVE {major}.{minor} is not supported; 1.4 to 1.8 are")
    if not 4 <= minor <= 8:
        detail = f"OpenDRIVE {major}.{minor} is read by the rules of 1.4 to 1.8"
        notes.add(Rule.VERSION, element, detail)
    groups = children(element)
    reference = _first_of(groups, "geoReference", notes)
    text = "" if reference is None else (reference.text or "").strip()
    offset = _first_of(groups, "offset", notes)
    return Header(
        rev_major=major,
        rev_minor=minor,
        name=element.get("name", ""),
        north=_descriptive_number(element, "north", notes),
        south=_descriptive_number(element, "south", notes),
        east=_descriptive_number(element, "east", notes),
        west=_descriptive_number(element, "west", notes),
        geo_reference=text,
        crs=_parse_crs(text, element, notes),
        offset=_parse_offset(offset, notes),
    )


def _first_of(groups: dict[str, list[Element]], tag: str, notes: Notes) -> Element | None:
    """The first of elements that only describe the file."""
    found = groups.get(tag, [])
    if len(found) > 1:
        detail = f"there are {len(found)} <{tag}> elements where one is allowed; the first holds"
        notes.add(Rule.PAINT, found[1], detail)
    return found[0] if found else None


def _read_revision(element: Element, name: str, usual: int, notes: Notes) -> int:
    """A part of the version; the oldest one stands for what is no number."""
    text = element.get(name, "").strip()
    if re.fullmatch(r"[-+]?\d{1,9}", text):
        return int(text)
    what = f"{name}={shown(text)} is no number" if text else f"{name} is missing"
    notes.add(Rule.VERSION, element, f"{what}; the file is read by the rules of 1.4 to 1.8")
    return usual


def _descriptive_number(element: Element, name: str, notes: Notes) -> float | None:
    """A number that only describes the file; ``None`` if it is none."""
    try:
        return optional_number(element, name)
    except OpenDriveError as error:
        notes.add(Rule.PAINT, element, f"{error.problem}; it is not used")
        return None


def _parse_offset(element: Element | None, notes: Notes) -> tuple[float, float, float, float]:
    if element is None:
        return (0.0, 0.0, 0.0, 0.0)
    x, y, z, hdg = (
        _descriptive_number(element, name, notes) or 0.0 for name in ("x", "y", "z", "hdg")
    )
    return (x, y, z, hdg)


def names_projection(text: str) -> bool:
    """Whether a text is a coordinate reference system, by how it is written: EPSG, proj or WKT."""
    return _CRS_TEXT.search(text) is not None


def _parse_crs(text: str, element: Element, notes: Notes) -> str | None:
    """WKT of a geoReference, if pyproj understands it."""
    if not text:
        return None
    if not names_projection(text):
        # pyproj would search its whole database for a name like this, for a fifth of a second.
        detail = f"geoReference {shown(text)} names no projection; kept as text"
        notes.add(Rule.GEO_REFERENCE, element, detail)
        return None
    import pyproj

    try:
        return str(pyproj.CRS.from_user_input(text).to_wkt())
    except (pyproj.exceptions.ProjError, ValueError, TypeError) as err:
        reason = str(err).splitlines()[0][:200]
        detail = f"geoReference {shown(text)} is not understood ({reason}); kept as text"
        notes.add(Rule.GEO_REFERENCE, element, detail)
        return None
