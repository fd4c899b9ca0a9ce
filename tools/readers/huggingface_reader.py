"""Reads a dataset's folder with Hugging Face's datasets, whole and streaming; in its environment.

``python huggingface_reader.py FOLDER OUT.json``: poses of all road users by run, and counts as JSON
on stdout. Nothing is fetched.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = os.environ["HF_DATASETS_OFFLINE"] = "1"

import datasets


def main(folder, out):
    with tempfile.TemporaryDirectory() as cache:
        read(folder, out, cache)


def read(folder, out, cache):
    whole = datasets.load_dataset(folder, cache_dir=cache)
    maps = datasets.load_dataset(folder, "maps", cache_dir=cache)
    rows, lanes = {}, []
    for split, runs in whole.items():
        nodes = {one["map_sha256"]: len(one["node"]) for one in maps[split]}
        lanes += [len(one["lane_key"]) for one in maps[split]]
        streamed = datasets.load_dataset(folder, split=split, streaming=True)
        for row, other in zip(runs, streamed, strict=True):
            assert row == other
            assert max(row["agent_node"]) < nodes[row["map_sha256"]]
            rows[row["run"]] = [
                (name, step, state[0], state[1], state[3])
                for name, states, there in zip(
                    row["agent_id"], row["agent_state"], row["agent_valid"], strict=True
                )
                for step, (state, valid) in enumerate(zip(states, there, strict=True))
                if valid
            ]
    Path(out).write_text(json.dumps(rows))
    print(json.dumps({"runs": len(rows), "splits": sorted(whole), "map_lanes": lanes}))


main(*sys.argv[1:])
