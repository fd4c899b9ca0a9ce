"""Demand of scenarios: matrices, counts, flows, whole days, timetables."""
