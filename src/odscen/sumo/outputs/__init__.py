"""What SUMO writes, as tables."""
