"""OpenSCENARIO files imported, checked and run: what became of their elements, and of their rules.

``python -m bench osc_import --folder FOLDER --maps MAPS`` takes every file below a folder that is
no catalog, by default those in ``shared/osc`` beside the project. Each is imported in a process of
its own and, if that gives a scenario without errors, run for at most a minute (``--limit``), with
the lowest priority. A rule has fired if the run has it started; those that never do are named with
``--rules``.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.app.exchange.imports import import_file
from odscen.app.running.runs import run
from odscen.base.errors import NoMapError, OdscenError
from odscen.base.xml_reading import read_xml
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from odscen.formats.openscenario_import.xosc_file import EgoDriver

SHARED = Path(__file__).parents[2] / "shared"
VERDICTS = ("taken", "approximated", "ignored", "refused")


def main() -> None:
    """Print a line for each file, and totals."""
    options = _options()
    rows = []
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        files = sorted(one for one in options.folder.rglob(options.files) if is_scenario(one))
        head = [one[:8] for one in VERDICTS]
        print(f"{'file':<60} {' '.join(f'{one:>8}' for one in head)}  rules  fired  run")
        for file in files:
            row = _in_a_process(file, options, Path(folder))
            rows.append(row)
            print(_line(row, file.name), flush=True)
            if options.rules and row.get("silent"):
                print(f"    never started: {', '.join(row['silent'])}")
    _totals(rows)
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bench osc_import", description=__doc__)
    parser.add_argument("--folder", type=Path, default=SHARED / "osc")
    parser.add_argument("--files", default="*.xosc", help="Which of them.")
    parser.add_argument("--maps", type=Path, default=SHARED / "maps" / "carla-2019")
    parser.add_argument("--ego", choices=("story", "sumo"), default="story")
    parser.add_argument("--limit", type=float, default=60.0, help="Seconds of a run.")
    parser.add_argument("--rules", action="store_true", help="Name rules that never start.")
    parser.add_argument("--json", type=Path, help="File that gets all of it.")
    return parser.parse_args()


def is_scenario(file: Path) -> bool:
    """Whether a file is no catalog; one that cannot be read may be a scenario."""
    try:
        return read_xml(file.read_bytes(), bare=True).find("Catalog") is None
    except OdscenError:
        return True


def _in_a_process(file: Path, options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Import and run a file; what a process says that is ended is what it said before."""
    given = [str(file), str(options.maps), str(folder), options.ego]
    command = ["nice", "-n", "19", sys.executable, "-m", "bench.osc_import", "--one", *given]
    child = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    over = False
    try:
        out, err = child.communicate(timeout=options.limit + 30.0)
    except subprocess.TimeoutExpired:
        over = True
        os.killpg(child.pid, signal.SIGKILL)
        out, err = child.communicate()
    found: dict[str, Any] = {"file": str(file)}
    for line in out.splitlines():
        if line.startswith("{"):
            found |= json.loads(line)
    if over:
        found["run"] = f"over {options.limit:g} s"
    elif child.returncode:
        found["run"] = f"traceback: {err.strip().splitlines()[-1] if err.strip() else 'none'}"
    return found


def _one(file: Path, maps: Path, folder: Path, ego: EgoDriver) -> None:
    """Import and run one file in this process, and print what became of it."""
    workspace = Workspace.open(folder / "workspace")
    try:
        found = import_file(
            workspace, file, maps=maps if maps.is_dir() else None, options={"ego": ego}
        )
    except NoMapError as error:
        counts = {one: len(error.lists[one]) for one in VERDICTS}
        print(json.dumps({"run": "no map", "report": counts}))
        return
    except OdscenError as error:
        print(json.dumps({"run": f"no import: {error}"}))
        return
    errors = [str(one.message) for one in found.problems if one.severity == "error"]
    said: dict[str, Any] = {one: len(found.lists[one]) for one in VERDICTS}
    said |= {"errors": errors, "rules": len(found.scenario.rules)}
    print(json.dumps(said), flush=True)
    if errors:
        print(json.dumps({"run": f"errors: {errors[0]}"}))
        return
    done = run(workspace, found.scenario, name="run", out=folder)
    result: dict[str, Any] = {"run": str(done.status)}
    if done.status == "completed":
        events = done.events()
        started = set(events.filter(events["kind"] == "rule_started")["rule"])
        failed = events.filter(events["kind"] == "rule_failed")
        result["fired"] = len(started)
        result["silent"] = [one.id for one in found.scenario.rules if one.id not in started]
        result["failed"] = [f"{one['rule']}: {one['detail']}" for one in failed.to_dicts()]
        result["vanished"] = events.filter(events["kind"] == "removed").height
    else:
        result["run"] = f"failed: {done.summary.get('error')}"
    print(json.dumps(result), flush=True)


def _line(row: dict[str, Any], name: str) -> str:
    counts = " ".join(f"{row.get(one, '-'):>8}" for one in VERDICTS)
    told = str(row.get("run", "nothing"))
    if row.get("failed"):
        told += f"; {row['failed'][0]}"
    return f"{name:<60} {counts} {row.get('rules', '-'):>6} {row.get('fired', '-'):>6}  {told}"


def _totals(rows: list[dict[str, Any]]) -> None:
    imported = [one for one in rows if "taken" in one]
    whole = [one for one in imported if not one["refused"]]
    checked = [one for one in imported if not one["errors"]]
    ran = [one for one in rows if one.get("run") == "completed"]
    rules, fired = (sum(one.get(key, 0) for one in ran) for key in ("rules", "fired"))
    share = 100 * len(whole) / max(len(rows), 1)
    mapless = sum("report" in one for one in rows)
    print(
        f"{len(rows)} files: {mapless} without a map have a report, {len(imported)} imported, "
        f"{len(whole)} of them with nothing refused ({share:.0f} %), "
        f"{len(checked)} without errors, {len(ran)} ran; of {rules} rules {fired} fired"
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        _one(*map(Path, sys.argv[2:5]), ego="sumo" if sys.argv[5] == "sumo" else "story")
    else:
        main()
