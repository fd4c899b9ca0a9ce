"""Co-simulation with a CARLA server."""
