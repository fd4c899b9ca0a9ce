"""From the road model to a SUMO network, and the lane table between them."""
