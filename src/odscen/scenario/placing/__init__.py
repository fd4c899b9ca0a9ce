"""The region of interest, and where bodies have room in it."""
