"""What people write: the scenario document, the sampling configuration, and problems with them."""
