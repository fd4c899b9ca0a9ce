"""The lane graph, its segments, the pedestrian graph."""
