"""``odscen assets``: models and weather."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.simulators.assets import Blueprint

app = typer.Typer(help="Models of road users, and weather presets.", no_args_is_help=True)

SAME_SIZE = 0.001
"""Metres by which two measurements of a model may differ."""


@app.callback()
def _assets_group() -> None:
    pass


@app.command("list")
def list_(
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the models with their size, and the weather presets."""
    from odscen.maps.store import Workspace

    assets = Workspace.open(workspace).assets()
    models = list(assets.blueprints.values())
    presets = list(assets.presets.values())
    if as_json:
        rows = [{**asdict(model), "body": model.body._asdict()} for model in models]
        print_json({"blueprints": rows, "weather": [asdict(preset) for preset in presets]})
        return
    print_table(
        "Models",
        ("model", "category", "length m", "width m", "height m"),
        [(model.id, model.category.value, *model.body) for model in models],
    )
    print_table(
        "Weather",
        ("preset", "kind", "time of day", "source"),
        [(preset.name, preset.kind, preset.time_of_day, preset.source) for preset in presets],
    )


@app.command()
def update(
    carla: Annotated[
        str, typer.Option(help="Where the CARLA server is.", metavar="HOST:PORT")
    ] = "127.0.0.1:2000",
    timeout: Annotated[
        float, typer.Option(min=0.5, help="Seconds that the server may take to answer.")
    ] = 10.0,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Take over the models of a CARLA server and their sizes, for this workspace.

    Weather presets belong to the Python package carla, not to a server: they stay.
    """
    import json

    from odscen.base.text_files import write_text
    from odscen.carla.server.carla_server import Server
    from odscen.carla.server.client import Address
    from odscen.carla.server.server_models import SOURCE, ServerModels
    from odscen.maps.store import Workspace
    from odscen.simulators.assets import BLUEPRINTS_FILE, blueprint_row

    store = Workspace.open(workspace)
    old = store.assets()
    address = Address.parse(carla, timeout=timeout)
    with Server(address) as server:
        models = ServerModels(server, old).models()
    rows = [json.dumps(blueprint_row(model)) for model in models]
    sources = json.dumps({SOURCE: "measured on a CARLA server, one of each model"})
    text = f'{{"sources": {sources},\n"blueprints": [\n' + ",\n".join(rows) + "\n]}\n"
    path = write_text(store.assets_folder / BLUEPRINTS_FILE, text)
    changes = _compare_models(old.blueprints, {model.id: model for model in models})
    if as_json:
        print_json({"file": str(path), "models": len(models), **changes})
        return
    log(f"{len(models)} models of {address} ({path})")
    for what, names in changes.items():
        if names:
            log(f"{what}: {', '.join(names)}")


def _compare_models(
    old: Mapping[str, Blueprint], new: Mapping[str, Blueprint]
) -> dict[str, list[str]]:
    both = sorted(old.keys() & new.keys())
    resized = [
        name
        for name in both
        if any(abs(a - b) > SAME_SIZE for a, b in zip(old[name].body, new[name].body, strict=True))
    ]
    return {
        "added": sorted(new.keys() - old.keys()),
        "gone": sorted(old.keys() - new.keys()),
        "resized": resized,
    }
