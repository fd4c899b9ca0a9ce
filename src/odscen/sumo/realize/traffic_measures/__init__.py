"""What measures of a scenario do in SUMO: additional files, switched lights, closed turns."""
