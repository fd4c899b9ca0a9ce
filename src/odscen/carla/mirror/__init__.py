"""A run in SUMO that is shown on a CARLA server, step by step."""
