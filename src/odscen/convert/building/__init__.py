"""The SUMO network built: nodes, junctions, roundabouts, and the conversion report's findings."""
