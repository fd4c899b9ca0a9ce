"""Tags of a way as a cross-section: lanes of both directions, their widths, turns and limits.

Keys and values as https://wiki.openstreetmap.org/wiki/Lanes, Key:turn, Key:placement, Key:cycleway,
Key:sidewalk, Key:maxspeed and Street_parking say. Everything here is in right-hand traffic: of a
country that keeps left, :func:`mirror_tags` has swapped left and right before.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.maps.importers.osm.osm_file import Tags, Way

MPH = 0.44704
"""Metres per second."""
KMH = 1.0 / 3.6
KNOT = 0.514444
NO_LIMIT = 0.0
"""The speed of a road without a limit."""


class StreetClass(NamedTuple):
    """What is usual of a class of highway.

    Attributes
    ----------
    rank
        The higher, the more important.
    width
        Of a lane, metres (RASt 06, RAL; AASHTO has 3.0 to 3.6).
    limit
        In towns, km/h.
    kind
        Road type of OpenDRIVE.
    """

    rank: int
    width: float
    limit: float
    kind: str


CLASSES = {
    "motorway": StreetClass(10, 3.75, 120, "motorway"),
    "motorway_link": StreetClass(9, 3.75, 80, "motorway"),
    "trunk": StreetClass(8, 3.5, 100, "rural"),
    "trunk_link": StreetClass(7, 3.5, 60, "rural"),
    "primary": StreetClass(6, 3.5, 50, "town"),
    "primary_link": StreetClass(5, 3.5, 50, "town"),
    "secondary": StreetClass(5, 3.25, 50, "town"),
    "secondary_link": StreetClass(4, 3.25, 50, "town"),
    "tertiary": StreetClass(4, 3.25, 50, "town"),
    "tertiary_link": StreetClass(3, 3.25, 50, "town"),
    "unclassified": StreetClass(3, 3.0, 50, "town"),
    "road": StreetClass(3, 3.0, 50, "town"),
    "residential": StreetClass(2, 3.0, 50, "town"),
    "busway": StreetClass(2, 3.25, 50, "town"),
    "bus_guideway": StreetClass(2, 3.0, 50, "town"),
    "living_street": StreetClass(1, 2.75, 10, "lowSpeed"),
    "service": StreetClass(0, 2.75, 20, "lowSpeed"),
    "track": StreetClass(0, 2.75, 20, "rural"),
}
"""Ways of vehicles, by ``highway``."""

PRIORITY_ROADS = {"designated", "yes", "yes_unposted"}
"""Values of ``priority_road`` that say that a street goes first."""
_SAID_TO_GO_FIRST = 20

FOOT_CLASSES = {"footway", "path", "pedestrian", "steps", "corridor", "bridleway", "platform"}
MINOR_SERVICES = {"driveway", "parking_aisle", "drive-through", "emergency_access", "slipway"}

BIKE_WIDTH, TRACK_WIDTH, WALK_WIDTH = 1.5, 2.0, 2.0
PARKING_WIDTH = {"parallel": 2.1, "diagonal": 4.3, "perpendicular": 5.0}
NARROWEST = 2.2
"""Metres of a lane for cars; a narrower one that ``lanes`` does not count is for bicycles."""
ONE_LANE_WIDTH = 5.0
"""Carriageway of a road of one lane that both directions share, metres."""


class Country(NamedTuple):
    """Rules of a country that tags leave out.

    Attributes
    ----------
    limits
        km/h by highway class, and by ``urban``, ``rural``, ``motorway``, ``living_street``.
    """

    code: str
    keeps_left: bool
    limits: Mapping[str, float]


_BOXES: tuple[tuple[str, bool, tuple[float, float, float, float]], ...] = (
    # Left-hand traffic: west, south, east, north. Coarse, the smaller before the larger.
    ("IE", True, (-10.8, 51.3, -6.0, 55.4)),
    ("GB", True, (-8.7, 50.9, 1.9, 61.0)),
    ("GB", True, (-6.6, 49.8, -0.5, 50.9)),
    ("MT", True, (14.1, 35.7, 14.7, 36.2)),
    ("CY", True, (32.2, 34.5, 34.7, 35.8)),
    ("HK", True, (113.82, 22.13, 114.45, 22.56)),
    ("JP", True, (129.6, 30.0, 146.0, 45.6)),
    ("JP", True, (122.9, 24.0, 131.2, 30.0)),
    ("AU", True, (112.0, -44.0, 154.0, -10.4)),
    ("NZ", True, (166.0, -47.5, 179.0, -34.0)),
    ("TH", True, (97.8, 5.7, 102.2, 20.3)),
    ("MY", True, (99.6, 0.8, 119.3, 7.4)),
    ("ID", True, (95.0, -11.0, 141.0, 0.8)),
    ("LK", True, (79.6, 5.8, 82.0, 9.9)),
    ("IN", True, (72.5, 8.0, 88.9, 26.3)),
    ("IN", True, (74.5, 26.3, 80.0, 32.5)),
    ("IN", True, (80.0, 26.3, 92.0, 28.5)),
    ("BD", True, (88.9, 20.6, 92.3, 26.6)),
    ("PK", True, (66.5, 24.0, 74.5, 36.5)),
    ("ZA", True, (14.0, -35.0, 33.0, -22.2)),
    ("ZW", True, (20.0, -22.2, 40.6, -15.6)),
    ("ZM", True, (24.0, -15.6, 40.6, -10.5)),
    ("TZ", True, (30.5, -10.5, 40.5, -1.0)),
    ("KE", True, (34.0, -4.7, 41.9, 4.6)),
    ("UG", True, (29.6, -1.4, 34.0, 4.2)),
    ("JM", True, (-78.4, 17.7, -76.1, 18.6)),
    ("TT", True, (-61.95, 10.0, -60.4, 11.4)),
    # Right-hand traffic whose limits differ.
    ("CA", False, (-141.0, 49.0, -52.0, 83.0)),
    ("CA", False, (-82.9, 42.0, -78.95, 49.0)),
    ("CA", False, (-78.95, 43.3, -76.0, 49.0)),
    ("CA", False, (-76.0, 45.02, -71.0, 49.0)),
    ("US", False, (-125.0, 24.5, -66.5, 49.0)),
    ("US", False, (-170.0, 51.0, -141.0, 71.5)),
    ("NL", False, (3.4, 51.3, 7.0, 53.6)),
    ("CH", False, (6.0, 45.9, 9.6, 47.6)),
    ("AT", False, (9.6, 46.4, 13.0, 47.4)),
    ("AT", False, (13.0, 46.4, 17.1, 48.4)),
    ("DE", False, (6.0, 47.4, 14.9, 55.0)),
    ("FR", False, (-4.8, 42.4, 7.6, 51.0)),
    ("IT", False, (7.0, 36.6, 18.5, 46.6)),
    ("ES", False, (-9.3, 36.0, 3.3, 43.8)),
    ("PL", False, (14.9, 49.0, 24.1, 54.8)),
    ("CN", False, (80.0, 20.0, 128.0, 50.0)),
)
_LIMITS: dict[str, dict[str, float]] = {
    # https://wiki.openstreetmap.org/wiki/Default_speed_limits
    "DE": {"urban": 50, "rural": 100, "motorway": NO_LIMIT, "living_street": 10},
    "AT": {"urban": 50, "rural": 100, "motorway": 130, "living_street": 10},
    "CH": {"urban": 50, "rural": 80, "motorway": 120, "trunk": 100, "living_street": 20},
    "NL": {"urban": 50, "rural": 80, "motorway": 100, "trunk": 100, "living_street": 15},
    "FR": {"urban": 50, "rural": 80, "motorway": 130, "trunk": 110, "living_street": 20},
    "IT": {"urban": 50, "rural": 90, "motorway": 130, "trunk": 110, "living_street": 30},
    "ES": {"urban": 50, "rural": 90, "motorway": 120, "residential": 30, "living_street": 20},
    "PL": {"urban": 50, "rural": 90, "motorway": 140, "trunk": 100, "living_street": 20},
    "CN": {"urban": 50, "rural": 70, "motorway": 120, "residential": 30},
    "JP": {"urban": 60, "rural": 60, "motorway": 100, "residential": 30},
    "AU": {"urban": 50, "rural": 100, "motorway": 110},
    "NZ": {"urban": 50, "rural": 100, "motorway": 100},
    "IN": {"urban": 50, "rural": 80, "motorway": 120},
    "ZA": {"urban": 60, "rural": 100, "motorway": 120},
    "CA": {"urban": 50, "rural": 80, "motorway": 100},
    "GB": {"urban": 30 * 1.609344, "rural": 60 * 1.609344, "motorway": 70 * 1.609344},
    "US": {
        "urban": 35 * 1.609344,
        "residential": 25 * 1.609344,
        "living_street": 15 * 1.609344,
        "service": 15 * 1.609344,
        "rural": 55 * 1.609344,
        "motorway": 65 * 1.609344,
    },
    "": {"urban": 50, "rural": 90, "motorway": 120, "living_street": 10},
}
_ZONES = {"urban": "urban", "rural": "rural", "motorway": "motorway", "trunk": "trunk"}
_FIXED_ZONES = {"living_street": 10.0, "bicycle_road": 30.0, "nsl_restricted": 30 * 1.609344}


def country_at(lat: float, lon: float) -> Country:
    """The country of a place, from boxes; without code where none is known."""
    for code, keeps_left, (west, south, east, north) in _BOXES:
        if west <= lon <= east and south <= lat <= north:
            return Country(code, keeps_left, _LIMITS.get(code, _LIMITS[""]))
    return Country("", False, _LIMITS[""])


@dataclass(frozen=True, slots=True)
class StreetLane:
    """A lane of a cross-section.

    Attributes
    ----------
    kind
        ``driving``, ``bus``, ``biking``, ``parking``, ``sidewalk``, ``shoulder``, ``border``.
    width
        Metres.
    turns
        Values of ``turn:lanes``; empty if nothing is said.
    change
        ``yes``, ``no``, ``only_left`` or ``only_right``: seen by who drives on it.
    denied, allowed
        Classes of vehicles in OpenDRIVE's words.
    """

    kind: str
    width: float
    turns: frozenset[str] = frozenset()
    change: str = "yes"
    denied: tuple[str, ...] = ()
    allowed: tuple[str, ...] = ()

    @property
    def carries_cars(self) -> bool:
        """Whether motor vehicles of any kind drive on it."""
        return self.kind in ("driving", "bus")


@dataclass(frozen=True, slots=True)
class CrossSection:
    """Lanes of a way, from the divider between its directions outwards.

    Attributes
    ----------
    right
        In the direction of the way.
    left
        Against it.
    offset
        From the line of the way to the divider, metres, positive to the left.
    speed_right, speed_left
        m/s; :data:`NO_LIMIT` where there is none.
    """

    right: tuple[StreetLane, ...]
    left: tuple[StreetLane, ...]
    offset: float
    speed_right: float
    speed_left: float

    def reversed(self) -> CrossSection:
        """The same seen against the way."""
        return CrossSection(self.left, self.right, -self.offset, self.speed_left, self.speed_right)

    def edges(self) -> tuple[float, float]:
        """The right and the left edge from the line of the way, metres, positive to the left."""
        right = self.offset - sum(lane.width for lane in self.right)
        return right, self.offset + sum(lane.width for lane in self.left)


class Guess(NamedTuple):
    """Something that tags do not say, or say otherwise: what, and how sure the importer is."""

    reason: str
    confidence: float


@dataclass(slots=True)
class StreetReading:
    """A cross-section and how it was read.

    Attributes
    ----------
    used
        Tags that were acted on.
    ignored
        Tags that were not, and why.
    """

    section: CrossSection
    guesses: list[Guess] = field(default_factory=list)
    used: dict[str, str] = field(default_factory=dict)
    ignored: dict[str, str] = field(default_factory=dict)


_SWAP = {"left": "right", "right": "left"}
_SIDES = re.compile(r"(?<![a-z])(left|right)(?![a-z])")


def rank_street(tags: Tags) -> int:
    """How important a street is at a junction without signs; the higher goes first.

    By ``priority_road``, else by its class.
    """
    first = tags.get("priority_road") in PRIORITY_ROADS
    return CLASSES[tags["highway"]].rank + (_SAID_TO_GO_FIRST if first else 0)


def mirror_tags(tags: Tags) -> Tags:
    """Swap left and right in keys and values, and turn lists of lanes round."""
    mirrored: Tags = {}
    for key, value in tags.items():
        if not _SIDES.search(key) and "lanes" not in key and key not in _SIDED_KEYS:
            mirrored[key] = value
            continue
        new = _SIDES.sub(lambda found: _SWAP[found[1]], key)
        text = _SIDES.sub(lambda found: _SWAP[found[1]], value.replace("_", " ")).replace(" ", "_")
        if key.startswith("placement"):
            # Lanes are counted from the left: from the last one back when mirrored.
            text = re.sub(r":(\d+)", r":-\1", text)
        mirrored[new] = "|".join(reversed(text.split("|"))) if "|" in text else text
    return mirrored


_SIDED_KEYS = {"sidewalk", "placement", "cycleway", "turn", "restriction"}


def read_speed(value: str, country: Country) -> float | None:
    """A value of ``maxspeed`` in m/s; ``None`` if it is none that is understood."""
    text = value.lower().split(";")[0].strip()
    if text in ("none", "unlimited"):
        return NO_LIMIT
    if text == "walk":
        return 7.0 * KMH
    if match := re.fullmatch(r"(\d+(?:\.\d+)?)\s*(km/h|kmh|kph|mph|knots)?", text):
        unit = {"mph": MPH, "knots": KNOT}.get(match[2] or "", KMH)
        speed = float(match[1]) * unit
        return speed if 0.5 < speed < 100.0 else None
    if match := re.fullmatch(r"([a-z]{2})(?:-[a-z]+)?:(?:zone:?)?([a-z_]*)(\d*)", text):
        limits = _LIMITS.get(match[1].upper(), country.limits)
        if match[3]:
            return float(match[3]) * (MPH if match[1] in ("gb", "uk", "us") else KMH)
        name = match[2].strip(":_")
        if name in _FIXED_ZONES and name not in limits:
            return _FIXED_ZONES[name] * KMH
        if name in limits:
            return limits[name] * KMH
        if name in _ZONES:
            return limits.get("rural" if name == "trunk" else name, 50.0) * KMH
    return None


_SIDE_KEY = re.compile(r"(?:sidewalk|cycleway|parking|verge|shoulder)\b")


def turn_way_round(way: Way) -> Way:
    """A way that is one-way against its direction, as one along it."""
    tags = {
        _SIDES.sub(lambda found: _SWAP[found[1]], key) if _SIDE_KEY.match(key) else key: _SWAP.get(
            value, value
        )
        if key in _SIDED_KEYS
        else value
        for key, value in way.tags.items()
    }
    return way._replace(nodes=way.nodes[::-1], tags={**tags, "oneway": "yes"})


def is_oneway(tags: Tags) -> int:
    """1 along the way, -1 against it, 0 both ways."""
    value = tags.get("oneway", "")
    if value in ("yes", "true", "1"):
        return 1
    if value in ("-1", "reverse"):
        return -1
    if value in ("no", "false", "0", "reversible", "alternating"):
        return 0
    if tags.get("junction") in ("roundabout", "circular") or tags.get("highway") == "motorway":
        return 1
    return int(tags.get("highway") == "motorway_link" and "lanes:backward" not in tags)


def read_width(value: str) -> float | None:
    """A width in metres; ``None`` if it is none that is understood."""
    if match := re.fullmatch(r"(\d+(?:[.,]\d+)?)\s*(m|ft|')?", value.lower().strip()):
        number = float(match[1].replace(",", "."))
        return number * 0.3048 if match[2] in ("ft", "'") else number
    return None


class _Keys:
    """Tags of a way as they are asked for, with a note of what was used."""

    def __init__(self, tags: Tags) -> None:
        self.tags = tags
        self.used: dict[str, str] = {}
        self.ignored: dict[str, str] = {}

    def get(self, *keys: str) -> str | None:
        """The first of several that is there."""
        for key in keys:
            if key in self.tags:
                self.used[key] = self.tags[key]
                return self.tags[key]
        return None

    def number(self, *keys: str, least: int = 0, most: int = 16) -> int | None:
        """The first of several that is a whole number within bounds."""
        for key in keys:
            text = self.tags.get(key)
            if text is None:
                continue
            if re.fullmatch(r"\d{1,3}(\.0)?", text) and least <= int(float(text)) <= most:
                self.used[key] = text
                return int(float(text))
            self.ignored[key] = f"{text!r} is no number of lanes from {least} to {most}"
        return None


_ACCESS_NO = {"no", "private", "agricultural", "forestry", "delivery", "emergency", "military"}


def keeps_cars_out(tags: Tags) -> bool:
    """Whether no motor vehicle of the public may drive on a way, buses aside."""
    for key in ("motorcar", "motor_vehicle", "vehicle", "access"):
        if key in tags:
            return tags[key] in _ACCESS_NO or tags[key] in ("psv", "bus")
    return False


def is_for_buses(tags: Tags) -> bool:
    """Whether buses may drive where others may not."""
    return tags.get("highway") in ("busway", "bus_guideway") or any(
        tags.get(key) in ("yes", "designated", "official") for key in ("bus", "psv")
    )


def _lane_values(keys: _Keys, name: str, suffix: str) -> list[str] | None:
    """Values of ``name:lanes`` of a direction, from the left to the right."""
    text = keys.get(
        *((f"{name}:lanes{suffix}",) if suffix else (f"{name}:lanes", f"{name}:lanes:forward"))
    )
    return [part.strip() for part in text.split("|")] if text is not None else None


_ONLY_BIKES = {"designated", "official"}


def _read_direction(
    keys: _Keys, suffix: str, count: int, width: float, guesses: list[Guess]
) -> list[StreetLane]:
    """Lanes of one direction from the left to the right, bicycle lanes between them too.

    Parameters
    ----------
    suffix
        Of the keys: ``:forward``, ``:backward``, or nothing where there is one direction.
    count
        Lanes for cars and buses, as ``lanes`` counts.
    """
    lists = {
        name: _lane_values(keys, name, suffix)
        for name in (
            "turn",
            "change",
            "width",
            "bicycle",
            "access",
            "vehicle",
            "motor_vehicle",
            "bus",
            "psv",
            "cycleway",
        )
    }
    lengths = [len(values) for values in lists.values() if values]
    total = max(set(lengths), key=lambda n: (lengths.count(n), n)) if lengths else count
    for name, values in lists.items():
        if values and len(values) != total:
            key = f"{name}:lanes{suffix}"
            if name == "turn" and total != count and len(values) == count:
                # It leaves the bicycle lanes out that other lists have.
                continue
            keys.used.pop(key, None)
            keys.ignored[key] = f"it has {len(values)} lanes where others have {total}"
            lists[name] = None

    def value(name: str, place: int) -> str:
        values = lists[name]
        return values[place] if values and place < len(values) else ""

    kinds = []
    for place in range(total):
        closed = any(
            value(n, place) in ("no", "private") for n in ("access", "vehicle", "motor_vehicle")
        )
        bikes = value("bicycle", place) in _ONLY_BIKES or value("cycleway", place) == "lane"
        buses = any(value(n, place) in _ONLY_BIKES for n in ("bus", "psv"))
        buses = buses or (closed and any(value(n, place) == "yes" for n in ("bus", "psv")))
        wide = read_width(value("width", place))
        bikes = bikes or (total > count and wide is not None and wide < NARROWEST)
        kinds.append(
            "bus"
            if buses
            else "biking"
            if bikes and (closed or total > count)
            else "closed"
            if closed
            else "driving"
        )
    cars = sum(kind in ("driving", "bus") for kind in kinds)
    if lengths and cars != count and keys.get("lanes", f"lanes{suffix}"):
        guesses.append(
            Guess(
                f"lanes says {count} for cars, the lists by lane {cars}: the lists are taken", 0.6
            )
        )
    turns = lists["turn"]
    lanes = []
    for place, kind in enumerate(kinds):
        if kind == "closed":
            continue
        tokens = frozenset[str]()
        if turns:
            index = place if len(turns) == total else sum(k != "biking" for k in kinds[:place])
            if len(turns) == total or kind != "biking":
                turn_text = turns[index] if index < len(turns) else ""
                tokens = frozenset(part.strip() for part in turn_text.split(";")) - {
                    ""
                } or frozenset(["none"])
        wide = read_width(value("width", place))
        own = BIKE_WIDTH if kind == "biking" else width
        if wide is not None and not 1.0 <= wide <= 7.5:
            wide = None
        change = {"not_left": "only_right", "not_right": "only_left", "no": "no"}.get(
            value("change", place), "yes"
        )
        lanes.append(StreetLane(kind, wide or own, tokens, change))
    return lanes


def _side_value(keys: _Keys, name: str, side: str) -> str | None:
    """What a key says of a side: ``name:side``, ``name:both``, ``name``."""
    found = keys.get(f"{name}:{side}", f"{name}:both")
    if found is not None:
        return found
    plain = keys.get(name)
    if plain in ("both", "left", "right"):
        return "yes" if plain in ("both", side) else "no"
    return plain


def _has_sidewalk(keys: _Keys, side: str) -> str:
    value = _side_value(keys, "sidewalk", side)
    if value in ("yes", "lane", "explicit"):
        return "yes" if value != "explicit" else "separate"
    return value if value in ("separate", "no", "none") else ""


def _parking_width(keys: _Keys, side: str) -> float | None:
    value = _side_value(keys, "parking", side)
    if value in ("lane", "street_side", "yes"):
        orientation = _side_value(keys, "parking", f"{side}:orientation") or keys.get(
            f"parking:{side}:orientation", "parking:both:orientation"
        )
        return PARKING_WIDTH.get(orientation or "parallel", PARKING_WIDTH["parallel"])
    old = keys.get(f"parking:lane:{side}", "parking:lane:both")
    return PARKING_WIDTH.get(old or "")


def read_street(tags: Tags, country: Country, *, walks: Mapping[str, bool]) -> StreetReading:
    """Make a cross-section of the tags of a way.

    Parameters
    ----------
    walks
        Whether a footway of its own runs beside the way, by side.
    """
    keys = _Keys(tags)
    guesses: list[Guess] = []
    highway = keys.get("highway") or "road"
    usual = CLASSES[highway]
    oneway = is_oneway(tags)
    keys.get("oneway", "junction")

    # Lanes for cars of each direction.
    total = keys.number("lanes")
    ahead, back = keys.number("lanes:forward"), keys.number("lanes:backward")
    if oneway:
        suffixes = ("", "")
        turn_list = tags.get("turn:lanes") or tags.get("turn:lanes:forward")
        own = total or ahead
        if not own:
            own = len(turn_list.split("|")) if turn_list else 2 if highway == "motorway" else 1
            if not turn_list:
                guesses.append(Guess(f"{own} lane{'s' * (own > 1)}: the class of the road", 0.7))
        counts = (own, 0)
    else:
        suffixes = (":forward", ":backward")
        both = keys.number("lanes:both_ways") or 0
        if both:
            keys.used.pop("lanes:both_ways")
            keys.ignored["lanes:both_ways"] = "a lane of both directions has none in SUMO"
        listed = [
            len(tags[f"turn:lanes{s}"].split("|")) if f"turn:lanes{s}" in tags else None
            for s in suffixes
        ]
        ahead, back = ahead or listed[0], back or listed[1]
        rest = None if total is None else max(0, total - both)
        if ahead is None and back is None and rest is not None and rest >= 2:
            ahead, back = (rest + 1) // 2, rest // 2
            if rest % 2:
                guesses.append(Guess(f"lanes={total} divided into {ahead} ahead, {back} back", 0.5))
        elif ahead is None and back is not None:
            ahead = max(1, rest - back) if rest else 1
        elif back is None and ahead is not None:
            back = max(1, rest - ahead) if rest else 1
        if ahead is None or back is None:
            ahead = back = 1
            if total is None:
                guesses.append(Guess("a lane each way: nothing is said of lanes", 0.7))
        counts = (ahead, back)

    # Widths: of each lane by its list, else of the carriageway, else of the class.
    width = usual.width
    text = keys.get("width:carriageway", "width")
    wide = read_width(text) if text else None
    lane_count = max(1, sum(counts))
    narrow = total == 1 and not oneway
    if narrow:
        width = (wide if wide and 3.0 <= wide <= 7.0 else ONE_LANE_WIDTH) / 2
        guesses.append(Guess("one lane for both directions: two narrow ones", 0.4))
    elif wide is not None and 2.4 <= wide / lane_count <= 4.5:
        width = wide / lane_count
    else:
        if text:
            for key in ("width", "width:carriageway"):
                if key in keys.used:
                    keys.ignored[key] = (
                        f"{text!r} for {lane_count} lanes: not of these lanes alone, or no number"
                    )
                    del keys.used[key]
        if not any(key.startswith("width:lanes") for key in tags):
            guesses.append(Guess(f"lanes of {width:g} m: the class of the road", 0.5))

    right = _read_direction(keys, suffixes[0], counts[0], width, guesses)
    left = _read_direction(keys, suffixes[1], counts[1], width, guesses) if counts[1] else []

    # Vehicles that may not drive on it, or on it alone.
    if is_for_buses(tags) and (keeps_cars_out(tags) or highway in ("busway", "bus_guideway")):
        right, left = (
            [replace(lane, kind="bus" if lane.kind == "driving" else lane.kind) for lane in lanes]
            for lanes in (right, left)
        )
    denied = []
    if tags.get("hgv") in ("no", "private") or tags.get("goods") == "no":
        keys.get("hgv")
        denied += ["truck"]
    if tags.get("bicycle") in ("no", "use_sidepath", "private"):
        keys.get("bicycle")
        denied += ["bicycle"]
    if denied:
        right, left = (
            [replace(lane, denied=tuple(denied)) if lane.carries_cars else lane for lane in lanes]
            for lanes in (right, left)
        )

    # Beside the lanes for cars, from the inside to the outside: bicycles, parking, pedestrians.
    for side, lanes, forward in (("right", right, True), ("left", left, False)):
        opposite = not forward and bool(oneway)
        cycle = _side_value(keys, "cycleway", side)
        has_bikes = any(lane.kind == "biking" for lane in lanes)
        if cycle in ("lane", "track", "opposite_lane", "opposite_track") and not has_bikes:
            against = (
                cycle.startswith("opposite")
                or tags.get("oneway:bicycle") == "no"
                or (tags.get(f"cycleway:{side}:oneway") in ("-1", "no"))
            )
            wide_track = cycle.endswith("track")
            lane = StreetLane("biking", TRACK_WIDTH if wide_track else BIKE_WIDTH, change="no")
            if not opposite or against:
                lanes.append(lane)
            elif tags.get(f"cycleway:{side}") in ("lane", "track"):
                # On the left of a one-way road, in its direction.
                right.insert(0, lane)
            guesses.append(Guess(f"bicycle {cycle.split('_')[-1]} of {lane.width:g} m", 0.6))
        elif cycle in ("lane", "track") and has_bikes:
            pass
        elif cycle and cycle not in ("no", "none"):
            for key in (f"cycleway:{side}", "cycleway:both", "cycleway"):
                if key in keys.used:
                    keys.ignored[key] = f"{cycle}: no lane of the carriageway"
        parked = _parking_width(keys, side)
        if parked is not None:
            lanes.append(StreetLane("parking", parked, change="no"))
        sidewalk = _has_sidewalk(keys, side)
        width_text = keys.get(f"sidewalk:{side}:width", "sidewalk:both:width")
        walk = (read_width(width_text) if width_text else None) or WALK_WIDTH
        walk = min(max(walk, 1.0), 6.0)
        if sidewalk == "yes" or (sidewalk in ("", "separate") and walks.get(side, False)):
            lanes.append(StreetLane("sidewalk", walk, change="no"))
            if sidewalk != "yes":
                guesses.append(
                    Guess(f"sidewalk on the {side}: a footway runs beside the road", 0.7)
                )
            elif not width_text:
                guesses.append(Guess(f"sidewalk of {walk:g} m", 0.6))
        elif sidewalk == "separate":
            key = next(k for k in (f"sidewalk:{side}", "sidewalk:both", "sidewalk") if k in tags)
            keys.ignored[key] = "no footway of the extract runs beside the road"

    section = CrossSection(tuple(right), tuple(left), 0.0, 0.0, 0.0)
    section = replace(section, offset=_divider_offset(section, keys, bool(oneway)))
    speeds = _read_speeds(keys, highway, country, guesses)
    section = replace(section, speed_right=speeds[0], speed_left=speeds[1])
    for key in keys.ignored:
        keys.used.pop(key, None)
    return StreetReading(section, guesses, keys.used, keys.ignored)


def _divider_offset(section: CrossSection, keys: _Keys, oneway: bool) -> float:
    """Where the divider is, from the line of the way: its middle, or what ``placement`` says."""
    right = [lane for lane in section.right if lane.kind not in ("sidewalk", "parking")]
    left = [lane for lane in section.left if lane.kind not in ("sidewalk", "parking")]
    wide_right = sum(lane.width for lane in right)
    wide_left = sum(lane.width for lane in left)
    for key, lanes, sign in (
        ("placement", right, 1.0),
        ("placement:forward", right, 1.0),
        ("placement:backward", left, -1.0),
    ):
        value = keys.tags.get(key, "")
        match = re.fullmatch(r"(left_of|right_of|middle_of):(-?\d+)", value)
        if not match or (key == "placement" and not oneway):
            if value:
                keys.ignored[key] = f"{value!r} is not understood, or has no direction"
            continue
        # The number counts lanes for cars, but where lists of lanes have bicycle lanes, those too.
        number = int(match[2])
        number += len(lanes) + 1 if number < 0 else 0
        if not 1 <= number <= len(lanes):
            keys.ignored[key] = f"there is no lane {number}"
            continue
        keys.used[key] = value
        before = sum(lane.width for lane in lanes[: number - 1])
        share = {"left_of": 0.0, "middle_of": 0.5, "right_of": 1.0}[match[1]]
        return sign * (before + share * lanes[number - 1].width)
    return (wide_right - wide_left) / 2


def _read_speeds(
    keys: _Keys, highway: str, country: Country, guesses: list[Guess]
) -> tuple[float, float]:
    speeds = []
    for direction in ("forward", "backward"):
        text = keys.get(f"maxspeed:{direction}", "maxspeed")
        speed = None if text is None else read_speed(text, country)
        if text is not None and speed is None:
            for key in (f"maxspeed:{direction}", "maxspeed"):
                if key in keys.used:
                    keys.ignored[key] = f"{text!r} is no limit that is understood"
        if speed is None:
            zone = keys.get("maxspeed:type", "source:maxspeed", "zone:traffic", "zone:maxspeed")
            speed = read_speed(zone, country) if zone and ":" in zone else None
        if speed is None:
            speed = _usual_limit(highway, country) * KMH
            if direction == "forward":
                shown = "no limit" if speed == NO_LIMIT else f"{speed * 3.6:.0f} km/h"
                guesses.append(Guess(f"{shown}: usual in {country.code or 'towns'}", 0.5))
        speeds.append(speed)
    return speeds[0], speeds[1]


def _usual_limit(highway: str, country: Country) -> float:
    limits = country.limits
    plain = highway.removesuffix("_link")
    if highway in limits:
        return limits[highway]
    if plain == "motorway" and plain != highway:
        return CLASSES[highway].limit
    if plain == "trunk" and plain == highway:
        return limits.get("trunk", limits["rural"])
    if highway in ("service", "track", "living_street"):
        return CLASSES[highway].limit
    return limits["urban"]


def iterate_lists(tags: Tags) -> Iterator[tuple[str, list[str]]]:
    """Tags with a value for each lane."""
    for key, value in tags.items():
        if ":lanes" in key:
            yield key, value.split("|")
