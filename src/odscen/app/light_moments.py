"""When in the life of its traffic lights a generated scenario begins.

At 0 s all programs of a map begin together, which hardly any other moment is like.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.document.distributions import stream
from odscen.scenario.document.signals_document import JunctionTiming, Signals

if TYPE_CHECKING:
    from odscen.app.maps import LoadedMap


def draw_moment(seed: int) -> float:
    """Draw when in the life of the lights a scenario begins: whole seconds of an hour."""
    return float(stream(seed, "moment of the lights").integers(3600))


def signals_at(loaded: LoadedMap, moment: float) -> Signals:
    """Programs of the map, moved so that a run begins as they are at a moment.

    Extended greens count with their shortest times, as it is not known who came.

    Parameters
    ----------
    moment
        Seconds since they were at the beginning that the map gives them; may be below 0.
    """
    timings = []
    for light in loaded.sumo.lights:
        cycle = sum(phase.duration for phase in light.phases)
        if cycle <= 0.0:
            continue
        offset = round((light.offset - moment) % cycle, 3)
        if abs((offset - light.offset) % cycle) > 1e-6:
            name = light.junctions[0] if light.junctions else light.id
            # An offset of 0 is that of the map.
            timings.append(
                JunctionTiming(
                    junction=str(name),
                    offset=offset or cycle,
                    # Of itself a light with an offset of the scenario's is fixed-time.
                    control=loaded.sumo.control,
                )
            )
    return Signals(junctions=tuple(timings))
