"""Whether exports are valid OpenSCENARIO: templates and sampled scenarios in all versions.

``python -m bench osc_export``. The seven templates on every shipped map that has room for them, and
50 sampled scenarios, are exported in versions 1.0 to 1.3 and held against ASAM's schemas and
checks; short runs of some as what recorded (``--as-run``). ``make build/qc/checkers`` installs
schemas and checks.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
from collections import Counter, defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

from lxml import etree

from odscen.app.exchange.exports import export, export_run
from odscen.app.generation import generate
from odscen.app.running.runs import run
from odscen.app.template_scenarios import write_template
from odscen.formats.openscenario.dialect import VERSIONS
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.scenario.templates.scene_sites import NoPlaceError
from odscen.scenario.templates.template_registry import TEMPLATES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

ROOT = Path(__file__).parents[1]
QC = ROOT / "build" / "qc"
SECONDS = 30.0
"""Of runs that are exported as what recorded."""


def main() -> None:
    """Print, of each version, how many files there are and what was found in them."""
    parser = argparse.ArgumentParser(prog="python -m bench osc_export")
    parser.add_argument("--sampled", type=int, default=50)
    parser.add_argument("--run-every", type=int, default=5)
    given = parser.parse_known_args()[0]
    if not (QC / "bin" / "qc_openscenario").exists():
        print("asam-qc-openscenarioxml is not here; `make build/qc/checkers` installs it")
        return
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        root = Path(folder)
        workspace = Workspace.open(root / "workspace")
        for file in sorted((ROOT / "maps").glob("*.xodr")):
            workspace.add_map(file)
        files = [*placed(workspace, root / "templates"), *sampled(workspace, given.sampled, root)]
        print(f"{len(files)} scenarios, {len(files[:: given.run_every])} of them run for as-run")
        _table("normal", files, lambda file, out, version: export(
            workspace, file, out, to="openscenario", options={"version": version}
        ))  # fmt: skip
        ran = [_short_run(workspace, file, root / "runs") for file in files[:: given.run_every]]
        _table("as run", ran, lambda file, out, version: export_run(
            workspace, file, out, to="openscenario", options={"version": version}
        ))  # fmt: skip


def placed(workspace: Workspace, out: Path) -> list[Path]:
    """Scenarios of all templates on every map that has room for them."""
    found = []
    for template in TEMPLATES.values():
        for entry in workspace.maps():
            try:
                found.append(write_template(workspace, template.name, entry.name, out=out))
            except NoPlaceError:
                continue
    return found


def sampled(workspace: Workspace, count: int, root: Path) -> list[Path]:
    """Sampled scenarios on all maps."""
    config = SamplingConfig(actors_max=40, ego=True)
    settings = GenerationSettings(config=config, count=count)
    return generate(workspace, settings=settings, out=root / "sampled")


def _short_run(workspace: Workspace, file: Path, out: Path) -> Path:
    name = file.name.removesuffix(".scenario.json")
    done = run(workspace, file, settings=RunSettings(until=SECONDS), name=name, out=out)
    return done.folder


def _table(
    title: str, these: Sequence[Path], written: Callable[[Path, Path, str], Iterable[Path]]
) -> None:
    heads = ("files", "valid", "checks", "findings", "rules left out")
    print("{:8} {:>6} {:>6} {:>7} {:>9} {:>15}".format(title, *heads))
    for version in VERSIONS:
        counts, words = Counter[str](), defaultdict[str, int](int)
        for file in these:
            with tempfile.TemporaryDirectory(prefix="odscen-bench-") as out:
                _count(list(written(file, Path(out), version)), version, counts, words)
        row = [counts[one] for one in heads]
        print("{:8} {:>6} {:>6} {:>7} {:>9} {:>15}".format(version, *row), flush=True)
        for line, times in sorted(words.items()):
            print(f"    {times} x {line}")


def _count(
    files: Sequence[Path], version: str, counts: Counter[str], words: dict[str, int]
) -> None:
    (file,) = (one for one in files if one.suffix == ".xosc")
    checks, issues = checked(file)
    counts["files"] += 1
    counts["valid"] += schema(version).validate(etree.parse(file))
    counts["checks"] += checks
    counts["findings"] += len(issues)
    notes = json.loads(next(one for one in files if one.name.endswith(".export.json")).read_text())
    counts["rules left out"] += sum(row["place"].startswith("rules") for row in notes["left_out"])
    for one in issues:
        words[re.sub(r"\d+", "N", one)[:200]] += 1


def schema(version: str) -> etree.XMLSchema:
    """ASAM's schema of a version, from the package of its checks."""
    (file,) = QC.glob(f"lib/python*/site-packages/qc_openscenario/schema/{version}.0/*.xsd")
    return etree.XMLSchema(etree.parse(file))


def checked(file: Path) -> tuple[int, list[str]]:
    """How many of ASAM's checks could be made, and what they found."""
    command = [QC / "bin" / "python", ROOT / "tools" / "check_maps.py", file]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    found = re.search(r"(\d+) checks completed", done.stdout)
    issues = [line.strip() for line in done.stdout.splitlines()[1:]]
    return (int(found[1]) if found else 0), issues or ([] if found else [done.stderr[-200:]])
