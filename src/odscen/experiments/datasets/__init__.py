"""Datasets: recordings of many runs, divided by towns, in formats that learners read."""
