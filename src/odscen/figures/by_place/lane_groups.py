"""Lane groups of approaches: lanes before a junction that share a movement, and how far they reach.

A lane group of the HCM is what is analysed as one: the lanes of an approach that vehicles of the
same movements choose from. Here lanes belong together if a movement can be driven from both, so
that exclusive turning lanes are groups of their own.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.lane_places import LanePlaces

JOINED = " + "
"""Between the movements in the name of a lane group."""


@dataclass(frozen=True, eq=False)
class LaneGroups:
    """Lane groups of a map; metres.

    Attributes
    ----------
    groups
        ``lane_group`` (its movements, joined by ``+``), ``junction``, number of ``lanes``,
        ``storage`` (from the stop line back to where its lanes become part of others, or to the
        junction behind) and ``room`` (back to the junction behind).
    ways
        One row for each first lane inside: ``via``, the ``source`` lane before it, ``movement``,
        ``lane_group``.
    reach
        One row for each lane and group that it leads to: ``lane``, ``junction``, ``lane_group``,
        and ``ahead``, from the end of the lane to the stop line.
    """

    groups: pl.DataFrame
    ways: pl.DataFrame
    reach: pl.DataFrame

    @cached_property
    def first(self) -> pl.DataFrame:
        """The first group of each ``lane`` on the way.

        ``lane``, ``junction``, ``other`` (its name) and ``ahead_of_other`` (metres).
        """
        return (
            self.reach.sort("lane", "lane_group")
            .unique("lane", keep="first")
            .select("lane", "junction", other="lane_group", ahead_of_other="ahead")
        )

    @cached_property
    def leads(self) -> pl.DataFrame:
        """``lane`` and the one ``lane_group`` for which vehicles on it count.

        First lanes inside, and lanes on the way.
        """
        import polars as pl

        inside = self.ways.select("lane_group", lane="via")
        both = [inside, self.first.select("lane", lane_group="other").select("lane_group", "lane")]
        return pl.concat(both).unique("lane", keep="first")

    @cached_property
    def of(self) -> pl.DataFrame:
        """``movement`` and its ``lane_group``."""
        return self.ways.select("movement", "lane_group").unique("movement", maintain_order=True)


def lane_groups(places: LanePlaces, facts: NetFacts) -> LaneGroups:
    """Lane groups of all junctions, from the lanes and connections of the network."""
    return facts.once("lane_groups", places, lambda: _lane_groups(places, facts))


def _lane_groups(places: LanePlaces, facts: NetFacts) -> LaneGroups:
    import polars as pl

    text = pl.String
    # Cycle lanes at the stop line carry none of the vehicles that capacity is of.
    narrow = places.lanes.filter(~pl.col("motor"))["lane"].unique().implode()
    inner = places.ways.filter(
        (pl.col("via") == pl.col("lane")) & ~pl.col("source").is_in(narrow)
    ).sort("junction", "via")
    named = _name_groups(inner.select("junction", "source", "movement").rows())
    ways = inner.with_columns(
        lane_group=pl.Series([named[lane] for lane in inner["source"]], dtype=text)
    ).select("junction", "via", "source", "movement", "lane_group")
    net = _Net(places, facts)
    reach, groups = [], []
    for (junction, group), rows in ways.group_by("junction", "lane_group", maintain_order=True):
        sources = sorted(set(rows["source"].to_list()))
        ahead = net.behind(sources, str(junction))
        room = max(distance + net.length[lane] for lane, distance in ahead.items())
        storage = max(net.own_length(lane, str(junction)) for lane in sources)
        groups.append((group, junction, len(sources), storage, room))
        reach += [(lane, junction, group, metres) for lane, metres in sorted(ahead.items())]
    number = pl.Float64
    return LaneGroups(
        pl.DataFrame(
            groups,
            schema={
                "lane_group": text, "junction": text, "lanes": pl.Int64, "storage": number,
                "room": number,
            },
            orient="row",
        ),
        ways,
        pl.DataFrame(
            reach,
            schema={"lane": text, "junction": text, "lane_group": text, "ahead": number},
            orient="row",
        ),
    )  # fmt: skip


class _Net:
    """Lanes before junctions, and which of them follow each other."""

    def __init__(self, places: LanePlaces, facts: NetFacts) -> None:
        self.length: dict[str, float] = dict(facts.limits.select("lane", "length").rows())
        outside = places.ways.filter(places.ways["via"].is_null())
        self._junction: dict[str, str] = dict(outside.select("lane", "junction").rows())
        self._before: Mapping[str, list[str]] = defaultdict(list)
        self._after: Mapping[str, list[str]] = defaultdict(list)
        for lane, following in facts.follows.rows():
            if lane in self._junction and following in self._junction:
                self._before[following].append(lane)
                self._after[lane].append(following)

    def behind(self, sources: Sequence[str], junction: str) -> dict[str, float]:
        """Lanes that lead to these, themselves included, and metres from their end to the line."""
        found = dict.fromkeys(sources, 0.0)
        todo = list(sources)
        while todo:
            lane = todo.pop()
            metres = found[lane] + self.length[lane]
            for previous in self._before[lane]:
                if self._junction[previous] == junction and metres < found.get(previous, 1e9):
                    found[previous] = metres
                    todo.append(previous)
        return found

    def own_length(self, lane: str, junction: str) -> float:
        """Metres from the end of a lane back to where it is no longer by itself."""
        metres, seen = self.length[lane], {lane}
        while True:
            previous = [name for name in self._before[lane] if self._junction[name] == junction]
            if len(previous) != 1 or previous[0] in seen or len(self._after[previous[0]]) != 1:
                return metres
            lane = previous[0]
            seen.add(lane)
            metres += self.length[lane]


def _name_groups(rows: Sequence[tuple[str, str, str]]) -> dict[str, str]:
    """Name of the group of each lane before a junction; rows of junction, lane and movement."""
    parent: dict[str, str] = {}

    def root(lane: str) -> str:
        while parent.setdefault(lane, lane) != lane:
            lane = parent[lane]
        return lane

    for _, lane, movement in rows:
        parent[root(movement)] = root(lane)
    movements: dict[str, set[str]] = defaultdict(set)
    for _, _, movement in rows:
        movements[root(movement)].add(movement)
    return {lane: JOINED.join(sorted(movements[root(lane)])) for _, lane, _ in rows}
