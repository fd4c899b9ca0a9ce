"""Recorded traffic of others as one table of tracks: readers and writers by published schema."""
