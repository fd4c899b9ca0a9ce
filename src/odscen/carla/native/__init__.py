"""A scenario that CARLA drives alone, with its Traffic Manager and its walkers."""
