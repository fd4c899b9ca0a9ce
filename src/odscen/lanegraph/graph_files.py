"""Graph files: npz (what commands load), GraphML and networkx (what other tools read)."""

from __future__ import annotations

from odscen.lanegraph.graph_npz import from_npz_bytes, to_npz_bytes
from odscen.lanegraph.map_graphml import from_graphml, to_graphml
from odscen.lanegraph.networkx_form import to_networkx

__all__ = ["from_graphml", "from_npz_bytes", "to_graphml", "to_networkx", "to_npz_bytes"]
