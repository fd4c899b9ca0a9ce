"""A SUMO network as values: edges, lanes, connections, right of way, and what is said of it."""
