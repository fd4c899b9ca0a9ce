"""Sweeps: one scenario, and many values of its parameters."""
