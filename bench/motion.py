"""Count by kind and cause what is left of implausible motion in runs of every sort.

``python -m bench motion [--scenarios 40] [--weekday 1800] [--step 0.5] [--keep FOLDER]``: sampled
scenarios on real and shipped maps, those of the shipped suites, every template, and so many seconds
of a weekday of two towns from 7:00 on. Aim: nothing is left, and what is has its cause.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from bench.common import shared_maps
from bench.kills import morning
from odscen.app.generation import generate
from odscen.app.running.batches import run_many
from odscen.app.scenarios import write_scenario
from odscen.app.template_scenarios import template_scenario, templates
from odscen.base.errors import OdscenError
from odscen.cli.map_commands import names_for
from odscen.figures.measures.motion import count_by_kind
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.sampling.generation_settings import GenerationSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

SUITES = Path(__file__).parents[1] / "suites" / "scenarios"
LONGEST = 600.0


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--scenarios", type=int, default=40)
    parser.add_argument("--weekday", type=float, default=1800.0, metavar="SECONDS")
    parser.add_argument("--step", type=float)
    parser.add_argument("--keep", type=Path, metavar="FOLDER")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(asked.keep or folder))
        real = shared_maps()
        sources = [*(sorted(real.glob("carla-*/*.xodr")) if real else []), *shipped_maps()]
        names = [
            workspace.add_map(path, name=name).name
            for path, name in zip(sources, names_for(sources, None), strict=True)
        ]
        groups = {
            "sampled": sample_scenarios(workspace, names, asked.scenarios),
            "suites": sorted(SUITES.glob("*.json")),
            "templates": place_templates(workspace, names),
        }
        for group, paths in groups.items():
            report(group, run_scenarios(workspace, paths, LONGEST, asked.step))
        for town in ("town_5x5", "carla-2020-Town07"):
            if asked.weekday > 0 and town in names:
                path = morning(workspace, town, asked.weekday / 3600.0, 200_000.0)
                found = run_scenarios(workspace, [path], asked.weekday, asked.step)
                report(f"weekday of {town}", found)


def sample_scenarios(workspace: Workspace, names: Sequence[str], count: int) -> list[Path]:
    """Sample scenarios, equally many on each map."""
    paths: list[Path] = []
    for index, name in enumerate(names):
        number = count // len(names) + (index < count % len(names))
        if number:
            settings = GenerationSettings(map_name=name, count=number, seed=1000 * index)
            paths += generate(workspace, settings=settings)
    return paths


def place_templates(workspace: Workspace, names: Sequence[str]) -> list[Path]:
    """Place each template on the first shipped map that has room for it."""
    paths: list[Path] = []
    for template in templates():
        for name in reversed(names):
            with suppress(OdscenError):
                scenario = template_scenario(workspace, template.name, name)
                path = workspace.scenarios / f"{template.name}-{name}.scenario.json"
                paths.append(write_scenario(scenario, path))
                break
    return paths


def run_scenarios(
    workspace: Workspace, paths: Sequence[Path], until: float, step: float | None
) -> tuple[int, pl.DataFrame]:
    """Run them; how many road users there were, and all findings with the name of the run."""
    settings = RunSettings(until=until, step_length=step)
    runs = run_many(workspace, paths, settings=settings, processes=os.cpu_count() or 1)
    found = [run.motion().with_columns(run=pl.lit(run.folder.name)) for run in runs]
    return sum(len(run.actors()) for run in runs), pl.concat(found)


def report(group: str, result: tuple[int, pl.DataFrame]) -> None:
    users, found = result
    print(f"{group}: {users} road users, {len(found)} findings", flush=True)
    with pl.Config(tbl_rows=-1, tbl_hide_dataframe_shape=True, tbl_hide_column_data_types=True):
        print(count_by_kind(found), flush=True)


if __name__ == "__main__":
    main()
