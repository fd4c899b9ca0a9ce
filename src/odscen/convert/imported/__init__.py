"""SUMO networks that odscen has not written itself, related to their map by geometry."""
