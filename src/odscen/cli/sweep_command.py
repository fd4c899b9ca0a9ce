"""``odscen sweep`` and ``odscen search``: a scenario with many values of its parameters."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import InputError, in_file
from odscen.base.given_files import read_given_text
from odscen.cli.console import (
    BehaviourCommandOption,
    BehaviourOption,
    BehaviourSettingOption,
    BehaviourTimeoutOption,
    JobsOption,
    JsonOption,
    WorkspaceOption,
    behaviour_door,
    log,
    print_json,
    print_table,
    progress,
)
from odscen.cli.scenario_commands import ScenarioArgument

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.experiments.searches import SearchResult
    from odscen.experiments.sweeps import Sweep
    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan

_SHOWN = 20
"""Cases that are listed on a terminal."""
_SHOWN_CRITICAL = 10


def sweep(
    scenario: ScenarioArgument,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help="Values of a parameter: gap=1..4:7 (a range in 7 steps), gap=1..4 (a range, for "
            "samples), gap=1,2,4; repeatable. (default: each parameter between its bounds)",
            metavar="NAME=VALUES",
        ),
    ] = None,
    plan: Annotated[
        Path | None, typer.Option(help="A file with all of that: JSON or TOML.", metavar="FILE")
    ] = None,
    samples: Annotated[
        int | None, typer.Option(min=1, help="How many cases, instead of a grid.")
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="How samples are drawn. (default: sobol)", metavar="[sobol|latin|random]"
        ),
    ] = None,
    sample_seed: Annotated[int, typer.Option(min=0, help="Seed of the samples.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Folder of the sweep. (default: NAME-sweep here)"),
    ] = None,
    safe: Annotated[
        list[str] | None,
        typer.Option(
            help='What a safe case keeps besides "no collision", for example "min_ttc >= 1.5"; '
            "repeatable.",
            metavar="LIMIT",
        ),
    ] = None,
    figure: Annotated[
        list[str] | None,
        typer.Option(
            help="A figure of runs as a column, or one of your own: queue=figures.py:queue.",
            metavar="FIGURE",
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
    openscenario: Annotated[
        str | None,
        typer.Option(
            help="Write each case as OpenSCENARIO too: 1.0 to 1.3.",
            metavar="VERSION",
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say which cases there are, and run none.")
    ] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a scenario with many values of its parameters; find where it is safe.

    Each case gives a row: parameters, collision and its speed, time to collision,
    post-encroachment time. The same command after an interruption runs what is missing. Exit code
    0, whether cases are safe or not; 2: bad input; 3: a run failed.
    """
    from odscen.app import scenarios
    from odscen.experiments.ineffective import variables_without_effect
    from odscen.experiments.sweeps import SweepSettings
    from odscen.experiments.sweeps import sweep as run_sweep
    from odscen.maps.store import Workspace

    document = scenarios.read_scenario(scenario)
    planned = _make_plan(document, vary, plan, samples, method, sample_seed)
    idle = variables_without_effect(document, planned)
    for name, reason in idle.items():
        log(f"{name} has no effect: {reason}")
    if dry_run:
        _show_plan(planned, idle, as_json=as_json)
        return
    own, named = _parse_figures(figure or [])
    driven = behaviour_door(behaviour, behaviour_set, behaviour_cmd, behaviour_timeout)
    settings = SweepSettings(tuple(safe or ()), named, own, seed, reports, openscenario, driven)
    folder = out or Path(f"{scenarios.scenario_name(scenario)}-sweep")
    with progress("sweeping") as step:
        results = run_sweep(
            Workspace.open(workspace),
            document,
            planned,
            folder,
            settings=settings,
            processes=jobs,
            tell=log,
            done=lambda ended, count: step(f"{ended} of {count} cases", ended / count),
        )
    _show_sweep(results, as_json=as_json)
    raise typer.Exit(3 if "failed" in results.table["status"].to_list() else 0)


def _make_plan(
    scenario: Scenario,
    vary: Sequence[str] | None,
    file: Path | None,
    samples: int | None,
    method: str | None,
    seed: int,
) -> SweepPlan:
    from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text, plan_from_data

    if file is not None:
        if vary or samples or method or seed:
            raise InputError(
                "give --plan or --vary, --samples, --method and --sample-seed, not both"
            )
        with in_file(str(file)):
            return plan_from_data(_read_plan_file(file))
    how = method or ("grid" if samples is None else "sobol")
    axes = tuple(map(axis_from_text, vary or ())) or _parameter_bounds(scenario)
    return SweepPlan(axes, how, samples, seed)


def _parameter_bounds(scenario: Scenario) -> tuple[Any, ...]:
    """Each parameter between its bounds."""
    from odscen.scenario.sweeps.sweep_plan import Range

    return tuple(
        Range(name, parameter.min, parameter.max)
        for name, parameter in scenario.parameters.items()
        if parameter.min is not None
        and parameter.max is not None
        and f"parameters/{name}/value" not in scenario.formulas
    )


def _read_plan_file(file: Path) -> dict[str, Any]:
    from pydantic_core import from_json

    text = read_given_text(file)
    try:
        data = tomllib.loads(text) if file.suffix == ".toml" else from_json(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"not a plan of a sweep: {error}") from error
    if not isinstance(data, dict):
        raise InputError("not a plan of a sweep: it must be an object with vary")
    return data


def _parse_figures(
    given: Sequence[str],
) -> tuple[dict[str, Callable[[Run], float | None]], tuple[str, ...]]:
    from odscen.experiments.own_figures import own_column

    own = {}
    for text in given:
        name, sign, function = text.partition("=")
        if sign:
            own[name] = own_column(name, function, beside=Path())
    return own, tuple(text for text in given if "=" not in text)


def _show_plan(plan: SweepPlan, idle: Mapping[str, str], *, as_json: bool) -> None:
    cases = plan.cases()
    if as_json:
        print_json({"plan": plan.to_dict(), "cases": list(cases), "without_effect": dict(idle)})
        return
    rows = [[f"{value:g}" for value in case.values()] for case in cases[:_SHOWN]]
    print_table(f"{len(cases)} cases", plan.names, rows)
    if len(cases) > _SHOWN:
        log(f"and {len(cases) - _SHOWN} more")


def _show_sweep(found: Sweep, *, as_json: bool) -> None:
    table = found.table
    if as_json:
        rows = [
            {key: None if value != value else value for key, value in row.items()}
            for row in table.to_dicts()
        ]
        print_json({"folder": str(found.folder), "boundary": found.boundary, "cases": rows})
        return
    safe = table["safe"].to_list()
    print_table(
        "",
        (),
        [
            ("cases", len(safe)),
            ("safe", safe.count(True)),
            ("not safe", safe.count(False)),
            ("not run", safe.count(None)),
        ],
    )
    log(f"Page: {found.folder / 'sweep.html'}")


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
            metavar="[tpe|latin|sobol|random]",
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

    Called again after an interruption it resumes, and ends with the same files. Exit code 0,
    whether there are critical cases or not; 2: bad input; 3: a run failed.
    """
    from odscen.app import scenarios
    from odscen.experiments.searches import SearchSettings
    from odscen.experiments.searches import search as find
    from odscen.experiments.sweeps import SweepSettings
    from odscen.maps.store import Workspace
    from odscen.scenario.sweeps.sweep_plan import axis_from_text

    document = scenarios.read_scenario(scenario)
    driven = behaviour_door(behaviour, behaviour_set, behaviour_cmd, behaviour_timeout)
    with progress("searching") as step:
        results = find(
            Workspace.open(workspace),
            document,
            tuple(map(axis_from_text, vary or ())) or _parameter_bounds(document),
            out or Path(f"{scenarios.scenario_name(scenario)}-search"),
            search_settings=SearchSettings(method, runs, batch, search_seed),
            settings=SweepSettings(tuple(safe or ()), seed=seed, reports=reports, behaviour=driven),
            processes=jobs,
            done=lambda ended, count: step(f"{ended} of {count} cases", ended / count),
        )
    _show_found(results, as_json=as_json)
    raise typer.Exit(3 if "failed" in results.table["status"].to_list() else 0)


def _show_found(found: SearchResult, *, as_json: bool) -> None:
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
    shown = sorted(found.archive, key=lambda case: (-rows[case]["criticality"], case))[
        :_SHOWN_CRITICAL
    ]
    names = [*rows[shown[0]]] if shown else []
    skipped = {"status", "safe", "detail", "collision", "max_drac", "clearance"}
    names = [name for name in names if name not in skipped]
    print_table("", names, [[_format_cell(rows[case][name]) for name in names] for case in shown])
    log(f"Page: {found.folder / 'sweep.html'}")


def _format_cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)
