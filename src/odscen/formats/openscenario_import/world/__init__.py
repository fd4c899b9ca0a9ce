"""What there is: entities with their bodies, and the weather."""
