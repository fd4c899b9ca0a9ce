"""The report of a run: one HTML file that needs nothing else, for people who do not program.

Each section is a block of ``run_report.html.j2`` and a function that computes what the block is
given, here or in :mod:`odscen.reports.report_sections`. Everything that comes from files is escaped
by the templates; besides, the page forbids itself every request and every script but its own, whose
hash it names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.durations import clock
from odscen.base.markup import number
from odscen.figures.by_place.level_of_service import FEWEST
from odscen.figures.measures.conflicts import SERIOUS_DRAC, SERIOUS_PET, SERIOUS_TTC, is_serious
from odscen.figures.measures.curves import presence
from odscen.figures.measures.figure import ReportSection, RunData, SummaryPart
from odscen.figures.measures.gridlock import find_incidents
from odscen.figures.measures.motion import FORCED, KIND_UNITS, MotionKind, count_by_kind
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.timetable import LATE, stops_served
from odscen.figures.measures.usability import IncidentWords, UsabilityLevel, run_usability
from odscen.records.outcomes import (
    ActorStatus,
    IncidentKind,
    RunStatus,
    reason_label,
    stop_reason,
)
from odscen.records.run_events import EventKind
from odscen.records.traces import bin_width, speed_over_time, tidy, travel
from odscen.reports.charts import Series, line_chart
from odscen.reports.front_page import (
    LEVEL_WORDS,
    MOST_ACTORS,
    junction_rows,
    level_notes,
    scene_sentences,
    traffic_sentences,
)
from odscen.reports.page_templates import PAGE_SCRIPT, REPLAY_SCRIPT, render_page
from odscen.reports.place_names import NO_NAMES
from odscen.reports.report_cards import Card, figure_cards, named_cards
from odscen.reports.report_demand import assignment_values
from odscen.reports.report_maps import (
    CATEGORIES,
    run_map,
    service_map,
    worst_incidents,
)
from odscen.reports.report_sections import (
    corridor_values,
    diagram_values,
    emission_values,
    flow_values,
    group_values,
    service_values,
    station_values,
)
from odscen.reports.report_signals import signal_values
from odscen.reports.report_words import duration, moment, starting_at
from odscen.scenario.story.condition_kinds import CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.figures.by_place.parking_use import ParkingUse
    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.figures.measures.figure import Values
    from odscen.figures.measures.gridlock import Incident
    from odscen.figures.measures.summary import ActorOutcome
    from odscen.figures.measures.usability import Usability
    from odscen.records.assignment_steps import Assignment
    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan, PlannedMeasure
    from odscen.records.traces import ActorTravel
    from odscen.reports.place_names import PlaceNames
    from odscen.reports.report_maps import PlaceShapes, RunMap
    from odscen.reports.report_sections import CorridorTraces
    from odscen.reports.report_signals import LightsOfRun


def render_report(
    summary: Mapping[str, Any],
    plan: Plan,
    actors: Sequence[ActorOutcome],
    events: Sequence[Event],
    trajectories: pl.DataFrame,
    *,
    drawing: MapDrawing | None = None,
    every: int = 1,
    figures: TrafficFigures | None = None,
    shapes: PlaceShapes | None = None,
    names: PlaceNames = NO_NAMES,
    corridor: CorridorTraces | str | None = None,
    conflicts: pl.DataFrame | None = None,
    lights: LightsOfRun | None = None,
    visits: pl.DataFrame | None = None,
    stations: pl.DataFrame | None = None,
    parking: ParkingUse | None = None,
    assignment: Assignment | None = None,
    motion: pl.DataFrame | None = None,
    replay: Mapping[str, Any] | None = None,
) -> str:
    """Write the report of one run.

    Parameters
    ----------
    summary
        As in ``summary.json``: ``status``, ``map``, ``sim_seconds``, ``wall_seconds``, ``figures``,
        ``expectations``, ``versions``, ``error``; whatever is missing is left out.
    plan
        What the run was to do; names the scenario and gives the frame of the trajectories.
    actors
        Outcome of each actor, as in ``actors.json``.
    events
        What happened, as in ``events.json``.
    trajectories
        As read from ``trajectories.parquet``, in SUMO's frame.
    drawing
        Of the map, if it is to be shown below the trajectories.
    every
        Of so many records the trajectories have one only; the page says so.
    figures
        By place and time, if they were recorded.
    shapes
        Of the map's places, if it is to be coloured by level of service.
    names
        Of the map's places, for people.
    corridor
        Vehicles along a corridor, or why there is no diagram of them.
    conflicts
        Traffic conflicts, if they were measured.
    lights
        Programs of traffic lights and what they showed, if the map has any.
    visits
        Visits of stops, if the scenario has lines of public transport.
    stations
        What the stations of the study counted, if it has any.
    parking
        Use of parking areas, if trips park.
    assignment
        How routes by travel time were found, if the scenario wants such.
    motion
        What the plausibility check of motion found, if trajectories were recorded.
    replay
        From :func:`odscen.reports.replay.replay_values`, if the run is to be watched on the page.

    Returns
    -------
    str
        The whole page; the same input gives the same text.
    """
    categories = {actor.id: actor.category for actor in actors}
    traces = tidy(trajectories, categories, net_offset=plan.net_offset)
    last = traces["time"].max()
    recorded = float(last) if isinstance(last, int | float) else 0.0
    end = max(float(summary.get("sim_seconds") or 0.0), recorded, 1.0)
    incidents = find_incidents(plan, actors, events, end=end)
    cut_short = plan.until if summary.get("stopped") else None
    words = IncidentWords(lambda incident: _name_spot(incident, names), moment)
    run = RunData(
        actors, figures, conflicts=conflicts, visits=visits, end=end, parking=parking, motion=motion
    )
    counts = figure_values(run, part=SummaryPart.ACTORS)
    given = summary.get("figures") or figure_values(run)
    values = {**given, **counts}
    drawn = run_map(traces, plan, actors, events, drawing, incidents=incidents)
    title = plan.scenario or "Run"
    scene = len(actors) <= MOST_ACTORS
    with starting_at(plan.clock):
        usability = run_usability(
            actors, incidents, end=end, until=cut_short, scene=plan.scene, words=words
        )
        asked = list(summary.get("criteria") or ())
        return render_page(
            "run_report.html.j2",
            title=f"{title} - run report",
            head=_head_values(title, plan, summary, usability),
            scene=scene,
            replay=replay,
            scripts=[PAGE_SCRIPT, *([REPLAY_SCRIPT, *replay["scripts"]] if replay else [])],
            brief=_brief_values(
                values,
                usability,
                None if scene else figures,
                shapes,
                names,
                asked,
                conflicts,
                drawn,
            ),
            figures={
                "outcomes": _outcome_sentence(counts),
                "cards": [
                    *figure_cards(ReportSection.KEY_FIGURES, values),
                    _speed_card(traces),
                ],
            },
            measures=measure_values(plan.measures, int(counts["stranded"] or 0)),
            service=service_values(figures, names) if figures else None,
            groups=group_values(figures.lane_groups, names) if figures else None,
            stations=station_values(stations) if stations is not None else None,
            map=None
            if scene or drawn is None
            else {**drawn._asdict(), "incidents": bool(incidents), "every": every},
            incidents=_incident_values(incidents, names),
            flow=flow_values(figures.network) if figures else None,
            diagram=diagram_values(figures.network) if figures else None,
            corridor=corridor_values(corridor, names) if corridor is not None else None,
            signals=signal_values(lights, given, drawing=drawing, names=names)
            if lights is not None
            else None,
            transit=_transit_values(visits, given) if visits is not None else None,
            parking=_parking_values(parking, given) if parking is not None else None,
            assignment=assignment_values(assignment) if assignment is not None else None,
            speed=_speed_values(traces, end),
            progress=_progress_values(actors, end),
            conflicts=conflict_values(conflicts) if conflicts is not None else None,
            walking=_walking_values(given, actors, traces, end=end),
            motion=motion_values(motion, values, names) if motion is not None else None,
            emissions=emission_values(figures, names) if figures else None,
            criteria=asked,
            expectations=summary.get("expectations") or (),
            events=_event_values(events, actors, names, problems=summary.get("problems") or ()),
            actors=_actor_values(actors, travel(traces)),
            foot=_foot_values(summary),
        )


def _head_values(
    title: str, plan: Plan, summary: Mapping[str, Any], usability: Usability
) -> dict[str, Any]:
    style, words = _verdict_words(summary, usability)
    weather = summary.get("environment")
    if isinstance(weather, dict):
        weather = str(weather.get("name") or weather.get("preset") or "")
    facts = [
        ("Map", summary.get("map")),
        ("Weather", weather),
        ("Seed", plan.seed),
        ("Starts at", clock(plan.clock) if plan.clock else None),
        ("Simulated", duration(summary.get("sim_seconds"))),
        ("Warm-up left out", duration(summary.get("warm_up"))),
        ("Computed in", duration(summary.get("wall_seconds"))),
    ]
    return {
        "title": title,
        "verdict": words,
        "style": style,
        "reason": summary.get("error") or summary.get("reason"),
        "facts": [fact for fact in facts if fact[1] not in (None, "")],
    }


_STYLES = {
    UsabilityLevel.USABLE: "good",
    UsabilityLevel.RESERVATIONS: "fair",
    UsabilityLevel.NOT_USABLE: "bad",
}


def _verdict_words(summary: Mapping[str, Any], usability: Usability) -> tuple[str, str]:
    """Class and words."""
    if summary.get("status") == RunStatus.FAILED:
        return "bad", "The run failed"
    asked = {"criteria": summary.get("criteria"), "expectations": summary.get("expectations")}
    expectations = [row for rows in asked.values() for row in rows or ()]
    kind = " and ".join(name for name, rows in asked.items() if rows)
    missed = sum(not row.get("passed") for row in expectations)
    words = LEVEL_WORDS[usability.level].capitalize()
    if summary.get("scene") and expectations and usability.level is not UsabilityLevel.NOT_USABLE:
        words = "Not passed" if missed else "Passed"
    if missed:
        return "bad", f"{words}, {missed} of {len(expectations)} {kind} not met"
    style = _STYLES[usability.level]
    if expectations:
        single = {"criteria": "criterion"}.get(kind, "expectation")
        met = f"{single} met" if len(expectations) == 1 else f"all {kind} met"
        return style, f"{words}, {met}"
    return style, words


def _outcome_sentence(counts: Values) -> str:
    if not counts["planned"]:
        return ""
    parts = [f"{counts['arrived']:,} of {counts['planned']:,} road users arrived"]
    if counts["running"]:
        verb = "was" if counts["running"] == 1 else "were"
        parts.append(f"{counts['running']:,} {verb} still under way at the end")
    if counts["waiting"]:
        verb = "was" if counts["waiting"] == 1 else "were"
        parts.append(f"{counts['waiting']:,} {verb} not inserted")
    if counts["stranded"]:
        parts.append(f"{counts['stranded']:,} blocked by closure")
    incidents = [
        f"{counts[key]:,} {word}"
        for key, word in (("teleported", "teleported"), ("collided", "collided"))
        if counts[key]
    ]
    parts += incidents or ["none was teleported or collided"]
    return "; ".join(parts) + "."


TRAFFIC_FIGURES = ("arrived", "mean_delay", "mean_speed", "worst_junction_delay")
SCENE_FIGURES = ("arrived", "collided", "min_ttc", "min_pet")
"""Figures of the run that the first page has; those that it does not have are left out."""


def _brief_values(
    values: Mapping[str, Any],
    usability: Usability,
    figures: TrafficFigures | None,
    shapes: PlaceShapes | None,
    names: PlaceNames,
    criteria: Sequence[Mapping[str, Any]],
    conflicts: pl.DataFrame | None,
    trajectories: RunMap | None,
) -> dict[str, Any]:
    """Sentences, cards, map and table of the first page; ``figures`` are ``None`` for a scene."""
    if figures is None:
        return {
            "sentences": scene_sentences(values, usability, criteria, conflicts),
            "cards": named_cards(SCENE_FIGURES, values),
            "map": None,
            "scene_map": trajectories,
            "junctions": [],
            "fewest": FEWEST,
            "notes": [],
        }
    rows = junction_rows(figures, names)
    return {
        "sentences": traffic_sentences(values, usability, rows),
        "cards": named_cards(TRAFFIC_FIGURES, values),
        "map": service_map(figures, shapes, rows, names) if shapes is not None else None,
        "scene_map": None,
        "junctions": rows,
        "fewest": FEWEST,
        "notes": level_notes(figures, rows),
    }


def _name_spot(incident: Incident, names: PlaceNames) -> str:
    if incident.x is None or incident.y is None:
        return incident.place or incident.lane or incident.actor
    return names.describe_spot(incident.x, incident.y)


def _speed_card(traces: pl.DataFrame) -> Card:
    """Mean of all vehicles at all times, those included that have not arrived."""
    speed = traces["speed"].filter(traces["category"] != "pedestrian").mean()
    text = f"{number(speed * 3.6, 1)} km/h" if isinstance(speed, int | float) else "-"
    return Card("mean speed on the road", text, "of all vehicles, stops included")


MOST_MOTIONS = 20
"""Findings of the check of motion that are listed."""


def _value_of_motion(row: Mapping[str, Any], column: str = "value") -> str:
    """Value, or bound, of a finding with its unit as it is printed."""
    unit = KIND_UNITS[MotionKind(row["kind"])].replace("s2", "s²").replace("s3", "s³")
    return f"{number(row[column], 2)} {unit}"


def motion_values(
    found: pl.DataFrame, values: Mapping[str, Any], names: PlaceNames = NO_NAMES
) -> dict[str, Any]:
    """Findings of the check of motion: by kind, category and cause, and the worst of each kind."""
    counted = [
        (
            row["kind"],
            row["category"],
            row["cause"],
            number(row["findings"], 0),
            number(row["users"], 0),
            _value_of_motion(row),
            _value_of_motion(row, "bound"),
        )
        for row in count_by_kind(found).iter_rows(named=True)
    ]
    own = found.filter(~found["cause"].is_in([str(cause) for cause in FORCED]))
    worst = (
        own.sort("value", descending=True, maintain_order=True)
        .group_by("kind", maintain_order=True)
        .head(MOST_MOTIONS // 5)
        .head(MOST_MOTIONS)
    )
    listed = [
        (
            row["kind"],
            row["id"] if row["partner"] is None else f"{row['id']}, {row['partner']}",
            number(row["begin"], 1),
            names.describe_spot(row["x"], row["y"]),
            _value_of_motion(row),
            row["cause"],
        )
        for row in worst.iter_rows(named=True)
    ]
    return {
        "cards": figure_cards(ReportSection.MOTION, values),
        "counted": counted,
        "listed": listed,
    }


MEASURE_LABELS = {
    "closure": "Closure",
    "roadworks": "Roadworks",
    "incident": "Incident",
    "speed_limit": "Speed limit",
    "permission": "Permission",
    "signal_outage": "Signal out of order",
}
"""Words for the kinds of measures."""


def measure_values(measures: Sequence[PlannedMeasure], stranded: int = 0) -> dict[str, Any] | None:
    """Measures with their numbers, and how many actors they left without a route."""
    if not measures:
        return None
    rows = [
        (
            place,
            f"{MEASURE_LABELS.get(measure.kind, measure.kind)} {measure.id}",
            measure.words,
            duration(measure.begin) or "0 s",
            duration(measure.end),
        )
        for place, measure in enumerate(measures, start=1)
    ]
    return {"rows": rows, "stranded": stranded}


def _incident_values(incidents: Sequence[Incident], names: PlaceNames) -> dict[str, Any] | None:
    if not incidents:
        return None
    shown = worst_incidents(incidents)
    rows = []
    for place, incident in enumerate(shown, start=1):
        where = _name_spot(incident, names)
        until = number(incident.until, 0) if incident.until is not None else "did not dissolve"
        if incident.kind is IncidentKind.NOT_INSERTED:
            until = "not inserted"
        reason = reason_label(incident.reason)
        count, since = number(incident.count, 0), number(incident.time, 0)
        rows.append((place, incident.kind.label, reason, count, since, until, where))
    return {"rows": rows, "more": len(incidents) - len(shown)}


def _transit_values(visits: pl.DataFrame, values: Mapping[str, Any]) -> dict[str, Any] | None:
    """Cards over all lines, and a row for each stop of each line."""
    if visits.is_empty():
        return None
    rows = stops_served(visits).to_dicts()
    return {
        "cards": figure_cards(ReportSection.TRANSIT, values),
        "rows": rows,
        "passengers": any(row.get("boarded") for row in rows),
        "late_minutes": LATE / 60.0,
    }


MOST_AREAS = 60
"""Parking areas in the table; of more, those that were fullest."""


def _parking_values(parking: ParkingUse, values: Mapping[str, Any]) -> dict[str, Any]:
    """Cards over all areas, places taken over time, and a row for each area."""
    rows = [(area, parking.use(area.id)) for area in parking.areas]
    if len(rows) > MOST_AREAS:
        fullest = sorted(rows, key=lambda row: -row[1].occupancy)[:MOST_AREAS]
        rows = [row for row in rows if row in fullest]
    taken = parking.taken()
    width = bin_width(parking.end - parking.begin)
    times = np.arange(parking.begin, parking.end + width / 2.0, width)
    last_change = np.searchsorted(taken.time, times, side="right") - 1
    places = sum(area.places for area in parking.areas)
    series = [
        Series("occupied", "c-running", taken.places[last_change].astype(np.float64)),
        Series("places", "c-waiting", np.full(len(times), float(places))),
    ]
    text = "Occupied parking places over time, in all areas"
    return {
        "cards": figure_cards(ReportSection.PARKING, values),
        "chart": line_chart(times, series, y_label="places", description=text, end=parking.end),
        "rows": rows,
        "areas": len(parking.areas),
    }


def _speed_values(traces: pl.DataFrame, end: float) -> dict[str, Any] | None:
    """Mean speed of all vehicles over time, and of each category if there are several."""
    if traces.is_empty():
        return None
    width = bin_width(end)
    traces = traces.select("time", "speed", "category")
    vehicles = traces.filter(traces["category"] != "pedestrian")
    all_vehicles = each = None
    if not vehicles.is_empty():
        curve = speed_over_time(vehicles, end=end, width=width)
        line = Series(
            "mean of all vehicles", "c-all", curve.mean * 3.6, curve.low * 3.6, curve.high * 3.6
        )
        text = "Mean speed of all vehicles over time"
        all_vehicles = line_chart(curve.time, [line], y_label="speed, km/h", description=text)
    present = [key for key in CATEGORIES if (traces["category"] == key).any()]
    # Fewer and longer bins: a handful of lines over each other must stay apart by eye.
    width_each = bin_width(end, bins=40)
    if len(present) > 1:
        lines = []
        for key in present:
            own = traces.filter(traces["category"] == key)
            curve = speed_over_time(own, end=end, width=width_each)
            lines.append(Series(CATEGORIES[key], f"c-{key}", curve.mean * 3.6))
        text = f"Mean speed of each category over time, every {duration(width_each)}"
        each = line_chart(curve.time, lines, y_label="speed, km/h", description=text)
    return {
        "all": all_vehicles,
        "each": each,
        "bin": duration(width),
        "bin_each": duration(width_each),
    }


def _progress_values(actors: Sequence[ActorOutcome], end: float) -> dict[str, Any] | None:
    if not actors:
        return None
    counts = presence(actors, end=end)
    series = [
        Series("on the road", "c-running", counts.running),
        Series("arrived", "c-arrived", counts.arrived),
    ]
    if counts.waiting.any():
        series.append(Series("not inserted yet", "c-waiting", counts.waiting))
    text = "Actors on the road and arrived over time"
    return {"chart": line_chart(counts.time, series, y_label="actors", description=text)}


MOST_CONFLICTS = 15
"""Rows of the table at most."""

CONFLICT_KINDS = {
    "following": "following",
    "merging": "merging",
    "crossing": "crossing",
    "walking": "with a pedestrian",
}


def conflict_values(conflicts: pl.DataFrame) -> dict[str, Any]:
    """Cards, and the worst conflicts.

    Parameters
    ----------
    conflicts
        As :func:`~odscen.figures.measures.conflicts.conflict_table` gives them.
    """
    import polars as pl

    values = {**figure_values(RunData(conflicts=conflicts)), "conflicts": conflicts.height}
    if not (conflicts["kind"] == "walking").any():
        del values["pedestrian_min_pet"]
    share = pl.max_horizontal(
        SERIOUS_TTC / pl.col("ttc").clip(0.01),
        SERIOUS_PET / pl.col("pet").clip(0.01),
        pl.col("drac") / SERIOUS_DRAC,
    )
    worst = conflicts.sort(share, descending=True, maintain_order=True).head(MOST_CONFLICTS)
    return {
        "cards": figure_cards(ReportSection.CONFLICTS, values),
        "rows": worst.with_columns(serious=is_serious()).to_dicts(),
        "kinds": CONFLICT_KINDS,
        "ttc": SERIOUS_TTC,
        "pet": SERIOUS_PET,
        "drac": SERIOUS_DRAC,
    }


def _walking_values(
    figures: Mapping[str, Any],
    actors: Sequence[ActorOutcome],
    traces: pl.DataFrame,
    *,
    end: float,
) -> dict[str, Any] | None:
    """Figures of pedestrians and their speed over time."""
    walkers = [actor for actor in actors if actor.category == "pedestrian"]
    if not walkers:
        return None
    arrived = sum(actor.status is ActorStatus.ARRIVED for actor in walkers)
    cards = [
        Card("pedestrians", f"{len(walkers):,}", f"{arrived:,} arrived"),
        *figure_cards(ReportSection.PEDESTRIANS, figures),
    ]
    chart = None
    on_foot = traces.filter(traces["category"] == "pedestrian")
    if not on_foot.is_empty():
        curve = speed_over_time(on_foot, end=end, width=bin_width(end, bins=60))
        if np.isfinite(curve.mean).sum() > 1:
            line = Series("mean of all pedestrians", "c-pedestrian", curve.mean, curve.low,
                          curve.high)  # fmt: skip
            text = "Mean walking speed over time"
            chart = line_chart(
                curve.time, [line], y_label="speed, m/s", description=text, height=210.0, end=end
            )
    return {"cards": cards, "chart": chart}


EVENT_LIMIT = 300

_GRIDLOCKED = "Usually a blocked lane, or a turn that other traffic never left room for."

EVENT_WORDS = {
    EventKind.TELEPORT_START: ("was gridlocked and teleported", _GRIDLOCKED),
    EventKind.TELEPORT_END: ("was put back on the road after its teleport", ""),
    EventKind.COLLISION: (
        "collided",
        "Two bodies overlapped; often at a junction without signals, or after a teleport.",
    ),
    EventKind.EMERGENCY_STOP: (
        "stopped harder than its brakes can",
        "Usually the lane ahead was closed to it at short notice.",
    ),
    EventKind.LOST: (
        "did not come back when the simulation was reloaded",
        "A limit of the simulator; its trip is not counted as finished.",
    ),
    EventKind.STRANDED: (
        "was stranded",
        "A measure had closed every route to its goal; it was taken out.",
    ),
    EventKind.ROUTE_CHANGED: (
        "took another route",
        "It did not get to the lane that its route needed.",
    ),
    EventKind.MEASURE_BEGIN: ("began", ""),
    EventKind.MEASURE_END: ("ended", ""),
    EventKind.RULE_STARTED: ("began to do what a rule says", ""),
    EventKind.RULE_ACTED: ("did what a rule says", ""),
    EventKind.RULE_ENDED: ("has done what a rule says", ""),
    EventKind.RULE_FAILED: (
        "could not do what a rule says",
        "The scenario, or what traffic did before, does not allow it.",
    ),
    EventKind.RULE_OVERRIDDEN: (
        "stopped doing what a rule says",
        "Another rule acts on the same actor instead.",
    ),
    EventKind.STORY_ENDED: (
        "has ended",
        "No rule can fire any more; the run ends as many seconds later as the scenario says.",
    ),
}
"""What happened and why that may be, for the events that are reported."""

_NOT_INSERTED = ("was not inserted", "Its start was never free, or the run ended before its turn.")


class _EventRow(NamedTuple):
    """Line of the list of events."""

    time: str
    actor: str
    words: str
    reason: str


_VALUE_WORDS = {
    "ttc": "time to collision", "headway": "time headway", "distance": "distance",
    "reaches": "distance", "travelled": "travelled", "speed": "speed",
    "relative_speed": "relative speed", "acceleration": "acceleration", "stopped": "stopped for",
}  # fmt: skip
"""What a rule was about when it started, by the kind of its condition."""
_SAID_BY_TIME = frozenset({"time", "signal", "appeared", "touched", "off_road"})
"""Kinds of which the number says no more than that they hold."""


def _name_rule_value(name: str, value: float) -> str:
    """``"time to collision 3 s"`` for the value of ``all[1].ttc``; empty if it says nothing."""
    kind = name.rsplit(".", maxsplit=1)[-1]
    if kind in _SAID_BY_TIME:
        return ""
    known = CONDITIONS.get(kind)
    unit = known.unit if known else ""
    return f"{_VALUE_WORDS.get(kind, kind)} {value:.4g} {unit}".rstrip()


def _event_values(
    events: Sequence[Event],
    actors: Sequence[ActorOutcome],
    names: PlaceNames,
    *,
    problems: Sequence[str] = (),
) -> dict[str, Any]:
    """Everything unusual, in order of time, in words; ``problems`` are known before the start."""
    listed = [
        (event.time, _event_row(event, names)) for event in events if event.kind in EVENT_WORDS
    ]
    listed += [
        (actor.depart, _EventRow(number(actor.depart, 1), actor.id, *_NOT_INSERTED))
        for actor in actors
        if actor.inserted is None
    ]
    listed.sort(key=lambda pair: pair[0])
    return {
        "rows": [row for _, row in listed[:EVENT_LIMIT]],
        "problems": problems[:EVENT_LIMIT],
        "more": max(len(listed) - EVENT_LIMIT, 0),
        "rules": any(event.rule for event in events),
    }


def _event_row(event: Event, names: PlaceNames) -> _EventRow:
    words, reason = EVENT_WORDS[event.kind]
    if event.rule:
        named_values = [
            _name_rule_value(name, value) for name, value in (event.values or {}).items()
        ]
        values = ", ".join(filter(None, named_values))
        words += f": {event.rule}" + (f" ({values})" if values else "")
    if event.partner:
        words += f" with {event.partner}"
    if event.x is not None and event.y is not None:
        spot = f"x {number(event.x, 1)} m, y {number(event.y, 1)} m"
        where = f"{names.describe_spot(event.x, event.y)} ({spot})" if names.middles else spot
        words += f" at {where}"
    if event.kind is EventKind.COLLISION and event.values:
        words += f", {number(event.values.get('impact_speed', 0.0), 1)} m/s faster"
    if event.detail:
        of_rule = event.kind in (EventKind.RULE_FAILED, EventKind.STORY_ENDED) or event.rule
        detail = event.detail if of_rule else reason_label(stop_reason(event.detail))
        words += f" ({detail})"
    time = number(event.time, 2 if event.rule else 1)
    return _EventRow(time, event.actor, words, reason)


ACTOR_LIMIT = 3000
"""Rows of the actor table at most; a browser sorts that many at once. The file has all."""

PRINTED_ACTORS = 100
"""Rows of it on paper; the style sheet hides the others there."""


def _actor_values(actors: Sequence[ActorOutcome], travel: ActorTravel) -> dict[str, Any]:
    """One row per actor; the page's script sorts and filters them."""
    return {
        "rows": actors[:ACTOR_LIMIT],
        "count": len(actors),
        "printed": PRINTED_ACTORS,
        "distance": travel.distance,
        "speed_kmh": {actor: speed * 3.6 for actor, speed in travel.speed.items()},
    }


def _foot_values(summary: Mapping[str, Any]) -> dict[str, Any]:
    versions = dict(summary.get("versions") or {})
    own = str(versions.pop("odscen", ""))
    others = ", ".join(f"{name} {version}" for name, version in sorted(versions.items()))
    return {"own": own, "others": others}
