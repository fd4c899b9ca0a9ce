"""The lane graph in networkx: what can be reached, what lane changes are worth, what is central.

Run it with ``python examples/lane_graph_networkx.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

import networkx as nx

import odscen

MAP = "motorway_weave"


def reached(lanes: nx.MultiDiGraph[str], relations: set[str]) -> float:
    """Mean share of all nodes that a vehicle comes to from the start of a segment."""
    edges = [(a, b) for a, b, relation in lanes.edges(keys=True) if relation in relations]
    graph = nx.DiGraph(edges)
    starts = {lanes.nodes[node]["segment"]: node for node in sorted(graph, reverse=True)}
    found = [len(nx.descendants(graph, node)) / len(lanes) for node in starts.values()]
    return sum(found) / len(found)


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    entry = store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    lanes, pedestrians = entry.networkx()

    print(f"{len(lanes)} nodes of lanes, {len(pedestrians)} of sidewalks and crosswalks")
    relations = Counter(relation for *_, relation in lanes.edges(keys=True))
    print("edges:", ", ".join(f"{count} {name}" for name, count in sorted(relations.items())))
    print(f"reached without lane changes: {reached(lanes, {'successor'}):.1%}")
    print(f"reached with lane changes: {reached(lanes, set(relations)):.1%}")

    central = nx.betweenness_centrality(lanes.graph["segments"])
    for name, share in sorted(central.items(), key=lambda item: (-item[1], item[0]))[:3]:
        print(f"on {share:.1%} of shortest paths between segments: {name}")
