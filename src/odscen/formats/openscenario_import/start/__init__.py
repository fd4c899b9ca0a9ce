"""What is at first: actors, where they are placed, how they appear and vanish."""
