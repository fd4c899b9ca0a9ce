"""Maintainers' tool: writes the OpenDRIVE maps that ship in ``maps/``."""
