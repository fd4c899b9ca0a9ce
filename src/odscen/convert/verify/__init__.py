"""How faithfully a SUMO network follows its map, measured anew."""
