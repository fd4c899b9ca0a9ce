"""``odscen calibrate``: a scenario changed until its runs show what was measured on the road."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from odscen.cli.console import (
    JobsOption,
    JsonOption,
    SeedsOption,
    WorkspaceOption,
    log,
    print_json,
    print_table,
)
from odscen.cli.scenario_commands import ScenarioArgument


def calibrate(
    scenario: ScenarioArgument,
    targets: Annotated[
        Path,
        typer.Argument(
            help="Table of what was measured: kind (flow, travel_time, queue, queue_max), place, "
            "begin, end, value, and perhaps use (calibrate, validate).",
            metavar="TARGETS.csv",
        ),
    ],
    change: Annotated[
        str,
        typer.Option(
            help="What may change: matrix, routes, drivers, programs, parameters; with commas."
        ),
    ] = "matrix,drivers",
    hold_back: Annotated[
        float,
        typer.Option(
            min=0, max=0.9, help="Share of the places of each kind that nothing is fitted to."
        ),
    ] = 0.25,
    seeds: SeedsOption = None,
    trials: Annotated[
        int, typer.Option(min=2, max=1000, help="Scenarios that are run at most, with all seeds.")
    ] = 24,
    trust: Annotated[
        float,
        typer.Option(
            min=0.0, help="Weight of a trip more or less than in the matrix, see demand correct."
        ),
    ] = 0.1,
    jobs: JobsOption = 1,
    page: Annotated[Path | None, typer.Option("--page", help="Page to write.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File to write. (default: the scenario itself)"),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Change a scenario until its runs meet flows, travel times and queues by hour.

    A part of the places is held back and says whether the result also holds elsewhere.
    """
    from odscen.app import scenarios
    from odscen.app.demand import calibration, calibration_page
    from odscen.base.errors import in_file
    from odscen.base.given_files import read_given_text
    from odscen.maps.store import Workspace
    from odscen.scenario.demand.targets import read_targets

    document = scenarios.read_scenario(scenario)
    with in_file(str(targets)):
        rows = read_targets(read_given_text(targets), clock=document.demand.clock)
    done = calibration.calibrate(
        Workspace.open(workspace),
        document,
        rows,
        change=[name.strip() for name in change.split(",") if name.strip()],
        held_back=hold_back,
        seeds=calibration.SEEDS if seeds is None else seeds,
        trials=trials,
        trust=trust,
        processes=jobs,
        tell=log,
    )
    path = scenarios.write_scenario(done.scenario, out or scenario)
    if page is not None:
        written = calibration_page.write_calibration_page(done, page, title=document.name)
        log(f"Wrote {written}")
    if as_json:
        print_json({"file": str(path), **done.to_dict()})
        return
    cells = [calibration_page.share_cells(share) for share in done.shares]
    print_table("", calibration_page.SHARE_HEADS, cells)
    missed = [row for row in calibration_page.target_cells(done) if row[-1] == "no"]
    if missed:
        print_table("Not met", calibration_page.TARGET_HEADS[:-1], [row[:-1] for row in missed])
    for words in done.doubts:
        log(f"not plausible: {words}")
    log(f"Wrote {path}")
