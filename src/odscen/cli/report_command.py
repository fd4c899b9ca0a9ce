"""``odscen report``: the report of a finished run, anew."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from odscen.cli.console import (
    IntervalOption,
    JsonOption,
    WarmUpOption,
    WorkspaceOption,
    log,
    print_json,
)


def report(
    run: Annotated[Path, typer.Argument(help="A finished run: its folder, or its name.")],
    corridor: Annotated[
        str | None,
        typer.Option(
            metavar="SEGMENT,SEGMENT,...",
            help="Follow vehicles along these segments, in driving direction; junctions between "
            "them may be left out. (default: the busiest route through several junctions)",
        ),
    ] = None,
    first: Annotated[
        str | None,
        typer.Option("--from", metavar="SEGMENT", help="Follow vehicles on the shortest path from"),
    ] = None,
    last: Annotated[str | None, typer.Option("--to", metavar="SEGMENT", help="to here.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File to write. (default: report.html of the run)", dir_okay=False),
    ] = None,
    warm_up: WarmUpOption = None,
    interval: IntervalOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write the report of a finished run anew, with a corridor or intervals of your choice.

    --json prints the figures too, and those of each interval and place.
    """
    from odscen.app.running.reports import interval_rows, renew_report
    from odscen.maps.store import Workspace

    if (first is None) != (last is None):
        raise typer.BadParameter("--from and --to belong together")
    if corridor is not None and first is not None:
        raise typer.BadParameter("give either --corridor, or --from and --to")
    segments = [name.strip() for name in (corridor or "").split(",") if name.strip()]
    store = Workspace.open(workspace)
    written = renew_report(
        store,
        run,
        corridor=segments,
        ends=None if first is None or last is None else (first, last),
        out=out,
        warm_up=warm_up,
        interval=interval,
    )
    if as_json:
        rows = interval_rows(store, run, warm_up=warm_up, interval=interval)
        print_json({"report": str(written), **rows})
    else:
        log(f"Report: {written}")
