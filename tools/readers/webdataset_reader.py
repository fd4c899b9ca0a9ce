"""Reads the shards of a dataset with webdataset, through torch's DataLoader; in its environment.

``python webdataset_reader.py FOLDER OUT.json``: poses of all road users by run, and counts as JSON
on stdout.
"""

import json
import sys
from pathlib import Path

import torch
import webdataset


def main(folder, out):
    rows, splits, lanes = {}, [], []
    for where in sorted(Path(folder).glob("*/webdataset")):
        shards = [str(one) for one in sorted(where.glob("shard-*.tar"))]
        samples = webdataset.WebDataset(shards, shardshuffle=False).decode().to_tuple("json", "npz")
        for said, arrays in torch.utils.data.DataLoader(samples, batch_size=None, num_workers=1):
            of_map = webdataset.autodecode.npz_loads((where / said["map_file"]).read_bytes())
            assert arrays["agent_node"].max() < len(of_map["node"])
            lanes.append(len(of_map["lane_key"]))
            states, valid = (torch.as_tensor(arrays[f"agent_{one}"]) for one in ("state", "valid"))
            rows[said["run"]] = [
                (str(arrays["agent_id"][row]), step, *states[row, step][[0, 1, 3]].tolist())
                for row, step in valid.nonzero().tolist()
            ]
        splits.append(where.parent.name)
    Path(out).write_text(json.dumps(rows))
    print(json.dumps({"runs": len(rows), "splits": splits, "map_lanes": sorted(set(lanes))}))


main(*sys.argv[1:])
