"""Demand and capacity of lane groups at traffic lights, by interval.

As HCM chapter 19 has it, for connections ``i`` of a lane that are driven in shares ``p_i``::

    c_i = s * g_i / 3600                      vehicles in the interval
    c   = sum over the lanes of 1 / sum over i of p_i / c_i
    v/c = demand / c

``g_i`` is the effective green that the light showed in the interval, actuated or not: the green
displayed, for start-up lost time and the use of yellow are both 2 s by default (HCM chapter 19)
and cancel. ``s`` is the saturation flow of the run itself, measured as HCM chapter 31 does in the
field: headways of the fifth and later vehicles of each queue that drives off; where fewer than
:data:`FEWEST_HEADWAYS` are known, that of all lanes at lights; where that is not known either,
HCM's 1,900 pc/h/ln. Demand are those who would have come to the stop line in the interval without
control delay, not those who passed it.

A connection that has green together with vehicles to which it gives way (permitted turns) carries
what their gaps let through: of a gap of ``h`` seconds ``floor((h - t_c) / t_f) + 1`` vehicles if
``h >= t_c``, with HCM's critical gap and follow-up time of permitted left turns, and
:data:`SNEAKERS` more at the end of each green. Where :data:`FEWEST_GREENS` greens or more of this
run did not clear the queue, all of it is taken times what they let through in proportion, with the
green of that turn that follows at once, and those who enter while the light is yellow.
Pedestrians to whom turns give way are not considered otherwise. Movements without lights are in
:mod:`odscen.figures.by_place.unsignalised`.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, NamedTuple

from odscen.figures.by_place.analysis_times import begins_at
from odscen.scenario.signals.webster import CRITICAL_GAP, FOLLOW_UP, SATURATION_FLOW

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.lane_groups import LaneGroups
    from odscen.records.light_programs import LightProgram

FEWEST_HEADWAYS = 15
"""Saturation headways from which a lane group has a saturation flow of its own."""
SNEAKERS = 2
"""Vehicles of a permitted turn that clear the junction after each green: HCM chapter 31."""
FEWEST_GREENS = 5
"""Greens that did not clear the queue from which permitted turns are taken as the run has them."""
_FREE = 4
"""Vehicles of a queue whose headways are longer because they start up."""
HELD = 4.0
"""Seconds lost before the line from which a vehicle was in the queue."""
_BREAK = 6.0
"""Seconds between two vehicles that end a discharging queue."""
_LEAST = 1e-9
_LINK = ("via", "source", "lane_group")


class _Green(NamedTuple):
    """Seconds in which a connection has green, and whether it gives way meanwhile."""

    time: float
    until: float
    permitted: bool


class _Turn(NamedTuple):
    """A green with gaps in it: its interval, from when to when, and vehicles it has room for."""

    interval: float
    begin: float
    end: float
    number: float


def shown_greens(
    programs: Sequence[LightProgram],
    states: pl.DataFrame,
    clock: pl.DataFrame,
    facts: NetFacts,
) -> pl.DataFrame:
    """Greens of each connection at lights, cut at the ends of intervals.

    Parameters
    ----------
    states
        From :func:`odscen.runs.recorded.read_light_states`.
    clock
        ``begin`` and ``end`` of each interval.

    Returns
    -------
    ``via``, ``begin`` of the interval, ``time`` and ``until`` (s), and ``permitted``: whether
    vehicles have green to whom the connection gives way.
    """
    import polars as pl

    col = pl.col
    first, last = clock["begin"][0], clock["end"][-1]
    edges = clock.select(time="begin").join(states.select(col("light").unique()), how="cross")
    spans = (
        pl.concat([states.select("light", "time", "state"), edges], how="diagonal")
        .sort("light", "time", maintain_order=True)
        .with_columns(state=col("state").forward_fill().over("light"))
        .with_columns(until=col("time").shift(-1).over("light").fill_null(last).clip(None, last))
        .filter(col("state").is_not_null() & (col("until") > col("time")) & (col("time") >= first))
    )
    spans = spans.with_columns(begins_at(spans["time"], clock))
    shown = _links_shown(programs, spans.select("light", "state").unique(), facts)
    return spans.join(shown, on=("light", "state")).sort("via", "time").drop("light", "state")


def _links_shown(
    programs: Sequence[LightProgram], states: pl.DataFrame, facts: NetFacts
) -> pl.DataFrame:
    """Connections that have green in each state, and whether they give way in it."""
    import polars as pl

    before = dict(facts.links.select("via", "yields_to").rows())
    of_light: dict[str, list[str]] = {}
    for name, state in states.rows():
        of_light.setdefault(name, []).append(state)
    rows = []
    for light in programs:
        at = {
            lanes[1]: link
            for group in light.groups
            for link, lanes in zip(group.links, group.lanes, strict=False)
            if len(lanes) > 1
        }
        for state in sorted(of_light.get(light.id, ())):
            green = {via for via, link in at.items() if state[link] in "Gg"}
            rows += [
                (light.id, state, via, state[at[via]] == "g" and bool(green & {*before[via]}))
                for via in sorted(green)
                if via in before
            ]
    return pl.DataFrame(
        rows,
        schema={
            "light": pl.String, "state": pl.String, "via": pl.String, "permitted": pl.Boolean,
        },
        orient="row",
    )  # fmt: skip


def saturation_flows(passed: pl.DataFrame, groups: LaneGroups) -> pl.DataFrame:
    """Saturation flow of each lane group in this run.

    Parameters
    ----------
    passed
        From :func:`odscen.figures.by_place.control_delay.passages`, of movements at lights.

    Returns
    -------
    ``lane_group``, ``headways`` that were measured, and ``saturation_flow``, veh/h and lane.
    """
    import numpy as np
    import polars as pl

    queued = (
        passed.drop_nulls("movement")
        .join(groups.ways.select("via", "source", "lane_group"), left_on="lane", right_on="via")
        .sort("source", "time", "id")
    )
    time = queued["time"].to_numpy()
    held = queued["before"].to_numpy() >= HELD
    first = np.diff(queued["source"].rle_id().to_numpy().astype(np.int64), prepend=-1) > 0
    headway = np.diff(time, prepend=np.nan)
    breaks = first | ~held | (headway > _BREAK)
    # Place in the queue, from 1 on.
    place = np.arange(1, len(time) + 1)
    begun = np.flatnonzero(breaks)
    place -= begun[np.cumsum(breaks) - 1] if len(begun) else 0
    known = held & (place > _FREE)
    own: dict[str, list[float]] = {}
    for group, seconds in zip(queued["lane_group"].filter(known), headway[known], strict=True):
        own.setdefault(group, []).append(float(seconds))
    number = int(known.sum())
    enough = number >= FEWEST_HEADWAYS
    usual = 3600.0 * number / float(headway[known].sum()) if enough else SATURATION_FLOW
    rows = []
    for group in groups.groups["lane_group"]:
        seconds = own.get(group, [])
        measured = len(seconds) >= FEWEST_HEADWAYS
        flow = 3600.0 * len(seconds) / sum(seconds) if measured else usual
        rows.append((group, len(seconds), flow))
    schema = {"lane_group": pl.String, "headways": pl.Int64, "saturation_flow": pl.Float64}
    return pl.DataFrame(rows, schema=schema, orient="row")


def demand_sums(passed: pl.DataFrame, groups: LaneGroups, clock: pl.DataFrame) -> pl.DataFrame:
    """Vehicles that would have come to the stop line in each interval: ``demand``.

    Parameters
    ----------
    passed
        From :func:`odscen.figures.by_place.control_delay.passages`: those that were queued when
        the run ended count too.
    """
    import polars as pl

    due = passed["time"] - passed["before"]
    return (
        passed.select("lane", begins_at(due, clock))
        .join(groups.leads, on="lane")
        .drop_nulls("begin")
        .group_by("lane_group", "begin")
        .agg(demand=pl.len().cast(pl.Int64))
        .sort("lane_group", "begin")
    )


def capacity_sums(
    greens: pl.DataFrame,
    flows: pl.DataFrame,
    passed: pl.DataFrame,
    groups: LaneGroups,
    facts: NetFacts,
) -> pl.DataFrame:
    """Capacity of lane groups at lights, vehicles by interval.

    Parameters
    ----------
    greens
        From :func:`shown_greens`.
    flows
        From :func:`saturation_flows`.

    Returns
    -------
    ``lane_group``, ``begin``, ``capacity``.
    """
    import polars as pl

    return (
        shared_lanes(_link_capacities(greens, flows, passed, groups, facts), passed, groups)
        .group_by("lane_group", "begin")
        .agg(pl.col("capacity").sum())
        .sort("lane_group", "begin")
    )


def shared_lanes(
    capacities: pl.DataFrame, passed: pl.DataFrame, groups: LaneGroups
) -> pl.DataFrame:
    """Capacity of lanes from those of their connections, in the shares that were driven.

    Parameters
    ----------
    capacities
        ``via``, ``begin``, ``capacity`` as if each connection had its lane for itself.

    Returns
    -------
    ``lane_group``, ``source``, ``begin``, ``capacity``.
    """
    import polars as pl

    entered = Counter(passed["lane"].filter(passed["movement"].is_not_null()))
    of = {via: (group, lane) for via, lane, group in groups.ways.select(_LINK).rows()}
    lanes: dict[tuple[str, str, float], list[tuple[float, float]]] = defaultdict(list)
    for via, begin, capacity in capacities.select("via", "begin", "capacity").rows():
        if via in of:
            lanes[*of[via], begin].append((entered[via] + _LEAST, max(capacity, _LEAST)))
    rows = []
    for key, links in sorted(lanes.items()):
        total = sum(number for number, _ in links)
        rows.append((*key, 1.0 / sum(number / total / capacity for number, capacity in links)))
    names = {"lane_group": pl.String, "source": pl.String, "begin": pl.Float64}
    return pl.DataFrame(rows, schema={**names, "capacity": pl.Float64}, orient="row")


def _link_capacities(
    greens: pl.DataFrame,
    flows: pl.DataFrame,
    passed: pl.DataFrame,
    groups: LaneGroups,
    facts: NetFacts,
) -> pl.DataFrame:
    """``via``, ``begin`` and ``capacity``, as if each connection had its lane for itself."""
    import numpy as np
    import polars as pl

    col = pl.col
    flow_of = dict(groups.ways.join(flows, on="lane_group").select("via", "saturation_flow").rows())
    before = dict(facts.links.select("via", "yields_to").rows())
    # Lists by connection, and no table for each: a table costs more than what is in it.
    entered = (
        passed.drop_nulls("movement")
        .select("lane", "time", due=col("time") - col("before"))
        .sort("time")
        .group_by("lane")
        .agg("due", "time")
    )
    entries = {via: np.array([due, time]).T for via, due, time in entered.rows()}
    shown: dict[str, dict[float, list[_Green]]] = {}
    for via, *green in greens.select("via", "begin", "time", "until", "permitted").rows():
        if via in flow_of:
            shown.setdefault(via, {}).setdefault(green[0], []).append(_Green(*green[1:]))
    nothing = np.zeros((0, 2))
    found = []
    for via, by_begin in shown.items():
        foes = [entries.get(lane, nothing)[:, 1] for lane in before[via]]
        opposing = np.sort(np.concatenate(foes)) if foes else np.zeros(0)
        flow = flow_of[via] / 3600.0
        totals = dict.fromkeys(by_begin, 0.0)
        turns, starts = [], []
        for begin, own in by_begin.items():
            for span in _merge_spans(own):
                starts.append(span[0].time)
                gaps = _merge_spans(green for green in span if green.permitted)
                number = flow * sum(
                    green.until - green.time for green in span if not green.permitted
                )
                if gaps:
                    number += sum(
                        through_gaps(opposing, part[0].time, part[-1].until, most=flow_of[via])
                        for part in gaps
                    )
                    turns.append(_Turn(begin, span[0].time, span[-1].until, number))
                else:
                    totals[begin] += number
        share = _measure_driven_share(entries.get(via, nothing), turns, np.sort(starts))
        for turn in turns:
            totals[turn.interval] += share * turn.number
        found += [(via, begin, total) for begin, total in sorted(totals.items())]
    schema = {"via": pl.String, "begin": pl.Float64, "capacity": pl.Float64}
    return pl.DataFrame(sorted(found), schema=schema, orient="row")


def _measure_driven_share(entries: FloatArray, turns: Sequence[_Turn], starts: FloatArray) -> float:
    """What greens that did not clear the queue let through, as a share of what they have room for.

    Parameters
    ----------
    entries
        ``(K, 2)``, when vehicles came to the queue and when they entered the junction, ascending.
    starts
        ``(G,)`` when greens of the connection begin, ascending.
    """
    import numpy as np

    due, time = entries[:, 0], entries[:, 1]
    greens, served, room = 0, 0, 0.0
    for turn in turns:
        # Up to the next green: who enters while the light is yellow is driven, too.
        later = starts[starts > turn.begin]
        first, last = np.searchsorted(time, (turn.begin, later[0] if len(later) else np.inf))
        if last < len(time) and due[first] < turn.begin and due[last] < turn.end:
            greens += 1
            served += int(last - first)
            room += turn.number
    return served / room if greens >= FEWEST_GREENS and room else 1.0


def _merge_spans(greens: Iterable[_Green]) -> list[list[_Green]]:
    """Greens without a break between them together, in the order of time."""
    found: list[list[_Green]] = []
    for green in sorted(greens):
        if found and green.time <= found[-1][-1].until:
            found[-1].append(green)
        else:
            found.append([green])
    return found


def through_gaps(opposing: FloatArray, begin: float, end: float, *, most: float) -> float:
    """Vehicles that could turn between others in a green from ``begin`` to ``end`` seconds.

    Parameters
    ----------
    opposing
        ``(K,)`` times at which those come to whom they give way, ascending.
    most
        Saturation flow, veh/h: an empty road carries no more.
    """
    import numpy as np

    there = opposing[(opposing > begin) & (opposing < end)]
    gaps = np.diff(np.concatenate(([begin], there, [end])))
    taken = np.floor((gaps - CRITICAL_GAP) / FOLLOW_UP) + 1.0
    turned = float(taken[gaps >= CRITICAL_GAP].sum()) + SNEAKERS
    return min(turned, (end - begin) * most / 3600.0)
