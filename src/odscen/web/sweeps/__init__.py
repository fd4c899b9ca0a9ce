"""Sweeps for the page: planned, run in the background, and their cases as a table."""
