"""Figures of a run: one file for each family, and the registry that all else reads."""
