"""Files that traffic offices have: matrices, counts, turns and detectors of other programs."""
