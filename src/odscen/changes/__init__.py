"""What differs between two maps, or two scenarios, in words."""
