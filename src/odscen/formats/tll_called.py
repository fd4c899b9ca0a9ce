"""Back from a program that calls the stages of the map to what the scenario says of the light."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.formats.tll_loops import taken_detectors
from odscen.formats.tll_stages import GAP, STAGE_NAME, main_phases
from odscen.scenario.document.problems import validated
from odscen.scenario.document.signals_document import JunctionTiming

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.formats.tll_file import FileProgram
    from odscen.formats.tll_loops import TakenLoop
    from odscen.scenario.signals.light import Light


def called_timing(
    light: Light, program: FileProgram, loops: Mapping[str, TakenLoop]
) -> JunctionTiming:
    """Timing of a light whose actuated program calls the stages of the map.

    Raises
    ------
    InputError
        If the map has other stages, or the program does not come back to its first phase.
    """
    greens, offset, gaps = _kept_stages(program)
    if len(greens) != len(light.green):
        raise InputError(
            f"{program.place}: it calls {len(greens)} stages of the map, but the light of this map "
            f"has {len(light.green)}"
        )
    own = {name: loop for name, loop in loops.items() if loop.name}
    made: dict[str, Any] = {"junction": light.names[0], "control": "actuated", "offset": offset}
    made |= {"green": list(greens)} if greens != light.green else {}
    made |= {"detectors": found} if (found := taken_detectors(gaps, own, light)) else {}
    buses = any(f"a:{program.light}.bus." in condition for condition in program.conditions.values())
    return validated(JunctionTiming, made | ({"bus_priority": True} if buses else {}))


def _kept_stages(
    program: FileProgram,
) -> tuple[tuple[float, ...], float, dict[str, dict[str, float]]]:
    """Stages of a program that calls those of the map: greens, offset, and loops with gaps each.

    Raises
    ------
    InputError
        If it does not come back to its first phase.
    """
    phases = [program.phases[n] for n in main_phases(program)]
    stages = [(named[1], phase) for phase in phases if (named := STAGE_NAME.search(phase.name))]
    cycle = sum(phase.seconds for phase in phases)
    total = sum(phase.seconds for phase in program.phases)
    gaps = {
        name: {
            loop: float(gap) for loop, gap in GAP.findall(program.conditions.get(f"end{name}", ""))
        }
        for name, _ in stages
    }
    offset = -((total - program.offset) % total) % cycle
    return tuple(phase.seconds for _, phase in stages), offset, gaps
