"""The reference generator on towns that it has not seen, beside baselines and SUMO itself.

``python -m bench learning [--data DIR] [--seeds 3] [--folds 3] [--json FILE]``. Without ``--data``
it makes snapshots first (6 runs of each map, towns of ``tools.make_maps`` on varied grids among
them). Towns are held out in turn, but for the varied ones, which are there to learn from; versions
of one town go together. For each fold one model is trained with each seed; baselines are measured
with seed 0 alone, as they learn nothing by chance. Hard braking is of vehicles outside junctions on
both sides. Aims: Frechet distance at most a
quarter of random fill's and below binned statistics' on maps with 30 vehicles and more, share
stopped within 10 points of SUMO's, hard braking in the first 2 s at most twice SUMO's.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.common import shared_maps
from odscen.app.learned.evaluation import (
    BINNED,
    FLOOR,
    RANDOM,
    REFERENCE,
    TrafficQuality,
    evaluate_model,
)
from odscen.app.learned.model_files import train_on
from odscen.app.learned.snapshot_data import DataSettings, make_shards, read_shards
from odscen.cli.map_commands import names_for
from odscen.learning.reference.model_training import TrainingSettings
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from tools.make_maps.__main__ import map_text
from tools.make_maps.maps import ON_DEMAND

if TYPE_CHECKING:
    from odscen.learning.traffic_snapshots import Shard

VARIED = "varied"
COLUMNS = ("frechet", "mmd", "jsd_gap", "jsd_speed", "jsd_junction", "jsd_heading", "stopped")
MORE = ("hard_braking", "collided", "off_road", "novelty")


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--data", type=Path)
    options.add_argument("--workspace", type=Path)
    options.add_argument("--seeds", type=int, default=3)
    options.add_argument("--folds", type=int, default=3)
    options.add_argument("--runs", type=int, default=6)
    options.add_argument("--epochs", type=int, default=TrainingSettings().epochs)
    options.add_argument("--first", type=int, default=0, help="seed to begin with")
    options.add_argument("--fold", type=int, help="only this one")
    options.add_argument("--most", type=int, default=12, help="fills of each map")
    options.add_argument("--draws", type=int, default=40, help="of the bootstrap, for intervals")
    options.add_argument("--varied", action="store_true", help="hold out varied towns instead")
    options.add_argument("--least", type=float, default=0.0, help="mean vehicles of a map")
    options.add_argument("--no-run", action="store_true", help="without hard braking")
    options.add_argument("--json", type=Path)
    given = options.parse_args(sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(given.workspace or Path(folder))
        data = given.data or Path(folder) / "shards"
        real = shared_maps()
        towns = sorted(real.glob("carla-*/*.xodr")) if real else []
        if given.workspace is None:
            sources = [*towns, *shipped_maps(), *_varied_towns(Path(folder))]
            for path, name in zip(sources, names_for(sources, None), strict=True):
                workspace.add_map(path, name=name)
        if given.data is None:
            make_shards(workspace, [], data, settings=DataSettings(runs=given.runs))
        _measure(workspace, data, given)


def _varied_towns(folder: Path) -> list[Path]:
    """Write the towns on varied grids."""
    files = []
    for name in ON_DEMAND:
        if name.startswith(VARIED):
            files.append(folder / f"{name}.xodr")
            files[-1].write_text(map_text(name), encoding="utf-8", newline="\n")
    return files


def _large(shards: list[Shard], least: float) -> list[Shard]:
    """Shards of maps with so many vehicles in the mean over snapshots."""
    counts: dict[str, list[int]] = {}
    for one in shards:
        counts.setdefault(one.map_name, []).extend(len(some.node) for some in one.snapshots)
    return [one for one in shards if np.mean(counts[one.map_name]) >= least]


def _measure(workspace: Workspace, data: Path, given: argparse.Namespace) -> None:
    shards = read_shards(data)
    towns = sorted(
        {
            one.town
            for one in shards
            if "town" in one.town.lower() and one.town.startswith(VARIED) == given.varied
        }
    )
    folds = [towns[k :: given.folds] for k in range(given.folds)]
    results: dict[tuple[str, str], list[TrafficQuality]] = {}
    seconds = []
    for number, fold in enumerate(folds):
        if given.fold not in (None, number):
            continue
        kept = [one for one in shards if one.town not in fold]
        held = _large([one for one in shards if one.town in fold], given.least)
        for seed in range(given.first, given.first + given.seeds):
            began = time.process_time()
            settings = TrainingSettings(seed=seed, epochs=given.epochs)
            model = train_on(workspace, kept, settings=settings)
            seconds.append(time.process_time() - began)
            print(f"fold {number} ({', '.join(fold)}), seed {seed}: {seconds[-1]:.0f} CPU s",
                  flush=True)  # fmt: skip
            for one in evaluate_model(
                workspace,
                held,
                kept,
                model=model,
                seed=seed,
                most=given.most,
                draws=given.draws,
                run=not given.no_run,
                baselines=seed == 0,
            ):
                results.setdefault((one.map_name, one.source), []).append(one)
                print(one.map_name, one.source, {
                    name: round(value.value, 3) for name, value in one.values.items()
                }, flush=True)  # fmt: skip
            if given.json is not None:
                rows = [one.to_dict() for some in results.values() for one in some]
                given.json.write_text(json.dumps(rows), encoding="utf-8")
    print(f"training: {np.mean(seconds):.0f} CPU s in the mean, {max(seconds):.0f} at most")
    print(table(results))


def table(results: dict[tuple[str, str], list[TrafficQuality]]) -> str:
    """Means over seeds as a table in Markdown; in brackets least and most of them."""
    heads = ("map", "vehicles", "traffic", *COLUMNS, *MORE)
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    order = {FLOOR: 0, REFERENCE: 1, BINNED: 2, RANDOM: 3}
    for (name, source), some in sorted(results.items(), key=lambda x: (x[0][0], order[x[0][1]])):
        cells = [name, f"{some[0].vehicles:.0f}", source]
        for column in (*COLUMNS, *MORE):
            values = [one.values[column].value for one in some if column in one.values]
            known = [one for one in values if not np.isnan(one)]
            cells.append(_cell(known, share=column in {"stopped", *MORE}) if known else "")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(values: list[float], *, share: bool) -> str:
    form = "{:.1%}" if share else "{:.3f}"
    mean, least, most = (form.format(one) for one in (np.mean(values), min(values), max(values)))
    return mean if least == most else f"{mean} [{least}, {most}]"
