"""Trials with what was received from others of late: recordings, pictures, histories, weights."""

from __future__ import annotations

import io
import json
import math
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from bench.fuzz.archive_damage import ARCHIVE
from bench.fuzz.damage import (
    CSV,
    JSON,
    NUMBERS,
    RAW,
    TEXT,
    WORDS,
    Change,
    Generator,
    damaged,
    flipped,
    pick,
)
from bench.fuzz.map_damage import XML
from bench.fuzz.material import CROSSING
from bench.fuzz.trials import Target, Trial

_BENCH = os.getpid()


def recordings(trial: Trial) -> str:
    """A file of a recording of some schema damaged or gone; what is taken has scenes and a fit."""
    rng = trial.rng
    source = pick(rng, sorted(trial.material.file("recordings").iterdir()))
    folder = trial.folder / "recording"
    shutil.copytree(source, folder)
    main = next(file for file in sorted(folder.iterdir()) if is_main(file))
    file = main if rng.random() < 0.7 else pick(rng, sorted(folder.iterdir()))
    kind = "gone"
    if file == main or rng.random() < 0.8:
        damage = damaged(file.read_bytes(), rng, changes_of_recording(file.name))
        file.write_bytes(damage.data)
        kind = damage.kind
    else:
        file.unlink()
    used = trial.used("maps")
    on_map = ["--map", CROSSING] if rng.random() < 0.6 else []
    some = ["--window", pick(rng, _WINDOWS)] if rng.random() < 0.2 else []
    some += ["--offset", pick(rng, _OFFSETS)] if rng.random() < 0.2 else []
    more = ["--estimate-offset"] if on_map and rng.random() < 0.2 else []
    shown = trial.command(
        *("recording", "show", str(main), "--scenes", "--json"), *on_map, *some, *more, *used
    )
    if shown.code == 0:
        trial.counts["recordings read"] += 1
        trial.ask("shown recording", lambda: wrong_in_recording(shown.out))
    if rng.random() < 0.15:
        out = trial.folder / "drivers.json"
        trial.command("recording", "fit", str(main), "-o", str(out), *on_map, *used)
    if rng.random() < 0.4:
        out = trial.folder / "made" / "scene.scenario.json"
        out.parent.mkdir()
        given = ["--out", str(out), "--map", CROSSING, *some]
        ended = trial.command("import", str(main), *given, *used, writes=[out.parent])
        if ended.code == 0 and out.exists():
            trial.command("check", str(out), *used)
            if rng.random() < 0.2:
                trial.run(out, used)
    return f"{source.name}: {file.name}: {kind}"


_WINDOWS = ("0..5", "10..12", "11..", "..12", "-1..1", "1e308..", "0..1e-9", "99:59:59..", "x..y")
_OFFSETS = ("0,0", "10,-2.5,180", "1e308,0", "nan,0", "1e18,1e18,1e18", "1,2,3,4", "-0.0,-0.0")


def is_main(file: Path) -> bool:
    """Whether it is the file of a recording that is named to odscen."""
    return not file.name.startswith("Ped") and "Meta" not in file.name and "Lights" not in file.name


def changes_of_recording(name: str) -> dict[str, Change]:
    """What can happen to a file of a recording."""
    if name.endswith(".parquet"):
        return {**RAW, **{f"column {n}": _parquet_column for n in range(8)}}
    if name.endswith((".osi", ".mcap", ".pkl")):
        return {**RAW, **{f"doubles {n}": _double for n in range(4)}}
    return XML if name.endswith(".xml") else CSV


def _double(data: bytes, rng: Generator) -> bytes:
    """Eight bytes that are an odd double."""
    import struct

    at = int(rng.integers(max(len(data) - 8, 1)))
    value = pick(rng, (math.nan, math.inf, 1e308, -1e308, 1e18, 0.0, 5e-324))
    return data[:at] + struct.pack("<d", value) + data[at + 8 :]


def _parquet_column(data: bytes, rng: Generator) -> bytes:
    """A column of another type, an odd value in it, nothing in it, or the column gone.

    Made in a fork of the bench itself: commands are such forks, too, and the threads that polars
    starts where it is used first are in none of them, so that they would wait for them without end.
    """
    if os.getpid() != _BENCH:
        return _damage_parquet_column(data, rng)
    ours, theirs = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(ours)
        try:
            with os.fdopen(theirs, "wb") as pipe:
                pipe.write(_damage_parquet_column(data, rng))
        finally:
            os._exit(0)
    os.close(theirs)
    with os.fdopen(ours, "rb") as pipe:
        made = pipe.read()
    os.waitpid(pid, 0)
    return made


def _damage_parquet_column(data: bytes, rng: Generator) -> bytes:
    import polars as pl

    try:
        rows = pl.read_parquet(io.BytesIO(data))
    except (pl.exceptions.PolarsError, OSError):
        return flipped(data, rng)
    if not rows.width:
        return data
    name = pick(rng, rows.columns)
    what = pick(rng, ("value", "value", "value", "type", "null", "drop", "list", "double"))
    column = rows[name]
    if what == "drop":
        rows = rows.drop(name)
    elif what == "null":
        rows = rows.with_columns(pl.lit(None).alias(name))
    elif what == "list":
        rows = rows.with_columns(column.implode().alias(name).new_from_index(0, rows.height))
    elif what == "double":
        rows = pl.concat([rows, rows.sample(fraction=0.5, seed=1)])
    elif what == "type":
        kind = pick(rng, (pl.String, pl.Boolean, pl.Binary, pl.Decimal, pl.Date, pl.Int8))
        with suppress(pl.exceptions.PolarsError):  # there is no such cast
            rows = rows.with_columns(column.cast(kind, strict=False))
    elif column.dtype.is_numeric():
        values = column.cast(pl.Float64).to_list()
        odd = pick(rng, (math.nan, math.inf, -math.inf, 1e308, -1e308, 1e18, -1.0, 0.0, None))
        values[int(rng.integers(len(values)))] = odd
        rows = rows.with_columns(pl.Series(name, values, dtype=pl.Float64))
    else:
        rows = rows.with_columns(pl.lit(pick(rng, WORDS[:-1])).alias(name))
    made = io.BytesIO()
    rows.write_parquet(made)
    return made.getvalue()


def wrong_in_recording(said: str) -> str:
    """What is wrong with a description of a recording: numbers that are none, times in no order."""
    told = json.loads(said, parse_constant=lambda name: f"no number: {name}")
    numbers = [value for value in _values_of(told) if str(value).startswith("no number: ")]
    if numbers:
        return f"it says {numbers[0]}"
    for scene in told["scenes"]:
        if not told["begin"] - 1e-6 <= scene["begin"] <= scene["end"] <= told["end"] + 1e-6:
            return f"a scene is at no time of the recording: {scene}"
    return ""


def _values_of(data: Any) -> list[Any]:
    if isinstance(data, dict):
        return [value for part in data.values() for value in _values_of(part)]
    if isinstance(data, list):
        return [value for part in data for value in _values_of(part)]
    return [data]


def pictures(trial: Trial) -> str:
    """A picture or its world file damaged; what is taken is drawn under its map."""
    rng = trial.rng
    folder = trial.folder / "picture"
    shutil.copytree(trial.material.file("pictures"), folder)
    picture = pick(rng, sorted(file for file in folder.iterdir() if file.suffix != ".wld"))
    world = picture.with_suffix(".wld")
    call, kind = ["maps", "background", CROSSING, str(picture)], "as it is"
    if rng.random() < 0.7:
        damage = damaged(picture.read_bytes(), rng, {**RAW, "number": _header_number})
        picture.write_bytes(damage.data)
        kind = damage.kind
    what = pick(rng, ("beside", "beside", "points", "none", "crs"))
    if what == "points":
        world.unlink(missing_ok=True)
        for _ in range(int(pick(rng, (1, 2, 2, 2, 3)))):
            column, row, x, y = (pick(rng, (*NUMBERS, *"0123456789" * 4)) for _ in range(4))
            call.append(f"--point={column},{row}={x},{y}")
    elif what == "none":
        world.unlink(missing_ok=True)
    else:
        damage = damaged(world.read_bytes(), rng, TEXT)
        world.write_bytes(damage.data)
        kind += f", world {damage.kind}"
    if what == "crs" or rng.random() < 0.1:
        said = pick(rng, (*_SYSTEMS, *WORDS)).replace("\x00", "")
        call += [f"--crs={said.encode('utf-8', 'replace').decode()}"]
    used = trial.used("maps")
    ended = trial.command(*call, "--json", *used)
    if ended.code == 0:
        trial.counts["pictures taken"] += 1
        trial.ask("picture", lambda: wrong_in_picture(ended.out))
        out = trial.folder / f"map.{pick(rng, ('svg', 'svg', 'png'))}"
        trial.command("maps", "render", CROSSING, "-o", str(out), "--picture", *used)
        if rng.random() < 0.3:
            trial.command("maps", "background", CROSSING, "--remove", *used)
    return f"{picture.name}: {what}: {kind}"


_SYSTEMS = (
    *("EPSG:25832", "EPSG:4326", "EPSG:3857", "EPSG:4978", "EPSG:0", "EPSG:999999", "epsg:25832"),
    *(
        "+proj=longlat +nadgrids=/etc/passwd",
        "/etc/passwd",
        "http://127.0.0.1:1/",
        "{}",
        "x" * 9999,
    ),
    *("+proj=utm +zone=32", "+proj=tmerc +lat_0=0 +k=nan", "+proj=pipeline +step +inv +proj=utm"),
    *("(" * 5000, "urn:ogc:def:crs:EPSG::25832", "WGS 84", "EPSG:25832+5783", "+init=epsg:4326"),
)


def _header_number(data: bytes, rng: Generator) -> bytes:
    """Four bytes near the beginning that are an odd number: a size, a place, a count."""
    at = int(rng.integers(min(len(data), 200) + 1))
    number = int(pick(rng, (0, 1, 2**16, 16_384, 10_000, 2**31, 2**32 - 1)))
    return data[:at] + number.to_bytes(4, pick(rng, ("big", "little"))) + data[at + 4 :]


def wrong_in_picture(said: str) -> str:
    """What is wrong with the place of a picture that was taken."""
    told = json.loads(said)["background"]
    low_x, low_y, high_x, high_y = told["bounds"]
    if not all(math.isfinite(value) for value in (*told["bounds"], *told["affine"])):
        return f"its place is no place: {told['affine']}"
    if not (low_x < high_x and low_y < high_y):
        return f"it has no area: {told['bounds']}"
    if max(high_x - low_x, high_y - low_y) > 1e9:
        return f"it is larger than the earth: {told['bounds']}"
    return ""


def histories(trial: Trial) -> str:
    """A history of a suite damaged; what is read makes a page."""
    rng = trial.rng
    lines = trial.material.file("history.jsonl").read_bytes().splitlines(keepends=True)
    at = int(rng.integers(len(lines)))
    whole = rng.random() < 0.3
    changes = TEXT if whole else JSON
    damage = damaged(b"".join(lines) if whole else lines[at], rng, changes)
    file = trial.folder / "history.jsonl"
    if whole:
        file.write_bytes(damage.data)
    else:
        lines[at] = damage.data.replace(b"\n", b" ") + b"\n"
        file.write_bytes(b"".join(lines))
    page = trial.folder / "page.html"
    ended = trial.command("history", str(file), "--html", str(page), *_or_json(rng))
    if ended.code == 0:
        trial.counts["histories read"] += 1
        trial.ask("page", lambda: "" if _is_page(page) else "no page, or one with no numbers in it")
    return damage.kind


def _or_json(rng: Generator) -> list[str]:
    return ["--json"] if rng.random() < 0.5 else []


def _is_page(file: Path) -> bool:
    text = file.read_text(encoding="utf-8")
    return (
        "</html>" in text
        and ">nan<" not in text
        and '="nan' not in text
        and "inf" not in text[text.find("<svg") : text.find("</svg>")]
    )


def weights(trial: Trial) -> str:
    """Weights of a light's agent, of a driver or of a model of traffic damaged."""
    rng = trial.rng
    source = pick(rng, sorted(trial.material.file("weights").iterdir()))
    damage = damaged(source.read_bytes(), rng, ARCHIVE)
    file = trial.folder / source.name
    file.write_bytes(damage.data)
    trial.ask(source.stem, lambda: _use_weights(source.stem, file))
    if source.stem in _DRIVEN and rng.random() < 0.15:
        trial.run(
            trial.material.file("done.scenario.json"),
            trial.used("maps"),
            *("--behaviour", _DRIVEN[source.stem][0]),
            *("--behaviour-set", f"{_DRIVEN[source.stem][1]}={file}"),
        )
    return f"{source.stem}: {damage.kind}"


_DRIVEN = {"lights": ("signal-agent", "agent"), "driver": ("imitation", "weights")}


def _use_weights(kind: str, file: Path) -> str:
    """Read weights and compute with them, or be refused; in words what is wrong with what comes."""
    import numpy as np

    from odscen.base.errors import OdscenError
    from odscen.learning.behaviour.imitation_driver import FEATURES as SEEN
    from odscen.learning.behaviour.imitation_driver import network_from_bytes
    from odscen.learning.behaviour.signal_agent import FEATURES, SignalAgent
    from odscen.learning.reference.traffic_model import model_from_bytes

    data = file.read_bytes()
    use: dict[str, Callable[[], Any]] = {
        "lights": lambda: SignalAgent.from_bytes(data, file="w").policy(
            np.ones((3, len(FEATURES)))
        ),
        "driver": lambda: network_from_bytes(data, file="w")(np.ones((3, len(SEEN)))),
        "traffic": lambda: model_from_bytes(data, file="w").occupied.weights[0],
    }
    try:
        found = np.asarray(use[kind](), dtype=np.float64)
    except OdscenError:
        return ""
    return "" if np.isfinite(found).all() else "weights that give no numbers are taken"


RECEIVED_TARGETS: dict[str, tuple[Target, float]] = {
    "history": (histories, 0.7),
    "picture": (pictures, 1.2),
    "recording": (recordings, 2.5),
    "weights": (weights, 0.7),
}
"""As :data:`bench.fuzz.file_targets.FILE_TARGETS`."""
