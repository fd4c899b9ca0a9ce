"""``odscen cosim --selfcheck``: what a CARLA server does of what the mirror relies on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import typer

from odscen.base.text_files import write_text
from odscen.cli.console import log, print_json, print_table, progress

if TYPE_CHECKING:
    from odscen.carla.server.client import Address


def run_selfcheck(
    address: Address,
    scenario: Path | None,
    *,
    out: Path | None,
    workspace: Path | None,
    as_json: bool,
) -> NoReturn:
    """Check a server, write the page and its data, and exit.

    Raises
    ------
    WorkspaceError
        If the files cannot be written.
    """
    from odscen.carla.selfcheck.selfcheck_page import DATA, PAGE, selfcheck_data, selfcheck_page
    from odscen.carla.selfcheck.selfcheck_run import selfcheck
    from odscen.carla.server.interruption import INTERRUPTED
    from odscen.maps.store import Workspace

    with progress("checking") as step:
        report = selfcheck(Workspace.open(workspace), address, scenario=scenario, notify=step)
    folder = out or Path()
    data = selfcheck_data(report)
    write_text(folder / PAGE, selfcheck_page(report))
    write_text(folder / DATA, json.dumps(data, indent=1) + "\n")
    if as_json:
        print_json({**data, "files": {"page": str(folder / PAGE), "data": str(folder / DATA)}})
    else:
        rows = [(line.name, line.expected, line.seen, str(line.state)) for line in report.lines]
        print_table("", ("check", "expected", "seen", "result"), rows)
    log(f"Page: {folder / PAGE}")
    if report.interrupted:
        raise typer.Exit(INTERRUPTED)
    raise typer.Exit(1 if report.differing else 0)
