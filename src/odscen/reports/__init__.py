"""Figures and drawings of a run as pages."""
