"""What plays a scenario, whichever it is: the seam, those there are, and records from positions."""
