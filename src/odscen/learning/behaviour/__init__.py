"""Behaviour models: what drives vehicles instead of SUMO, and the two that ship."""
