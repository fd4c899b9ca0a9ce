"""Trials with folders of ours in which one file is damaged, and with odd options."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from bench.fuzz.damage import JSON, NUMBERS, TOML, WORDS, Generator, changes_for, damaged, pick
from bench.fuzz.material import CROSSING
from bench.fuzz.trials import Target, Trial
from bench.fuzz.verdicts import Finding, Verdict


def suites(trial: Trial) -> str:
    folder = trial.folder / "suite"
    shutil.copytree(trial.material.file("suite"), folder)
    file = pick(trial.rng, sorted(folder.rglob("*.toml")) + sorted(folder.rglob("*.json")))
    changes = TOML if file.suffix == ".toml" else JSON
    damage = damaged(file.read_bytes(), trial.rng, changes)
    file.write_bytes(damage.data)
    trial.command("test", str(folder / "suite.toml"), *trial.used("maps"), writes=[folder])
    return f"{file.name}: {damage.kind}"


def assets(trial: Trial) -> str:
    from importlib.resources import files

    shipped = files("odscen.maps") / "data" / "blueprints.json"
    damage = damaged(shipped.read_bytes(), trial.rng, JSON)
    used = trial.used("maps")
    file = Path(used[1]) / "assets" / "blueprints.json"
    file.parent.mkdir()
    file.write_bytes(damage.data)
    ended = trial.command("assets", "list", *used)
    scenario = trial.material.file("done.scenario.json")
    trial.command("check", str(scenario), *used)
    if ended.code == 0 and trial.rng.random() < 0.4:
        trial.run(scenario, used)
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
        trial.run(scenario, used)
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
    inputs = kind.startswith(("sumo/", "plan.json", "run.json"))  # slices are computed again
    if ended.code == 0 and inputs and not trial.finding.verdict.failed:
        trial.findings.append(Finding(Verdict.WRONG, f"resumed to its end after {kind}"))
    return kind


_NUMERIC = ("cycle", "per-km", "saturation", "seed", "segments", "spacing", "step", "trips")
_TIMES = (
    "1h",
    "-1h",
    "1e-300",
    "1e-300h",
    "0",
    "5",
    "0.01s",
    "9" * 400 + "h",
    "1e18",
    "nan",
    "7:15",
)
_OWN_VALUES: dict[str, tuple[str, ...]] = {
    "until": _TIMES,
    "slice": _TIMES,
    "expect": (
        "arrived>=",
        "arrived>=nan",
        "mean_delay<=1e400",
        "arrived>=-1%",
        "x>=1",
        "arrived==0",
    ),
    "trajectories": (
        "none",
        "every=0",
        "every=1e-9",
        "every=1e18",
        "region=1:2:3:nan",
        "region=9:9:1:1",
        "columns=+",
        "columns=lane",
        "every=2,every=3",
        "region=-1e308:1e308:-1e308:1e308",
    ),
    "mix": ("car=nan", "car=1,", "car=1e308,bus=1e308", "car=0", "car=-1", "car=1e-300", "car"),
    "corridor": ("r1,r1", "r1,j10001,r2", "r1,r2", "j10001", ",", "r1," * 5000),
    "from": ("r1", "r2", "j10001", "r99"),
    "along": ("r1,r2", "1,2", "r1," * 5000, "10001"),
    "render": ("/proc/x/y.svg", "x.svg", "x.png", "x.SVG", ".svg", "/dev/full", "no/folder/x.svg"),
}


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
        "trips": [
            *("demand", "weekday", "--map", CROSSING, "--no-trial"),
            *("--out", out + ".json", "--trips"),
        ],
        "junction": [
            "signals",
            "import",
            scenario,
            str(material.file("tll.add.xml")),
            "--out",
            out + ".json",
            "--junction",
        ],
        "saturation": [
            "signals",
            "webster",
            "--no-trial",
            scenario,
            "--out",
            out + ".json",
            "--saturation",
        ],
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
    own = _OWN_VALUES.get(what, NUMBERS if what in _NUMERIC else WORDS)
    value = pick(rng, own if rng.random() < 0.8 else (*NUMBERS, *WORDS))
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


FOLDER_TARGETS: dict[str, tuple[Target, float]] = {
    "assets": (assets, 0.5),
    "interrupted run": (interrupted, 0.4),
    "map folder": (map_folders, 0.4),
    "options": (options, 0.7),
    "run folder": (run_folders, 1.2),
    "suite": (suites, 0.6),
}
"""As :data:`bench.fuzz.file_targets.FILE_TARGETS`."""
