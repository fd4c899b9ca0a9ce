"""Suites: what they hold, their runs, and how their results are shown."""
