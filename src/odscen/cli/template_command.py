"""``odscen new``: a scenario from a template."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from odscen.base.errors import InputError
from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.templates.scene_template import SceneTemplate, TemplateParameter


class NewCommand(TyperCommand):
    """Takes ``--template`` without a name, which typer has no words for."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Give the option an empty name if what follows it is another option, or nothing."""
        full: list[str] = []
        for word, after in zip_longest(args, args[1:]):
            full.append(word)
            if word == "--template" and (after is None or after.startswith("-")):
                full.append("")
        return super().parse_args(ctx, full)


def new(
    template: Annotated[
        str, typer.Option(help="Template to place; without a name, all of them are listed.")
    ] = "",
    map_name: Annotated[str | None, typer.Option("--map", help="Map to place it on.")] = None,
    values: Annotated[
        list[str] | None,
        typer.Option("--set", help="A number of the template.", metavar="NAME=NUMBER"),
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the scenario. (default: TEMPLATE-MAP)")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write to. (default: the workspace's scenarios)")
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make a scenario from a template, on any map that has room for it."""
    if not template:
        _list_templates(as_json=as_json)
        return
    from odscen.app.template_scenarios import write_template
    from odscen.maps.store import Workspace
    from odscen.scenario.templates.template_registry import find_template

    find_template(template)
    if map_name is None:
        raise InputError("name the map to place it on with --map")
    numbers = _parse_numbers(values or ())
    store = Workspace.open(workspace)
    file = write_template(store, template, map_name, values=numbers, name=name, out=out)
    log(f"Wrote {file}")
    if as_json:
        print_json({"file": str(file), "template": template, "map": map_name})


def _list_templates(*, as_json: bool) -> None:
    from odscen.scenario.templates.template_registry import TEMPLATES

    for template in TEMPLATES.values():
        log(f"{template.name}: {template.summary} Needs {template.needs}.")
        for number in template.parameters:
            log(f"    {_describe_number(number)}")
    if as_json:
        print_json({"templates": [_template_fields(template) for template in TEMPLATES.values()]})


def _describe_number(number: TemplateParameter) -> str:
    usual = "" if number.default is None else f" = {number.default:.4g} {number.unit}"
    return f"{number.name}{usual}: {number.meaning}"


def _template_fields(scene_template: SceneTemplate) -> dict[str, Any]:
    return {
        "name": scene_template.name,
        "title": scene_template.title,
        "summary": scene_template.summary,
        "source": scene_template.source,
        "needs": scene_template.needs,
        "parameters": [number._asdict() for number in scene_template.parameters],
    }


def _parse_numbers(given: Sequence[str]) -> dict[str, float]:
    """Read ``NAME=NUMBER``.

    Raises
    ------
    InputError
        If one is not written so.
    """
    numbers = {}
    for text in given:
        name, equals, number = text.partition("=")
        try:
            numbers[name.strip()] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise InputError(f"--set wants NAME=NUMBER, such as ego_speed=8, not {text!r}")
    return numbers
