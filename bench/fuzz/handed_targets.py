"""Trials with files that others hand over: OpenSCENARIO, GTFS, plans, edits as files."""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from typing import Any

from bench.fuzz.damage import (
    CSV,
    JSON,
    NUMBERS,
    TOML,
    WORDS,
    Damage,
    Generator,
    damaged,
    flipped,
    json_value,
    pick,
    torn,
)
from bench.fuzz.map_damage import XML
from bench.fuzz.results import other_files, wrong_in_document, wrong_in_variant
from bench.fuzz.trials import Target, Trial


def openscenario(trial: Trial) -> str:
    """A scene, its catalog or its map damaged; what is taken is the same again, and runs."""
    rng = trial.rng
    folder = trial.folder / "osc"
    shutil.copytree(trial.material.file("osc"), folder)
    scene = pick(rng, sorted(folder.glob("*.xosc")))
    files = [scene, scene, scene, *sorted((folder / "own").glob("*.xosc"))]
    file = pick(rng, files)
    damage = damaged(file.read_bytes(), rng, XML)
    file.write_bytes(damage.data)
    used = trial.used("maps")
    made = trial.folder / "made" / "taken.scenario.json"
    made.parent.mkdir()
    ended = trial.command(
        "import", str(scene), "--out", str(made), *used, writes=[made.parent, folder]
    )
    if ended.code == 0 and made.exists():
        trial.ask("taken scene", lambda: wrong_in_document(made))
        trial.command("check", str(made), *used)
        if rng.random() < 0.25:
            again = trial.folder / "again" / "taken.scenario.json"
            again.parent.mkdir()
            trial.command("import", str(scene), "--out", str(again), *used)
            trial.ask("scene again", lambda: other_files(made.parent, again.parent))
        if rng.random() < 0.3:
            trial.run(made, used, "--criticality")
    return f"{file.relative_to(folder)}: {damage.kind}"


def feeds(trial: Trial) -> str:
    """A table of a GTFS feed damaged, or the archive itself."""
    rng = trial.rng
    source = trial.material.file("feed")
    tables = {path.name: path.read_bytes() for path in sorted(source.glob("*.txt"))}
    name = pick(rng, sorted(tables))
    what = pick(rng, ("table", "table", "table", "gone", "archive", "folder"))
    damage = Damage(what, b"")
    if what == "gone":
        del tables[name]
    elif what != "archive":
        damage = damaged(tables[name], rng, CSV)
        tables[name] = damage.data
    feed = trial.folder / ("feed" if what == "folder" else "feed.zip")
    if what == "folder":
        feed.mkdir()
        for table, content in tables.items():
            (feed / table).write_bytes(content)
    else:
        feed.write_bytes(_archive(tables, rng, odd=what == "archive"))
    document = trial.folder / "document" / "buses.scenario.json"
    document.parent.mkdir()
    shutil.copy(trial.material.file("buses.scenario.json"), document)
    used = trial.used("maps")
    day = pick(rng, ("2026-11-23", "2026-11-23", "2026-11-23", "2026-11-28", "1-1-1", "nan"))
    more = ["--within", pick(rng, ("1", "500", "nan", "1e9"))] if rng.random() < 0.1 else []
    ended = trial.command(
        "transit",
        "import",
        str(document),
        str(feed),
        "--day",
        day,
        *more,
        *used,
        writes=[document.parent],
    )
    if ended.code == 0:
        trial.ask("lines of a feed", lambda: wrong_in_document(document))
        trial.command("check", str(document), *used)
        if rng.random() < 0.25:
            trial.run(document, used)
    return f"{name}: {what} {damage.kind}"


def _archive(tables: dict[str, bytes], rng: Generator, *, odd: bool) -> bytes:
    """A feed as an archive; an odd one has members that no feed has, or is damaged."""
    made = io.BytesIO()
    kind = pick(rng, ("bytes", "cut", "outside", "twice", "large", "deep", "link")) if odd else ""
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in tables.items():
            archive.writestr(f"{'d/' * 2000 if kind == 'deep' else ''}{name}", content)
        if kind == "outside":
            archive.writestr("../../../stops.txt", b"stop_id\nx\n")
        elif kind == "large":
            archive.writestr("shapes.txt", b"0" * 120_000_000)
            archive.writestr("more/stops.txt", b"a,b\n" * 20_000_000)
        elif kind == "link":
            link = zipfile.ZipInfo("calendar_dates.txt")
            link.external_attr = 0o120777 << 16
            archive.writestr(link, "/etc/passwd")
    if kind == "twice":
        import warnings

        with zipfile.ZipFile(made, "a") as archive, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            archive.writestr("stops.txt", b"stop_id,stop_lat,stop_lon\na,1,1\n")
    data = made.getvalue()
    return {"bytes": flipped, "cut": torn}.get(kind, lambda given, _: given)(data, rng)


_AXES: tuple[dict[str, Any], ...] = (
    {"parameter": "gap", "from": 6, "to": 46, "steps": 3},
    {"parameter": "gap", "values": [6, 8]},
    {"parameters": ["gap", "speed"], "table": [[6, 10], [8, 12.5]]},
    {"parameter": "speed", "from": 5, "to": 15},
)


def sweep_plans(trial: Trial) -> str:
    """A plan of a sweep, as a file or as words; some are carried out."""
    rng = trial.rng
    used = trial.used("maps")
    scenario = str(trial.material.file("turned.scenario.json"))
    out = trial.folder / "swept"
    call = ["sweep", scenario, "--out", str(out)]
    if rng.random() < 0.4:
        kind = pick(rng, _WORDS_TO_VARY) if rng.random() < 0.5 else _odd_words(rng)
        kind = kind.replace("\x00", "").encode("utf-8", errors="replace").decode()
        call += [f"--vary={kind}"]
        if rng.random() < 0.3:
            call += [f"--samples={pick(rng, ('1', '3', '0', '-1', '100000', '1e9', '9' * 30))}"]
    else:
        plan: dict[str, Any] = {"vary": [pick(rng, _AXES)]}
        if rng.random() < 0.5:
            plan |= {"method": pick(rng, ("sobol", "latin", "random", "grid")), "samples": 3}
        data = json.dumps(plan).encode()
        damage = damaged(data, rng, {"value": json_value, **JSON}) if rng.random() < 0.9 else None
        file = trial.folder / "plan.json"
        file.write_bytes(damage.data if damage else data)
        kind = damage.kind if damage else "as it is"
        call += ["--plan", str(file)]
    ended = trial.command(*call, "--dry-run", *used, writes=[out])
    if ended.code == 0 and rng.random() < 0.15 and ended.out.count("\n") < 12:
        trial.command(*call, *used, seconds=60.0)
        trial.command(*call, *used, seconds=60.0)
    return f"sweep: {kind[:60]}"


_WORDS_TO_VARY = (
    "gap=6..46:30000000",
    "gap=6..46:1e9",
    "gap=6..46:2.5",
    "gap=6..46:-1",
    "gap=6..46:0",
    "gap=6..46:1",
    "gap=6..6:3",
    "gap=46..6:3",
    "gap=nan..6:3",
    "gap=6..inf:3",
    "gap=6,6,6",
    "gap=",
    "gap=,",
    "=1..2:3",
    "gap",
    "gap=1e400",
    "gap=6..46:" + "9" * 5000,
    "gap=6..46:99999999999999999999",
    "gap=" + ",".join(map(str, range(30))) * 300,
    "gap=0..100:300",
    "speed=5..15:3",
    "none=1,2",
    "gap=6...46:3",
    "gap=6..46:3:4",
)


def _odd_words(rng: Generator) -> str:
    name = pick(rng, ("gap", "speed", "gap", *WORDS))
    low, high, steps = (pick(rng, (*NUMBERS, "6", "46", "3")) for _ in range(3))
    return pick(rng, (f"{name}={low}..{high}:{steps}", f"{name}={low},{high}", f"{name}={low}"))


def study_plans(trial: Trial) -> str:
    """Plans of studies and datasets; most are counted only, some carried out and looked at."""
    rng = trial.rng
    what = pick(rng, ("study", "study", "study", "dataset"))
    folder = trial.folder / "plans"
    folder.mkdir()
    for name in (f"{what}.toml", "turned.scenario.json"):
        shutil.copy(trial.material.file(name), folder)
    source = (folder / f"{what}.toml").read_bytes()
    if rng.random() < 0.5:
        import tomllib

        file = folder / f"{what}.json"
        data = json.dumps(tomllib.loads(source.decode())).encode()
        damage = damaged(data, rng, {"value": json_value, **JSON})
    else:
        file = folder / f"{what}.toml"
        damage = damaged(source, rng, TOML)
    file.write_bytes(damage.data)
    used = trial.used("maps")
    out = trial.folder / "written"
    if what == "study":
        ended = trial.command(
            "study", "run", str(file), "--out", str(out), "--dry-run", *used, writes=[out]
        )
        if ended.code == 0 and rng.random() < 0.15 and _few(ended.out):
            trial.command("study", "run", str(file), "--out", str(out), *used, seconds=60.0)
            trial.command("study", "status", str(out), *used)
            trial.command("study", "report", str(out), *used)
    else:
        ended = trial.command("dataset", str(file), "--out", str(out), *used, seconds=60.0)
        if ended.code == 2 and out.exists() and not (out / "study").exists():
            left = sorted(path.name for path in out.iterdir())
            if left:
                trial.wrong(f"a refused plan of a dataset occupies its folder: {left}")
    return f"{what}: {damage.kind}"


def _few(said: str) -> bool:
    """Whether a study has so few runs that they are carried out here."""
    import re

    numbers = [int(one.replace(",", "")) for one in re.findall(r"\d[\d,]*", said)]
    return bool(numbers) and max(numbers[:1]) <= 8


def edits_of_files(trial: Trial) -> str:
    """``odscen variant`` with edits from a file or from words; what is taken is in the variant."""
    rng = trial.rng
    used = trial.used("maps")
    source = trial.material.file("turned.scenario.json")
    out = trial.folder / "variant" / "x.scenario.json"
    out.parent.mkdir()
    call = ["variant", str(source)]
    chosen = rng.permutation(len(_EDITS))[: int(rng.integers(1, 5))]
    edits = [_EDITS[row] for row in sorted(chosen)]
    file = trial.folder / "edits.json"
    what = pick(
        rng, ("as they are", "numbers", "numbers", "words", "value", "value", "bytes", "odd words")
    )
    if what == "numbers":
        edits = [_with_other_numbers(edit, rng) for edit in edits]
    kind = what
    if what in ("words", "odd words"):
        said = [
            f"{edit['kind']}.{field}={json.dumps(value)}"
            for edit in edits
            for field, value in edit.items()
            if field != "kind"
        ]
        if what == "odd words":
            kind = _odd_setting(rng)
            said.insert(int(rng.integers(len(said) + 1)), kind)
        call += [f"--set={one}" for one in said]
    else:
        data = json.dumps(edits).encode()
        if what == "value":
            for _ in range(int(pick(rng, (1, 1, 2)))):
                data = json_value(data, rng)
        elif what == "bytes":
            damage = damaged(data, rng, JSON)
            data, kind = damage.data, damage.kind
        file.write_bytes(data)
        call.insert(2, str(file))
    ended = trial.command(*call, "--out", str(out), *used, writes=[out.parent])
    if ended.code != 0:
        if what in ("as they are", "numbers", "words"):
            trial.wrong(f"edits that fit are refused: {[edit['kind'] for edit in edits]}")
        return f"variant: {kind[:60]}"
    trial.counts["edits taken"] += 1
    trial.ask("variant", lambda: wrong_in_document(out))
    if file.exists() or what == "words":
        given = json.loads(file.read_bytes()) if file.exists() else edits
        trial.ask("edits", lambda: wrong_in_variant(source, given, out))
    trial.command("check", str(out), *used)
    trial.command("diff", str(source), str(out))
    if rng.random() < 0.2:
        again = trial.folder / "again" / out.name
        again.parent.mkdir()
        trial.command(*call, "--out", str(again), *used)
        trial.ask("variant again", lambda: other_files(out.parent, again.parent))
    if rng.random() < 0.1:
        trial.run(out, used)
    return f"variant: {kind[:60]}"


def _with_other_numbers(edit: dict[str, Any], rng: Generator) -> dict[str, Any]:
    """Other numbers in the place of those of an edit, which fit as well."""
    factor = float(pick(rng, (0.7, 0.9, 1.1, 1.5)))
    found: dict[str, Any] = {}
    for field, value in edit.items():
        if isinstance(value, float):
            found[field] = value if field == "max" else value * factor
        elif isinstance(value, int):
            found[field] = value + int(rng.integers(0, 3))
        else:
            found[field] = value
    return found


def _odd_setting(rng: Generator) -> str:
    """A field of an edit of any kind, with an odd value."""
    from odscen.scenario.edits.edit_messages import EDIT_MESSAGES

    edit = pick(rng, sorted(EDIT_MESSAGES))
    field = pick(rng, (*sorted(EDIT_MESSAGES[edit].model_fields), *WORDS))
    value = pick(rng, (*NUMBERS, *WORDS, "[]", "{}", "null", '["r1"]', '{"time": {}}'))
    said = f"{edit}.{field}={value}".replace("\x00", "")
    return said.encode("utf-8", errors="replace").decode()


_EDITS: tuple[dict[str, Any], ...] = (
    {"kind": "set_seed", "seed": 4},
    {"kind": "set_simulation", "duration": 20.0},
    {"kind": "set_environment", "preset": "HardRainNoon"},
    {"kind": "set_parameter", "parameter": "gap", "value": 12.0, "max": 100.0},
    {"kind": "set_goal", "actor": "car-2", "goal": None},
    {"kind": "move_actor", "actor": "car-3", "spawn": "1.0.-2.29"},
    {"kind": "rename", "name": "other", "description": "a variant"},
    {"kind": "set_clock", "clock": 25200.0},
    {"kind": "set_signal_control", "control": "actuated"},
    {"kind": "add_actor", "id": "bike", "category": "bicycle", "spawn": "1.0.-1.11"},
    {"kind": "add_flow", "id": "more", "spawn": "1.0.-2.5", "per_hour": 120.0},
    {"kind": "change_flow", "flow": "f", "per_hour": 60.0},
    {"kind": "set_zone", "zone": "west", "segments": ["r1", "r2"]},
    {"kind": "set_study", "warm_up": 1},
    {"kind": "set_drivers", "headway": 1.4},
    {"kind": "set_routes", "by": "travel_time", "iterations": 2},
    {"kind": "set_offset", "junction": "10001", "offset": 5.0},
    {"kind": "remove_actors", "actors": ["car-1"]},
)
"""Each is taken, and so are any of them together."""

HANDED_TARGETS: dict[str, tuple[Target, float]] = {
    "edits of files": (edits_of_files, 2.5),
    "feed": (feeds, 1.0),
    "openscenario": (openscenario, 1.2),
    "study plan": (study_plans, 2.0),
    "sweep plan": (sweep_plans, 2.0),
}
"""As :data:`bench.fuzz.file_targets.FILE_TARGETS`."""
