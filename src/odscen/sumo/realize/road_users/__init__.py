"""Who is on the road, when and where, and how each of them goes."""
