"""``odscen demo``: the main job from end to end."""

from __future__ import annotations

from typing import Annotated

import typer

from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, progress
from odscen.cli.run_commands import show_results

DEMO_MAP = "town_5x5"
DEMO_FILL = 0.3


def demo(
    seed: Annotated[int, typer.Option(min=0, help="Seed of the scenario.")] = 1,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Build the maps that ship, sample a scenario, run it, and name the report to open."""
    from odscen.app import generation
    from odscen.app.running import runs
    from odscen.maps.shipped import shipped_maps
    from odscen.maps.store import Workspace
    from odscen.scenario.sampling.generation_settings import GenerationSettings

    store = Workspace.open(workspace)
    for path in shipped_maps():
        with progress(path.stem) as step:
            entry = store.add_map(path, progress=step)
        log(f"{entry.name}: {entry.info['graph']['nodes']:,} nodes ({entry.path('preview')})")
    with progress("generating") as step:
        settings = GenerationSettings(map_name=DEMO_MAP, seed=seed, fill=DEMO_FILL, roi_segments=60)
        paths = generation.generate(store, settings=settings, progress=step)
    log(f"Scenario: {paths[0]}")
    result = runs.run(store, paths[0])
    if as_json:
        print_json(result.to_dict())
    else:
        show_results([result], as_json=False, several=False)
    raise typer.Exit(result.exit_code)
