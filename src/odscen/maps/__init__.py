"""Maps and assets on disk."""
