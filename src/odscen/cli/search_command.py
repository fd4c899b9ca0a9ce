"""``odscen search``: look for critical cases of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from odscen.cli.behaviour_options import (
    BehaviourCommandOption,
    BehaviourOption,
    BehaviourSettingOption,
    BehaviourTimeoutOption,
    behaviour_door,
)
from odscen.cli.console import JobsOption, JsonOption, WorkspaceOption, log, print_json, print_table
from odscen.cli.console import progress as shown_progress
from odscen.cli.scenario_commands import ScenarioArgument

if TYPE_CHECKING:
    from odscen.app.sweeps.critical_search import Found

_SHOWN = 10
"""Cases of the archive that are listed on a terminal."""


def search(
    scenario: ScenarioArgument,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help="Values of a parameter: gap=1..4 (a range), gap=1,2,4 (a set); repeatable. "
            "(default: each parameter between its bounds)",
            metavar="NAME=VALUES",
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="How many cases.")] = 100,
    method: Annotated[
        str,
        typer.Option(
            help="How cases are proposed; tpe learns from those before and needs odscen\\[search].",
            metavar="[tpe|latin|random]",
        ),
    ] = "tpe",
    batch: Annotated[
        int, typer.Option(min=1, help="Cases that are proposed at a time; not less than --jobs.")
    ] = 4,
    search_seed: Annotated[int, typer.Option(min=0, help="Seed of the proposals.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Folder of the search. (default: NAME-search here)"),
    ] = None,
    safe: Annotated[
        list[str] | None,
        typer.Option(
            help='What a safe case keeps besides "no collision", for example "min_ttc >= 1.5"; '
            "repeatable.",
            metavar="LIMIT",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of every run, instead of the scenario's.")
    ] = None,
    behaviour: BehaviourOption = None,
    behaviour_set: BehaviourSettingOption = None,
    behaviour_cmd: BehaviourCommandOption = None,
    behaviour_timeout: BehaviourTimeoutOption = 60.0,
    jobs: JobsOption = 1,
    reports: Annotated[bool, typer.Option("--reports", help="Write a report of each run.")] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Search the parameters of a scenario for cases that are not safe.

    Called again after an interruption it goes on, and ends with the same files. Exit code 0,
    whether there are critical cases or not; 2: bad input; 3: a run failed.
    """
    from odscen.app import scenarios
    from odscen.app.sweeps.critical_search import SearchSettings
    from odscen.app.sweeps.critical_search import search as find
    from odscen.app.sweeps.sweep_folder import SweepSettings
    from odscen.cli.sweep_command import bounds_of
    from odscen.scenario.sweeps.sweep_plan import axis_from_text
    from odscen.workspace.store import Workspace

    document = scenarios.read_scenario(scenario)
    driven = behaviour_door(behaviour, behaviour_set, behaviour_cmd, behaviour_timeout)
    with shown_progress("searching") as step:
        found = find(
            Workspace.open(workspace),
            document,
            tuple(map(axis_from_text, vary or ())) or bounds_of(document),
            out or Path(f"{scenarios.scenario_name(scenario)}-search"),
            search_settings=SearchSettings(method, runs, batch, search_seed),
            settings=SweepSettings(tuple(safe or ()), seed=seed, reports=reports, behaviour=driven),
            processes=jobs,
            done=lambda ended, count: step(f"{ended} of {count} cases", ended / count),
        )
    _show(found, as_json=as_json)
    raise typer.Exit(3 if "failed" in found.table["status"].to_list() else 0)


def _show(found: Found, *, as_json: bool) -> None:
    if as_json:
        print_json(
            {
                "folder": str(found.folder),
                "runs": found.table.height,
                "critical": list(found.critical),
                "archive": list(found.archive),
                "coverage": found.coverage,
                "cases": found.table.to_dicts(),
            }
        )
        return
    rows = {row["case"]: row for row in found.table.to_dicts()}
    print_table(
        "",
        (),
        [
            ("cases", len(rows)),
            ("critical", len(found.critical)),
            ("distinct", len(found.archive)),
            ("coverage of pairs", f"{found.coverage:.0%}"),
        ],
    )
    shown = sorted(found.archive, key=lambda case: (-rows[case]["criticality"], case))[:_SHOWN]
    names = [*rows[shown[0]]] if shown else []
    skipped = {"status", "safe", "detail", "collision", "max_drac", "clearance"}
    names = [name for name in names if name not in skipped]
    print_table("", names, [[_cell(rows[case][name]) for name in names] for case in shown])
    log(f"Page: {found.folder / 'sweep.html'}")


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)
