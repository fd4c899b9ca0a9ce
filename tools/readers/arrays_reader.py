"""Makes a HeteroData of a scenario's arrays, validates it, and goes back; in PyG's environment.

``python arrays_reader.py FILE.npz OUT.npz``: the arrays as they come back, and counts as JSON.
"""

import json
import sys
from pathlib import Path

import numpy as np

from odscen.learning.hetero_data import arrays_of, hetero_data, read_arrays


def main(file, out):
    data = hetero_data(read_arrays(Path(file)))
    assert data.validate(raise_on_error=True)
    counts = {kind: data[kind].num_nodes for kind in data.node_types}
    counts["edges"] = {"-".join(kind): data[kind].num_edges for kind in data.edge_types}
    np.savez(out, allow_pickle=False, **arrays_of(data))
    print(json.dumps(counts | {"valid": True}))


main(*sys.argv[1:])
