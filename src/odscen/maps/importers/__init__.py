"""What maps are read from: each importer makes OpenDRIVE of a file in one format."""
