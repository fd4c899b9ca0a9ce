"""The rules of a scenario on its map."""
