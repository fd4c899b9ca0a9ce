"""From a scenario to SUMO files, and the run."""
