"""Where on the map the elements of a file are about, as far as that was found out."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml.etree import _Element

Spot = tuple[float, float]
"""Metres in the OpenDRIVE frame."""

_WHOLE: Final = frozenset({"OpenSCENARIO", "Storyboard", "Init", "Actions", "Story", "Act"})
"""Elements about no one place, whatever is in them."""
_NAMED: Final[Mapping[str, tuple[str, str]]] = {
    "Private": (".", "entityRef"),
    "ScenarioObject": (".", "name"),
    "ByEntityCondition": ("TriggeringEntities/EntityRef", "entityRef"),
    "ManeuverGroup": ("Actors/EntityRef", "entityRef"),
}
"""Elements about an entity, and where they name it."""


class RowPlaces:
    """Finds the place of an element.

    That is the place of the one position in it or around it, else the start of the entity that it
    is about.

    Parameters
    ----------
    positions
        Points of the ``Position`` elements that were read.
    starts
        Where entities start, by name.
    """

    def __init__(self, positions: Mapping[_Element, Spot], starts: Mapping[str, Spot]) -> None:
        self._positions = positions
        self._starts = starts
        self._inside: Counter[_Element] = Counter()
        self._only: dict[_Element, Spot] = {}
        for position, spot in positions.items():
            for above in position.iterancestors():
                self._inside[above] += 1
                self._only[above] = spot

    def of(self, element: _Element) -> Spot | None:
        """Place of an element, if there is one."""
        if element.tag in _WHOLE:
            return None
        if self._inside[element] == 1:
            return self._only[element]
        for iterancestor in (element, *element.iterancestors()):
            if iterancestor in self._positions:
                return self._positions[iterancestor]
            path, attribute = _NAMED.get(str(iterancestor.tag), ("", ""))
            if path:
                named = iterancestor if path == "." else iterancestor.find(path)
                return None if named is None else self._starts.get(named.get(attribute, ""))
        return None
