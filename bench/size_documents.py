"""Scenarios with so many parts of one kind, for the bench of sizes and for tests of what grows.

Each kind is a function ``(scenario as JSON data, number) -> the same with so many of them``. Of the
kinds there are some that nothing is wrong with, and some of which each is wrong, or clashes with
each other: what is found of them may grow faster than they do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Document = dict[str, Any]
Grow = Callable[[Document, int], Document]


def _rules(document: Document, number: int, **fields: Any) -> Document:
    actor = document["actors"][0]["id"]
    rules = [
        {
            "id": f"rule-{n}",
            "actor": actor,
            "when": {"time": {"after": float(n)}},
            "then": [{"speed": {"to": 5.0, "over": 2.0}}],
        }
        | {key: value(n) if callable(value) else value for key, value in fields.items()}
        for n in range(number)
    ]
    return document | {"rules": rules}


def rules_of_one_actor(document: Document, number: int) -> Document:
    """All of them move the same actor, and none waits for another."""
    return _rules(document, number)


def rules_that_wait(document: Document, number: int) -> Document:
    """Each waits for the one before it."""
    first = {"time": {"after": 1.0}}
    return _rules(
        document, number, when=lambda n: {"rule": {"id": f"rule-{n - 1}"}} if n else first
    )


def rules_of_unknown_actors(document: Document, number: int) -> Document:
    return _rules(document, number, actor=lambda n: f"nobody-{n}")


def rules_of_one_id(document: Document, number: int) -> Document:
    return _rules(document, number, id="same")


def _inputs(document: Document, number: int, **fields: Any) -> Document:
    segment = document["roi"][0]
    inputs = [
        {"id": f"input-{n}", "segment": segment, "per_hour": 1.0, "end": 60.0}
        | {key: value(n) if callable(value) else value for key, value in fields.items()}
        for n in range(number)
    ]
    return document | {"demand": {"inputs": inputs}}


def inputs(document: Document, number: int) -> Document:
    """All on the first segment of the region."""
    return _inputs(document, number)


def inputs_to_zones(document: Document, number: int) -> Document:
    """Each with a zone of its own to go to, and a day profile of its own."""
    segment = document["roi"][0]
    grown = _inputs(
        document, number, to=lambda n: [[f"zone-{n}", 1.0]], profile=lambda n: f"day-{n}"
    )
    grown["demand"] |= {
        "zones": [{"id": f"zone-{n}", "segments": [segment]} for n in range(number)],
        "profiles": [{"id": f"day-{n}", "shares": [1.0, 2.0]} for n in range(number)],
    }
    return grown


def inputs_on_unknown_segments(document: Document, number: int) -> Document:
    return _inputs(document, number, segment=lambda n: f"r-{n}", profile="none")


def matrix_rows(document: Document, number: int) -> Document:
    """Trips between zones, each pair once."""
    segments = document["roi"]
    zones = [{"id": f"zone-{n}", "segments": [segments[n % len(segments)]]} for n in range(number)]
    trips = [[f"zone-{n}", f"zone-{(n + 1) % number}", 0.01] for n in range(number)]
    return document | {"demand": {"zones": zones, "matrices": [{"id": "od", "trips": trips}]}}


def matrices(document: Document, number: int) -> Document:
    segments = document["roi"]
    parts = [{"id": f"od-{n}", "trips": [[segments[0], segments[-1], 0.01]]} for n in range(number)]
    return document | {"demand": {"matrices": parts}}


def count_rows(document: Document, number: int) -> Document:
    """Slices of a minute, one place after another."""
    rows = [[document["roi"][0], 60.0 * n, 60.0 * n + 60.0, 1.0] for n in range(number)]
    return document | {"demand": {"counts": [{"id": "counts", "use": "compare", "rows": rows}]}}


def counts_twice(document: Document, number: int) -> Document:
    """One place and slice, counted again and again."""
    rows = [[document["roi"][0], 0.0, 60.0, float(n)] for n in range(number)]
    return document | {"demand": {"counts": [{"id": "counts", "use": "compare", "rows": rows}]}}


def route_shares(document: Document, number: int) -> Document:
    """At most the thousand that a document may have."""
    ends = document["roi"][0], document["roi"][-1]
    share = {"origin": ends[0], "destination": ends[1], "routes": [[[], 1.0]]}
    return document | {"demand": {"routes": {"shares": [share] * min(number, 1000)}}}


def _lane_node(document: Document) -> str:
    return next(actor["spawn"] for actor in document["actors"] if actor["category"] == "car")


def _road_nodes(document: Document) -> tuple[str, str]:
    """Two nodes of a road outside the junction, the second further on."""
    roads = {segment.removeprefix("r") for segment in document["roi"] if segment[0] == "r"}
    cars = [actor for actor in document["actors"] if actor["category"] == "car"]
    node = next(car["spawn"] for car in cars if car["spawn"].partition(".")[0] in roads)
    lane, _, number = node.rpartition(".")
    return node, f"{lane}.{int(number) + 1}"


def stations(document: Document, number: int) -> Document:
    node = _lane_node(document)
    detectors = [{"id": f"d{n}", "nodes": [node]} for n in range(number)]
    return document | {"study": {"detectors": detectors}}


def stations_on_unknown_nodes(document: Document, number: int) -> Document:
    detectors = [{"id": "same", "nodes": [f"nowhere-{n}"]} for n in range(number)]
    return document | {"study": {"detectors": detectors}}


def _timing(document: Document, program: Document, **changes: Any) -> Document:
    return document | {"signals": {"junctions": [program | changes]}}


def signal_stages(document: Document, number: int) -> Document:
    """A program whose cycle has the stages of the first light of the map again and again."""
    program = document["signals"]["junctions"][0]
    stages = [
        program["stages"][n % len(program["stages"])] | {"id": f"s{n}"} for n in range(number)
    ]
    return _timing(document, program, stages=stages)


def signal_plans(document: Document, number: int) -> Document:
    """Plans of the day, each from another second on."""
    program = document["signals"]["junctions"][0]
    times = [f"{n // 3600:02}:{n // 60 % 60:02}:{n % 60:02}" for n in range(number)]
    plans = [{"id": f"p{n}", "times": [time]} for n, time in enumerate(times)]
    return _timing(document, program, plans=plans)


def signal_intergreens(document: Document, number: int) -> Document:
    """Rows that name groups which are not there."""
    program = document["signals"]["junctions"][0]
    return _timing(document, program, intergreens=[[f"a{n}", f"b{n}", 5.0] for n in range(number)])


def signal_detectors(document: Document, number: int) -> Document:
    program = document["signals"]["junctions"][0]
    stages = [one["id"] for one in program["stages"]]
    loops = [{"id": f"d{n}", "at": document["roi"][0], "stages": stages} for n in range(number)]
    return _timing(document, program, detectors=loops)


def signal_timings(document: Document, number: int) -> Document:
    """The same light timed again and again."""
    junction = document["signals"]["junctions"][0]["junction"]
    return document | {"signals": {"junctions": [{"junction": junction}] * number}}


def _lines(document: Document, number: int, served: Callable[[int], str]) -> Document:
    """Lines that each serve one of as many stops, two metres behind their start."""
    start, stop = _road_nodes(document)
    lines = [
        {"id": f"line-{n}", "start": start, "stops": [{"stop": served(n)}], "headway": 60.0}
        for n in range(number)
    ]
    stops = [{"id": f"stop-{n}", "node": stop} for n in range(number)]
    return document | {"transit": {"stops": stops, "lines": lines}}


def transit_lines(document: Document, number: int) -> Document:
    """All serve one stop."""
    return _lines(document, number, lambda _: "stop-0")


def transit_stops(document: Document, number: int) -> Document:
    """Each line serves a stop of its own."""
    return _lines(document, number, lambda n: f"stop-{n}")


def lines_at_unknown_stops(document: Document, number: int) -> Document:
    return _lines(document, number, lambda n: f"nowhere-{n}")


def measures(document: Document, number: int) -> Document:
    """Closures of one segment, each for a second of its own."""
    place = document["roi"][0]
    closures = [
        {"kind": "closure", "id": f"m{n}", "places": [place], "begin": float(n), "end": n + 1.0}
        for n in range(number)
    ]
    return document | {"measures": closures}


def measures_at_once(document: Document, number: int) -> Document:
    """The light of one junction is out of order again and again, all the time."""
    junction = document["signals"]["junctions"][0]["junction"]
    outages = [
        {"kind": "signal_outage", "id": f"m{n}", "junction": junction} for n in range(number)
    ]
    return document | {"measures": outages}


def _actors(document: Document, number: int, **fields: Any) -> Document:
    known = document["actors"]
    actors = [
        known[n % len(known)]
        | {"id": f"a{n}", "ego": False, "depart": 5.0 * (n // len(known))}
        | {key: value(n) if callable(value) else value for key, value in fields.items()}
        for n in range(number)
    ]
    return document | {"actors": actors}


def actors(document: Document, number: int) -> Document:
    """At the places that a sampler has found, one after another."""
    return _actors(document, number)


def actors_at_one_time(document: Document, number: int) -> Document:
    """All depart at once, from few places."""
    return _actors(document, number, depart=0.0)


def actors_of_unknown_styles(document: Document, number: int) -> Document:
    """Each is an ego, with a driving style that is not there."""
    return _actors(document, number, style=lambda n: f"wild-{n}", ego=True)


def flows(document: Document, number: int) -> Document:
    """All from one node."""
    node = _lane_node(document)
    ones = [{"id": f"f{n}", "spawn": node, "per_hour": 1.0, "end": 60.0} for n in range(number)]
    return document | {"flows": ones}


def criteria(document: Document, number: int) -> Document:
    """At most the 200 that a document may have."""
    return document | {"criteria": ["collisions == 0"] * min(number, 200)}


def _edits_of_measures(document: Document, number: int) -> list[Document]:
    measures_of = measures(document, number)["measures"]
    return [{"kind": "set_measure", "measure": one} for one in measures_of]


def _edits_of_an_actor(document: Document, number: int) -> list[Document]:
    actor = document["actors"][0]["id"]
    return [{"kind": "change_actor", "actor": actor, "speed": 5.0 + n % 7} for n in range(number)]


def _edits_of_flows(document: Document, number: int) -> list[Document]:
    """One flow after another from one node; the first is refused where others start."""
    start, _ = _road_nodes(document)
    return [{"kind": "add_flow", "spawn": start, "per_hour": 1.0} for _ in range(number)]


def _edits_of_parameters(_document: Document, number: int) -> list[Document]:
    return [{"kind": "set_parameter", "parameter": f"p{n}", "value": 1.0} for n in range(number)]


EDITS: dict[str, Callable[[Document, int], list[Document]]] = {
    "edits of measures": _edits_of_measures,
    "edits of one actor": _edits_of_an_actor,
    "edits of flows": _edits_of_flows,
    "edits of parameters": _edits_of_parameters,
}
"""Edits of one request, each for so many."""


def region(document: Document, number: int) -> Document:
    """Segments that the map does not have."""
    return document | {"roi": [*document["roi"], *(f"r-{n}" for n in range(number))]}
