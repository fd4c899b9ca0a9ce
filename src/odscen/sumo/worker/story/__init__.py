"""Rules in the simulation: what they see of the road, and what they make of it."""
