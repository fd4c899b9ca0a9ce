"""Pedestrians in SUMO's network: crossings, walking areas and sidewalks."""
