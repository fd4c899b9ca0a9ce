"""Large scenarios: children of the server that answer requests about them."""
