"""Lanelet2 maps, and others that are made of lanelets, as OpenDRIVE."""
