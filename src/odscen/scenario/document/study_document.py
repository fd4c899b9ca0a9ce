"""What is measured in a run besides what always is: times that are analysed, and stations.

Times are seconds after the start of the run. What belongs to a station is named as in the lane
graph of the map.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from odscen.scenario.document.document_parts import Part

WholeSeconds = Annotated[float, Field(ge=0, le=1e9, multiple_of=1)]


class Study(Part):
    """What of a run is analysed.

    ``warm_up`` are seconds from the start that all figures leave out. ``interval`` is what figures
    over time are given for, 900 s for those of an hour by quarters; ``None`` leaves it to odscen.
    """

    warm_up: WholeSeconds = 0.0
    interval: Annotated[float, Field(ge=1, le=86_400, multiple_of=1)] | None = None
