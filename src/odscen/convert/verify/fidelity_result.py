"""Result of :func:`odscen.convert.verify.fidelity.verify`: figures, places, a verdict per limit.

Places are in the OpenDRIVE frame, metres. Lanes of the map are written ``road.lane`` where the
section does not matter, else ``road.section.lane``.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

MAX_P99 = 0.05
"""Metres that 99 % of the places on driving lanes may lie beside the map's lane at most."""
NEAR = 0.25
"""Metres within which a lane counts as covered and beyond which a place counts as far."""
MAX_FAR_SHARE = 0.002
MIN_COVERAGE = 0.998
MIN_SIDEWALKS = 0.98
CROSSWALK_SHARE = 0.6
"""Share of its area that a crossing must lie on for a crosswalk to count as kept."""


@dataclass(frozen=True, slots=True)
class Deviation:
    """Metres between SUMO lanes and the map's lanes, at places a metre apart.

    ``far`` is the share of places more than :data:`NEAR` aside.
    """

    lanes: int
    places: int
    p50: float
    p95: float
    p99: float
    max: float
    far: float


@dataclass(frozen=True, slots=True)
class LaneCover:
    """Length of lanes in metres and the share of it that SUMO has a lane for."""

    length: float
    share: float


@dataclass(frozen=True, slots=True)
class FarPlace:
    """Where a SUMO lane lies farthest from the map's lanes; one per lane."""

    lane: str
    x: float
    y: float
    metres: float


@dataclass(frozen=True, slots=True)
class UncoveredStretch:
    """``metres`` of a lane of the map that SUMO has no lane for, and the middle of them."""

    lane: str
    x: float
    y: float
    metres: float


@dataclass(frozen=True, slots=True)
class LaneRelation:
    """A connection from lane to lane (``road.lane``, ``?`` if SUMO's lane is none of the map's).

    ``sumo`` names the SUMO lanes of an invented one.
    """

    source: str
    target: str
    x: float
    y: float
    sumo: str = ""


@dataclass(frozen=True, slots=True)
class LostCrosswalk:
    """A crosswalk of which the best crossing overlaps only ``share``."""

    road: str
    object_id: str
    x: float
    y: float
    share: float


@dataclass(frozen=True, slots=True)
class UnsafePair:
    """Two links that conflict and are green in the same phase; ``links`` are link indices.

    ``yields`` says that one of both at least has the green that gives way (``g``), but does not
    give way to the other by the junction's right of way.
    """

    tl: str
    phase: int
    links: tuple[int, int]
    yields: bool
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class SignalCoverage:
    """Junctions with traffic lights: counts, and the ids of those that only one side has.

    ``lights`` counts the map's traffic lights; ``lost_lights`` control nothing in SUMO.
    """

    opendrive: int
    sumo: int
    lost: tuple[str, ...]
    invented: tuple[str, ...]
    lights: int = 0
    lost_lights: tuple[str, ...] = ()


class FidelityVerdict(NamedTuple):
    """One limit: what was found, what is allowed (``at_most`` or at least), whether it holds."""

    name: str
    value: float
    limit: float
    at_most: bool

    @property
    def ok(self) -> bool:
        """Whether the limit is held."""
        return self.value <= self.limit if self.at_most else self.value >= self.limit


@dataclass(frozen=True, slots=True)
class Fidelity:
    """How faithfully a SUMO network follows its map.

    Attributes
    ----------
    normal, internal
        Driving lanes outside and inside junctions; ``far_places`` lists every lane that lies more
        than :data:`MAX_P99` aside somewhere, farthest first.
    coverage, coverage_roads, coverage_junctions
        Drivable lanes of the map with a SUMO lane; ``gaps`` lists those that lack more than 1 m.
    relations
        Number of relations between drivable lanes of the map outside junctions.
    missing, invented
        Relations that only the map has, only SUMO has.
    sidewalks
        Walkable lanes with a lane for pedestrians alone; ``sidewalk_gaps`` as ``gaps``.
    crosswalks
        Number of crosswalks of the map; ``lost_crosswalks`` are those without a crossing.
    cars_on_sidewalks
        SUMO lanes that cars may use and that run along walkable lanes.
    wrong_side
        Whether the network drives on the other side of the road than the map.
    """

    normal: Deviation
    internal: Deviation
    far_places: tuple[FarPlace, ...]
    coverage: LaneCover
    coverage_roads: LaneCover
    coverage_junctions: LaneCover
    gaps: tuple[UncoveredStretch, ...]
    relations: int
    missing: tuple[LaneRelation, ...]
    invented: tuple[LaneRelation, ...]
    sidewalks: LaneCover
    sidewalk_gaps: tuple[UncoveredStretch, ...]
    crosswalks: int
    lost_crosswalks: tuple[LostCrosswalk, ...]
    cars_on_sidewalks: tuple[str, ...]
    signals: SignalCoverage
    unsafe_pairs: tuple[UnsafePair, ...]
    wrong_side: bool

    @property
    def verdicts(self) -> tuple[FidelityVerdict, ...]:
        """Every limit and whether it is held."""
        return (
            FidelityVerdict("lanes on roads, 99 %, m", self.normal.p99, MAX_P99, True),
            FidelityVerdict(
                "lanes on roads, share over 0.25 m", self.normal.far, MAX_FAR_SHARE, True
            ),
            FidelityVerdict("lanes in junctions, 99 %, m", self.internal.p99, MAX_P99, True),
            FidelityVerdict(
                "lanes in junctions, share over 0.25 m", self.internal.far, MAX_FAR_SHARE, True
            ),
            FidelityVerdict(
                "drivable lanes covered, share", self.coverage.share, MIN_COVERAGE, False
            ),
            FidelityVerdict("relations missing", len(self.missing), 0, True),
            FidelityVerdict("relations invented", len(self.invented), 0, True),
            FidelityVerdict("sidewalks covered, share", self.sidewalks.share, MIN_SIDEWALKS, False),
            FidelityVerdict("crosswalks lost", len(self.lost_crosswalks), 0, True),
            FidelityVerdict("car lanes on sidewalks", len(self.cars_on_sidewalks), 0, True),
            FidelityVerdict("junctions with lights lost", len(self.signals.lost), 0, True),
            FidelityVerdict("traffic lights lost", len(self.signals.lost_lights), 0, True),
            FidelityVerdict("unsafe greens", len(self.unsafe_pairs), 0, True),
            FidelityVerdict("wrong side of the road", int(self.wrong_side), 0, True),
        )

    @property
    def passed(self) -> bool:
        """Whether every limit is held."""
        return all(verdict.ok for verdict in self.verdicts)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data, for JSON."""
        verdicts = [{**verdict._asdict(), "ok": verdict.ok} for verdict in self.verdicts]
        return {"passed": self.passed, "verdicts": verdicts, **asdict(self)}
