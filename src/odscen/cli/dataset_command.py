"""``odscen dataset``: recordings of many runs for learners, divided by towns, with a card."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from odscen.cli.console import (
    JobsOption,
    JsonOption,
    WorkspaceOption,
    log,
    print_json,
    print_table,
    progress,
)
from odscen.cli.study_commands import ExecutorOption, SchedulerOption, open_executor


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
    from odscen.app.datasets.dataset_plan import read_dataset_plan
    from odscen.app.datasets.dataset_runs import CARD_FILE, make_dataset
    from odscen.workspace.store import Workspace

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
