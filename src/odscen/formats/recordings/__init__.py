"""Runs as arrays, map elements, tracks and lights, for the formats that learners read."""
