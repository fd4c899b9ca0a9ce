"""Positions and lines of a file, on the ground and on the lane graph."""
