"""Building the SUMO network: nodes, junctions, roundabouts, and the conversion report's findings."""
