"""Studies: many runs as data, with a plan, a state and one table of results."""
