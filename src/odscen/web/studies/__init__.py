"""Studies for the page: begun, carried out in the background, and their figures."""
