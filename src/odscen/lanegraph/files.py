"""Graph files: npz (what commands load), GraphML and networkx (what other tools read)."""

from __future__ import annotations

from odscen.lanegraph.graphml import from_graphml, to_graphml
from odscen.lanegraph.interchange import to_networkx
from odscen.lanegraph.npz import from_npz_bytes, to_npz_bytes

__all__ = ["from_graphml", "from_npz_bytes", "to_graphml", "to_networkx", "to_npz_bytes"]
