"""Sweeps: a row for each case, the boundary between safe and not, and a page."""
