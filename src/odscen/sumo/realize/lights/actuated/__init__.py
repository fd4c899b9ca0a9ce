"""Actuated lights with the stages of the map: vehicles and people call them."""
