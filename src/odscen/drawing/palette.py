"""Colours and names of what is drawn of a map."""

from __future__ import annotations

AREA_COLORS = {
    "green": "#c3d2ae",
    "other": "#d5d6d1",
    "rail": "#b9aa9b",
    "restricted": "#b9bbb6",
    "curb": "#c9c6bf",
    "shoulder": "#bec3c8",
    "sidewalk": "#e0d8c8",
    "parking": "#a9b4c4",
    "bicycle": "#c98f7a",
    "bus": "#a7939c",
    "road": "#939ba5",
}
"""Fill per kind of area, in the order they are painted."""


AREA_NAMES = {
    "road": "Carriageway",
    "bus": "Bus, taxi or high-occupancy lane",
    "bicycle": "Bicycle lane",
    "sidewalk": "Sidewalk",
    "parking": "Parking",
    "shoulder": "Shoulder",
    "curb": "Kerb",
    "restricted": "Restricted area",
    "rail": "Tram or rail",
    "green": "Median or verge",
    "other": "Other surface",
}


MARK_COLORS = {
    "white": "#ffffff",
    "yellow": "#f4c431",
    "red": "#d64545",
    "blue": "#3f7fd1",
    "green": "#4a9a5a",
    "orange": "#ea8a2c",
    "curb": "#7c8289",
}


CROSSWALK_COLOR = "#ff8a1f"


RELATION_COLORS = ("#000000", "#FF4261", "#00E279")
"""Successor, left, right (requirement R22)."""


VEHICLE_NODE_COLOR = "#24A3F2"


PEDESTRIAN_NODE_COLOR = "#FFD800"


SEGMENT_COLORS = ("#7b6fd0", "#3f9c8f", "#c7772e", "#b4558a", "#5f8a2f", "#4477aa")


SYMBOL_NAMES = {
    "traffic_light": "Traffic light",
    "pedestrian_light": "Pedestrian light",
    "stop": "Stop sign",
    "yield": "Yield sign",
    "speed_limit": "Speed limit",
}


FONT = "system-ui, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif"
