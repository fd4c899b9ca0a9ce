"""A CARLA server: the only door to the client, what is asked of it, and how it is given back."""
