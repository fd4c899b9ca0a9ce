"""A dataset for learners: sampled runs, in shards with a card, read back run by run and in batches.

Run it with ``python examples/make_dataset.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import odscen
from odscen import datasets

MAP = "t_junction_signs"


def make(workspace: odscen.Workspace) -> None:
    plan = datasets.DatasetPlan.model_validate(
        {
            "name": "junctions",
            "licence": "CC0-1.0",
            "formats": ["pyg"],
            "study": {
                "sample": [{"maps": [MAP], "count": 2, "seed": 1, "fill": 0.2}],
                "run": {"until": 20, "step_length": 0.1},
            },
        }
    )
    folder = workspace.root / "junctions"
    facts = datasets.make_dataset(workspace, plan, folder, processes=2)
    print(f"{facts.table.height} runs, {sum(size for size, _ in facts.files.values())} bytes")
    runs = datasets.open_dataset(folder, split="train")
    arrays = runs[0]
    print(f"first run: {len(arrays)} arrays, {arrays['agent_id'].size} road users")
    for batch in datasets.batches(runs, 2, **runs.sizes):
        print(f"batch: {batch['agent_state'].shape}, {batch['lane_valid'].sum()} lanes")


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    make(store)
