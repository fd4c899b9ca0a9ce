"""``odscen study`` and ``odscen dataset``: many runs as data, and recordings made of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import InputError
from odscen.cli.console import (
    JobsOption,
    JsonOption,
    WorkspaceOption,
    log,
    print_json,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.experiments.studies import StudyState
    from odscen.experiments.study_page import StudyGroup
    from odscen.experiments.work import Executor
    from odscen.maps.store import Workspace

app = typer.Typer(
    name="study",
    help="Many runs as data: a plan, a state, and one table of results.",
    no_args_is_help=True,
)

FolderArgument = Annotated[Path, typer.Argument(help="Folder of the study.", metavar="STUDY")]
ExecutorOption = Annotated[
    str,
    typer.Option(
        help="Where runs are carried out: on this machine, or by the workers of a Dask scheduler "
        "(needs odscen\\[dask]).",
        metavar="[local|dask]",
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        help="Of Dask: tcp://HOST:8786, or a file that the scheduler has written.",
        metavar="ADDRESS",
    ),
]
TargetOption = Annotated[
    str | None,
    typer.Option(
        help="Folder or URL (of fsspec, such as s3://bucket/study) for run folders that the plan "
        "keeps, as .tar. (default: runs/ in the folder of the study)",
        metavar="TARGET",
    ),
]
_SHOWN = 20


@app.command()
def run(
    plan: Annotated[Path, typer.Argument(help="Plan, JSON or TOML.", metavar="PLAN")],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Folder of the study. (default: NAME-study here)"),
    ] = None,
    jobs: JobsOption = 1,
    executor: ExecutorOption = "local",
    scheduler: SchedulerOption = None,
    target: TargetOption = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say how many runs there are, and run none.")
    ] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run every scenario of a plan with every variant, case of parameters and seed.

    One row for each run goes to results.parquet, with every figure. A study that was interrupted
    resumes with the same command, or with `odscen study resume`. Exit code 0: all have
    completed; 2: bad input; 3: a run failed or was not possible.
    """
    from odscen.experiments.plan import found_sources, grid_of, read_study_plan
    from odscen.experiments.studies import begin_study
    from odscen.maps.store import Workspace

    place = Workspace.open(workspace)
    folder = out or Path(f"{plan.name.partition('.')[0]}-study")
    if dry_run:
        read = read_study_plan(plan)
        grid = grid_of(read, found_sources(read, place, beside=plan.parent))
        _show_grid(grid, as_json=as_json)
        return
    begin_study(place, plan, folder)
    _carry_out(place, folder, jobs, executor, scheduler, target, again=False, as_json=as_json)


@app.command()
def resume(
    study: FolderArgument,
    jobs: JobsOption = 1,
    executor: ExecutorOption = "local",
    scheduler: SchedulerOption = None,
    target: TargetOption = None,
    failed: Annotated[
        bool, typer.Option("--failed", help="Run those again that failed or were not possible.")
    ] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run what is missing of a study; none is run twice. Exit codes as of `odscen study run`."""
    from odscen.maps.store import Workspace

    place = Workspace.open(workspace)
    _carry_out(place, study, jobs, executor, scheduler, target, again=failed, as_json=as_json)


@app.command()
def extend(
    study: FolderArgument,
    plan: Annotated[
        Path | None,
        typer.Option(help="The plan as it is to be, with all that the study has.", metavar="FILE"),
    ] = None,
    seeds: Annotated[
        str | None,
        typer.Option(help="All seeds: 40 for 1 to 40, or 1-40.", metavar="SEEDS"),
    ] = None,
    jobs: JobsOption = 1,
    executor: ExecutorOption = "local",
    scheduler: SchedulerOption = None,
    target: TargetOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Add seeds, scenarios, variants or cases to a study, and run them.

    Runs that have ended stay as they are. Exit codes as of `odscen study run`.
    """
    from odscen.experiments.plan import StudyPlan, read_study_plan
    from odscen.experiments.studies import extend_study, read_study
    from odscen.maps.store import Workspace
    from odscen.scenario.document.problems import validated

    if (plan is None) == (seeds is None):
        raise InputError("give --plan or --seeds, one of them")
    place = Workspace.open(workspace)
    if plan is not None:
        extend_study(place, study, read_study_plan(plan), beside=plan.parent)
    else:
        given: Any = int(seeds) if seeds and seeds.isdecimal() else seeds
        old = read_study(study).plan.model_dump(mode="json")
        extend_study(place, study, validated(StudyPlan, {**old, "seeds": given}))
    _carry_out(place, study, jobs, executor, scheduler, target, again=False, as_json=as_json)


@app.command()
def status(study: FolderArgument, as_json: JsonOption = False) -> None:
    """Say how far a study is, and why runs failed; also while it runs."""
    from odscen.experiments.studies import study_state

    _show_state(study_state(study), as_json=as_json)


@app.command()
def report(
    study: FolderArgument,
    figure: Annotated[
        list[str] | None,
        typer.Option(help="A figure of runs to be shown; repeatable.", metavar="FIGURE"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File to write. (default: study.html in the study)"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a page: means with confidence intervals by scenario and variant, and failures."""
    from odscen.experiments.studies import PAGE_FILE
    from odscen.experiments.study_page import (
        SHOWN_FIGURES,
        difference_sentences,
        study_groups,
        write_study_page,
    )

    figures = tuple(figure or SHOWN_FIGURES)
    means, differences = study_groups(study, figures)
    file = write_study_page(study, figures, out or study / PAGE_FILE)
    if as_json:
        parts = {"means": means, "differences": differences}
        groups_by_name = {
            name: [group.to_dict() for group in groups] for name, groups in parts.items()
        }
        print_json(
            {"file": str(file), **groups_by_name, "sentences": difference_sentences(study, figures)}
        )
        return
    _show_groups("Means", means, figures)
    if differences:
        _show_groups("Differences from the first variant, by case and seed", differences, figures)
    for sentence in difference_sentences(study, figures):
        log(sentence)
    log(f"Page: {file}")


def _show_groups(title: str, groups: Sequence[StudyGroup], figures: Sequence[str]) -> None:
    rows = [
        (group.scenario, group.variant, group.runs, *(group.words(name) for name in figures))
        for group in groups[:_SHOWN]
    ]
    print_table(title, ("scenario", "variant", "runs", *figures), rows)
    if len(groups) > _SHOWN:
        log(f"and {len(groups) - _SHOWN} more")


def open_executor(place: Workspace, name: str, jobs: int, scheduler: str | None) -> Executor:
    """The executor that the options name."""
    from odscen.experiments.work import LocalExecutor

    if name == "local":
        if scheduler is not None:
            raise InputError("--scheduler is of --executor dask")
        return LocalExecutor(place, jobs)
    if name != "dask":
        raise InputError(f"--executor {name!r} is not local or dask")
    from odscen.experiments.dask_executor import DaskExecutor

    return DaskExecutor(place, scheduler)


def _carry_out(
    place: Workspace,
    folder: Path,
    jobs: int,
    executor: str,
    scheduler: str | None,
    target: str | None,
    *,
    again: bool,
    as_json: bool,
) -> None:
    from odscen.experiments.studies import carry_out_study

    with progress("study") as step:
        ended = carry_out_study(
            folder,
            open_executor(place, executor, jobs, scheduler),
            target=target,
            again=again,
            done=lambda some, count: step(f"{some:,} of {count:,} runs", some / count),
        )
    _show_state(ended.state, as_json=as_json)
    raise typer.Exit(0 if ended.state.counts["completed"] == ended.state.runs else 3)


def _show_state(state: StudyState, *, as_json: bool) -> None:
    from odscen.experiments.studies import TABLE_FILE

    if as_json:
        print_json(state.to_dict() | {"table": str(state.folder / TABLE_FILE)})
        return
    rows: list[tuple[str, object]] = [("runs", state.runs), *state.counts.items()]
    rows.append(("to run", state.runs - state.ended))
    if state.seconds is not None:
        rows.append(("seconds per run", state.seconds))
    print_table("", (), rows)
    for words, count in state.problems[:_SHOWN]:
        log(f"{count:,} x {words}")
    if state.done:
        log(f"Table: {state.folder / TABLE_FILE}")


def _show_grid(grid: Any, *, as_json: bool) -> None:
    counts = {
        "scenarios": len(grid.sources),
        "variants": len(grid.plan.variant_names),
        "cases": max(len(grid.cases), 1),
        "seeds": len(grid.plan.seeds),
        "runs": grid.count,
    }
    if as_json:
        print_json(counts)
        return
    print_table("", (), list(counts.items()))


def dataset(
    plan: Annotated[Path, typer.Argument(help="Plan, JSON or TOML.", metavar="PLAN")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder of the dataset.")] = ...,  # type: ignore[assignment]
    jobs: JobsOption = 1,
    executor: ExecutorOption = "local",
    scheduler: SchedulerOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run many scenarios and write what happened as a dataset: shards by split, and a card.

    The same command after an interruption runs what is missing. Runs that failed or that the
    plan leaves out are counted in the card. Exit code 0: the dataset is complete; 2: bad input.
    """
    from odscen.experiments.dataset_plan import read_dataset_plan
    from odscen.experiments.datasets import CARD_FILE, make_dataset
    from odscen.maps.store import Workspace

    place = Workspace.open(workspace)
    asked = read_dataset_plan(plan)
    with progress("dataset") as step:
        facts = make_dataset(
            place,
            asked,
            out,
            open_executor(place, executor, jobs, scheduler),
            beside=plan.parent,
            done=lambda some, count: step(f"{some:,} of {count:,} runs", some / count),
        )
    splits = facts.splits()
    if as_json:
        print_json(
            {
                "folder": str(out),
                "card": str(out / CARD_FILE),
                "runs": facts.table.height,
                "splits": splits,
                "left_out": dict(facts.left_out),
            }
        )
        return
    print_table("", tuple(splits[0]), [tuple(row.values()) for row in splits])
    for words, count in facts.left_out.items():
        log(f"{count:,} left out: {words}")
    log(f"Card: {out / CARD_FILE}")
