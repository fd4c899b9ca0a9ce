"""``odscen import``: a scenario from an OpenSCENARIO file."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table


class EgoChoice(StrEnum):
    """What drives the ego."""

    SUMO = "sumo"
    STORY = "story"


def import_(
    file: Annotated[Path, typer.Argument(help="OpenSCENARIO file.", metavar="FILE.xosc")],
    out: Annotated[Path, typer.Option(help="Scenario to write.")],
    maps: Annotated[
        Path | None, typer.Option(help="Folder of maps, beside that of the file.")
    ] = None,
    ego: Annotated[
        EgoChoice, typer.Option(help="What drives the ego: SUMO, or its story.")
    ] = EgoChoice.STORY,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Read an OpenSCENARIO file as a scenario, and report on each of its elements."""
    from odscen.app.scenario_imports import import_scenario
    from odscen.workspace.store import Workspace

    store = Workspace.open(workspace)
    found = import_scenario(store, file, out=out, maps=maps, ego=ego.value)
    if as_json:
        lists = {name: [row._asdict() for row in rows] for name, rows in found.lists.items()}
        problems = [{"where": one.where, "message": one.message} for one in found.problems]
        plan = None if found.plan_file is None else str(found.plan_file)
        print_json({"file": str(out), "sweep": plan, **lists, "problems": problems})
        return
    rows = [
        (name, f"{row.file}:{row.line}", row.xpath.rpartition("/")[2], row.reason)
        for name in ("refused", "approximated", "ignored")
        for row in found.lists[name]
    ]
    print_table("Elements not taken as they are", ("", "line", "element", "reason"), rows)
    log(", ".join(f"{len(rows)} {name}" for name, rows in found.lists.items()))
    log(f"Wrote {out}")
    if found.plan_file is not None:
        log(f"Wrote {found.plan_file}: odscen sweep {out} --plan {found.plan_file}")
