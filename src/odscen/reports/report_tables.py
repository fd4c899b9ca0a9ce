"""Tables of the report: expectations, events, actors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import Markup, element, number
from odscen.records.outcomes import reason_label, stop_reason
from odscen.records.run_events import EventKind
from odscen.reports.page_templates import html_table, report_section

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.figures.measures.summary import ActorOutcome
    from odscen.records.run_events import Event
    from odscen.records.traces import ActorTravel

ACTOR_LIMIT = 3000
"""Rows of the actor table at most; a browser sorts that many at once. The file has all."""

PRINTED_ACTORS = 100
"""Rows of it on paper; the style sheet hides the others there."""

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
}
"""What happened and why that may be, for the events that are reported."""

_NOT_INSERTED = ("was not inserted", "Its start was never free, or the run ended before its turn.")


def expectation_table(expectations: Sequence[Mapping[str, Any]]) -> Markup | None:
    """Table of what was expected and what came out."""
    if not expectations:
        return None
    rows = []
    for row in expectations:
        met = bool(row.get("passed"))
        verdict = element("td", "met" if met else "not met", class_="good" if met else "bad")
        text = row.get("expectation", "")
        cells = (
            element("td", element("code", text)),
            element("td", _value(row.get("value"), 3) or "none"),
        )
        rows.append(element("tr", *cells, verdict))
    explained = (
        "each line was asked for when the run was started; the value is what the run gave. Names "
        "like arrived compare the share of all planned actors."
    )
    table = html_table(("Expectation", "Value", "Verdict"), rows)
    return report_section("Expectations", table, explained=explained, ident="expectations")


def criteria_table(criteria: Sequence[Mapping[str, Any]]) -> Markup | None:
    """Table of the scenario's criteria: met or not, the value, and the instant."""
    if not criteria:
        return None
    rows = []
    for row in criteria:
        met = bool(row["passed"])
        value = _value(row["value"], 3)
        cells = (
            element("td", row["words"]),
            element("td", f"{value} {row['unit']}".strip() if value else "not measured"),
            element("td", "" if row["time"] is None else f"{row['time']:.1f} s"),
            element("td", "met" if met else "not met", class_="good" if met else "bad"),
        )
        rows.append(element("tr", *cells))
    explained = (
        "what the scenario asks of a run, what the run gave, and the second of the run in which it "
        "came about. Where no conflict was recorded, TTC, PET and DRAC are at the limit of what is "
        "recorded."
    )
    table = html_table(("Criterion", "Value", "At", "Verdict"), rows)
    return report_section("Criteria", table, explained=explained, ident="criteria")


def event_list(
    events: Sequence[Event], actors: Sequence[ActorOutcome], *, problems: Sequence[str] = ()
) -> Markup:
    """Everything unusual, in order of time, in words; ``problems`` are known before the start."""
    listed = [(event.time, _event(event)) for event in events if event.kind in EVENT_WORDS]
    listed += [
        (actor.depart, _item(actor.depart, actor.id, *_NOT_INSERTED))
        for actor in actors
        if actor.inserted is None
    ]
    listed.sort(key=lambda pair: pair[0])
    before = [element("li", element("time", "before"), text) for text in problems]
    explained = (
        "teleports, collisions and actors that were not inserted are listed here, because each is "
        "a place where the scenario, the map or the traffic is worth a second look."
    )
    if any(event.rule for event in events):
        explained += (
            " So is what rules did, each with its instant and what its conditions were about."
        )
    if not listed and not before:
        nothing = element("p", "Nothing unusual happened.", class_="good")
        return report_section("Events", nothing, explained=explained, ident="events")
    items = [*before[:EVENT_LIMIT], *(item for _, item in listed[:EVENT_LIMIT])]
    shown = element("ol", *items, class_="events")
    more = None
    if len(listed) > EVENT_LIMIT:
        text = f"{len(listed) - EVENT_LIMIT:,} more are in events.json and actors.json."
        more = element("p", text)
    return report_section("Events", shown, more, explained=explained, ident="events")


def _event(event: Event) -> Markup:
    words, reason = EVENT_WORDS[event.kind]
    if event.rule:
        values = ", ".join(f"{name} {value:.4g}" for name, value in (event.values or {}).items())
        words += f": {event.rule}" + (f" ({values})" if values else "")
    if event.partner:
        words += f" with {event.partner}"
    if event.x is not None and event.y is not None:
        words += f" at x {number(event.x, 1)} m, y {number(event.y, 1)} m"
    if event.kind is EventKind.COLLISION and event.values:
        words += f", {number(event.values.get('impact_speed', 0.0), 1)} m/s faster"
    if event.detail:
        of_rule = event.kind is EventKind.RULE_FAILED or event.rule
        said = event.detail if of_rule else reason_label(stop_reason(event.detail))
        words += f" ({said})"
    return _item(event.time, event.actor, words, reason, digits=2 if event.rule else 1)


def _item(time: float, actor: str, words: str, reason: str, *, digits: int = 1) -> Markup:
    return element(
        "li",
        element("time", f"{number(time, digits)} s"),
        element("b", actor),
        f" {words}. ",
        element("small", reason) if reason else None,
    )


_COLUMNS = (
    "Actor",
    "Category",
    "Model",
    "Planned departure, s",
    "Inserted, s",
    "Arrived, s",
    "Travel time, s",
    "Delay, s",
    "Distance, m",
    "Mean speed, km/h",
    "Teleports",
    "Collisions",
    "Outcome",
)


def actor_table(actors: Sequence[ActorOutcome], travel: ActorTravel) -> Markup:
    """One row per actor; the page's script sorts and filters it."""
    rows = [_actor_row(row, travel) for row in actors[:ACTOR_LIMIT]]
    field = element("input", type="search", id="filter", placeholder="car, not inserted, ...")
    control = element("label", "Show only rows with ", field, class_="filter")
    more = None
    if len(actors) > ACTOR_LIMIT:
        text = f"The first {ACTOR_LIMIT:,} of {len(actors):,} actors; all are in actors.json."
        more = element("p", text)
    explained = (
        "press a heading to sort by it, once more to turn the order round. Times count from the "
        "start of the simulation; an empty field means that it never came to that."
    )
    table = html_table(_COLUMNS, rows, id="actors-table")
    printed = None
    if len(rows) > PRINTED_ACTORS:
        words = f"The first {PRINTED_ACTORS} are printed."
        printed = element("p", words, class_="print-only")
    return report_section(
        "Actors", control, more, printed, table, explained=explained, ident="actors"
    )


def _actor_row(actor: ActorOutcome, travel: ActorTravel) -> Markup:
    speed = travel.speed.get(actor.id)
    numbers = (
        _value(actor.depart),
        _value(actor.inserted),
        _value(actor.arrived),
        _value(actor.travel_time),
        _value(actor.delay),
        _value(travel.distance.get(actor.id), 0),
        "" if speed is None else number(speed * 3.6, 1),
        _value(actor.teleports),
        _value(actor.collisions),
    )
    cells = [
        element("th", actor.id + (" (ego)" if actor.ego else ""), scope="row"),
        element("td", element("i", class_=f"swatch c-{actor.category}"), actor.category),
        element("td", actor.model or ""),
        *(element("td", text, class_="n") for text in numbers),
        element("td", actor.status.label),
    ]
    return element("tr", *cells)


def _value(value: float | None, digits: int = 1) -> str:
    return "" if value is None else number(float(value), digits)
