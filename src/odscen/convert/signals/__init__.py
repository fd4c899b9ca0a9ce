"""Traffic lights: the map's signals, and the programs made from them."""
