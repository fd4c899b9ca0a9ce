"""Behaviour models in a running simulation."""
