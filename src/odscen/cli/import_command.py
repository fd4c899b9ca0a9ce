"""``odscen import``: a scenario from an OpenSCENARIO file."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import NoMapError
from odscen.cli.console import (
    JsonOption,
    WorkspaceOption,
    as_rows,
    log,
    print_json,
    print_table,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


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
    on_map: Annotated[
        str | None,
        typer.Option(
            "--map", help="The map on which it plays: a file (.xodr) or the name of a map."
        ),
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
    try:
        found = import_scenario(store, file, out=out, maps=maps, on_map=on_map, ego=ego.value)
    except NoMapError as error:
        if not as_json:
            _print_lists(error.lists)
        raise
    if as_json:
        lists = as_rows(found.lists)
        problems = [{"where": one.where, "message": one.message} for one in found.problems]
        plan = None if found.plan_file is None else str(found.plan_file)
        print_json({"file": str(out), "sweep": plan, **lists, "problems": problems})
        return
    _print_lists(found.lists)
    log(f"Wrote {out}")
    if found.plan_file is not None:
        log(f"Wrote {found.plan_file}: odscen sweep {out} --plan {found.plan_file}")


def _print_lists(lists: Mapping[str, Sequence[Any]]) -> None:
    rows = [
        (name, f"{row.file}:{row.line}", row.xpath.rpartition("/")[2], row.reason)
        for name in ("refused", "approximated", "ignored")
        for row in lists[name]
    ]
    print_table("Elements not taken as they are", ("", "line", "element", "reason"), rows)
    log(", ".join(f"{len(rows)} {name}" for name, rows in lists.items()))
