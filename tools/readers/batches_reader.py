"""Reads a dataset by odscen.datasets in torch's DataLoader and in JAX; in their environment.

``python batches_reader.py FOLDER OUT.json``: poses of all road users by run, from JAX's arrays, and
counts as JSON on stdout. A function that JAX has compiled runs on all batches and is compiled once.
"""

import functools
import json
import sys
from pathlib import Path

import jax
import numpy as np
import torch

from odscen.learning.run_datasets import batches, open_dataset, padded_batch


def main(folder, out):
    facts = json.loads((Path(folder) / "dataset.json").read_text())
    compiled, rows, lanes = [], {}, []

    @jax.jit
    def metres(batch):
        compiled.append(1)
        state, valid = batch["agent_state"], batch["agent_valid"]
        return (state[..., 4] * valid).sum() * 0.1

    driven, by_torch = 0.0, 0.0
    splits = [one["split"] for one in facts["splits"] if one["runs"]]
    of_splits = [open_dataset(folder, split=split).sizes for split in splits]
    sizes = {name: max(one[name] for one in of_splits) for name in of_splits[0]}
    for split in splits:
        runs = open_dataset(folder, split=split)
        names = [json.loads(str(one["about"]))["run"] for one in runs]
        loader = torch.utils.data.DataLoader(
            runs,
            batch_size=2,
            num_workers=2,
            collate_fn=functools.partial(padded_batch, **sizes),
            multiprocessing_context="spawn",  # JAX has threads, which a fork would lose
        )
        number = 0
        ids = [one["agent_id"].tolist() for one in runs]
        for batch, other in zip(batches(runs, 2, **sizes), loader, strict=True):
            tensors = torch.utils.data.default_convert(other)
            assert all(np.array_equal(batch[key], one.numpy()) for key, one in tensors.items())
            state, valid = tensors["agent_state"], tensors["agent_valid"]
            by_torch += float((state[..., 4] * valid).sum()) * 0.1
            tree = {key: one for key, one in batch.items() if key != "origin"}
            if len(batch["origin"]) == 2:
                driven += float(metres(tree))
            else:
                driven += float((tree["agent_state"][..., 4] * tree["agent_valid"]).sum()) * 0.1
            arrays = jax.tree.map(np.asarray, jax.device_put(tree))
            lanes += arrays["lane_valid"].sum(axis=1).tolist()
            for row, origin in enumerate(batch["origin"]):
                state = arrays["agent_state"][row].astype(np.float64)
                state[..., :2] += origin
                rows[names[number]] = [
                    (ids[number][agent], int(step), *state[agent, step][[0, 1, 3]].tolist())
                    for agent, step in zip(*arrays["agent_valid"][row].nonzero(), strict=True)
                ]
                number += 1
    assert len(compiled) == 1
    assert abs(driven - by_torch) < 1e-3 * by_torch
    Path(out).write_text(json.dumps(rows))
    print(json.dumps({"runs": len(rows), "splits": splits, "map_lanes": sorted(set(lanes))}))


if __name__ == "__main__":
    main(*sys.argv[1:])
