"""Trials with damaged files, each through the commands that read them."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bench.fuzz.damage import CSV, JSON, NUMBERS, TEXT, WORDS, Generator, changes_for, damaged, pick
from bench.fuzz.limits import Ended, Limits
from bench.fuzz.map_damage import MAP, XML
from bench.fuzz.material import CROSSING, Material
from bench.fuzz.verdicts import Finding, Verdict, judge, left_over, listing, worst

WHOLE = 20
"""One of so many trials starts the real command line."""
UNTIL = "8"
SUMO_LIMIT = "10"


@dataclass(slots=True)
class Trial:
    """One trial: its folder, its chance, and what became of its commands."""

    material: Material
    limits: Limits
    folder: Path
    seed: int
    rng: Generator
    findings: list[Finding] = field(default_factory=list)
    peak: int = 0

    def command(
        self,
        *argv: str,
        writes: Sequence[Path] = (),
        user: int | None = None,
        seconds: float | None = None,
    ) -> Ended:
        """Run a command and judge it.

        A refused command may change nothing in the workspace and in ``writes``, but a run that
        failed leaves its folder; none may leave anything temporary.
        """
        roots = [self.folder / "workspace", self.folder / "tmp", self.folder / "cwd", *writes]
        before = listing(roots)
        ended = self.limits.run(
            argv, self.folder, whole=self.seed % WHOLE == 0, user=user, seconds=seconds
        )
        self.peak = max(self.peak, ended.peak)
        finding = judge(ended)
        if not finding.verdict.failed:
            left = left_over(before, listing(roots), refused=ended.code == 2)
            if left:
                finding = Finding(Verdict.LEFTOVER, f"{finding.words} ({left})")
        self.findings.append(finding)
        return ended

    @property
    def finding(self) -> Finding:
        return worst(self.findings)

    def used(self, *parts: str) -> list[str]:
        """``--workspace`` with a copy of parts of the one that was prepared."""
        return ["--workspace", str(self.material.copy_workspace(self.folder, *parts))]


Target = Callable[[Trial], str]
"""Makes one trial; gives the kind of damage."""


def maps(trial: Trial) -> str:
    source = pick(trial.rng, trial.material.map_files)
    damage = damaged(source.read_bytes(), trial.rng, MAP)
    file = trial.folder / "damaged.xodr"
    file.write_bytes(damage.data)
    used = trial.used()
    other = ["--converter", "netconvert"] if trial.rng.random() < 0.08 else []
    ended = trial.command("maps", "add", str(file), *other, *used)
    if ended.code == 0 and trial.rng.random() < 0.4:
        _use_map(trial, used)
    return f"{source.stem}: {damage.kind}"


def _use_map(trial: Trial, used: list[str]) -> None:
    """All that one does with a map."""
    made = trial.folder / "made"
    trial.command("maps", "verify", "damaged", *used)
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
        trial.command("check", str(scenario), *used)
        _run(trial, scenario, used)


def _run(trial: Trial, scenario: Path, used: list[str]) -> None:
    trial.command(
        "run",
        str(scenario),
        "--until",
        UNTIL,
        "--time-limit",
        SUMO_LIMIT,
        "--out",
        str(trial.folder / "workspace" / "runs"),
        *used,
    )


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
    if ended.code == 0 and trial.rng.random() < 0.5:
        _run(trial, file, used)
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
        trial.command("signals", "webster", str(file), "--out", str(trial.folder / "x.json"), *used)
    return damage.kind


def graph_forms(trial: Trial) -> str:
    damage = damaged(_graphml(trial.material).read_bytes(), trial.rng, XML)
    file = trial.folder / "damaged.graphml"
    file.write_bytes(damage.data)
    trial.command("check", str(file), *trial.used("maps"))
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
        trial.command("check", str(scenario), *used)
        if trial.rng.random() < 0.3:
            _run(trial, scenario, used)
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
            _run(trial, scenario, used)
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
            _run(trial, scenario, used)
    return damage.kind


def configs(trial: Trial) -> str:
    damage = damaged(trial.material.file("config.toml").read_bytes(), trial.rng, _TOML)
    file = trial.folder / "config.toml"
    file.write_bytes(damage.data)
    used, made = trial.used("maps"), trial.folder / "made"
    ended = trial.command(
        "generate", "--config", str(file), "--count", "2", "--out", str(made), *used, writes=[made]
    )
    for scenario in sorted(made.glob("*"))[:1] if ended.code == 0 else ():
        trial.command("check", str(scenario), *used)
        if trial.rng.random() < 0.3:
            _run(trial, scenario, used)
    return damage.kind


def _toml_value(data: bytes, rng: Generator) -> bytes:
    lines = data.decode("utf-8", errors="replace").split("\n")
    places = [n for n, line in enumerate(lines) if " = " in line]
    if not places:
        return data
    n = pick(rng, places)
    key = lines[n].split(" = ")[0]
    value = pick(
        rng,
        (
            *NUMBERS,
            "[]",
            "{}",
            "true",
            '""',
            *(repr(word) for word in WORDS),
            '{ kind = "uniform", low = 3, high = 1e308 }',
            '{ kind = "normal", mean = 1e18, std = 0, low = 1e18, high = 1e18 }',
            '{ kind = "choice", values = [] }',
            '{ kind = "choice", values = [1], weights = [0] }',
        ),
    )
    lines[n] = f"{key} = {value}"
    return "\n".join(lines).encode("utf-8", errors="surrogatepass")


_TOML = {**TEXT, **{f"entry {n}": _toml_value for n in range(8)}}


def suites(trial: Trial) -> str:
    folder = trial.folder / "suite"
    shutil.copytree(trial.material.file("suite"), folder)
    file = pick(trial.rng, sorted(folder.rglob("*.toml")) + sorted(folder.rglob("*.json")))
    changes = _TOML if file.suffix == ".toml" else JSON
    damage = damaged(file.read_bytes(), trial.rng, changes)
    file.write_bytes(damage.data)
    trial.command("test", str(folder / "suite.toml"), *trial.used("maps"), writes=[folder])
    return f"{file.name}: {damage.kind}"


def assets(trial: Trial) -> str:
    from importlib.resources import files

    shipped = files("odscen.workspace") / "data" / "blueprints.json"
    damage = damaged(shipped.read_bytes(), trial.rng, JSON)
    used = trial.used("maps")
    file = Path(used[1]) / "assets" / "blueprints.json"
    file.parent.mkdir()
    file.write_bytes(damage.data)
    ended = trial.command("assets", "list", *used)
    scenario = trial.material.file("done.scenario.json")
    trial.command("check", str(scenario), *used)
    if ended.code == 0 and trial.rng.random() < 0.4:
        _run(trial, scenario, used)
    return damage.kind


def map_folders(trial: Trial) -> str:
    """One file of a built map damaged, or gone."""
    used = trial.used("maps")
    folder = Path(used[1]) / "maps" / CROSSING
    kind = damage_one(folder, trial.rng)
    scenario = trial.material.file("done.scenario.json")
    trial.command("maps", "list", *used)
    trial.command("maps", "show", CROSSING, *used)
    trial.command("check", str(scenario), *used)
    if trial.rng.random() < 0.3:
        _run(trial, scenario, used)
    else:
        trial.command(
            *pick(
                trial.rng,
                (
                    ("maps", "verify", CROSSING),
                    ("maps", "render", CROSSING, "--out", str(trial.folder / "x.svg"), "--graph"),
                    ("generate", "--map", CROSSING, "--out", str(trial.folder / "made")),
                    ("signals", "show", str(scenario)),
                    ("maps", "remove", CROSSING),
                    ("doctor",),
                ),
            ),
            *used,
        )
    source = trial.material.map_files[0]
    ended = trial.command("maps", "add", str(source), *used)
    if ended.code and not trial.finding.verdict.failed:
        words = f"a damaged map cannot be added again: {ended.err[-200:]}"
        trial.findings.append(Finding(Verdict.WRONG, words))
    return kind


def damage_one(folder: Path, rng: Generator, *, keep: Sequence[str] = ()) -> str:
    """Damage one file of a folder, or remove it."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in keep]
    file = pick(rng, files)
    name = str(file.relative_to(folder))
    if rng.random() < 0.1:
        file.unlink()
        return f"{name}: gone"
    damage = damaged(file.read_bytes(), rng, changes_for(file.name))
    file.write_bytes(damage.data)
    return f"{name}: {damage.kind}"


def run_folders(trial: Trial) -> str:
    used = trial.used("maps", "runs/done")
    run = Path(used[1]) / "runs" / "done"
    kind = damage_one(run, trial.rng)
    good = str(trial.material.workspace / "runs" / "done")
    page = str(trial.folder / "page.html")
    trial.command("report", str(run), *used)
    trial.command("compare", good, str(run), "--html", page, *used)
    if trial.rng.random() < 0.3:
        trial.command("demand", "fit", str(run), *used)
    return kind


def interrupted(trial: Trial) -> str:
    """A run in slices that was killed, and damaged before it is resumed."""
    used = trial.used("maps", "runs/sliced")
    run = Path(used[1]) / "runs" / "sliced"
    plan = run / "run.json"
    kind = damage_one(run, trial.rng, keep=() if plan.exists() else ("run.json",))
    ended = trial.command("resume", str(run), "--time-limit", "3", *used)
    if ended.code == 0 and not trial.finding.verdict.failed:
        trial.findings.append(Finding(Verdict.WRONG, f"resumed to its end after {kind}"))
    return kind


def options(trial: Trial) -> str:
    """Odd values of options."""
    used, material, rng = trial.used("maps", "runs/done"), trial.material, trial.rng
    scenario, out = str(material.file("done.scenario.json")), str(trial.folder / "out")
    limit = ["--time-limit", "5"]
    choices: dict[str, list[str]] = {
        "until": ["run", scenario, *limit, "--out", out, "--until"],
        "slice": ["run", scenario, *limit, "--out", out, "--until", "10", "--slice"],
        "trajectories": ["run", scenario, *limit, "--out", out, "--until", "5", "--trajectories"],
        "expect": ["run", scenario, *limit, "--out", out, "--until", "5", "--expect"],
        "step": ["run", scenario, *limit, "--out", out, "--until", "5", "--step-length"],
        "seed": ["run", scenario, *limit, "--out", out, "--until", "5", "--seed"],
        "name": ["maps", "add", str(material.map_files[0]), "--name"],
        "spacing": ["maps", "add", str(material.map_files[0]), "--spacing"],
        "map": ["generate", "--out", out, "--map"],
        "segments": ["generate", "--map", CROSSING, "--out", out, "--roi-segments"],
        "corridor": ["report", "done", "--out", out + ".html", "--corridor"],
        "from": ["report", "done", "--out", out + ".html", "--to", "r1", "--from"],
        "mix": ["demand", "add", scenario, "--out", out + ".json", "--per-km", "1", "--mix"],
        "per-km": ["demand", "add", scenario, "--out", out + ".json", "--per-km"],
        "trips": ["demand", "weekday", "--map", CROSSING, "--out", out + ".json", "--trips"],
        "junction": [
            "signals",
            "import",
            scenario,
            str(material.file("tll.add.xml")),
            "--out",
            out + ".json",
            "--junction",
        ],
        "saturation": ["signals", "webster", scenario, "--out", out + ".json", "--saturation"],
        "cycle": [
            "signals",
            "coordinate",
            scenario,
            "--along",
            "r1,r2",
            "--out",
            out + ".json",
            "--cycle",
        ],
        "along": ["signals", "coordinate", scenario, "--out", out + ".json", "--along"],
        "render": ["maps", "render", CROSSING, "--out"],
        "run": ["report", "--out", out + ".html"],
        "scenario": ["check"],
    }
    what = pick(rng, sorted(choices))
    value = pick(
        rng,
        (
            *NUMBERS,
            *WORDS,
            "arrived>=",
            "mean_delay<=1e400",
            "every=0",
            "every=1e-9",
            "region=1:2:3:nan",
            "columns=+",
            "1h",
            "-1h",
            "1e-300h",
            "car=nan",
            "car=1,",
            "r1,r1",
            "r1,j10001,r2",
            "/proc/x/y.svg",
        ),
    )
    value = value.replace("\x00", "").encode("utf-8", errors="replace").decode()
    # A value that starts with a dash would be an option of its own.
    last = choices[what][-1]
    call = (
        [*choices[what][:-1], f"{last}={value}"]
        if last.startswith("--")
        else [*choices[what], "--", value]
    )
    at = call.index("--") if "--" in call else len(call)
    trial.command(*call[:at], *used, *call[at:])
    return f"{what}: {value[:30]!r}"


FILE_TARGETS: dict[str, tuple[Target, float]] = {
    "assets": (assets, 0.4),
    "config": (configs, 0.8),
    "graph form": (graph_forms, 0.5),
    "interrupted run": (interrupted, 1.0),
    "lights": (lights, 0.7),
    "map": (maps, 3.0),
    "map folder": (map_folders, 1.0),
    "network": (networks, 0.8),
    "odd file": (map_files, 0.3),
    "options": (options, 0.7),
    "run folder": (run_folders, 1.2),
    "scenario": (scenarios, 1.2),
    "suite": (suites, 0.6),
    "tables": (tables, 0.7),
}
"""Trials by name, each with its share of the time."""


def trial_rng(target: str, seed: int) -> Generator:
    """The chance of one trial: the same for the same target and seed, on any machine."""
    return np.random.default_rng([seed, *target.encode()])
