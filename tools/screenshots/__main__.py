"""Writes docs/images/page-*.png: what the page shows, light and dark, the same each time.

``python -m tools.screenshots [--to FOLDER] [SCENE ...]``, by default all scenes. The pictures of
each colour scheme are taken in a workspace of their own, so that neither sees what the other did.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import expect

from odscen.maps.store import Workspace
from tools import page as tool
from tools.screenshots import editor_scenes, guide_scenes, run_scenes, scenarios, task_scenes
from tools.screenshots.camera import Scene, Studio

SCENES: dict[str, Scene] = {
    one.__name__: one
    for one in (
        editor_scenes.catalogue,
        editor_scenes.placing,
        editor_scenes.map_tools,
        editor_scenes.planned_time,
        editor_scenes.language,
        editor_scenes.narrow,
        task_scenes.demand,
        task_scenes.measures,
        task_scenes.rules,
        task_scenes.signals,
        task_scenes.signal_parts,
        run_scenes.results,
        run_scenes.time_of_a_run,
        run_scenes.interrupted,
        guide_scenes.expert,
        guide_scenes.engineer,
        editor_scenes.sweeps,
        editor_scenes.studies,
        editor_scenes.exchange,
    )
}
"""In the order in which they are taken: the last one adds a map."""
PATIENCE = 60_000
"""Milliseconds that a view may take to come about on a busy machine."""


def main() -> None:
    """Take the pictures that are asked for."""
    asked = argparse.ArgumentParser(prog="python -m tools.screenshots", description=__doc__)
    asked.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(SCENES)}")
    asked.add_argument("--to", type=Path, default=tool.ROOT / "docs/images", metavar="FOLDER")
    asked.add_argument("--scheme", choices=("light", "dark"), help="one of both")
    options = asked.parse_args()
    if unknown := [one for one in options.scenes if one not in SCENES]:
        asked.error(f"no scene is called {unknown[0]!r}; there are {', '.join(SCENES)}")
    options.to.mkdir(parents=True, exist_ok=True)
    expect.set_options(timeout=PATIENCE)
    with tempfile.TemporaryDirectory() as name:
        prepared = Path(name, "prepared")
        scenarios.prepare(Workspace.open(prepared))
        for scheme in [options.scheme] if options.scheme else ["light", "dark"]:
            own = Path(name, scheme)
            shutil.copytree(prepared, own)
            with tool.served(own) as server, tool.launched() as browser:
                studio = Studio(browser, server.url, scheme, options.to)
                for scene in options.scenes or SCENES:
                    SCENES[scene](studio)


if __name__ == "__main__":
    main()
