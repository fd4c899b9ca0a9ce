"""Routes of the page that have no room of their own."""
