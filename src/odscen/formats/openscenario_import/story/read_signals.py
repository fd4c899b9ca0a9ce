"""Actions and conditions about traffic signals, as those of the lights of the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.formats.openscenario_import.import_report import RefusedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

Made = dict[str, Any]
_LAMPS: Final = ("red", "yellow", "green")


@dataclass(frozen=True, slots=True)
class SignalReader:
    """Reads them.

    Attributes
    ----------
    root
        The file, which has the phases of controllers.
    movement
        Light and movement of a signal of the map.
    """

    report: ImportReport
    root: _Element
    movement: Callable[[str], tuple[str, str] | None]

    def condition(self, kind: _Element) -> Made:
        """Condition of a signal, or of a phase of a controller.

        Raises
        ------
        RefusedError
            If it is over no movement of a light of the map, or its state is none that lights have.
        """
        if kind.tag == "TrafficSignalControllerCondition":
            light, movement = self._green_in_phase(kind, "trafficSignalControllerRef")
            self.report.mark(kind, "approximated", f"while {movement!r} of {light!r} has green")
            return {"signal": {"light": light, "movement": movement, "shows": "green"}}
        state = _colour_of_state(kind.get("state", ""))
        light, movement = self._light_and_movement_of(kind)
        if state not in ("red", "yellow", "green"):
            raise RefusedError(kind, f"the state {state!r} of a signal")
        return {"signal": {"light": light, "movement": movement, "shows": state}}

    def action(self, about: _Element) -> Made:
        """Action of a rule that an ``InfrastructureAction`` is.

        Raises
        ------
        RefusedError
            If rules cannot do it.
        """
        kind = next(about.iter("TrafficSignalStateAction", "TrafficSignalControllerAction"), None)
        if kind is None:
            raise RefusedError(about, "an infrastructure action without a signal")
        for iterancestor in (about, *kind.iterancestors("TrafficSignalAction"), kind):
            self.report.mark(iterancestor, "taken")
        if kind.tag == "TrafficSignalControllerAction":
            light, movement = self._green_in_phase(kind, "trafficSignalControllerRef")
            words = f"the program of {light!r} jumps to where {movement!r} has green"
            self.report.mark(kind, "approximated", words)
            return {"signal": {"light": light, "shows": "green", "movement": movement}}
        state = _colour_of_state(kind.get("state", ""))
        light, movement = self._light_and_movement_of(kind)
        if state in ("off", ""):
            return {"signal": {"light": light, "shows": "off"}}
        if state != "green":
            raise RefusedError(kind, f"a signal that is set to {state!r}: rules give green only")
        words = f"the program of {light!r} jumps to where {movement!r} has green, and resumes"
        self.report.mark(kind, "approximated", words)
        return {"signal": {"light": light, "shows": "green", "movement": movement}}

    def programs(self) -> None:
        """Say that phases of the file are not those of the lights."""
        for element in self.root.iterfind("RoadNetwork/TrafficSignals"):
            self.report.ignore(element, "lights have the program of the map, or that of a scenario")

    def _light_and_movement_of(self, kind: _Element) -> tuple[str, str]:
        name = self.report.word(kind, "name")
        found = self.movement(name)
        if found is None:
            raise RefusedError(kind, f"signal {name!r} is over no movement of a light of the map")
        return found

    def _green_in_phase(self, kind: _Element, key: str) -> tuple[str, str]:
        name, phase = self.report.word(kind, key), self.report.word(kind, "phase")
        for element in self.root.iterfind("RoadNetwork/TrafficSignals/TrafficSignalController"):
            if element.get("name") != name:
                continue
            for state in element.iterfind("Phase/TrafficSignalState"):
                above = state.getparent()
                if above is None or above.get("name") != phase:
                    continue
                found = self.movement(state.get("trafficSignalId", ""))
                if _colour_of_state(state.get("state", "")) == "green" and found is not None:
                    return found
        raise RefusedError(kind, f"phase {phase!r} of {name!r} gives no signal of the map green")


def _colour_of_state(state: str) -> str:
    """Colour of a state, given by its name or as the lamps that are on, from the top: ``off;on``.

    Red and yellow together are red: who waits has to wait on.
    """
    lamps = [part.strip().lower() for part in state.split(";")]
    if not lamps or any(lamp not in ("on", "off") for lamp in lamps) or len(lamps) == 1:
        return state.strip().lower()
    lit = [colour for colour, lamp in zip(_LAMPS, lamps, strict=False) if lamp == "on"]
    return lit[0] if lit else "off"
