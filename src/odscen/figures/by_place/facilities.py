"""What kind of facility a junction, a movement or a segment is, as the HCM distinguishes them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, TypeVar

from odscen.figures.by_place.analysis_times import begins_at

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.figures.by_place.lane_places import LanePlaces

_Made = TypeVar("_Made")

STOP, ALL_WAY = "s", "w"
"""SUMO's states of connections at a stop sign, and where everybody has to stop."""

HIGHWAY_SPEED = 80.0 / 3.6
"""m/s: from this limit on, and with two lanes or more in a direction, a road is a freeway or
multilane highway of HCM chapter 12."""

HEAVY_AS_CARS = 2.0
"""Passenger cars that a truck or bus stands for on level terrain: HCM Exhibit 12-25."""


class Facility(StrEnum):
    """Kind of facility; each has thresholds of its own for its level of service."""

    SIGNAL = "signal"
    ROUNDABOUT = "roundabout"
    ALL_WAY_STOP = "all-way stop"
    TWO_WAY_STOP = "two-way stop"
    MINOR = "minor movement"
    MAJOR = "major movement"
    UNCONTROLLED = "uncontrolled"
    STREET = "street"
    HIGHWAY = "highway"


@dataclass(frozen=True, slots=True, eq=False)
class FacilityData:
    """What levels of service by facility are made of.

    Attributes
    ----------
    movements
        From :func:`movement_facilities`.
    by_junction, by_movement
        Control delay, from :func:`passage_sums`; ``None`` without trajectories.
    density
        From :func:`highway_density`.
    groups, group_of
        From :func:`odscen.figures.by_place.group_figures.group_sums`; ``None`` without
        trajectories.
    """

    movements: pl.DataFrame
    by_junction: pl.DataFrame | None
    by_movement: pl.DataFrame | None
    density: pl.DataFrame
    groups: pl.DataFrame | None = None
    group_of: pl.DataFrame | None = None


def no_links() -> pl.DataFrame:
    """Table of :attr:`NetFacts.follows` without rows."""
    import polars as pl

    return pl.DataFrame(schema={"lane": pl.String, "following": pl.String})


@dataclass(frozen=True, slots=True, eq=False)
class NetFacts:
    """What the network says that :class:`LanePlaces` does not.

    Attributes
    ----------
    limits
        ``lane``, its ``edge``, its ``length`` (m), and its speed ``limit``, m/s.
    links
        One row for each connection through a junction: ``via`` (its first lane inside), its
        ``state`` (SUMO's letter), whether it ``gives_way`` to other vehicles, whether it leads
        ``onto_ring`` or comes ``from_ring``, a roundabout, ``yields_to``: the ``via`` of those that
        it gives way to, and its ``turn``: SUMO's letter, mirrored where one drives on the left.
    drivers
        ``id``, ``factor`` on limits, ``max_speed`` (m/s), ``length`` (m), whether a vehicle is
        ``heavy``, whether it ``serves`` stops, its ``arrival_pos`` (m along its last lane), its
        planned ``depart`` (s) and the ``edges`` of its route; the last three null if not known.
    follows
        ``lane`` and ``following``: lanes, those in junctions included, by which one drives on.
    shapes
        Points of the centre line of each lane, ``(K, 2)``, metres, SUMO's frame.
    widths
        Metres, of the lanes that vehicles use.
    inside
        Lanes inside junctions.
    made
        What :meth:`once` has made; facts of other runs on the same map share it.
    """

    limits: pl.DataFrame
    links: pl.DataFrame
    drivers: pl.DataFrame
    follows: pl.DataFrame = field(default_factory=no_links)
    shapes: Mapping[str, FloatArray] = field(default_factory=dict)
    widths: Mapping[str, float] = field(default_factory=dict)
    inside: frozenset[str] = frozenset()
    made: dict[str, tuple[LanePlaces, Any]] = field(default_factory=dict, repr=False)

    def once(self, name: str, places: LanePlaces, make: Callable[[], _Made]) -> _Made:
        """What follows from the map alone: made by the first run on it, kept for the others.

        Parameters
        ----------
        name
            Of what is made.
        places
            Of the map; other places than those it was made with have it made anew.
        make
            Makes it, of nothing that a run has of its own.
        """
        kept = self.made.get(name)
        if kept is None or kept[0] is not places:
            kept = self.made[name] = places, make()
        found: _Made = kept[1]
        return found


def movement_facilities(places: LanePlaces, facts: NetFacts) -> pl.DataFrame:
    """``movement``, ``junction``, ``approach``, ``facility`` of each way through a junction."""
    return facts.once("movement_facilities", places, lambda: _classify_facilities(places, facts))


def _classify_facilities(places: LanePlaces, facts: NetFacts) -> pl.DataFrame:
    import polars as pl

    col = pl.col
    lit = places.movements.select("movement", "control")
    kinds = (
        places.ways.filter(col("via").is_not_null())
        .unique("via")
        .join(facts.links, on="via", how="left")
        .join(lit, on="movement", how="left")
        .group_by("movement", "junction", "approach")
        .agg(
            signal=(col("control") == "signal").any(),
            inside=col("from_ring").any(),
            ring=col("onto_ring").any(),
            all_way=(col("state") == ALL_WAY).any(),
            minor=((col("state") == STOP) | col("gives_way")).any(),
        )
    )
    facility = (
        pl.when("signal").then(pl.lit(Facility.SIGNAL.value))
        .when("inside").then(pl.lit(Facility.MAJOR.value))
        .when("ring").then(pl.lit(Facility.ROUNDABOUT.value))
        .when("all_way").then(pl.lit(Facility.ALL_WAY_STOP.value))
        .when("minor").then(pl.lit(Facility.MINOR.value))
        .otherwise(pl.lit(Facility.MAJOR.value))
    )  # fmt: skip
    return kinds.select("movement", "junction", "approach", facility=facility).sort(
        "movement", "approach"
    )


_OF_JUNCTION = (
    (Facility.MINOR, Facility.TWO_WAY_STOP),
    (Facility.ALL_WAY_STOP, Facility.ALL_WAY_STOP),
    (Facility.ROUNDABOUT, Facility.ROUNDABOUT),
    (Facility.SIGNAL, Facility.SIGNAL),
)
"""A junction with such a movement is such a facility; the later ones go before."""


def junction_facilities(movements: pl.DataFrame) -> pl.DataFrame:
    """``junction`` and ``facility``, from those of its movements."""
    import polars as pl

    kinds: dict[str, set[str]] = {}
    for junction, kind in movements.select("junction", "facility").rows():
        kinds.setdefault(junction, set()).add(kind)
    rows = []
    for junction, there in sorted(kinds.items()):
        whole = Facility.UNCONTROLLED
        for of_movement, of_junction in _OF_JUNCTION:
            whole = of_junction if of_movement.value in there else whole
        rows.append((junction, whole.value))
    return pl.DataFrame(rows, schema={"junction": pl.String, "facility": pl.String}, orient="row")


_SOME = (Facility.TWO_WAY_STOP.value, Facility.ROUNDABOUT.value, Facility.UNCONTROLLED.value)
"""Junctions of which not all movements count."""


def passage_sums(
    passed: pl.DataFrame, movements: pl.DataFrame, clock: pl.DataFrame
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Control delay by junction and by movement, summed up by interval.

    At a two-way stop a junction has that of its minor movements, at a roundabout of those that
    enter it; and of who is queued on an approach from which there are no others.

    Parameters
    ----------
    passed
        From :func:`odscen.figures.by_place.control_delay.passages`.
    movements
        From :func:`movement_facilities`.
    clock
        ``begin`` and ``end`` of each interval.

    Returns
    -------
    Two tables with ``begin``, ``passages`` and ``control_seconds``.
    """
    import polars as pl

    col = pl.col
    major = movements.filter(col("facility") == Facility.MAJOR.value)
    two_way = junction_facilities(movements).filter(col("facility").is_in(_SOME))
    timed = passed.with_columns(begins_at(passed["time"], clock)).drop_nulls("begin")
    there = col("junction").is_in(two_way["junction"].implode())
    first = pl.when(col("movement").is_not_null()).then(
        col("movement").is_in(major["movement"].implode())
    )
    left_out = there & first.otherwise(col("approach").is_in(major["approach"].implode()))

    def summed(rows: pl.DataFrame, place: str) -> pl.DataFrame:
        return (
            rows.drop_nulls(place)
            .group_by(place, "begin")
            .agg(passages=pl.len().cast(pl.Int64), control_seconds=col("control_delay").sum())
            .sort(place, "begin")
        )

    return summed(timed.filter(~left_out), "junction"), summed(timed, "movement")


def highway_density(
    parts: pl.DataFrame, places: LanePlaces, facts: NetFacts, heavy: pl.DataFrame | None
) -> pl.DataFrame:
    """Passenger-car seconds and metres of lane of the freeways and multilane highways.

    Parameters
    ----------
    parts
        From :func:`odscen.figures.by_place.lane_parts.lane_parts`.
    heavy
        ``lane``, ``begin`` and ``share``: of the vehicle-seconds there, those of heavy vehicles;
        ``None`` without trajectories, which takes their share of all vehicles. Where ``parts``
        have it, theirs counts.

    Returns
    -------
    ``segment``, ``begin``, ``car_seconds`` and ``lane_metres`` of the densest direction, by SUMO
    edge. Segments that are no highway are not in it, nor intervals without vehicles.
    """
    import polars as pl

    col = pl.col
    known = facts.once("highways", places, lambda: _find_highways(places, facts))
    # A map without any has no row, and most maps are such.
    if known.is_empty():
        return _make_empty_densities()
    share = float(facts.drivers["heavy"].mean() or 0.0)  # type: ignore[arg-type]
    rows = parts.filter("motor").select(
        "lane", "edge", "segment", "begin", "seconds", "heavy_seconds"
    )
    if heavy is None:
        rows = rows.with_columns(share=pl.lit(share))
    else:
        rows = rows.join(heavy, on=("lane", "begin"), how="left")
    own = pl.coalesce("heavy_seconds", col("seconds") * col("share").fill_null(0.0))
    cars = col("seconds") + own * (HEAVY_AS_CARS - 1)
    return (
        rows.with_columns(cars=cars)
        .join(known.select("segment", "edge", "edge_of", "metres"), on=("segment", "edge"))
        .group_by("segment", "edge_of", "begin")
        .agg(car_seconds=col("cars").sum(), metres=col("metres").first())
        .with_columns(density=col("car_seconds") / col("metres"))
        .sort("density", "edge_of")
        .group_by("segment", "begin", maintain_order=True)
        .agg(col("car_seconds").last(), lane_metres=col("metres").last())
        .sort("segment", "begin")
    )


def _make_empty_densities() -> pl.DataFrame:
    import polars as pl

    number = pl.Float64
    return pl.DataFrame(
        schema={
            "segment": pl.String, "begin": number, "car_seconds": number, "lane_metres": number,
        }
    )  # fmt: skip


def _find_highways(places: LanePlaces, facts: NetFacts) -> pl.DataFrame:
    """Edges of freeways and multilane highways."""
    import polars as pl

    col = pl.col
    motor = places.lanes.filter("motor").join(facts.limits, on="lane")
    one_way = places.segments.rename({"length": "road"})
    return (
        motor.with_columns(own=col("length") * col("share"))
        .group_by("segment", "edge")
        .agg(
            col("own").first(),
            metres=col("own").sum(),
            wide=pl.len() >= 2,
            fast=col("limit").min() >= HIGHWAY_SPEED,
        )
        .join(one_way, on="segment")
        .with_columns(directions=(col("own").sum().over("segment") / col("road")).round())
        # Edges one behind the other are one direction.
        .with_columns(edge_of=pl.when(col("directions") > 1).then("edge").otherwise(pl.lit("")))
        .filter((col("wide") & col("fast")).all().over("segment", "edge_of"))
        .with_columns(metres=col("metres").sum().over("segment", "edge_of"))
    )


def has_highways(places: LanePlaces, facts: NetFacts) -> bool:
    """Whether the map has freeways or multilane highways, of which density is a figure."""
    return not facts.once("highways", places, lambda: _find_highways(places, facts)).is_empty()


def heavy_share(
    trajectories: pl.LazyFrame, facts: NetFacts, clock: pl.DataFrame
) -> pl.DataFrame | None:
    """Share of heavy vehicles in the vehicle-seconds of each lane and interval.

    Returns
    -------
    ``lane``, ``begin``, ``share``; ``None`` if the lane was not recorded.
    """
    import polars as pl

    if "vehicle_lane" not in trajectories.collect_schema():
        return None
    return (
        trajectories.select(
            id=pl.col("vehicle_id").cast(str),
            lane=pl.col("vehicle_lane").cast(str),
            time=pl.col("timestep_time").cast(pl.Float64),
        )
        .join(facts.drivers.lazy().select("id", "heavy"), on="id")
        .sort("time")
        .join_asof(clock.lazy().sort("begin"), left_on="time", right_on="begin", coalesce=False)
        .drop_nulls("begin")
        .group_by("lane", "begin")
        .agg(share=pl.col("heavy").mean())
        .collect()
    )
