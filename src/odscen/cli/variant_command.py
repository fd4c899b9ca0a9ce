"""``odscen variant``: a scenario made of another by a few edits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json


def variant(
    parent: Annotated[Path, typer.Argument(help="Scenario to begin with.", metavar="PARENT")],
    edits: Annotated[
        list[Path] | None,
        typer.Argument(help="JSON files of edits: a list of them, or one.", metavar="[EDITS]..."),
    ] = None,
    out: Annotated[Path, typer.Option("-o", "--out", help="File to write.")] = ...,  # type: ignore[assignment]
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="An edit by its kind, after those of files: KIND.FIELD=VALUE, for example "
            "set_simulation.duration=900; the value as JSON or text. Repeatable; fields of one "
            "kind one after another are one edit.",
            metavar="KIND.FIELD=VALUE",
        ),
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a scenario of another one by a few edits; it knows its parent and its edits.

    It is a scenario as any other, to be run and tested. `odscen compare` of runs of both names the
    edits. The kinds of edits are the functions of odscen.scenario.edits.
    """
    from odscen.app import scenarios, variants
    from odscen.workspace.store import Workspace

    asked = [edit for path in edits or () for edit in variants.read_edits(path)]
    asked += variants.edits_of_settings(settings or ())
    made = variants.make_variant(
        Workspace.open(workspace), parent, asked, name=scenarios.scenario_name(out)
    )
    path = scenarios.write_scenario(made, out)
    for edit in asked:
        log(edit.words)
    log(f"Wrote {path}")
    if as_json:
        words = [edit.words for edit in asked]
        print_json({"file": str(path), "parent": str(parent), "edits": words})
