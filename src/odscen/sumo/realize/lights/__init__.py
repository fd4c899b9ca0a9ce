"""Traffic lights of a run: programs, detectors and what calls their stages."""
