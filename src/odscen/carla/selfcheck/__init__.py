"""What a CARLA server does of what the mirror relies on, measured on it, as one page."""
