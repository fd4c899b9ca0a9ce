"""Foreign formats, one file each: a scenario on its map goes in, files come out."""
