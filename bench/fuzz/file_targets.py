"""Trials with damaged files, each through the commands that read them."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable
from pathlib import Path

from bench.fuzz.damage import CSV, JSON, TOML, damaged, pick
from bench.fuzz.map_damage import MAP, XML
from bench.fuzz.material import CROSSING, Material
from bench.fuzz.results import wrong_in_document, wrong_in_imported_table, wrong_in_map
from bench.fuzz.trials import Target, Trial


def maps(trial: Trial) -> str:
    source = pick(trial.rng, trial.material.map_files)
    damage = damaged(source.read_bytes(), trial.rng, MAP)
    file = trial.folder / "damaged.xodr"
    file.write_bytes(damage.data)
    used = trial.used()
    other = ["--converter", "netconvert"] if trial.rng.random() < 0.08 else []
    ended = trial.command("maps", "add", str(file), *other, *used)
    if ended.code == 0:
        folder = Path(used[1]) / "maps" / "damaged"
        trial.ask("built map", lambda: wrong_in_map(folder))
        said = trial.command("maps", "verify", "damaged", *used)
        if said.code == 1 and "maps verify" not in ended.err + ended.out:
            trial.wrong("maps verify fails, and maps add has not said so")
    if ended.code == 0 and trial.rng.random() < 0.3:
        _use_map(trial, used)
    return f"{source.stem}: {damage.kind}"


def _use_map(trial: Trial, used: list[str]) -> None:
    """All that one does with a map."""
    made = trial.folder / "made"
    trial.command("maps", "show", "damaged", "--json", *used)
    ended = trial.command(
        "generate",
        "--map",
        "damaged",
        "--seed",
        str(trial.seed % 1000),
        "--fill",
        "0.3",
        "--out",
        str(made),
        *used,
    )
    for scenario in made.glob("*.scenario.json") if ended.code == 0 else ():
        if trial.command("check", str(scenario), *used).code == 1:
            trial.wrong("a scenario that was sampled has errors")
        trial.run(scenario, used)


def map_files(trial: Trial) -> str:
    """What is no file, or none that can be read."""
    kind = pick(trial.rng, sorted(_ODD_FILES))
    file = trial.folder / "odd.xodr"
    file = _ODD_FILES[kind](file) or file
    command = pick(trial.rng, ("add", "add", "add", "check", "network", "tables"))
    if command == "add":
        trial.command("maps", "add", str(file), *trial.used())
    elif command == "check":
        trial.command("check", str(file), *trial.used("maps"))
    elif command == "network":
        trial.command("maps", "network", CROSSING, "--from", str(file), *trial.used("maps"))
    else:
        scenario = Path(shutil.copy(trial.material.scenario, trial.folder))
        trial.command("demand", "import", str(scenario), "--od", str(file), *trial.used("maps"))
    return f"{command}: {kind}"


def _socket(file: Path) -> None:
    here = Path.cwd()
    os.chdir(file.parent)  # the name of a socket is short
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(file.name)
    finally:
        os.chdir(here)


def _sparse(file: Path) -> None:
    with file.open("wb") as made:
        made.truncate(5_000_000_000)


def _undecodable(file: Path) -> Path:
    name = os.fsencode(file.parent) + b"/\xff\xfe\x1b[31m.xodr"
    with open(name, "wb") as made:  # noqa: PTH123 (a name that is no text)
        made.write(b"<OpenDRIVE/>")
    return Path(os.fsdecode(name))


def _named(file: Path, name: str) -> Path:
    made = file.with_name(name)
    made.write_bytes(b"<OpenDRIVE/>")
    return made


_ODD_FILES: dict[str, Callable[[Path], Path | None]] = {
    "pipe": os.mkfifo,
    "zeros without end": lambda _: Path("/dev/zero"),
    "random without end": lambda _: Path("/dev/urandom"),
    "nothing": lambda _: Path("/dev/null"),
    "terminal": lambda _: Path("/dev/tty"),
    "socket": _socket,
    "sparse": _sparse,
    "folder": lambda file: file.mkdir(),
    "link to itself": lambda file: file.symlink_to(file),
    "link to nothing": lambda file: file.symlink_to("nowhere"),
    "no file": lambda _: None,
    "no text": _undecodable,
    "long name": lambda file: file.with_name("x" * 300 + ".xodr"),
    "turned name": lambda file: _named(file, "\u202egnp.xodr"),
    "name with lines": lambda file: _named(file, "a\nb.xodr"),
    "name of dots": lambda file: _named(file, "...xodr"),
    "memory": lambda _: Path("/proc/self/mem"),
}


def scenarios(trial: Trial) -> str:
    material = trial.material
    source = material.scenario if trial.rng.random() < 0.6 else material.file("done.scenario.json")
    damage = damaged(source.read_bytes(), trial.rng, JSON)
    file = trial.folder / "damaged.scenario.json"
    file.write_bytes(damage.data)
    used = trial.used("maps")
    ended = trial.command("check", str(file), *used)
    if ended.code == 0:
        trial.ask("what was read", lambda: wrong_in_document(file))
    if ended.code == 0 and trial.rng.random() < 0.3:
        trial.run(file, used)
    elif trial.rng.random() < 0.3:
        out = str(trial.folder / "exported")
        trial.command(
            "export",
            str(file),
            "--to",
            pick(trial.rng, ("sumo", "graphml")),
            "--out",
            out,
            *used,
            writes=[trial.folder / "exported"],
        )
    elif trial.rng.random() < 0.3:
        trial.command(
            "signals",
            "webster",
            "--no-trial",
            str(file),
            "--out",
            str(trial.folder / "x.json"),
            *used,
        )
    return damage.kind


def graph_forms(trial: Trial) -> str:
    damage = damaged(_graphml(trial.material).read_bytes(), trial.rng, XML)
    file = trial.folder / "damaged.graphml"
    file.write_bytes(damage.data)
    if trial.command("check", str(file), *trial.used("maps")).code == 0:
        trial.ask("what was read", lambda: wrong_in_document(file))
    return damage.kind


def _graphml(material: Material) -> Path:
    return next(material.root.glob("*.graphml"))


def tables(trial: Trial) -> str:
    option = pick(trial.rng, ("od", "counts", "profile", "zones"))
    material = trial.material
    damage = damaged(material.file(f"{option}.csv").read_bytes(), trial.rng, CSV)
    file = trial.folder / f"{option}.csv"
    file.write_bytes(damage.data)
    scenario = trial.folder / "document" / "x.scenario.json"
    scenario.parent.mkdir()
    shutil.copy(material.file("done.scenario.json"), scenario)
    zones = ["--zones", str(material.file("zones.csv"))] if option != "zones" else []
    used = trial.used("maps")
    ended = trial.command(
        "demand",
        "import",
        str(scenario),
        f"--{option}",
        str(file),
        *zones,
        *used,
        writes=[scenario.parent],
    )
    if ended.code == 0:
        trial.ask("imported", lambda: wrong_in_imported_table(option, file, scenario))
        trial.command("check", str(scenario), *used)
        if trial.rng.random() < 0.15:
            trial.run(scenario, used)
    return f"{option}: {damage.kind}"


def lights(trial: Trial) -> str:
    damage = damaged(trial.material.file("tll.add.xml").read_bytes(), trial.rng, XML)
    file = trial.folder / "lights.add.xml"
    file.write_bytes(damage.data)
    scenario = trial.folder / "x.scenario.json"
    shutil.copy(trial.material.file("done.scenario.json"), scenario)
    used = trial.used("maps")
    ended = trial.command("signals", "import", str(scenario), str(file), *used)
    if ended.code == 0:
        trial.command("signals", "show", str(scenario), *used)
        if trial.rng.random() < 0.3:
            trial.run(scenario, used)
    return damage.kind


def networks(trial: Trial) -> str:
    damage = damaged(trial.material.file("net.net.xml").read_bytes(), trial.rng, XML)
    file = trial.folder / "changed.net.xml"
    file.write_bytes(damage.data)
    used = trial.used("maps")
    ended = trial.command("maps", "network", CROSSING, "--from", str(file), *used)
    if ended.code == 0:
        scenario = trial.material.file("done.scenario.json")
        trial.command("check", str(scenario), *used)
        if trial.rng.random() < 0.5:
            trial.run(scenario, used)
    return damage.kind


def configs(trial: Trial) -> str:
    damage = damaged(trial.material.file("config.toml").read_bytes(), trial.rng, TOML)
    file = trial.folder / "config.toml"
    file.write_bytes(damage.data)
    used, made = trial.used("maps"), trial.folder / "made"
    ended = trial.command(
        "generate", "--config", str(file), "--count", "2", "--out", str(made), *used, writes=[made]
    )
    for scenario in sorted(made.glob("*"))[:1] if ended.code == 0 else ():
        trial.command("check", str(scenario), *used)
        if trial.rng.random() < 0.3:
            trial.run(scenario, used)
    return damage.kind


FILE_TARGETS: dict[str, tuple[Target, float]] = {
    "config": (configs, 1.0),
    "graph form": (graph_forms, 0.6),
    "lights": (lights, 0.8),
    "map": (maps, 2.0),
    "network": (networks, 0.4),
    "odd file": (map_files, 0.2),
    "scenario": (scenarios, 2.5),
    "tables": (tables, 1.5),
}
"""Trials by name, each with its share of the time."""
