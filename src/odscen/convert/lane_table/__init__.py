"""The lane table between OpenDRIVE lanes and SUMO lanes."""
