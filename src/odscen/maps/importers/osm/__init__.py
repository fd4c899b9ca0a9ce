"""OpenStreetMap to OpenDRIVE: reading, tags, the street network, its lines, its junctions."""
