"""``odscen import``: a scenario from an OpenSCENARIO file, or from arrays."""

from __future__ import annotations

from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import InputError, NoMapError
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

    from odscen.maps.store import Workspace


class EgoChoice(StrEnum):
    """What drives the ego."""

    SUMO = "sumo"
    STORY = "story"


def import_(
    file: Annotated[
        Path,
        typer.Argument(
            help="OpenSCENARIO file, or arrays as odscen export --to arrays writes them.",
            metavar="FILE.xosc|FILE.npz",
        ),
    ],
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
    """Read a file as a scenario, and report on what it has.

    Of an OpenSCENARIO file each element is taken, approximated, ignored or refused. Arrays give the
    scenario that they were written of, with what was changed in them; its problems are listed.
    """
    from odscen.app.scenario_imports import import_scenario
    from odscen.maps.store import Workspace

    store = Workspace.open(workspace)
    if file.suffix == ".npz":
        if maps is not None or on_map is not None:
            raise InputError(
                "--maps and --map are for OpenSCENARIO; arrays name a map of the workspace",
                file=str(file),
            )
        _import_arrays(store, file, out, as_json=as_json)
        return
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


def _import_arrays(workspace: Workspace, file: Path, out: Path, *, as_json: bool) -> None:
    from odscen.app.scenarios import check_scenario, read_scenario, write_scenario

    scenario = read_scenario(file)
    problems = check_scenario(workspace, scenario)
    write_scenario(scenario, out)
    for one in problems:
        log(f"{one.severity}: {one.where}: {one.message}")
    log(f"Wrote {out}")
    if as_json:
        print_json({"file": str(out), "problems": [asdict(one) for one in problems]})


def _print_lists(lists: Mapping[str, Sequence[Any]]) -> None:
    rows = [
        (name, f"{row.file}:{row.line}", row.xpath.rpartition("/")[2], row.reason)
        for name in ("refused", "approximated", "ignored")
        for row in lists[name]
    ]
    print_table("Elements not taken as they are", ("", "line", "element", "reason"), rows)
    log(", ".join(f"{len(rows)} {name}" for name, rows in lists.items()))
