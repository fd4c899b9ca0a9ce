"""Scenarios from and to other formats: OpenSCENARIO in, OpenSCENARIO, SUMO and GraphML out."""
