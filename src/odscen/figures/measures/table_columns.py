"""Columns of the tables of :mod:`odscen.figures.by_place.traffic`, with their units."""

from __future__ import annotations

from odscen.figures.measures.figure import TableColumn

_STOPPED = "below 0.1 m/s"
_HERE = "at the place itself (junction: inside); null with `--no-emissions`"
_SUM = "one of the sums that the other columns are made of"


def _make_column(name: str, unit: str, definition: str, *, whole: bool = False) -> TableColumn:
    return TableColumn(name=name, unit=unit, definition=definition, whole=whole)


COLUMNS = (
    _make_column("begin", "s", "start of the interval"),
    _make_column("end", "s", "end of the interval"),
    _make_column(
        "delay",
        "s",
        "time loss per vehicle: the sum of (1 - speed / desired speed) dt. Junction: from the "
        "junction before, or the start, through this one, per vehicle that enters",
    ),
    _make_column(
        "control_delay",
        "s",
        "control delay per vehicle that entered or wanted to, from trajectories: waiting outside "
        "for room to depart, slowing down, queue and getting up to speed. Junction at a two-way "
        "stop: of the minor movements",
    ),
    _make_column("passages", "veh", "vehicles that `control_delay` is the mean of", whole=True),
    _make_column("control_seconds", "veh*s", f"their control delay; {_SUM}"),
    _make_column(
        "lane_density",
        "pc/km/ln",
        "of freeways and multilane highways: passenger cars per km and lane of the densest "
        "direction, a heavy vehicle as two",
    ),
    _make_column("car_seconds", "veh*s", f"time that passenger cars spent there; {_SUM}"),
    _make_column("lane_metres", "m", "lanes of that direction"),
    _make_column(
        "waiting", "s", f"stopped delay: time {_STOPPED} per vehicle; places as for `delay`"
    ),
    _make_column("travel_time", "s", "segment: along all of it, at the mean speed"),
    _make_column(
        "free_flow_time", "s", "segment: along all of it, at the speeds that drivers desired"
    ),
    _make_column(
        "spread",
        "",
        "segment: share of the time spent there that is known of whole SUMO lanes only, which "
        "reach further, and is shared out by length: 0 where positions were recorded. See "
        "[figures of a segment](figures.md#figures-of-a-segment)",
    ),
    _make_column("spread_seconds", "veh*s", f"that time; {_SUM}"),
    _make_column("seconds", "veh*s", f"time that vehicles spent there; {_SUM}"),
    _make_column("time_loss", "veh*s", f"time that they lost; {_SUM}"),
    _make_column("standing_seconds", "veh*s", f"time that they were {_STOPPED}; {_SUM}"),
    _make_column(
        "vehicles",
        "veh",
        "came into the place or started there; network: were under way",
        whole=True,
    ),
    _make_column(
        "standing", "veh", f"mean number {_STOPPED}, the mean queue; places as for `delay`"
    ),
    _make_column("running", "veh", "network: mean number under way"),
    _make_column("departed", "veh", "network: departed", whole=True),
    _make_column("arrived", "veh", "network: arrived", whole=True),
    _make_column(
        "queue_max",
        "veh",
        "longest queue: vehicles stopped at one time on the approaches to the junction and in it. "
        "Only with trajectories, and not in the mesoscopic model",
    ),
    _make_column(
        "queue_p95",
        "veh",
        "95th percentile queue: what it does not exceed 95 % of the time, of the interval or of "
        "all that is analysed",
    ),
    _make_column("queue_p95_run", "veh", "that of all that is analysed, in each row"),
    _make_column(
        "demand",
        "veh",
        "lane group (movement: of its lane group): would have come to the stop line in the "
        "interval without control delay, from trajectories; those still queued at the end too, "
        "and who waited outside for room to depart",
        whole=True,
    ),
    _make_column(
        "capacity",
        "veh",
        "at lights: what the greens shown let through, by the saturation flow of its lanes, "
        "permitted turns by the gaps of those they give way to; without: what those they give way "
        "to leave, by HCM chapters 20 to 22. Null for those who give way to none",
    ),
    _make_column("vc", "", "demand / capacity; null in intervals below 300 s"),
    _make_column(
        "queue_metres",
        "m",
        "lane group: mean distance from the stop line to the back of the queue, over all of the "
        "interval; movement: of its lane group",
    ),
    _make_column(
        "queue_metres_p95", "m", "what it does not exceed 95 % of the time, as `queue_p95`"
    ),
    _make_column("queue_metres_p95_run", "m", "that of all that is analysed, in each row"),
    _make_column("queue_metres_max", "m", "its maximum"),
    _make_column(
        "outside",
        "veh",
        "lane group: mean number that waited outside for room to depart, and go through it first; "
        "movement: of its lane group",
    ),
    _make_column("outside_seconds", "veh*s", f"their time there; {_SUM}"),
    _make_column(
        "overflow", "", "share of the time in which the queue is longer than its lanes (`storage`)"
    ),
    _make_column(
        "spillback",
        "",
        "share of the time in which it reaches the junction behind (less than 7.5 m are free), or "
        "the edge of the map",
    ),
    _make_column("queue_metre_seconds", "m*s", f"length of the queue over time; {_SUM}"),
    _make_column("overflow_seconds", "s", _SUM),
    _make_column("spillback_seconds", "s", _SUM),
    _make_column("lanes", "", "lane group: lanes at the stop line", whole=True),
    _make_column(
        "storage",
        "m",
        "lane group: from the stop line back to where its longest lane becomes part of another, "
        "or to the junction behind",
    ),
    _make_column(
        "saturation_flow",
        "veh/h",
        "lane group at lights: of each lane, from headways of the run; HCM's 1,900 if there are "
        "too few",
    ),
    _make_column("headways", "", "lane group: saturation headways that were measured", whole=True),
    _make_column("throughput", "veh", "of a junction: the same as `vehicles`", whole=True),
    _make_column("co2", "g", f"carbon dioxide, {_HERE}"),
    _make_column("co", "g", "carbon monoxide, likewise"),
    _make_column("hc", "g", "hydrocarbons, likewise"),
    _make_column("nox", "g", "nitrogen oxides, likewise"),
    _make_column("pmx", "g", "particulate matter, likewise"),
    _make_column("fuel", "g", "fuel, likewise"),
    _make_column(
        "flow",
        "veh/h",
        "generalized definition of Edie (1963): metres of all vehicles over length and time. "
        "Segment: all lanes and directions together; junction and movement: along the mean "
        "connection; network: per lane",
    ),
    _make_column("density", "veh/km", "Edie's: seconds of all vehicles over length and time"),
    _make_column(
        "speed", "m/s", "Edie's: metres over seconds, the space mean; null without vehicles"
    ),
    _make_column("distance", "m", f"metres that vehicles travelled; {_SUM}"),
    _make_column("length", "km", "what flow and density refer to"),
)
