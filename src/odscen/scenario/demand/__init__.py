"""Demand: zones, day profiles, matrices, count stations, and the trips drawn from them."""
