"""What users get from two checkouts, byte for byte.

``python -m tools.same_outputs write FOLDER`` has the ``odscen`` of this checkout do everything that
leaves files: maps, scenarios, exports, runs, long runs that are interrupted and resumed, suites,
studies, sweeps, a search, a dataset, OpenSCENARIO in and out, and keeps what was said on stdout and
by ``--help``. ``python -m tools.same_outputs compare A B`` lists what differs between two such
folders, after what the clock says and the folders' own paths are set aside.

For changes that are to change nothing. Real maps and OpenSCENARIO files take part where their
folders are named by ``ODSCEN_TEST_MAPS`` and ``ODSCEN_TEST_OSC`` or lie beside the checkout.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import polars as pl

ROOT = Path(__file__).parents[1]
SHARED = ROOT.parent / "shared"
REAL_MAPS = ("Town01", "Town04", "Town07", "fabriksgatan", "multi_intersections", "e6mini")
XOSC_FILES = 20

# What the clock says, and what names the machine's folders.
_CLOCK_KEYS = frozenset(
    {
        "build_seconds", "wall_seconds", "seconds_left", "created", "started", "ended", "written",
        "cpu_seconds", "real_time_factor", "peak_memory_mb", "wall", "memory_mb", "took",
    }
)  # fmt: skip
_CLOCK_TEXT = re.compile(
    rb"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?(Z|[+-]\d\d:?\d\d)?"
    rb"|\b\d+(\.\d+)? ?(s|ms|min) (of wall|wall)|in \d+(\.\d+)? s\b"
)


class _Writer:
    """Runs commands of the checkout in one folder, and keeps what they say."""

    def __init__(self, folder: Path, odscen: str) -> None:
        self.folder = folder
        self.odscen = odscen
        self.said = folder / "said"
        self.said.mkdir(parents=True)

    def run(self, name: str, *words: str | Path, cwd: str = ".", timeout: float = 1800) -> None:
        begun = time.monotonic()
        place = self.folder / cwd
        place.mkdir(parents=True, exist_ok=True)
        done = subprocess.run(
            [self.odscen, *map(str, words)],
            cwd=place,
            capture_output=True,
            timeout=timeout,
            check=False,
            env=os.environ | {"ODSCEN_WORKSPACE": str(self.folder / "workspace"), "COLUMNS": "120"},
        )
        (self.said / f"{name}.stdout").write_bytes(done.stdout)
        (self.said / f"{name}.code").write_text(f"{done.returncode}\n", encoding="utf-8")
        print(f"{time.monotonic() - begun:7.1f} s  {done.returncode}  {name}", flush=True)
        if done.returncode not in {0, 1}:
            print(done.stderr.decode(errors="replace")[-800:], flush=True)

    def interrupt(self, name: str, *words: str | Path, until: Path) -> None:
        """Run a command until a file is there, then end it by SIGINT."""
        env = os.environ | {"ODSCEN_WORKSPACE": str(self.folder / "workspace"), "COLUMNS": "120"}
        process = subprocess.Popen(
            [self.odscen, *map(str, words)],
            cwd=self.folder, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        for _ in range(6000):
            if until.exists() or process.poll() is not None:
                break
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        process.wait(120)
        print(f"interrupted {name}: {process.returncode}", flush=True)

    def keep_help(self) -> None:
        """Keep the help of every command."""
        groups = [[]]
        while groups:
            words = groups.pop()
            name = "-".join(["help", *words])
            self.run(name, *words, "--help")
            text = (self.said / f"{name}.stdout").read_text(encoding="utf-8")
            _, _, listed = text.partition("─ Commands ─")
            for line in listed.splitlines():
                found = re.match(r"│ ([a-z][a-z-]*) +\S", line)
                if found and len(words) < 2:
                    groups.append([*words, found.group(1)])


def write(folder: Path, odscen: str) -> None:
    """Have a checkout write everything into ``folder``, which must not be there yet."""
    folder.mkdir(parents=True)
    writer = _Writer(folder, odscen)
    run = writer.run
    writer.keep_help()

    # Maps: those that ship, and real ones.
    shipped = sorted((ROOT / "maps").glob("*.xodr"))
    maps = Path(os.environ.get("ODSCEN_TEST_MAPS", SHARED / "maps"))
    real = [file for name in REAL_MAPS for file in sorted(maps.glob(f"*/{name}*.xodr"))[:1]]
    run("maps-add", "maps", "add", *shipped, *real)
    for file in [*shipped, *real]:
        run(f"maps-show-{file.stem}", "maps", "show", file.stem, "--json")
        run(f"maps-verify-{file.stem}", "maps", "verify", file.stem, "--json")
    run("maps-render", "maps", "render", "Town01", "-o", "town01.svg")
    run("maps-compare", "maps", "compare", "signal_crossing", "--json")

    # Scenarios: sampled, from templates, and those of the suite; checked and in every form.
    for file in [*shipped, *real[:3]]:
        run(
            f"generate-{file.stem}", "generate", "--map", file.stem, "--count", "2",
            "--seed", "7", "--fill", "0.2", "--out", "scenarios", "--json",
        )  # fmt: skip
    run("new-list", "new", "--json")
    templates = json.loads((writer.said / "new-list.stdout").read_text(encoding="utf-8"))
    for template in templates.get("templates", []):
        name = template["name"]
        for at in ("town_5x5", "signal_crossing"):
            run(
                f"new-{name}-{at}",
                "new",
                "--template",
                name,
                "--map",
                at,
                "--out",
                "placed",
                "--json",
            )
    suite = sorted((ROOT / "suites" / "scenarios").glob("*.json"))
    sampled = sorted((folder / "scenarios").glob("*.json"))
    placed = sorted((folder / "placed").glob("*.json"))
    run("check", "check", *suite, *sampled, *placed, "--json")
    for file in [*suite, *sampled[:4], *placed[:3]]:
        for form in ("graphml", "sumo", "arrays", "openscenario", "pyg"):
            run(f"export-{form}-{file.stem}", "export", file, "--to", form, "-o", f"exports/{form}")

    # OpenSCENARIO of others.
    osc = Path(os.environ.get("ODSCEN_TEST_OSC", SHARED / "osc"))
    files = sorted(osc.rglob("*.xosc"))
    for file in files[:: max(1, len(files) // XOSC_FILES)][:XOSC_FILES]:
        out = Path("imported") / f"{file.stem}.scenario.json"
        run(
            f"import-{file.stem}",
            "import",
            file,
            "--out",
            out,
            "--maps",
            osc / "esmini" / "xodr",
            "--json",
        )
        if (folder / out).exists():
            run(
                f"import-again-{file.stem}",
                "export",
                out,
                "--to",
                "openscenario",
                "-o",
                "imported/again",
            )

    # Runs with records, figures and reports, and their exports.
    run("run-suite", "run", *suite, "--until", "300", "--report", "--out", "runs", "--json")
    run("run-placed", "run", *placed[:8], "--report", "--out", "runs", "--json")
    run(
        "run-close",
        "run",
        suite[4],
        "--until",
        "60",
        "--criticality",
        "--seed",
        "5",
        "--out",
        "close",
        "--json",
    )
    run("run-idm", "run", suite[4], "--until", "60", "--behaviour", "idm", "--out", "idm", "--json")
    runs = sorted(path for path in (folder / "runs").iterdir() if (path / "summary.json").exists())
    for path in runs[:3]:
        for form in ("commonroad", "waymo", "scenarionet", "pyg"):
            run(
                f"export-{form}-{path.name}",
                "export",
                path,
                "--to",
                form,
                "-o",
                f"exports/{form}",
                "--end",
                "20",
            )
        run(
            f"as-run-{path.name}",
            "export",
            path,
            "--to",
            "openscenario",
            "--as-run",
            "-o",
            "exports/as-run",
        )
    run("compare", "compare", runs[0], runs[0], "--json")

    # A long run, whole and interrupted.
    day = ["run", suite[-1], "--until", "1800", "--slice", "300", "--json"]
    run("long-whole", *day, "--out", "long-whole")
    first = next(iter((folder / "long-whole").iterdir()), None)
    if first is not None:
        writer.interrupt(
            "long-cut",
            *day,
            "--out",
            "long-cut",
            until=folder / "long-cut" / first.name / "status.json",
        )
        cut = next(iter((folder / "long-cut").iterdir()), first)
        run("long-resume", "resume", cut, "--json")

    # Many runs.
    run(
        "suite", "test", ROOT / "suites" / "shipped.toml", "--jobs", "2", "--junit", "suite.xml",
        "--html", "suite.html", "--summary", "suite.md", "--results", "results.json", "--json",
    )  # fmt: skip
    (folder / "rain.toml").write_text(
        f'name = "rain"\nscenarios = ["{suite[4]}"]\nseeds = 3\n'
        '[[variant]]\nname = "hard-rain"\n'
        'edits = [{kind = "set_environment", preset = "HardRainNoon"}]\n[run]\nuntil = 120\n',
        encoding="utf-8",
    )
    run("study-rain", "study", "run", "rain.toml", "--jobs", "2", "--json")
    run("study-rain-report", "study", "report", "rain-study", "--figure", "mean_speed", "--json")
    run("study-rain-status", "study", "status", "rain-study", "--json")
    (folder / "sampled.toml").write_text(
        'name = "sampled"\nseeds = [3, 4]\nkeep = "all"\n'
        '[[sample]]\nmaps = ["t_junction_signs", "roundabout"]\ncount = 2\nseed = 5\nfill = 0.2\n'
        "[run]\nuntil = 60\ncriticality = true\n",
        encoding="utf-8",
    )
    run("study-sampled", "study", "run", "sampled.toml", "--jobs", "2", "--json")
    scene = json.loads((folder / "placed/lead-brakes-signal_crossing.scenario.json").read_text())
    scene["parameters"] = {"pace": {"value": 12, "min": 8, "max": 16}}
    scene["actors"][0]["speed"] = "$pace"
    swept = folder / "swept.scenario.json"
    swept.write_text(json.dumps(scene), encoding="utf-8")
    many = ("--jobs", "2", "--safe", "min_ttc >= 1.5", "--json")
    run("sweep-grid", "sweep", swept, "--vary", "pace=8..16:5", "--out", "sweep-grid", *many)
    run(
        "sweep-latin",
        "sweep",
        swept,
        "--samples",
        "6",
        "--method",
        "latin",
        "--out",
        "sweep-latin",
        *many,
    )
    run("search", "search", swept, "--runs", "12", "--out", "search", *many)
    (folder / "dataset.toml").write_text(
        'name = "set"\nlicence = "CC0-1.0"\nformats = ["pyg", "commonroad"]\nusable = false\n'
        '[splits]\ntrain = ["t_*"]\ntest = ["round*"]\n'
        '[[study.sample]]\nmaps = ["t_junction_signs", "roundabout"]\n'
        "count = 2\nseed = 5\nfill = 0.2\n"
        "[study.run]\nuntil = 20\n",
        encoding="utf-8",
    )
    run("dataset", "dataset", "dataset.toml", "--out", "dataset", "--json")


def _plain(value: object) -> object:
    """JSON without what the clock says."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items() if key not in _CLOCK_KEYS}
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return value


def _content(path: Path, root: Path) -> bytes:
    data = path.read_bytes()
    if path.suffix == ".parquet":
        table = pl.read_parquet(io.BytesIO(data))
        return (
            table.drop([name for name in table.columns if name in _CLOCK_KEYS]).write_csv().encode()
        )
    if path.suffix == ".npz":
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            arrays = [
                (name, np.lib.format.read_array(io.BytesIO(archive.read(name))))
                for name in sorted(archive.namelist())
            ]
        return b"".join(name.encode() + str(a.dtype).encode() + a.tobytes() for name, a in arrays)
    data = data.replace(str(root).encode(), b"@").replace(str(ROOT).encode(), b"@")
    if path.suffix in {".json", ".stdout"}:
        with contextlib.suppress(ValueError):
            data = json.dumps(_plain(json.loads(data)), indent=1).encode()
    return _CLOCK_TEXT.sub(b"<time>", data)


_ASIDE = re.compile(r"SHA256SUMS$|\.lock$|__pycache__|/journal|checksums|build\.log$|sums\.json$")


def compare(a: Path, b: Path) -> int:
    """Print what differs; return how many files do."""
    files = [
        {path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file()}
        for root in (a, b)
    ]
    differing = 0
    for name in sorted(files[0] | files[1]):
        if _ASIDE.search(name):
            continue
        if not all(name in each for each in files):
            print(f"only in {a if name in files[0] else b}: {name}")
            differing += 1
            continue
        left, right = _content(a / name, a), _content(b / name, b)
        if left != right:
            differing += 1
            print(f"differs: {name} ({len(left)} and {len(right)} bytes)")
            lines = (
                difflib.unified_diff(
                    left.decode(errors="replace").splitlines(),
                    right.decode(errors="replace").splitlines(),
                    lineterm="",
                    n=0,
                )
                if len(left) < 400_000
                else []
            )
            for line in list(lines)[2:8]:
                print("    " + line[:160])
    print(f"{len(files[0] & files[1])} files in both, {differing} differ")
    return differing


def main() -> int:
    """Write or compare, as the command line says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parts = parser.add_subparsers(dest="do", required=True)
    writing = parts.add_parser("write")
    writing.add_argument("folder", type=Path)
    writing.add_argument("--odscen", default=str(Path(sys.executable).parent / "odscen"))
    comparing = parts.add_parser("compare")
    comparing.add_argument("a", type=Path)
    comparing.add_argument("b", type=Path)
    asked = parser.parse_args()
    if asked.do == "write":
        write(asked.folder.absolute(), asked.odscen)
        return 0
    return int(compare(asked.a.absolute(), asked.b.absolute()) > 0)


if __name__ == "__main__":
    raise SystemExit(main())
