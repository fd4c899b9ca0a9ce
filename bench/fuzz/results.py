"""What is wrong with a result that a command has called good, in words; none if nothing is.

These are asked in processes of their own (:meth:`bench.fuzz.trials.Trial.ask`): what they read was
made from damaged input.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

FAR = 1e7
"""Metres: no map of the bench is so large, or moved so far away."""


def _no_constant(text: str) -> float:
    raise ValueError(f"{text} in JSON")


def strict_json(path: Path) -> Any:
    """JSON of a file, without the numbers that JSON does not have."""
    return json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_constant)


def wrong_in_run(run: Path) -> str:
    """Counts that do not add up, numbers that are none, road users from nowhere."""
    from odscen.base.errors import InputError
    from odscen.runs.finished_run import Run

    try:
        known = strict_json(run / "summary.json")
        rows = strict_json(run / "actors.json")["actors"]
        events = strict_json(run / "events.json")["events"]
        opened = Run.open(run)
        table = opened.trajectories() if known["files"].get("trajectories") else None
    except (ValueError, KeyError, InputError) as error:
        return f"what a run wrote is not readable: {error}"
    counts = known["actors"]
    names = Counter(row["id"] for row in rows)
    if double := [name for name, number in names.items() if number > 1]:
        return f"{double[0]} has {names[double[0]]} outcomes"
    if len(rows) != counts["planned"]:
        return f"{counts['planned']} are planned and {len(rows)} have an outcome"
    states = Counter(row["status"] for row in rows)
    for state in ("arrived", "running", "waiting"):
        if states[state] > counts[state]:
            return f"{states[state]} are {state}, and the summary says {counts[state]}"
    for event in events:
        if not 0.0 <= event["time"] <= known["until"] + known["step_length"]:
            return f"an event at {event['time']} of a run until {known['until']}"
        if abs(event.get("x") or 0.0) > FAR or abs(event.get("y") or 0.0) > FAR:
            return f"an event at x {event['x']}, y {event['y']}"
    if known["status"] != "completed":
        return f"exit code 0, and the status is {known['status']}"
    if table is not None:
        return _wrong_in_table(table, set(names))
    return ""


def _wrong_in_table(table: Any, names: set[str]) -> str:
    import polars as pl

    numbers = [name for name, kind in table.schema.items() if kind.is_float()]
    for name in numbers:
        values = table[name].drop_nulls()
        if len(values) and not bool(values.is_finite().all()):
            return f"{name} of trajectories has what is no number"
        if name in ("x", "y", "vehicle_x", "vehicle_y") and len(values):
            far = float(values.abs().max())
            if far > FAR:
                return f"{name} of trajectories is {far}"
    for column in ("id", "actor", "vehicle_id"):
        if column in table.columns:
            strange = set(table[column].unique().drop_nulls().cast(pl.String)) - names
            if strange:
                return f"{min(strange)} has a trajectory, and no outcome"
    return ""


def wrong_in_document(file: Path) -> str:
    """What the text of a scenario says, and the scenario read from it does not.

    And whether it is the same again after it was written.
    """
    from odscen.app.scenarios import read_scenario
    from odscen.scenario.document.json_form import dumps, loads

    scenario = read_scenario(file)
    text = dumps(scenario)
    if loads(text) != scenario:
        return "the scenario is another one after it was written and read"
    if dumps(loads(text)) != text:
        return "the scenario is written in another way the second time"
    if file.suffix == ".json":
        doubled: list[str] = []

        def pairs(found: list[tuple[str, Any]]) -> dict[str, Any]:
            names = Counter(name for name, _ in found)
            doubled.extend(name for name, number in names.items() if number > 1)
            return dict(found)

        given = json.loads(file.read_bytes().decode("utf-8-sig"), object_pairs_hook=pairs)
        if doubled:
            return f"the document has {doubled[0]!r} twice, and one of them is not read"
        return _lost(given, scenario.model_dump(mode="json"), "")
    return ""


_PLACES: dict[str, tuple[str, ...]] = {
    "set_seed": (),
    "rename": (),
    "set_simulation": ("simulation",),
    "set_environment": ("environment",),
    "set_study": ("study",),
    "set_drivers": ("drivers",),
    "set_clock": ("demand",),
}
"""Where a document has what edits of a kind give, by the same names."""


def wrong_in_variant(source: Path, edits: Any, out: Path) -> str:
    """What edits say that were taken, and the scenario made by them does not."""
    document, before = strict_json(out), strict_json(source)
    edits = edits if isinstance(edits, list) else [edits]
    said = {(edit["kind"], field): given for edit in edits for field, given in edit.items()}
    for (kind, field), given in said.items():
        if kind in _PLACES and field != "kind" and given is not None:
            read = document
            for name in _PLACES[kind]:
                read = read.get(name) or {}
            if field not in read:
                continue  # what is usual is not written
            # An edit takes a number as text, too.
            number = isinstance(given, str) and isinstance(read[field], int | float)
            if words := _lost(float(given) if number else given, read[field], f"{kind}.{field}"):
                return words
    actors = {row["id"]: row for row in document.get("actors") or ()}
    flows = {row["id"]: row for row in document.get("flows") or ()}
    removed: set[str] = set()
    for edit in edits:
        if edit["kind"] == "remove_actors":
            removed |= set(edit["actors"])
        elif edit["kind"] == "add_flow" and edit.get("id"):
            if edit["id"] not in removed | flows.keys():
                return f"the flow {edit['id']!r} was added, and is not there"
        elif edit["kind"] == "move_actor" and edit["actor"] in actors:
            last = [one for one in edits if one.get("actor") == edit["actor"]][-1]
            if last is edit and actors[edit["actor"]]["spawn"] != edit["spawn"]:
                return f"{edit['actor']!r} was moved to {edit['spawn']!r}, and is not there"
    missing = {row["id"] for row in before["actors"]} - removed - actors.keys()
    if missing and not {edit["kind"] for edit in edits} & {"shrink_roi", "change_actor"}:
        return f"{sorted(missing)} were not removed, and are gone"
    if stayed := sorted(removed & actors.keys() - {edit.get("id") for edit in edits}):
        return f"{stayed} were removed, and are there"
    number = len((document.get("variant") or {}).get("edits") or ())
    if number != len(edits):
        return f"{len(edits)} edits were taken, and the variant names {number}"
    return ""


def _lost(given: Any, read: Any, place: str) -> str:
    """The first value that was given and is not what was read."""
    if isinstance(given, dict):
        if not isinstance(read, dict):
            return f"{place}: {str(given)[:80]} became {str(read)[:80]}"
        for name, value in given.items():
            if name not in read:
                return f"{place}.{name} is not read, and not refused"
            if words := _lost(value, read[name], f"{place}.{name}"):
                return words
        return ""
    if isinstance(given, list):
        if not isinstance(read, list) or len(read) != len(given):
            return f"{place}: {str(given)[:80]} became {str(read)[:80]}"
        for number, (value, other) in enumerate(zip(given, read, strict=True)):
            if words := _lost(value, other, f"{place}[{number}]"):
                return words
        return ""
    if isinstance(given, str) and "$" in given:
        return ""  # a formula, and its number
    if isinstance(given, bool) or isinstance(read, bool):
        same = given is read
    elif isinstance(given, int | float) and isinstance(read, int | float):
        same = math.isclose(given, read, rel_tol=1e-15)
    else:
        same = given == read
    return "" if same else f"{place}: {given!r} became {read!r}"[:300]


def wrong_in_imported_table(kind: str, table: Path, scenario: Path) -> str:
    """A sum of a table that is another one in the scenario that it was imported into."""
    from odscen.app.scenarios import read_scenario

    demand = read_scenario(scenario).demand
    text = table.read_bytes().decode("utf-8-sig")
    head = text.partition("\n")[0]
    separator = ";" if ";" in head else ","
    if kind != "profile" and not {"trips", "count", "zone"} & set(head.split(separator)):
        return ""  # written in another way, of which this knows nothing
    lines = csv.DictReader(io.StringIO(text), delimiter=separator)
    # A quote that nothing closes leaves a row of white space, which is none.
    rows = [row for row in lines if "".join(map(str, filter(None, row.values()))).strip()]
    if kind == "od":
        given = sum(float(row["trips"].replace(",", ".")) for row in rows)
        read = sum(trips for matrix in demand.matrices for _, _, trips in matrix.trips)
    elif kind == "counts":
        given = sum(float(row["count"].replace(",", ".")) for row in rows)
        read = sum(row[3] for counts in demand.counts for row in counts.rows)
    elif kind == "zones":
        given = len({(row["zone"].strip(), row["segment"].strip()) for row in rows})
        read = sum(len(set(zone.segments)) for zone in demand.zones)
    else:
        given = len(rows)
        read = max((len(profile.shares) for profile in demand.profiles), default=0)
    if not math.isclose(given, read, rel_tol=1e-9):
        return f"the table of {kind} says {given}, and the scenario {read}"
    return ""


def wrong_in_map(map_folder: Path) -> str:
    """Numbers of a built map that are none, or nodes far from its roads."""
    import numpy as np

    from odscen.app.maps import load_map
    from odscen.maps.store import Workspace

    loaded = load_map(Workspace.open(map_folder.parents[1]).map(map_folder.name))
    lanes = loaded.sumo.graph.lanes
    for name in ("x", "y", "z", "hdg"):
        values = getattr(lanes, name, None)
        if values is not None and not np.isfinite(values).all():
            return f"{name} of the lane graph has what is no number"
    return ""


def other_files(first: Path, second: Path) -> str:
    """The first file that differs between two folders."""
    ours = {path.relative_to(first): path for path in first.rglob("*") if path.is_file()}
    theirs = {path.relative_to(second): path for path in second.rglob("*") if path.is_file()}
    if strange := sorted(map(str, ours.keys() ^ theirs.keys())):
        return f"{strange[0]} is there once only"
    for name, path in sorted(ours.items()):
        if path.read_bytes() != theirs[name].read_bytes():
            return f"{name} is another one the second time"
    return ""
