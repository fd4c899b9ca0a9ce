"""Pictures of the page for the documentation, each in a light and a dark form."""
