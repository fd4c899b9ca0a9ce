"""``odscen generate``, ``check`` and ``export``: scenarios before they run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from odscen.app.export import EXPORTERS
from odscen.cli.output import JsonOption, WorkspaceOption, log, print_json, progress

ScenarioArgument = Annotated[
    Path, typer.Argument(help="Scenario, as JSON or GraphML.", metavar="SCENARIO")
]


def _format(text: str) -> str:
    if text not in EXPORTERS:
        msg = f"{text!r} is not one of {', '.join(EXPORTERS)}"
        raise typer.BadParameter(msg)
    return text


def generate(
    map_name: Annotated[
        str | None, typer.Option("--map", help="Map to use. [default: drawn from the catalogue]")
    ] = None,
    count: Annotated[int, typer.Option(min=1, max=100_000, help="How many scenarios.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the first; the others count on.")] = 0,
    fill: Annotated[
        float | None,
        typer.Option(min=0, max=1, help="Share of the largest number of actors that fit."),
    ] = None,
    roi_segments: Annotated[
        int | None, typer.Option(min=1, help="Size of the region of interest in segments.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Sampling configuration, TOML or JSON.", dir_okay=False)
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write to. [default: the workspace's scenarios]")
    ] = None,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Sample scenarios on a map: region, weather, actors, goals. The same seed, the same bytes."""
    from odscen.app import scenarios
    from odscen.catalog.store import Workspace
    from odscen.scenario.generation_settings import GenerationSettings

    settings = GenerationSettings(
        map_name=map_name,
        count=count,
        seed=seed,
        fill=fill,
        roi_segments=roi_segments,
        config=scenarios.read_config(config),
    )
    with progress("generating") as step:
        paths = scenarios.generate(
            Workspace.open(workspace), settings=settings, out=out, progress=step
        )
    rows = [
        {"file": str(path), "name": scenario.name, "map": scenario.map.name, "seed": scenario.seed}
        | {"segments": len(scenario.roi), "actors": len(scenario.actors)}
        for path, scenario in ((path, scenarios.read_scenario(path)) for path in paths)
    ]
    for row in rows:
        log(f"{row['file']}: {row['actors']} actors on {row['segments']} segments of {row['map']}")
    if as_json:
        print_json({"scenarios": rows})


def check(
    scenario: ScenarioArgument,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check a scenario: everything that is wrong with it, where and why.

    Exit code 0 without errors (warnings are allowed), 2 with errors.
    """
    from odscen.app.scenarios import check_scenario, read_scenario
    from odscen.catalog.store import Workspace

    problems = check_scenario(Workspace.open(workspace), read_scenario(scenario))
    errors = sum(problem.severity == "error" for problem in problems)
    for problem in problems:
        log(f"{problem.severity}: {problem.where}: {problem.message}")
    log(f"{scenario}: {errors} errors, {len(problems) - errors} warnings")
    if as_json:
        print_json(
            {
                "file": str(scenario),
                "valid": errors == 0,
                "errors": errors,
                "warnings": len(problems) - errors,
                "problems": [asdict(problem) for problem in problems],
            }
        )
    raise typer.Exit(2 if errors else 0)


def export(
    scenario: ScenarioArgument,
    to: Annotated[
        str,
        typer.Option(
            parser=_format,
            metavar="|".join(EXPORTERS),
            help="; ".join(f"{one.name}: {one.label}" for one in EXPORTERS.values()) + ".",
        ),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder to write to.", metavar="DIR")],
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a scenario in another format."""
    from odscen.app.export import export as write
    from odscen.catalog.store import Workspace

    files = write(Workspace.open(workspace), scenario, out, to=to)
    for file in files:
        log(f"Wrote {file}")
    if as_json:
        print_json({"files": [str(file) for file in files]})
