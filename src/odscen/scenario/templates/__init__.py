"""Scenes to start from: each is placed on any map that has room for it."""
