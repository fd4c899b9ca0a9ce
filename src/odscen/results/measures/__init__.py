"""Figures of a run, from its records."""
