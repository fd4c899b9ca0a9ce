"""Scenarios run with many values of their parameters."""
