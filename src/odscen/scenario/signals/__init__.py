"""Signal programs of a scenario: names of movements, intergreens, and what is shown when."""
