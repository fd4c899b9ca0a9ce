"""``odscen maps diff`` and ``odscen diff``: what changed, in words."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.changes.map_change import MapChange
    from odscen.changes.scenario_differences import ScenarioChange


def diff_maps(
    before: Annotated[str, typer.Argument(metavar="BEFORE", help="Name of a map, or a .xodr.")],
    after: Annotated[str, typer.Argument(metavar="AFTER", help="Name of a map, or a .xodr.")],
    svg: Annotated[
        Path | None,
        typer.Option("--svg", help="Draw the map after, with what differs.", metavar="FILE"),
    ] = None,
    exit_code: Annotated[
        bool, typer.Option("--exit-code", help="Exit with 1 if anything differs.")
    ] = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say what differs between two maps: roads, lanes, widths, limits, connections, signals.

    What counts is what the files mean: the order of elements, or a profile written in other pieces,
    is no difference.
    """
    from odscen.app.differences import compare_maps
    from odscen.base.text_files import write_text
    from odscen.maps.store import Workspace

    comparison = compare_maps(Workspace.open(workspace), before, after)
    if svg is not None:
        write_text(svg, comparison.to_svg())
        log(f"Wrote {svg}")
    if as_json:
        print_json(comparison.to_dict())
    else:
        _print_differences(comparison.changes)
    _exit_with_code(comparison.changes, exit_code=exit_code)


def diff_scenarios(
    before: Annotated[Path, typer.Argument(metavar="BEFORE")],
    after: Annotated[Path, typer.Argument(metavar="AFTER")],
    exit_code: Annotated[
        bool, typer.Option("--exit-code", help="Exit with 1 if anything differs.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Say what differs between two scenarios, field by field."""
    from odscen.app.differences import compare_scenarios

    comparison = compare_scenarios(before, after)
    if as_json:
        print_json(
            {
                "before": str(before),
                "after": str(after),
                "changes": [difference.to_dict() for difference in comparison],
            }
        )
    else:
        _print_differences(comparison)
    _exit_with_code(comparison, exit_code=exit_code)


def _print_differences(found: Sequence[MapChange] | Sequence[ScenarioChange]) -> None:
    for difference in found:
        typer.echo(difference.words)
    log(f"{len(found)} differences" if found else "No difference")


def _exit_with_code(found: Sequence[object], *, exit_code: bool) -> None:
    if exit_code and found:
        raise typer.Exit(1)
