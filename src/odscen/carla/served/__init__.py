"""Mirrored runs for the page, each in a process of its own."""
