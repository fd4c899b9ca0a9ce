"""Makes a HeteroData of an .npz file and validates it with PyTorch Geometric; in its environment.

``python pyg_reader.py FILE.npz OUT.json``: poses as the tensors have them, and counts as JSON.
"""

import json
import sys
from pathlib import Path

from odscen.learning.hetero_data import hetero_data, read_arrays


def main(file, out):
    arrays = read_arrays(Path(file))
    data = hetero_data(arrays)
    assert data.validate(raise_on_error=True)
    state = data["agent"].state.double()
    state[..., :2] += data.origin
    rows = []
    for row, name in enumerate(arrays["agent_id"].tolist()):
        for step in data["agent"].valid[row].nonzero().flatten().tolist():
            x, y, _z, hdg, _speed = state[row, step].tolist()
            rows.append((name, step, x, y, hdg))
    counts = {
        "tracks": data["agent"].num_nodes,
        "lanes": data["lane"].num_nodes,
        "nodes": data["node"].num_nodes,
        "lights": data["light"].num_nodes,
        "edges": {"-".join(kind): data[kind].num_edges for kind in data.edge_types},
        "valid": True,
    }
    Path(out).write_text(json.dumps(rows))
    print(json.dumps(counts))


main(*sys.argv[1:])
