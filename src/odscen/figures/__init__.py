"""From the records of a run to its figures, and what is asked of them."""
