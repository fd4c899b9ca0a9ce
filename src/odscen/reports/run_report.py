"""The report of a run: one HTML file that needs nothing else, for people who do not program.

Everything that comes from files is escaped by construction (:mod:`odscen.base.markup`); besides,
the page forbids itself every request and every script but its own, whose hash it names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.durations import clock
from odscen.base.markup import Markup, element, join, number
from odscen.figures.measures.curves import presence
from odscen.figures.measures.figure import RunData, SummaryPart
from odscen.figures.measures.gridlock import find_incidents
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.usability import UsabilityLevel, run_usability
from odscen.records.outcomes import RunStatus
from odscen.records.traces import bin_width, speed_over_time, tidy, travel
from odscen.reports.charts import Series, line_chart
from odscen.reports.page_templates import html_page, page_head, report_section
from odscen.reports.report_brief import brief_section
from odscen.reports.report_conflicts import conflict_section
from odscen.reports.report_corridor import corridor_section
from odscen.reports.report_demand import assignment_section
from odscen.reports.report_emissions import emission_section
from odscen.reports.report_figures import key_figure_section
from odscen.reports.report_flow import diagram_section, flow_section
from odscen.reports.report_groups import group_section, station_section
from odscen.reports.report_incidents import incident_section
from odscen.reports.report_maps import CATEGORIES, run_map
from odscen.reports.report_measures import measure_section
from odscen.reports.report_parking import parking_section
from odscen.reports.report_service import service_section
from odscen.reports.report_signals import signal_section
from odscen.reports.report_tables import (
    actor_table,
    criteria_table,
    event_list,
    expectation_table,
)
from odscen.reports.report_transit import transit_section
from odscen.reports.report_walking import walking_section
from odscen.reports.report_words import duration, starting_at

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
    from odscen.records.run_plan import Plan
    from odscen.reports.report_corridor import CorridorTraces
    from odscen.reports.report_maps import PlaceShapes
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
    corridor: CorridorTraces | str | None = None,
    conflicts: pl.DataFrame | None = None,
    lights: LightsOfRun | None = None,
    visits: pl.DataFrame | None = None,
    stations: pl.DataFrame | None = None,
    parking: ParkingUse | None = None,
    assignment: Assignment | None = None,
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

    Returns
    -------
    str
        The whole page; the same input gives the same text.
    """
    categories = {actor.id: actor.category for actor in actors}
    traces = tidy(trajectories, categories, net_offset=plan.net_offset)
    end = _end(summary, traces)
    incidents = find_incidents(plan, actors, events, end=end)
    title = plan.scenario or "Run"
    usability = run_usability(actors, incidents, end=end, until=_cut_short(summary, plan))
    run = RunData(actors, figures, conflicts=conflicts, visits=visits, end=end, parking=parking)
    counts = figure_values(run, part=SummaryPart.ACTORS)
    given = summary.get("figures") or figure_values(run)
    with starting_at(plan.clock):
        body = [
            _head(title, plan, summary, usability, _in_a_sentence(counts)),
            brief_section({**given, **counts}, usability, figures, shapes),
            key_figure_section({**given, **counts}, traces),
            measure_section(plan.measures, int(counts["stranded"] or 0)),
            service_section(figures) if figures else None,
            group_section(figures.lane_groups) if figures else None,
            station_section(stations) if stations is not None else None,
            _map_section(traces, plan, actors, events, drawing, incidents, every),
            incident_section(incidents),
            *((flow_section(figures.network), diagram_section(figures.network)) if figures else ()),
            corridor_section(corridor) if corridor is not None else None,
            signal_section(lights, given, drawing=drawing) if lights is not None else None,
            transit_section(visits, given) if visits is not None else None,
            parking_section(parking, given) if parking is not None else None,
            assignment_section(assignment) if assignment is not None else None,
            _speed_section(traces, end),
            _progress_section(actors, end),
            conflict_section(conflicts) if conflicts is not None else None,
            walking_section(given, actors, traces, end=end),
            emission_section(figures) if figures else None,
            criteria_table(summary.get("criteria") or ()),
            expectation_table(summary.get("expectations") or ()),
            event_list(
                events, actors, problems=[str(text) for text in summary.get("problems") or ()]
            ),
            actor_table(actors, travel(traces)),
            _foot(summary),
        ]
    return html_page(f"{title} - run report", join([part for part in body if part]))


def _end(summary: Mapping[str, Any], traces: pl.DataFrame) -> float:
    last = traces["time"].max()
    recorded = float(last) if isinstance(last, int | float) else 0.0
    return max(float(summary.get("sim_seconds") or 0.0), recorded, 1.0)


def _cut_short(summary: Mapping[str, Any], plan: Plan) -> float | None:
    return plan.until if summary.get("stopped") else None


_STYLES = {
    UsabilityLevel.USABLE: "good",
    UsabilityLevel.RESERVATIONS: "fair",
    UsabilityLevel.NOT_USABLE: "bad",
}


def _verdict(summary: Mapping[str, Any], usability: Usability) -> tuple[str, str]:
    """Class and words."""
    if summary.get("status") == RunStatus.FAILED:
        return "bad", "The run failed"
    asked = {"criteria": summary.get("criteria"), "expectations": summary.get("expectations")}
    expectations = [row for rows in asked.values() for row in rows or ()]
    kind = " and ".join(name for name, rows in asked.items() if rows)
    missed = sum(not row.get("passed") for row in expectations)
    words = usability.level.capitalize()
    if missed:
        return "bad", f"{words}, {missed} of {len(expectations)} {kind} not met"
    style = _STYLES[usability.level]
    if expectations:
        one = {"criteria": "criterion"}.get(kind, "expectation")
        met = f"{one} met" if len(expectations) == 1 else f"all {kind} met"
        return style, f"{words}, {met}"
    return style, words


def _in_a_sentence(counts: Values) -> str:
    """Outcomes of the actors, in one sentence."""
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
        parts.append(f"{counts['stranded']:,} stranded by a closure")
    incidents = [
        f"{counts[key]:,} {word}"
        for key, word in (("teleported", "teleported"), ("collided", "collided"))
        if counts[key]
    ]
    parts += incidents or ["none was teleported or collided"]
    return "; ".join(parts) + "."


def _head(
    title: str, plan: Plan, summary: Mapping[str, Any], usability: Usability, sentence: str
) -> Markup:
    style, words = _verdict(summary, usability)
    facts = [
        ("Map", summary.get("map")),
        ("Weather", summary.get("environment")),
        ("Seed", plan.seed),
        ("Starts at", clock(plan.clock) if plan.clock else None),
        ("Simulated", duration(summary.get("sim_seconds"))),
        ("Warm-up left out", duration(summary.get("warm_up"))),
        ("Computed in", duration(summary.get("wall_seconds"))),
    ]
    shown = [
        element("span", element("b", f"{name} "), _plain(value))
        for name, value in facts
        if value not in (None, "")
    ]
    reason = summary.get("error") or summary.get("reason")
    return page_head(
        "Run report",
        title,
        element("p", sentence) if sentence else None,
        element("pre", str(reason), class_="reason") if reason else None,
        element("p", *shown, class_="facts"),
        verdict=words,
        style=style,
    )


def _plain(value: object) -> str:
    if isinstance(value, dict):
        return str(value.get("name") or value.get("preset") or "")
    return number(value) if isinstance(value, float) else str(value)


def _map_section(
    traces: pl.DataFrame,
    plan: Plan,
    actors: Sequence[ActorOutcome],
    events: Sequence[Event],
    drawing: MapDrawing | None,
    incidents: Sequence[Incident],
    every: int,
) -> Markup | None:
    figure = run_map(traces, plan, actors, events, drawing, incidents=incidents)
    if figure is None:
        return None
    explained = (
        "every line is the trajectory of one actor; point at it to see whose. Switch to mean speed "
        "to see where traffic was slow: red places were congested, blue places flowed freely."
    )
    if incidents:
        explained += (
            " Numbered rings are incidents: gridlock, teleports; the table below has them. Where "
            "rings crowd, one has its number; point at the others for theirs."
        )
    if every > 1:
        explained += (
            f" The run is long: this page is made from one in {every} recorded positions, "
            "so that trajectories are a little straighter and shorter than they were."
        )
    return report_section("Trajectories", figure, explained=explained, ident="map")


def _speed_section(traces: pl.DataFrame, end: float) -> Markup | None:
    if traces.is_empty():
        return None
    width = bin_width(end)
    traces = traces.select("time", "speed", "category")
    vehicles = traces.filter(traces["category"] != "pedestrian")
    parts: list[Markup | None] = []
    if not vehicles.is_empty():
        curve = speed_over_time(vehicles, end=end, width=width)
        line = Series(
            "mean of all vehicles", "c-all", curve.mean * 3.6, curve.low * 3.6, curve.high * 3.6
        )
        text = "Mean speed of all vehicles over time"
        parts.append(line_chart(curve.time, [line], y_label="speed, km/h", description=text))
    present = [key for key in CATEGORIES if (traces["category"] == key).any()]
    if len(present) > 1:
        # Fewer and longer bins: a handful of lines over each other must stay apart by eye.
        width_each = bin_width(end, bins=40)
        lines = []
        for key in present:
            curve = speed_over_time(
                traces.filter(traces["category"] == key), end=end, width=width_each
            )
            lines.append(Series(CATEGORIES[key], f"c-{key}", curve.mean * 3.6))
        text = f"Mean speed of each category over time, every {duration(width_each)}"
        parts.append(element("h3", f"By category, mean over {duration(width_each)}"))
        parts.append(line_chart(curve.time, lines, y_label="speed, km/h", description=text))
    explained = (
        f"each point of the upper chart is the mean over {duration(width)} of all vehicles on the "
        "road then, stopped ones included. A wide band means that some drive freely while others "
        "are queued. A line ends where no vehicle is left."
    )
    return report_section("Speed over time", *parts, explained=explained, ident="speed")


def _progress_section(actors: Sequence[ActorOutcome], end: float) -> Markup | None:
    if not actors:
        return None
    counts = presence(actors, end=end)
    series = [
        Series("on the road", "c-running", counts.running),
        Series("arrived", "c-arrived", counts.arrived),
    ]
    if counts.waiting.any():
        series.append(Series("not inserted yet", "c-waiting", counts.waiting))
    chart = line_chart(
        counts.time,
        series,
        y_label="actors",
        description="Actors on the road and arrived over time",
    )
    explained = (
        "when the line of arrivals climbs steadily, traffic flows. A growing number that is not "
        "inserted yet (insertion backlog) means that there is no room where they depart."
    )
    return report_section("Insertions and arrivals", chart, explained=explained, ident="progress")


def _foot(summary: Mapping[str, Any]) -> Markup:
    versions = dict(summary.get("versions") or {})
    own = str(versions.pop("odscen", ""))
    made = ", ".join(f"{name} {version}" for name, version in sorted(versions.items()))
    return element("footer", f"Made by odscen {own}".strip() + (f" with {made}." if made else "."))
