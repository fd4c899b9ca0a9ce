"""Exports played by the program esmini, which the user has."""
