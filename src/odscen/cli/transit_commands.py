"""``odscen transit``: public transport of a scenario."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Annotated

import typer

from odscen.base.errors import InputError
from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json
from odscen.cli.scenario_commands import ScenarioArgument

app = typer.Typer(help="Public transport of a scenario.", no_args_is_help=True)


@app.callback()
def _transit_group() -> None:
    """Public transport of a scenario."""


@app.command("import")
def import_(
    scenario: ScenarioArgument,
    feed: Annotated[
        Path, typer.Argument(help="GTFS feed: a zip archive, or its folder.", metavar="FEED")
    ],
    day: Annotated[
        str | None, typer.Option(help="Day whose trips are taken.", metavar="YYYY-MM-DD")
    ] = None,
    routes: Annotated[
        str | None, typer.Option(help="Names of routes. (default: all by bus)", metavar="7,12")
    ] = None,
    within: Annotated[
        float, typer.Option(min=1, max=500, help="Metres that a stop may be from its lane.")
    ] = 30.0,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File to write. (default: the scenario itself)"),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take stops and bus trips of a day from a GTFS feed, instead of those of the scenario.

    The map needs a georeference. Times of day count from the scenario's clock.
    """
    from odscen.app import scenarios
    from odscen.app.demand import transit_feeds
    from odscen.maps.store import Workspace

    document, placed = transit_feeds.import_transit(
        Workspace.open(workspace),
        scenarios.read_scenario(scenario),
        feed,
        day=_parse_day(day),
        routes=tuple(part.strip() for part in routes.split(",")) if routes else (),
        within=within,
    )
    trips = sum(len(line.departures) for line in placed.transit.lines)
    log(f"{len(placed.transit.stops)} stops, {len(placed.transit.lines)} lines, {trips} trips")
    for why, number in placed.left_out.items():
        log(f"left out: {number} {why}")
    path = scenarios.write_scenario(document, out or scenario)
    log(f"Wrote {path}")
    if as_json:
        counts = {"stops": len(placed.transit.stops), "lines": len(placed.transit.lines)}
        print_json({"file": str(path), **counts, "trips": trips, "left_out": placed.left_out})


def _parse_day(text: str | None) -> date | None:
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise InputError(f"a day is written as 2026-11-23, not {text!r}") from None
