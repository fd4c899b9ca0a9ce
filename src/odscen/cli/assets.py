"""``odscen assets``: models and weather."""

from __future__ import annotations

from dataclasses import asdict

import typer

from odscen.cli.output import JsonOption, WorkspaceOption, print_json, print_table

app = typer.Typer(help="Models of road users, and weather presets.", no_args_is_help=True)


@app.callback()
def _assets() -> None:
    pass


@app.command("list")
def list_(
    workspace: WorkspaceOption = None,  # noqa: ARG001 - the shipped catalogue is the same for all
    as_json: JsonOption = False,
) -> None:
    """List the models with their size, and the weather presets."""
    from odscen.catalog.assets import shipped_assets

    assets = shipped_assets()
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
