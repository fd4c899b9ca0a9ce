"""How demand fits counts, and what a town's junctions carry in a day."""
