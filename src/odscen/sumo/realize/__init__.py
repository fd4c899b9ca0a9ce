"""From a scenario on its map to the files that SUMO runs."""
