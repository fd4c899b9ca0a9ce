"""What the parser tolerates and where it stops: rules have names, every use of one is noted."""

from __future__ import annotations

from collections import Counter
from enum import StrEnum
from typing import TYPE_CHECKING, Final, TypeAlias, TypeVar

from odscen.opendrive.parse_xml import Element, element_path

if TYPE_CHECKING:
    from collections.abc import Callable


class Rule(StrEnum):
    """A named tolerance; the name ends the note of each use."""

    VERSION = "version"
    """Versions before 1.4 and after 1.8 are read as far as their elements are known."""
    MISSING_HEADER = "missing-header"
    """A file without ``<header>`` is read by the rules of 1.4 to 1.8, without a projection."""
    CONTROL_CHARACTER = "control-character"
    """Line ends and control characters in attributes are spaces, as XML has it where they are not
    escaped: names with them could not stand in lists and other files."""
    GEO_REFERENCE = "geo-reference"
    """A geoReference that pyproj does not understand is kept as text; coordinates do not change."""
    LEADING_SPACE = "leading-space"
    """White space and comments before the XML declaration are skipped."""
    SPELLING = "spelling"
    """A value of the standard in other letters, as ``KMH`` for ``km/h``, means that value."""
    JUNCTION_ATTRIBUTE = "junction-attribute"
    """A road without ``junction``, or with an empty one, belongs to no junction."""
    DANGLING_LINK = "dangling-link"
    """A reference to something that is not in the file, or is neither road nor junction, is left
    out: the road or lane ends there."""
    JUNCTION_TABLE = "junction-table"
    """A connecting lane that leads nowhere is joined to the one lane that it meets in the plane."""
    MISSING_CONTACT = "missing-contact-point"
    """A link or connection without ``contactPoint`` means the end of the other road that links
    back; where none or both do it is left out, for which end it means is not guessed."""
    ONE_SIDED_LINK = "one-sided-link"
    """A road end without a link has one to the road end that links to it, if exactly one does."""
    SILENT_LANES = "silent-lanes"
    """Where a section follows, or a linked road outside junctions, and no lane of a side names any
    there, on neither of both, and both have lanes for driving of the same ids, these are linked."""
    DUPLICATE_ID = "duplicate-id"
    """Objects and signals may share an id; references mean the first."""
    REPEATED_CONTROLLER = "repeated-controller"
    """Controllers of one id are one: it controls the signals of all of them."""
    REPEATED_ELEMENT = "repeated-element"
    """An element that is in a file twice in a row, alike in everything, counts once."""
    ROAD_LEFT_OUT = "road-left-out"
    """A road that cannot be read is left out, if the others hang together without it."""
    TEMPORARY_LANES = "temporary-lanes"
    """The temporary lane layer of a road (1.9), as for road works, is left out."""
    POINT_ROAD = "point-road"
    """A road of no length that joins two others counts as one of 1 mm."""
    ROAD_LENGTH = "road-length"
    """Of a length and a plan view that differ by more than 1 m that holds whose end the roads meet
    that are linked there; where none is, the shorter one."""
    CONNECTION_LEFT_OUT = "connection-left-out"
    """A connection of a junction, or a lane link of it, that names no road or lane is left out."""
    COINCIDENT_ROAD = "coincident-road"
    """Of roads that no junction names and that are alike in all but id and name the first stays."""
    PLAN_VIEW_S = "plan-view-s"
    """Lengths of geometries and the next s may disagree by up to a metre: s decides."""
    PLAN_VIEW_GAP = "plan-view-gap"
    """Successive geometries may miss each other by up to 10 m; positions stay as written."""
    CURVE_LENGTH = "curve-length"
    """A paramPoly3 may be up to twice or half as long as its ``length``; the run is evened."""
    ZERO_LENGTH = "zero-length"
    """Geometries and lane sections too short to hold a point have no effect."""
    SLIVER = "sliver"
    """Of a geometry of up to 0.1 mm whose numbers are beyond the limits, the rest of the road is
    kept; of such a record of a profile its first coefficient."""
    RECORD_ORDER = "record-order"
    """A record, section or geometry that starts less than 5 cm before the one in front of it starts
    where that one does; of geometries the one of less than 5 cm is left out. The first one starts
    at 0, and a section at the end of the road, if they are less than 5 cm behind it."""
    PAINT = "paint"
    """What a road mark, a height or a header says that only paints, and cannot be read, counts as
    not given."""
    MARK_ORDER = "mark-order"
    """Marks, speeds, heights and access of a lane, and types of a road, may be written in any
    order; each holds from where it begins to the next."""
    MISSING_NUMBER = "missing-number"
    """Coefficients b, c and d of a record that are missing are 0; the first record, section or
    geometry that does not say where it begins does so at 0; a missing length is what the next s,
    the road's length or the plan view says."""
    ENCODING = "encoding"
    """Bytes that cannot be what the declaration says are read as UTF-8, or as Windows-1252 where
    they are none: only names can have letters that differ."""
    LATE_START = "late-start"
    """A profile of the road that starts after s = 0 is zero before."""
    SAME_S = "same-s"
    """Of two records at the same s the later one holds; of two geometries the one that is not
    longer than 5 cm, or than single precision tells apart at that s, is left out."""
    JUMP = "jump"
    """Elevations and lane widths may jump within a road or section; they do so in the model."""
    WIDTH_AND_BORDER = "width-and-border"
    """A lane with width and border records uses the widths (section 11.7)."""
    NO_WIDTH = "no-width"
    """A lane without width and border has zero width."""
    NEGATIVE_WIDTH = "negative-width"
    """A width may fall below zero by up to 25 cm; it counts as zero there."""
    LANE_SIDE = "lane-side"
    """A lane in the element of the other side lies on the side that the sign of its id says."""
    LANE_NUMBERS = "lane-numbers"
    """Lane ids may leave numbers out; lanes lie side by side in the order of their ids."""
    NO_CENTER = "no-center-lane"
    """A lane section without centre lane has an unmarked centre line."""
    SPEED = "speed"
    """A speed that is no positive number, "no limit" or "undefined", or has a unit that is not
    known, counts as not given."""
    OLD_NAMES = "old-names"
    """``heightInner`` and ``heightOuter`` of a lane's height are read as ``inner``, ``outer``."""
    OBJECT_LEFT_OUT = "object-left-out"
    """An object without an id, or with a number that is missing or none, is left out."""
    ACCESS_LEFT_OUT = "access-left-out"
    """An ``<access>`` that does not say where it begins, or names no road user, is left out."""
    SIGNAL_LEFT_OUT = "signal-left-out"
    """A signal, reference or controller without an id, or with a number that is missing or none, is
    left out."""
    OUTSIDE_ROAD = "outside-road"
    """Objects and signals may lie before the start or behind the end of their road."""
    IGNORED = "ignored"
    """Elements without effect on lanes and traffic are not read (docs/opendrive-coverage.md)."""
    UNKNOWN = "unknown-element"
    """Elements that no version of the standard names here are not read."""
    UNKNOWN_VALUE = "unknown-value"
    """A value that the standard does not name is kept as text, or left out where it decides."""


LOSING_RULES: Final = frozenset(
    {Rule.ROAD_LEFT_OUT, Rule.CONNECTION_LEFT_OUT, Rule.OBJECT_LEFT_OUT, Rule.SIGNAL_LEFT_OUT}
    | {Rule.ACCESS_LEFT_OUT, Rule.TEMPORARY_LANES}
)
"""Rules by which something of the file is lost, not repaired."""

MAX_BYTES: Final = 256_000_000
"""Bytes of a file."""
MAX_TAGS: Final = 4_000_000
"""Tags of a file, opening and closing."""
MAX_NUMBER: Final = 1e9
"""Any number of a file, absolute; lengths and positions have limits of their own."""
MAX_ROAD_LENGTH: Final = 1e6
"""Metres of one road."""
MAX_LANE_LENGTH: Final = 1e7
"""Metres of all lanes of a map together."""
MAX_COORDINATE: Final = 1e8
"""Metres from the origin."""
MAX_TURNING: Final = 100.0
"""Radians that one geometry may turn through."""
MAX_ELEVATION: Final = 1e5
"""Metres above or below zero."""
MAX_ROLL: Final = 1.5
"""Radians of superelevation."""
MAX_LANE_ID: Final = 1000
"""Absolute lane id."""
MAX_WIDTH: Final = 1000.0
"""Metres of one lane."""

S_TOLERANCE: Final = 1e-3
"""Metres by which s values may disagree without a note."""
SLIVER_LENGTH: Final = 1e-4
"""Metres of geometries and records whose numbers may be beyond all limits (:attr:`Rule.SLIVER`)."""
STEP_BACK: Final = 0.05
"""Metres by which a record may start before the one in front of it (:attr:`Rule.RECORD_ORDER`)."""
POINT_LENGTH: Final = 1e-3
"""Metres that a road of no length counts as (:attr:`Rule.POINT_ROAD`)."""
MEETING: Final = 0.5
"""Metres along the road within which it meets a linked one (:attr:`Rule.ROAD_LENGTH`)."""
MOST_LEFT_OUT: Final = 0.1
"""Share of the roads that may be left out; one may be always (:attr:`Rule.ROAD_LEFT_OUT`)."""
MAX_S_GAP: Final = 1.0
"""Metres by which s values of the plan view may disagree with a note (:attr:`Rule.PLAN_VIEW_S`)."""
GAP_TOLERANCE: Final = 0.01
"""Metres between successive geometries without a note."""
KINK_TOLERANCE: Final = 0.1
"""Radians between the headings of successive geometries without a note."""
JUMP_TOLERANCE: Final = 0.05
"""Metres that elevations and widths may jump without a note."""
CURVE_TOLERANCE: Final = 0.01
"""Share by which the length of a paramPoly3 may be off without a note."""
MAX_ASTRAY: Final = 0.05
"""Metres by which places on a poly3 or paramPoly3 may be off, or the curve cannot be followed."""
MAX_GAP: Final = 10.0
"""Metres between successive geometries with a note (:attr:`Rule.PLAN_VIEW_GAP`)."""
WIDTH_TOLERANCE: Final = 1e-3
"""Metres below zero that a width may have without a note."""
MAX_NEGATIVE_WIDTH: Final = 0.25
"""Metres below zero that a width may have with a note (:attr:`Rule.NEGATIVE_WIDTH`)."""

_LISTED_PER_RULE = 1000


SkippedElements: TypeAlias = Counter[tuple[Rule, str, str]]
"""Numbers of elements that are not read, by rule, parent and tag."""
NotesMark: TypeAlias = tuple[int, Counter[Rule], SkippedElements]
Read = TypeVar("Read")


class Notes:
    """Collects one sentence per use of a tolerance; beyond a thousand of a rule only counts."""

    def __init__(self) -> None:
        self._sentences: list[str] = []
        self._uses: Counter[Rule] = Counter()
        self._skipped: SkippedElements = Counter()

    def add(self, rule: Rule, place: Element | str, detail: str) -> None:
        """Note that ``rule`` was used at ``place``."""
        self._uses[rule] += 1
        if self._uses[rule] <= _LISTED_PER_RULE:
            path = place if isinstance(place, str) else element_path(place)
            self._sentences.append(f"{path}: {detail} [{rule}]" if path else f"{detail} [{rule}]")

    def skip(self, rule: Rule, parent: str, tag: str, count: int = 1) -> None:
        """Count elements ``tag`` below ``parent`` that are not read; one note per kind."""
        self._skipped[rule, parent[:60], tag[:60]] += count

    def skip_all(self, skipped: SkippedElements) -> None:
        """Count elements that are not read, as they were counted before."""
        self._skipped.update(skipped)

    def skipped_by(self, read: Callable[[], Read]) -> tuple[Read, SkippedElements, bool]:
        """What reads something gives, what it skips, and whether it notes nothing else."""
        before, self._skipped = self._skipped, Counter()
        uses = self._uses.copy()
        try:
            value = read()
        finally:
            own, self._skipped = self._skipped, before
            before.update(own)
        return value, own, uses == self._uses

    def mark(self) -> NotesMark:
        """Where the notes stand, for :meth:`return_to`."""
        return len(self._sentences), self._uses.copy(), self._skipped.copy()

    def return_to(self, mark: NotesMark) -> None:
        """Forget what was noted since ``mark``."""
        count, self._uses, self._skipped = mark
        del self._sentences[count:]

    def sentences(self) -> tuple[str, ...]:
        """All notes, those of single elements first."""
        more = [
            f"{count - _LISTED_PER_RULE} further uses of this rule [{rule}]"
            for rule, count in self._uses.items()
            if count > _LISTED_PER_RULE
        ]
        skipped = [
            f"{parent}: {count} x <{tag}> not read [{rule}]"
            for (rule, parent, tag), count in list(self._skipped.items())[:_LISTED_PER_RULE]
        ]
        return (*self._sentences, *more, *skipped)
