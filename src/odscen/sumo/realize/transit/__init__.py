"""Public transport as SUMO sees it: vehicles of lines, and stops."""
