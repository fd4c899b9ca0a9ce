"""Scenarios in MetaDrive, which runs in a Python of its own."""
