"""What a map sheet shows."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RenderOptions:
    """What the sheet shows.

    Attributes
    ----------
    symbols, speed_limits
        Lights and signs; speed-limit signs on top.
    graph
        Lane graph and pedestrian graph, if one is given.
    segments
        Segments of the graph, in alternating colours, if one is given.
    margins
        Name, figures, legend, scale; without them only the map is drawn.
    """

    symbols: bool = True
    speed_limits: bool = False
    graph: bool = True
    segments: bool = False
    margins: bool = True
