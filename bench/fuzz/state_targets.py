"""Trials with input that is well-formed and odd in what it says: bodies in bodies, empty roads."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from bench.fuzz.damage import Generator, pick
from bench.fuzz.drawn import drawn
from bench.fuzz.results import other_files, wrong_in_document, wrong_in_map
from bench.fuzz.trials import Target, Trial

Document = dict[str, Any]
_CATEGORIES = (
    "car", "van", "truck", "bus", "motorcycle", "bicycle", "pedestrian", "wheelchair", "emergency",
)  # fmt: skip


def odd_states(trial: Trial) -> str:
    """One to three odd states of one scenario, checked and run with criticality."""
    rng = trial.rng
    source = trial.material.file(pick(rng, ("done.scenario.json", "turned.scenario.json")))
    document = json.loads(source.read_text(encoding="utf-8"))
    kinds = [pick(rng, sorted(_STATES)) for _ in range(int(pick(rng, (1, 1, 2, 3))))]
    for kind in kinds:
        document = _STATES[kind](document, rng)
    file = trial.folder / "odd.scenario.json"
    file.write_text(json.dumps(document), encoding="utf-8")
    used = trial.used("maps")
    ended = trial.command("check", str(file), *used)
    if ended.code == 0:
        trial.ask("odd state", lambda: wrong_in_document(file))
        if rng.random() < 0.6:
            trial.run(file, used, "--criticality")
            if rng.random() < 0.1:
                _same_again(trial, file, used)
    return " + ".join(kinds)


def _same_again(trial: Trial, file: Path, used: list[str]) -> None:
    """The same scenario run again gives the same bytes."""
    first, second = trial.folder / "workspace" / "runs", trial.folder / "again"
    trial.command("run", str(file), "--until", "8", "--criticality", "--out", str(second), *used)

    def compare() -> str:
        for name in ("actors.json", "events.json", "trajectories.parquet", "conflicts.parquet"):
            ours, theirs = sorted(first.glob(f"*/{name}")), sorted(second.glob(f"*/{name}"))
            if [one.read_bytes() for one in ours] != [one.read_bytes() for one in theirs]:
                return f"{name} is another one the second time"
        return ""

    trial.ask("run again", compare)


def _actors(document: Document, rng: Generator) -> list[Document]:
    known = document["actors"]
    return [known[int(rng.integers(len(known)))] for _ in range(int(pick(rng, (2, 3, 8))))]


def _stacked(document: Document, rng: Generator) -> Document:
    """Several at one place and time: bodies in bodies from the start."""
    spawn = pick(rng, document["actors"])["spawn"]
    stacked = [
        one | {"id": f"stack-{n}", "spawn": spawn, "depart": 0.0, "ego": False}
        for n, one in enumerate(_actors(document, rng))
    ]
    return document | {"actors": [*document["actors"], *stacked]}


def _close(document: Document, rng: Generator) -> Document:
    """A queue with less between the bodies than they are long, or with speeds that do not fit."""
    first = pick(rng, document["actors"])
    place, _, number = first["spawn"].rpartition(".")
    if not re.fullmatch(r"-?\d+", number):
        return document
    gap = int(pick(rng, (0, 1, 1, 2)))
    fields: tuple[Document, ...] = ({}, {"initial_speed": 0.0}, {"initial_speed": 13.0})
    queue = [
        first | {"id": f"queue-{n}", "spawn": f"{place}.{int(number) + n * gap}", "ego": False}
        | pick(rng, fields)
        for n in range(6)
    ]  # fmt: skip
    return document | {"actors": [*document["actors"], *queue]}


def _no_way(document: Document, rng: Generator) -> Document:
    """A goal that is the start, or behind it, or on another lane."""
    actors = [dict(one) for one in document["actors"]]
    for one in actors:
        if rng.random() < 0.3:
            one["goal"] = pick(rng, (one["spawn"], pick(rng, actors)["spawn"]))
    return document | {"actors": actors}


def _other_bodies(document: Document, rng: Generator) -> Document:
    actors = [
        one | {"category": pick(rng, _CATEGORIES)} if rng.random() < 0.3 else one
        for one in document["actors"]
    ]
    return document | {"actors": actors}


def _same_names(document: Document, rng: Generator) -> Document:
    """Names that others have: of flows, persons, crossings, SUMO's own."""
    words = ("f.0", "ped.1", "f", ":J10001", "J10001", "1.0.f", "flow.0", "none", "0", "ego", "ä b")
    actors = [dict(one) for one in document["actors"]]
    for one in actors[:4]:
        one["id"] = pick(rng, words)
    return document | {"actors": actors}


def _region(document: Document, rng: Generator) -> Document:
    """A region of junctions only, or of one segment."""
    roi = document["roi"]
    inner = [one for one in roi if one.startswith("j")]
    return document | {"roi": pick(rng, (inner, roi[:1], roi[-1:], [*roi, roi[0]]))}


def _instant(document: Document, rng: Generator) -> Document:
    simulation = document.get("simulation", {}) | {
        "duration": pick(rng, (0.1, 0.5, 1.0, 86400.0)),
        "step_length": pick(rng, (0.05, 0.1, 0.5, 1.0)),
    }
    return document | {"simulation": simulation}


def _flood(document: Document, rng: Generator) -> Document:
    spawn = pick(rng, document["actors"])["spawn"]
    flows = [
        {"id": f"flood-{n}", "spawn": spawn, "per_hour": float(pick(rng, (1.0, 1e3, 3.6e3, 1e5)))}
        for n in range(3)
    ]
    return document | {"flows": [*document.get("flows", []), *flows]}


def _rules(document: Document, rng: Generator) -> Document:
    """Rules of all kinds, which act at once, upon each other, on others that are gone."""
    schema = _rule_schema()
    names = [one["id"] for one in document["actors"]][:4]
    names += [one["spawn"] for one in document["actors"]][:3]
    rules = []
    for n in range(int(pick(rng, (1, 3, 8)))):
        made = drawn(schema, schema["$defs"], names, rng)
        if not isinstance(made, dict):
            continue
        actor = pick(rng, document["actors"])["id"]
        first = {"when": {"time": {"after": 0.5}}} if rng.random() < 0.5 else {}
        rules.append(made | {"id": f"odd-{n}", "actor": actor} | first)
    return document | {"rules": rules}


@cache
def _rule_schema() -> Document:
    from odscen.scenario.document.rules_document import StoryRule

    return StoryRule.model_json_schema()


def _closed(document: Document, rng: Generator) -> Document:
    """Everything is closed, or all lights are off, all the time or for an instant."""
    places = document["roi"]
    chosen = places if rng.random() < 0.5 else [pick(rng, places)]
    measures = [
        {
            "kind": "closure",
            "id": "m",
            "places": chosen,
            "begin": 0.0,
            "end": pick(rng, (0.1, 9e4)),
        },
        {"kind": "signal_outage", "id": "o", "junction": "10001"},
    ]
    return document | {"measures": measures}


def _weather(document: Document, rng: Generator) -> Document:
    names = ("precipitation", "wetness", "fog_density", "wind_intensity", "sun_altitude_angle")
    parameters = {name: float(pick(rng, (0.0, 100.0, 90.0))) for name in names}
    return document | {"environment": document["environment"] | {"parameters": parameters}}


def _walkers(document: Document, rng: Generator) -> Document:
    """Pedestrians who all go from and to one place."""
    walkers = [one for one in document["actors"] if one["category"] == "pedestrian"]
    if not walkers:
        return document
    one = pick(rng, walkers)
    crowd = [one | {"id": f"crowd-{n}", "depart": 0.0} for n in range(30)]
    return document | {"actors": [*document["actors"], *crowd]}


def _transit(document: Document, rng: Generator) -> Document:
    spawn = pick(rng, document["actors"])["spawn"]
    stop = {"id": "s", "node": spawn}
    line = {
        "id": "l",
        "start": spawn,
        "stops": [{"stop": "s"}],
        "headway": float(pick(rng, (1.0, 5.0, 60.0, 1e-3))),
        "end": float(pick(rng, (10.0, 1e9, 3600.0))),
    }
    return document | {"transit": {"stops": [stop], "lines": [line]}}


_STATES: dict[str, Callable[[Document, Generator], Document]] = {
    "bodies in bodies": _stacked,
    "bodies in bodies again": _stacked,
    "closed": _closed,
    "crowd": _walkers,
    "flood": _flood,
    "instant": _instant,
    "names of others": _same_names,
    "no way": _no_way,
    "other bodies": _other_bodies,
    "queue": _close,
    "region": _region,
    "rules": _rules,
    "transit": _transit,
    "weather": _weather,
}


def odd_maps(trial: Trial) -> str:
    """Maps that are well-formed, and whose roads are not what one expects."""
    rng = trial.rng
    source = pick(rng, trial.material.map_files[:5])
    kind = pick(rng, sorted(_MAPS))
    text = _MAPS[kind](source.read_text(encoding="utf-8"), rng)
    file = trial.folder / "odd.xodr"
    file.write_text(text, encoding="utf-8")
    used = trial.used()
    ended = trial.command("maps", "add", str(file), *used)
    if ended.code:
        return f"{source.stem}: {kind}"
    folder = Path(used[1]) / "maps" / "odd"
    trial.ask("odd map", lambda: wrong_in_map(folder))
    said = trial.command("maps", "verify", "odd", *used)
    if said.code == 1 and "maps verify" not in ended.out + ended.err:
        trial.wrong(f"maps add says nothing of what maps verify finds: {said.out[-200:]}")
    made = trial.folder / "made"
    ended = trial.command(
        "generate", "--map", "odd", "--seed", "1", "--fill", "0.3", "--out", str(made), *used
    )
    for scenario in made.glob("*.scenario.json") if ended.code == 0 else ():
        if trial.command("check", str(scenario), *used).code:
            trial.wrong("a scenario that was sampled has errors")
        trial.run(scenario, used)
    if rng.random() < 0.1:
        again = trial.folder / "again"
        trial.command("maps", "add", str(file), "--workspace", str(again))

        def compare() -> str:
            return other_files(folder / "sumo", again / "maps" / "odd" / "sumo")

        if (folder / "sumo").is_dir():
            trial.ask("map again", compare)
    return f"{source.stem}: {kind}"


def _all_in_a_junction(text: str, _rng: Generator) -> str:
    junction = re.search(r'<junction\b[^>]*\bid="([^"]+)"', text)
    name = junction[1] if junction else "1"
    return re.sub(r'(<road\b[^>]*\bjunction=")-1"', rf'\g<1>{name}"', text)


def _no_links(text: str, _rng: Generator) -> str:
    return re.sub(r"<(predecessor|successor)\b[^>]*/>", "", text)


def _no_junctions(text: str, _rng: Generator) -> str:
    return re.sub(r"<junction\b.*?</junction>", "", text, flags=re.DOTALL)


def _names(text: str, rng: Generator) -> str:
    """Ids of roads that others use: pedestrians, junctions, SUMO."""
    known = sorted(set(re.findall(r'<road\b[^>]*\bid="([^"]+)"', text)))
    for old in known[:3]:
        new = pick(rng, ("ped.1", "J10001", ":x", "1.0.f", "1.f", "a b", "é", "-1", "0", "1.0"))
        if new not in known:
            text = re.sub(rf'(<road\b[^>]*\bid="){re.escape(old)}"', rf'\g<1>{new}"', text)
            text = re.sub(
                rf'((?:elementType="road" elementId|incomingRoad|connectingRoad)=")'
                rf'{re.escape(old)}"', rf'\g<1>{new}"', text,
            )  # fmt: skip
    return text


def _only_type(text: str, rng: Generator) -> str:
    kind = pick(rng, ("none", "sidewalk", "biking", "parking", "shoulder", "bidirectional", "tram"))
    return re.sub(r'type="driving"', f'type="{kind}"', text)


def _widths(text: str, rng: Generator) -> str:
    width = pick(rng, ("0", "0.01", "0.5", "30", "1.2"))
    return re.sub(r'(<width\b[^>]*\ba=")[^"]*"', rf'\g<1>{width}"', text)


def _scaled(text: str, rng: Generator) -> str:
    """All places moved far away."""
    far = float(pick(rng, (1e3, 1e5, 5e6)))
    return re.sub(
        r'(<geometry\b[^>]*\bx=")([^"]*)"', lambda at: f'{at[1]}{float(at[2]) + far!r}"', text
    )


def _speeds(text: str, rng: Generator) -> str:
    speed = pick(rng, ("0", "0.1", "no limit", "undefined", "1000"))
    return re.sub(r'(<speed\b[^>]*\bmax=")[^"]*"', rf'\g<1>{speed}"', text)


_MAPS: dict[str, Callable[[str, Generator], str]] = {
    "all in a junction": _all_in_a_junction,
    "far away": _scaled,
    "names of others": _names,
    "no junctions": _no_junctions,
    "no links": _no_links,
    "one type of lane": _only_type,
    "speeds": _speeds,
    "widths": _widths,
}

STATE_TARGETS: dict[str, tuple[Target, float]] = {
    "odd map": (odd_maps, 0.6),
    "odd state": (odd_states, 1.5),
}
"""As :data:`bench.fuzz.file_targets.FILE_TARGETS`."""
