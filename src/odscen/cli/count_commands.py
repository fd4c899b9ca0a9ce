"""``odscen demand fit``, ``routes`` and ``correct``: counts against traffic, and its routes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table
from odscen.cli.demand_commands import OutOption
from odscen.cli.scenario_commands import ScenarioArgument

if TYPE_CHECKING:
    from odscen.sumo.calibrate.count_fit import CountFits

PageOption = Annotated[
    Path | None,
    typer.Option("--page", help="Page to write, with a scatter plot and what is not met."),
]


def fit(
    what: Annotated[
        Path, typer.Argument(help="Scenario, or folder of a run.", metavar="SCENARIO_OR_RUN")
    ],
    every: Annotated[bool, typer.Option("--all", help="Show the counts that are met too.")] = False,
    page: PageOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compare traffic with the counts of its scenario: GEH and RMSE; what is not met and why.

    Of a scenario, traffic as planned, without congestion; of a run, as simulated.
    """
    from odscen.app.demand import demands
    from odscen.maps.store import Workspace

    fit_report = demands.fit_counts(Workspace.open(workspace), what)
    if page is not None:
        from odscen.app.demand.demand_correction import write_fit_page

        log(f"Wrote {write_fit_page([('Counts and traffic', fit_report)], page, title=what.stem)}")
    if as_json:
        print_json({"file": str(what), **fit_report.to_dict()})
        return
    show_fit(fit_report, every=every)


def routes(
    scenario: ScenarioArgument,
    by: Annotated[
        str | None, typer.Option(help="length, or travel_time: found by repeated runs.")
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(min=1, max=100, help="Runs that routes are found by, at most.")
    ] = None,
    gap: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Share of travel time left to save at which it is enough."),
    ] = None,
    interval: Annotated[
        float | None, typer.Option(help="Seconds that travel times are means of.")
    ] = None,
    informed: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Share of drivers who look for quicker routes on the way."),
    ] = None,
    period: Annotated[
        float | None, typer.Option(help="Seconds after which these look again.")
    ] = None,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say how trips of the demand choose their routes; what is not given stays as it is."""
    from odscen.app import scenarios
    from odscen.app.demand import demands
    from odscen.maps.store import Workspace

    given = {
        "by": by, "iterations": iterations, "gap": gap, "interval": interval,
        "informed": informed, "period": period,
    }  # fmt: skip
    fields = {name: value for name, value in given.items() if value is not None}
    document = scenarios.read_scenario(scenario)
    document = demands.choose_routes(Workspace.open(workspace), document, **fields)
    path = scenarios.write_scenario(document, out or scenario)
    log(f"Wrote {path}")
    if as_json:
        chosen = document.demand.routes.model_dump(mode="json")
        print_json({"file": str(path), "routes": chosen})


def parking(
    scenario: ScenarioArgument,
    begin: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Share of cars that begin in a parking place."),
    ] = None,
    end: Annotated[
        float | None, typer.Option(min=0, max=1, help="Share of cars that end in one.")
    ] = None,
    stay: Annotated[
        float | None, typer.Option(min=1, help="Seconds that a place is taken before and after.")
    ] = None,
    within: Annotated[
        float | None, typer.Option(help="Metres from a zone to its places, at most.")
    ] = None,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say which trips of the demand park; what is not given stays as it is."""
    from odscen.app import scenarios
    from odscen.app.demand import demands
    from odscen.maps.store import Workspace

    given = {"begin": begin, "end": end, "stay": stay, "within": within}
    fields = {name: value for name, value in given.items() if value is not None}
    document = scenarios.read_scenario(scenario)
    document = demands.choose_parking(Workspace.open(workspace), document, **fields)
    path = scenarios.write_scenario(document, out or scenario)
    log(f"Wrote {path}")
    if as_json:
        print_json({"file": str(path), "parking": document.demand.parking.model_dump(mode="json")})


def correct(
    scenario: ScenarioArgument,
    trust: Annotated[
        float,
        typer.Option(
            min=0.0,
            help="Weight of a trip more or less than in the matrix, against a vehicle that "
            "counts do not have.",
        ),
    ] = 0.1,
    rounds: Annotated[
        int, typer.Option(min=1, max=20, help="Times that routes by travel time are found.")
    ] = 1,
    page: PageOption = None,
    out: OutOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Correct the matrices of a scenario by its counts: link and turn counts by slices of time.

    Each matrix becomes one for each slice; the counts are kept to compare with.
    """
    from odscen.app import scenarios
    from odscen.app.demand import demand_correction
    from odscen.maps.store import Workspace

    document = scenarios.read_scenario(scenario)
    correction = demand_correction.correct_matrix(
        Workspace.open(workspace),
        document,
        trust=trust,
        rounds=rounds,
        iterated=lambda step: log(step.words),
    )
    path = scenarios.write_scenario(correction.scenario, out or scenario)
    if page is not None:
        fits = [("Prior matrix", correction.before), ("Corrected matrix", correction.after)]
        log(f"Wrote {demand_correction.write_fit_page(fits, page, title=document.name)}")
    if as_json:
        trips = {"trips_before": correction.trips_before, "trips_after": correction.trips_after}
        fits_json = {"before": correction.before.to_dict(), "after": correction.after.to_dict()}
        print_json({"file": str(path), **trips, **fits_json})
        return
    show_fit(correction.after, every=False)
    log(
        f"{correction.trips_before:,.0f} trips became {correction.trips_after:,.0f}; "
        f"counts within GEH 5: {correction.before.share_met or 0:.1%} before, "
        f"{correction.after.share_met or 0:.1%} now"
    )
    log(f"Wrote {path}")


def show_fit(found: CountFits, *, every: bool) -> None:
    """Print a fit for people."""
    rows = [row for row in found.rows if every or not row.met]
    if rows:
        print_table(
            "",
            ("place", "from, s", "to, s", "counted", "traffic", "GEH", "why not"),
            [
                (row.place, row.begin, row.end, row.counted, row.modelled, row.geh, row.why)
                for row in rows
            ],
        )
    for message in found.contradictions:
        log(f"contradictory: {message}")
    met = sum(row.met for row in found.rows)
    if found.hours_met is not None:
        good = sum(hour.met for hour in found.hours)
        log(f"{good} of {len(found.hours)} hours within GEH 5 ({found.hours_met:.1%})")
    log(
        f"{met} of {len(found.rows)} counts within GEH 5 ({found.share_met or 0:.1%}); RMSE "
        f"{found.rmse or 0:.2f} vehicles; {found.vehicles} vehicles ({found.source}), "
        f"{sum(row.counted for row in found.rows):g} passages counted, "
        f"{sum(row.modelled for row in found.rows)} made"
    )
