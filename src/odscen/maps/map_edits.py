"""Edits that mend a map, as data: a file beside the map, applied to its OpenDRIVE.

Each edit says where by a place on the ground, in metres of the map or in degrees, never by ids: a
new import of the same place has other ids, and the edit finds its lane, line, light or crosswalk
again all the same. What is not found there any more is reported and left out.
"""

from __future__ import annotations

import json
import tomllib
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator
from pydantic_core import from_json

from odscen.base.errors import InputError
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.maps.edited_map import EditedMap, EditRefusedError
from odscen.opendrive.parse import parse
from odscen.opendrive.write import rewrite_opendrive

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.opendrive.parse import ReadRoads

FORMAT = "odscen-map-edits"

Metres = Annotated[float, Field(gt=0.0, le=200.0)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class MapPlace(_Strict):
    """A place on the ground.

    Attributes
    ----------
    x, y
        Metres in the OpenDRIVE frame.
    lat, lon
        Degrees; of a map with a georeference they hold, and are added to places that have none.
    hdg
        Direction of driving there, rad counter-clockwise from x, where lanes lie on each other.
    """

    x: float | None = None
    y: float | None = None
    lat: Annotated[float, Field(ge=-90, le=90)] | None = None
    lon: Annotated[float, Field(ge=-180, le=180)] | None = None
    hdg: float | None = None

    @model_validator(mode="after")
    def _check_whole(self) -> MapPlace:
        if (self.x is None) != (self.y is None) or (self.lat is None) != (self.lon is None):
            raise ValueError("a place has x and y, or lat and lon")
        if self.x is None and self.lat is None:
            raise ValueError("a place needs x and y, or lat and lon")
        return self


class _Edit(_Strict):
    at: MapPlace


class _Moving(_Edit):
    """An edit that may move something: ``to`` a place, or ``by`` metres along its road."""

    by: Annotated[float, Field(ge=-100, le=100)] = 0.0
    to: MapPlace | None = None

    @model_validator(mode="after")
    def _check_target(self) -> _Moving:
        kind = str(getattr(self, "kind", ""))
        if kind.startswith("move_") and self.to is None and not self.by:
            raise ValueError(f"{kind} needs to or by")
        return self

    def target(self, bench: EditedMap) -> tuple[float, float] | None:
        """Where it is moved to, metres of the map."""
        return None if self.to is None else bench.place_of(self.to)


class LaneWidth(_Edit):
    """Give a lane a width, metres, but for a taper at both ends of its section."""

    kind: Literal["lane_width"]
    width: Annotated[float, Field(ge=0.5, le=20.0)]

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        return bench.widen_lane(bench.find_lane(*xy, self.at.hdg), self.width)


class LaneLimit(_Edit):
    """Give the lane, its direction or all lanes of the section there a limit, km/h."""

    kind: Literal["speed_limit"]
    limit: Annotated[float, Field(ge=1.0, le=300.0)]
    lanes: Literal["lane", "direction", "road"] = "direction"

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        return bench.limit_speed(bench.find_lane(*xy, self.at.hdg), self.limit / 3.6, self.lanes)


class LaneAccess(_Edit):
    """Say what a lane is for (``type`` of OpenDRIVE), and who alone may or who may not use it."""

    kind: Literal["access"]
    type: str | None = None
    allow: tuple[str, ...] = ()
    deny: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _check_meaning(self) -> LaneAccess:
        if self.allow and self.deny:
            raise ValueError("either allow or deny")
        return self

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        lane = bench.find_lane(*xy, self.at.hdg)
        return bench.set_access(lane, self.type, self.allow, self.deny)


class RoadMarkEdit(_Edit):
    """Paint the border that is nearest to the place: ``solid``, ``broken``, ``none``, ..."""

    kind: Literal["road_mark"]
    mark: Literal[
        "none",
        "solid",
        "broken",
        "solid solid",
        "solid broken",
        "broken solid",
        "broken broken",
        "curb",
    ]
    lane_change: Literal["both", "increase", "decrease", "none"] | None = None

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        return bench.paint_border(xy, self.at.hdg, self.mark, self.lane_change)


class StopLineEdit(_Moving):
    """Add a stop line for the lanes of the direction there, remove the nearest or move it.

    It is moved ``to`` a place on its road, or ``by`` metres in the direction of driving.
    """

    kind: Literal["add_stop_line", "remove_stop_line", "move_stop_line"]

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        if self.kind == "add_stop_line":
            return bench.add_stop_line(bench.find_lane(*xy, self.at.hdg))
        line = bench.find_object(xy, "stop line")
        if self.kind == "remove_stop_line":
            return bench.remove_object(line)
        return bench.move_object(line, self.by, self.target(bench))


class CrosswalkEdit(_Moving):
    """Add a crosswalk over the carriageway, ``width`` metres along the road, remove or move it."""

    kind: Literal["add_crosswalk", "remove_crosswalk", "move_crosswalk"]
    width: Annotated[float, Field(ge=1.0, le=20.0)] = 4.0

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        if self.kind == "add_crosswalk":
            return bench.add_crosswalk(bench.find_lane(*xy, self.at.hdg), self.width)
        walk = bench.find_object(xy, "crosswalk")
        if self.kind == "remove_crosswalk":
            return bench.remove_object(walk)
        return bench.move_object(walk, self.by, self.target(bench))


class ObjectEdit(_Moving):
    """Remove the island or other object (tree, pole, building) nearest to the place, or move it."""

    kind: Literal["remove_island", "move_island", "remove_object", "move_object"]

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        action, _, what = self.kind.partition("_")
        part = bench.find_object(xy, "island" if what == "island" else "object")
        if action == "remove":
            return bench.remove_object(part)
        return bench.move_object(part, self.by, self.target(bench), beside=True)


class AddIsland(_Edit):
    """Put a traffic island on the place; it is drawn, and does not part a crosswalk."""

    kind: Literal["add_island"]
    length: Metres = 6.0
    width: Metres = 2.0

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        return bench.add_island(bench.find_lane(*xy, self.at.hdg), xy, self.length, self.width)


class SignalEdit(_Moving):
    """Remove the light or sign nearest to the place, or move it.

    It is moved ``to`` a place beside its road, or ``by`` metres along it.
    """

    kind: Literal["remove_light", "move_light", "remove_sign", "move_sign"]

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        action, _, what = self.kind.partition("_")
        signal = bench.find_signal(xy, "light" if what == "light" else "sign")
        if action == "remove":
            return bench.remove_signal(signal)
        return bench.move_signal(signal, self.by, self.target(bench))


class AddSign(_Edit):
    """Put up a sign for the driving lanes of the direction there; ``value`` in ``unit``."""

    kind: Literal["add_sign"]
    type: Annotated[str, Field(min_length=1, max_length=20)]
    subtype: str = "-1"
    country: str = "DE"
    value: float | None = None
    unit: str = ""

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        lane = bench.find_lane(*xy, self.at.hdg)
        return bench.add_signal(
            lane, self.type, self.subtype, self.country, self.value, self.unit, light=False
        )


class AddLight(_Edit):
    """Put up a traffic light for the driving lanes of the direction there, with a controller."""

    kind: Literal["add_light"]

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        lane = bench.find_lane(*xy, self.at.hdg)
        return bench.add_signal(lane, "1000001", "-1", "OpenDRIVE", None, "", light=True)


class TurnEdit(_Edit):
    """Let a lane lead to the lane at ``to`` through the junction between them, or not any more."""

    kind: Literal["add_turn", "remove_turn"]
    to: MapPlace

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        start = bench.find_lane(*xy, self.at.hdg, connecting=False)
        end = bench.find_lane(*bench.place_of(self.to), self.to.hdg, connecting=False)
        return (bench.add_turn if self.kind == "add_turn" else bench.remove_turn)(start, end)


class BendEdit(_Edit):
    """Lead the lane border nearest to the place, or the road, through ``to``.

    ``length`` is metres of the bend along the road, the same before and behind.
    """

    kind: Literal["bend_border", "bend_road"]
    to: MapPlace
    length: Metres = 40.0

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        to = bench.place_of(self.to)
        if self.kind == "bend_border":
            return bench.bend_border(xy, self.at.hdg, to, self.length)
        return bench.bend_road(bench.find_lane(*xy, self.at.hdg), to, self.length)


class RoadEndEdit(_Edit):
    """Move the end of a road nearest to the place as far as ``to`` is from the place."""

    kind: Literal["move_road_end"]
    to: MapPlace

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        found = bench.find_lane(*xy, self.at.hdg, connecting=False)
        return bench.move_road_end(found, xy, bench.place_of(self.to))


class JoinJunctions(_Edit):
    """Make one junction of that at the place, that at ``to`` and the roads between them."""

    kind: Literal["join_junctions"]
    to: MapPlace

    def apply(self, bench: EditedMap, xy: tuple[float, float]) -> tuple[str, str]:
        """Do it; returns the element and what became of it."""
        second = bench.find_junction(bench.place_of(self.to))
        return bench.join_junctions(bench.find_junction(xy), second)


MapEdit = Annotated[
    LaneWidth
    | LaneLimit
    | LaneAccess
    | RoadMarkEdit
    | StopLineEdit
    | CrosswalkEdit
    | AddIsland
    | ObjectEdit
    | SignalEdit
    | AddSign
    | AddLight
    | TurnEdit
    | BendEdit
    | RoadEndEdit
    | JoinJunctions,
    Field(discriminator="kind"),
]
_EDITS: TypeAdapter[list[MapEdit]] = TypeAdapter(list[MapEdit])
MOST = 20_000
"""Edits of one map."""


class MendedMap(NamedTuple):
    """OpenDRIVE with edits.

    Attributes
    ----------
    edits
        As they are to be kept: with places in degrees if the map has a georeference.
    entries
        A row for each edit: done (``repaired``), or ``lost`` as it fits no more.
    """

    xodr: bytes
    edits: str
    entries: tuple[ReportEntry, ...]


def read_edits(text: str) -> list[MapEdit]:
    """Edits of a file, JSON or TOML.

    Raises
    ------
    InputError
        If it is neither, or an edit is wrong; names the edit, the field and the value.
    """
    try:
        data: Any = from_json(text) if _is_json(text) else tomllib.loads(text)
    except ValueError as error:
        raise InputError(f"this is neither JSON nor TOML: {error}") from error
    if isinstance(data, dict):
        unknown = sorted(set(data) - {"format", "edits"})
        if data.get("format", FORMAT) != FORMAT or unknown:
            what = f"unknown key {unknown[0]!r}" if unknown else f"format {data['format']!r}"
            raise InputError(f"these are no edits of a map: {what}; expected a list 'edits'")
        data = data.get("edits", [])
    return check_edits(data)


def _is_json(text: str) -> bool:
    start = text.lstrip()[:2]
    return start.startswith(("{", "[")) and start != "[["  # which is a table of TOML


def check_edits(data: object) -> list[MapEdit]:
    """Edits from a list of objects, as JSON has them.

    Raises
    ------
    InputError
        If an edit is wrong; names the edit, the field and the value.
    """
    try:
        edits = _EDITS.validate_python(data, strict=False)
    except ValidationError as error:
        details = error.errors(include_url=False)[0]
        number, *path = details["loc"] or ("",)
        where = f"edit {number + 1}" if isinstance(number, int) else "edits"
        if isinstance(number, int) and isinstance(data, list):
            kind = data[number].get("kind") if isinstance(data[number], dict) else None
            path = [part for part in path if part != kind]
            where += f" ({kind})" if isinstance(kind, str) else ""
        field = ".".join(map(str, path))
        raise InputError(
            f"{details['msg'].removeprefix('Value error, ')}"
            + ("" if isinstance(details["input"], dict) else f", not {details['input']!r}"),
            element=f"{where}{f' > {field}' if field else ''}",
        ) from error
    if len(edits) > MOST:
        raise InputError(f"there are {len(edits):,} edits, at most {MOST:,} are taken")
    return edits


def edits_text(edits: Sequence[MapEdit]) -> str:
    """Edits as they are written: the same ones have the same text."""
    rows = [
        edit.model_dump(mode="json", exclude_defaults=True, exclude_none=True) for edit in edits
    ]
    return json.dumps({"format": FORMAT, "edits": rows}, indent=1) + "\n"


def mend_map(
    xodr: bytes, edits: Sequence[MapEdit], *, file: str = "", known: ReadRoads | None = None
) -> MendedMap:
    """Apply edits to OpenDRIVE, one after the other.

    Roads, junctions and controllers that no edit touches stay as they are in the file, but for
    comments; those touched are written anew.

    Parameters
    ----------
    known
        Keeps the roads that are read, for who reads the mended map next.

    Raises
    ------
    OpenDriveError
        If the map cannot be read.
    """
    before = parse(xodr, file=file, known=known)
    bench = EditedMap(before)
    rows, kept = [], []
    for number, edit in enumerate(edits, 1):
        rows.append(_apply_edit(bench, edit, f"edit {number} ({edit.kind})"))
        kept.append(_with_degrees(edit, bench))
    return MendedMap(rewrite_opendrive(xodr, before, bench.map), edits_text(kept), tuple(rows))


def try_edit(bench: EditedMap, edit: MapEdit) -> tuple[ReportEntry, list[tuple[float, ...]]]:
    """What an edit would do to a map, which stays as it is.

    Returns
    -------
    ReportEntry, list[tuple[float, ...]]
        Its row, and outlines of what would change: x and y in turn, metres.
    """
    trial = bench.copy()
    row = _apply_edit(trial, edit, edit.kind)
    return row, trial.outline_changes(bench)


def _apply_edit(bench: EditedMap, edit: MapEdit, name: str) -> ReportEntry:
    try:
        xy = bench.place_of(edit.at)
        element, done = edit.apply(bench, xy)
    except EditRefusedError as error:
        return ReportEntry(ElementOutcome.LOST, name, str(error), source_id=name)
    return ReportEntry(ElementOutcome.REPAIRED, element, done, 1.0, name)


def _with_degrees(edit: MapEdit, bench: EditedMap) -> MapEdit:
    """The edit with its places in degrees, too, so that another import finds them."""
    changed = {}
    for name in ("at", "to"):
        place = getattr(edit, name, None)
        if isinstance(place, MapPlace) and place.lat is None and place.x is not None:
            degrees = bench.degrees_of(place.x, place.y or 0.0)
            if degrees is not None:
                lon, lat = np.round(degrees, 9).tolist()
                changed[name] = place.model_copy(update={"lat": lat, "lon": lon})
    return edit.model_copy(update=changed)
