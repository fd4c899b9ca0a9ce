"""``odscen doctor``: what is installed, what is missing and how to get it."""

from __future__ import annotations

import platform
import shutil
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import typer

from odscen.base.errors import OdscenError
from odscen.cli.console import JsonOption, WorkspaceOption, print_json, print_table

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


def doctor(workspace: WorkspaceOption = None, as_json: JsonOption = False) -> None:
    """Show versions, what is installed, what is missing and how to get it."""
    checks = [
        _check("python", platform.python_version(), needed=True),
        *(_package(name, needed=True, advice=f"pip install {name}") for name in NEEDED),
        *(_package(name, needed=False, advice=advice) for name, advice in OPTIONAL.items()),
        _sumo(),
        _allocator(),
        _workspace(workspace),
    ]
    healthy = all(check["found"] is not None for check in checks if check["needed"])
    if as_json:
        print_json({"healthy": healthy, "checks": checks})
    else:
        rows = [
            (check["name"], check["found"] or "missing", "" if check["found"] else check["advice"])
            for check in checks
        ]
        print_table("", ("part", "found", "how to get it"), rows)
    raise typer.Exit(0 if healthy else 2)


def _check(name: str, found: str | None, *, needed: bool, advice: str = "") -> dict[str, Any]:
    return {"name": name, "found": found, "needed": needed, "advice": advice}


def _package(name: str, *, needed: bool, advice: str) -> dict[str, Any]:
    try:
        found = version(name)
    except PackageNotFoundError:
        found = None
    return _check(name, found, needed=needed, advice=advice)


def _sumo() -> dict[str, Any]:
    advice = "pip install 'eclipse-sumo>=1.28,<1.29'"
    try:
        import sumo
    except ImportError:
        return _check("sumo", shutil.which("sumo"), needed=True, advice=advice)
    return _check("sumo", str(Path(sumo.SUMO_HOME) / "bin" / "sumo"), needed=True, advice=advice)


def _allocator() -> dict[str, Any]:
    from odscen.sumo.runner.allocator import fast_allocator

    advice = "runs are a tenth faster with it: apt-get install libtcmalloc-minimal4"
    return _check("fast allocator", fast_allocator(), needed=False, advice=advice)


def _workspace(workspace: Any) -> dict[str, Any]:
    from odscen.workspace.store import Workspace

    try:
        found, advice = str(Workspace.open(workspace).root), ""
    except OdscenError as error:
        found, advice = None, str(error)
    return _check("workspace", found, needed=True, advice=advice)
