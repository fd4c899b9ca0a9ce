"""``odscen doctor``: what is installed, what is missing and how to get it."""

from __future__ import annotations

import platform
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import OdscenError
from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.app.map_repairs import RepairStep

NEEDED = (
    "odscen",
    "eclipse-sumo",
    "libsumo",
    "lxml",
    "numpy",
    "polars",
    "pydantic",
    "scipy",
    "shapely",
)
OPTIONAL = {
    "cairosvg": "PNG drawings: pip install 'odscen[png]'",
    "carla": "co-simulation with CARLA (CPython 3.11 or 3.12): pip install 'odscen[carla]'",
}


def doctor(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(help="Folders of runs outside the workspace.", metavar="RUN..."),
    ] = None,
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="Rebuild what is damaged in the workspace from what is not, and set aside what "
            "cannot be rebuilt.",
        ),
    ] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show versions, what is missing and how to get it, and what is damaged in the workspace.

    Exit code 0: all is well, or was repaired; 2: something is missing, damaged, or was set aside.
    """
    checks = [
        _check_row("python", platform.python_version(), needed=True),
        *(_check_package(name, needed=True, advice=f"pip install {name}") for name in NEEDED),
        *(_check_package(name, needed=False, advice=advice) for name, advice in OPTIONAL.items()),
        _check_sumo(),
        _check_allocator(),
        _check_workspace(workspace),
    ]
    healthy = all(check["found"] is not None for check in checks if check["needed"])
    if not as_json:
        rows = [
            (check["name"], check["found"] or "missing", "" if check["found"] else check["advice"])
            for check in checks
        ]
        print_table("", ("part", "found", "how to get it"), rows)
    steps = (
        []
        if checks[-1]["found"] is None
        else _examine_workspace(workspace, runs or [], repair=repair)
    )
    findings = []
    for step in steps:
        findings.append(step.to_dict())
        if step.harm:
            healthy = False
        if not as_json:
            place = f" -> {step.place}" if step.place else ""
            log(f"{step.what} {step.name}: {step.action}: {step.words}{place}")
    if as_json:
        print_json({"healthy": healthy, "checks": checks, "stored": findings})
    raise typer.Exit(0 if healthy else 2)


def _examine_workspace(
    workspace: Path | None, runs: list[Path], *, repair: bool
) -> Iterator[RepairStep]:
    from odscen.app.doctor import examine
    from odscen.maps.store import Workspace

    return examine(Workspace.open(workspace), runs, repair=repair)


def _check_row(name: str, found: str | None, *, needed: bool, advice: str = "") -> dict[str, Any]:
    return {"name": name, "found": found, "needed": needed, "advice": advice}


def _check_package(name: str, *, needed: bool, advice: str) -> dict[str, Any]:
    from importlib.metadata import PackageNotFoundError, version

    try:
        installed = version(name)
    except PackageNotFoundError:
        installed = None
    return _check_row(name, installed, needed=needed, advice=advice)


def _check_sumo() -> dict[str, Any]:
    advice = "pip install 'eclipse-sumo>=1.28,<1.29'"
    try:
        import sumo
    except ImportError:
        return _check_row("sumo", shutil.which("sumo"), needed=True, advice=advice)
    return _check_row(
        "sumo", str(Path(sumo.SUMO_HOME) / "bin" / "sumo"), needed=True, advice=advice
    )


def _check_allocator() -> dict[str, Any]:
    from odscen.sumo.runner.allocator import fast_allocator

    advice = "runs are a tenth faster with it: apt-get install libtcmalloc-minimal4"
    return _check_row("fast allocator", fast_allocator(), needed=False, advice=advice)


def _check_workspace(workspace: Any) -> dict[str, Any]:
    from odscen.maps.store import Workspace

    try:
        found, advice = str(Workspace.open(workspace).root), ""
    except OdscenError as error:
        found, advice = None, str(error)
    return _check_row("workspace", found, needed=True, advice=advice)
