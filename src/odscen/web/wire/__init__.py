"""What goes over the wire about maps, results and live runs, and how the schema shows it."""
