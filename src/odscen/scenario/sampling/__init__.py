"""Automated generation of scenarios."""
