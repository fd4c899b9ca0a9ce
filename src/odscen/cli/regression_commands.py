"""``odscen test`` and ``odscen compare``: is it still as it was, and what is different."""

from __future__ import annotations

import os
import re
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.cli.console import (
    JobsOption,
    JsonOption,
    SeedsOption,
    WorkspaceOption,
    log,
    print_json,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from odscen.experiments.suite import SuiteResult
    from odscen.maps.store import Workspace

HtmlOption = Annotated[
    Path | None, typer.Option("--html", help="Write a page for people.", dir_okay=False)
]


class Annotations(StrEnum):
    """Where findings are shown."""

    GITHUB = "github"
    GITLAB = "gitlab"


def _parse_shard(text: str) -> tuple[int, int]:
    """Read ``2/3``."""
    match = re.fullmatch(r"([1-9]\d{0,3})/([1-9]\d{0,3})", text)
    if match is None or int(match[1]) > int(match[2]):
        raise typer.BadParameter(
            f"{text!r} is no part of a suite; write for example 1/3, 2/3 and 3/3"
        )
    return int(match[1]), int(match[2])


def gate(
    suite: Annotated[Path, typer.Argument(help="Suite, as TOML.", metavar="SUITE.toml")],
    update_baseline: Annotated[
        bool,
        typer.Option(
            "--update-baseline",
            help="Write the baselines of what comes out, but of scenarios that miss expectations.",
        ),
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="With --update-baseline: of those, too.")
    ] = False,
    shard: Annotated[
        Any,
        typer.Option(
            parser=_parse_shard,
            metavar="K/N",
            help="Only the K-th of N parts, for N jobs side by side.",
        ),
    ] = None,
    seeds: SeedsOption = None,
    merge: Annotated[
        list[Path] | None,
        typer.Option(
            help="Run nothing, but judge what other jobs wrote with --results: a file, or a folder "
            "with results.json files at any depth; repeatable.",
            metavar="PATH",
        ),
    ] = None,
    jobs: JobsOption = 1,
    out: Annotated[
        Path | None, typer.Option(help="Keep the runs in this folder; they are deleted without.")
    ] = None,
    junit: Annotated[
        Path | None, typer.Option(help="Write JUnit XML for CI.", dir_okay=False)
    ] = None,
    html: HtmlOption = None,
    summary: Annotated[
        Path | None,
        typer.Option(
            help="Write a summary in Markdown; added to the end of $GITHUB_STEP_SUMMARY.",
            dir_okay=False,
        ),
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(help="Write the figures of all runs, for --merge.", dir_okay=False),
    ] = None,
    annotations: Annotated[
        Annotations | None,
        typer.Option(
            help="Show findings at the files of a change: github prints workflow commands, gitlab "
            "writes gl-code-quality-report.json.",
        ),
    ] = None,
    sarif: Annotated[
        Path | None, typer.Option(help="Write findings as SARIF 2.1.0.", dir_okay=False)
    ] = None,
    badge: Annotated[
        Path | None, typer.Option(help="Write a badge of the result, as SVG.", dir_okay=False)
    ] = None,
    history: Annotated[
        Path | None,
        typer.Option(
            help="Add the figures of this run to a history, for `odscen history`.",
            dir_okay=False,
        ),
    ] = None,
    commit: Annotated[
        str | None,
        typer.Option(
            help="With --history: the commit. [default: that of the CI job, else of git]",
            show_default=False,
        ),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a suite of scenarios, each with several seeds, against expectations and baselines.

    Exit code 0: all pass; 1: something differs or falls short; 2: bad input; 3: a run failed. The
    largest that a scenario has is that of the suite.
    """
    from odscen.experiments.gates import Update, run_suite
    from odscen.experiments.suite import read_suite
    from odscen.experiments.suite_runs import read_parts
    from odscen.experiments.suite_words import to_dict
    from odscen.maps.store import Workspace

    read, store = read_suite(suite), Workspace.open(workspace)
    if force and not update_baseline:
        raise typer.BadParameter("it goes with --update-baseline", param_hint="--force")
    if commit is not None and history is None:
        raise typer.BadParameter("it goes with --history", param_hint="--commit")
    # Asked before anything runs, so that a run of an hour does not end with an error.
    known = None if history is None else _find_commit(commit, suite)
    if seeds is not None:
        read = read.with_seeds(seeds)
    if shard is not None:
        read = read.shard(*shard)
    with progress("testing") as step:
        result = run_suite(
            store,
            read,
            processes=jobs,
            update=Update(update_baseline, force),
            out=out,
            progress=step,
            parts=read_parts(merge) if merge else None,
        )
    _write_results(result, store, junit=junit, html=html, summary=summary, results=results)
    _write_findings(result, sarif=sarif, badge=badge)
    if history is not None and known is not None:
        from odscen.experiments.history import append_history, history_line

        append_history(history, history_line(result, commit=known[0], date=known[1]))
    if as_json:
        print_json(to_dict(result))
    _show_result(result, as_json=as_json)
    if annotations is not None:
        _print_annotations(result, annotations, as_json=as_json)
    raise typer.Exit(result.exit_code)


def _find_commit(commit: str | None, suite: Path) -> tuple[str, str]:
    from odscen.experiments.history import current_commit

    return (commit, "") if commit is not None else current_commit(suite.resolve().parent)


def _write_findings(result: SuiteResult, *, sarif: Path | None, badge: Path | None) -> None:
    from odscen.base.text_files import write_text
    from odscen.experiments.annotations import sarif as sarif_log
    from odscen.experiments.badge import suite_badge

    if sarif is not None:
        write_text(sarif, sarif_log(result))
    if badge is not None:
        write_text(badge, suite_badge(result))


def _write_results(
    result: SuiteResult,
    workspace: Workspace,
    *,
    junit: Path | None,
    html: Path | None,
    summary: Path | None,
    results: Path | None,
) -> None:
    from odscen.base.text_files import write_text
    from odscen.experiments.suite_page import suite_page
    from odscen.experiments.suite_runs import results_json
    from odscen.experiments.suite_words import junit_xml, suite_summary

    if junit is not None:
        write_text(junit, junit_xml(result))
    if results is not None:
        write_text(results, results_json(result, beside=results.parent))
    if html is not None:
        write_text(html, suite_page(result, workspace=workspace, beside=html.parent))
    if summary is not None:
        before = ""
        # GitHub shows what all commands of a step have added to this file.
        if str(summary) == os.environ.get("GITHUB_STEP_SUMMARY") and summary.is_file():
            before = summary.read_text(encoding="utf-8", errors="replace")
        write_text(summary, before + suite_summary(result))


def _show_result(result: SuiteResult, *, as_json: bool) -> None:
    from odscen.experiments.suite_words import lines

    if not as_json:
        rows = [
            (case.name, case.label, len(case.runs), f"{case.wall_seconds:.1f} s")
            for case in result.cases
        ]
        print_table(result.suite.name, ("scenario", "verdict", "runs", "computed in"), rows)
    for case in result.worst_first:
        for line in lines(case):
            log(f"{case.name}: {line}")


def _print_annotations(result: SuiteResult, form: Annotations, *, as_json: bool) -> None:
    from odscen.base.text_files import write_text
    from odscen.experiments.annotations import (
        CODE_QUALITY_FILE,
        code_quality,
        github_annotations,
    )

    if form is Annotations.GITLAB:
        write_text(Path(CODE_QUALITY_FILE), code_quality(result))
        return
    # GitHub reads both; with --json stdout is one object.
    typer.echo(github_annotations(result), nl=False, err=as_json)


def show_history(
    file: Annotated[Path, typer.Argument(help="History, written by `odscen test --history`.")],
    html: HtmlOption = None,
    suite: Annotated[
        str | None, typer.Option(help="Only runs of the suite of this name.", metavar="NAME")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show since when which figure of a suite has changed, over commits."""
    from odscen.base.errors import NotFoundError
    from odscen.base.text_files import write_text
    from odscen.experiments.history import find_trends, history_page, read_history, told_lines

    history = read_history(file)
    if suite is not None:
        names = sorted({line.suite for line in history})
        history = tuple(line for line in history if line.suite == suite)
        if not history:
            raise NotFoundError("suite", suite, names)
    trends = find_trends(history)
    if html is not None:
        write_text(html, history_page(history))
    if as_json:
        commits = [line.commit for line in history]
        rows = [
            {
                "scenario": trend.scenario,
                "figure": trend.figure,
                "levels": [
                    {
                        "first": commits[level.first],
                        "last": commits[level.last],
                        "value": level.value,
                    }
                    for level in trend.levels
                ],
                "other_seeds": trend.other_seeds,
                "better": trend.better,
            }
            for trend in trends
        ]
        print_json({"runs": commits, "figures": rows})
        return
    for text in told_lines(history, trends):
        typer.echo(text)


def compare(
    run_a: Annotated[
        Path, typer.Argument(help="Run, or a folder of runs (seeds of one scenario).")
    ],
    run_b: Annotated[Path, typer.Argument(help="What to hold against it.")],
    html: HtmlOption = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Put two runs, or several seeds of two, side by side: differences, with 95 % intervals."""
    from odscen.base.text_files import write_text
    from odscen.experiments.comparison_page import comparison_page
    from odscen.experiments.comparisons import compare as compare_sides
    from odscen.maps.store import Workspace

    # The page draws the map, if the workspace has it.
    store = None if html is None else Workspace.open(workspace)
    result = compare_sides(run_a, run_b, workspace=store)
    if html is not None:
        write_text(html, comparison_page(result))
    if as_json:
        print_json(result.to_dict())
        return
    rows = []
    for row in result.rows:
        if row.key.kind == "run":
            figure, unit, a, b, difference, interval, says = row.cells
            name = f"{figure}, {unit}" if unit else figure
            rows.append((name, a, b, difference.split(" ")[0], interval or "-", says))
    print_table("", ("figure", "A", "B", "B - A", "95 % interval", ""), rows)
    for row in result.places:
        log(f"changed most: {row.words}")
    for note in result.notes:
        log(note)
