"""What became of each element of a file: taken, approximated, ignored or refused."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError
from odscen.formats.base import VERDICTS, ReportRow
from odscen.formats.openscenario_import.traced_numbers import TracedNumber

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from lxml.etree import _Element


# ---------------------------- where on the map the elements of a file are about, as far as that was
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


# ------------------------------------------------------------ what became of each element of a file
_UNREAD: Final = "odscen has no part for it"


class RefusedError(Exception):
    """An element that cannot be taken over; what it belongs to is left out."""

    def __init__(self, element: _Element, reason: str) -> None:
        self.element = element
        self.reason = reason
        super().__init__(reason)


class ImportReport:
    """Marks elements while they are read; an element that is never read counts as ignored.

    Elements are added before the tree is changed, so that places are those of the file.

    Attributes
    ----------
    formulas
        Of attributes in whose place a number was put, of parameters, by element and name of the
        attribute.
    uses
        Parameters whose values were put in the place of attributes.
    positions
        Points of those elements that are positions, as far as read.
    starts
        Where entities start, by name.
    """

    def __init__(self) -> None:
        self._places: dict[_Element, tuple[str, str, int]] = {}
        self._marks: dict[_Element, tuple[str, str]] = {}
        self.formulas: dict[tuple[_Element, str], str] = {}
        self.uses: dict[tuple[_Element, str], frozenset[str]] = {}
        self.positions: dict[_Element, Spot] = {}
        self.starts: dict[str, Spot] = {}

    def add(self, root: _Element, file: str) -> None:
        """Add an element with all in it."""
        tree = root.getroottree()
        for element in root.iter("*"):
            line = element.sourceline
            self._places[element] = (
                file,
                tree.getpath(element),
                line if isinstance(line, int) else 0,
            )

    def mark(self, element: _Element, verdict: str, reason: str = "") -> None:
        """Give an element a verdict, unless it has a worse one already."""
        old = self._marks.get(element, ("taken", ""))[0]
        if VERDICTS.index(verdict) >= VERDICTS.index(old):
            self._marks[element] = (verdict, reason)

    def ignore(self, element: _Element, reason: str) -> None:
        """Ignore an element with all in it, for one reason."""
        for inner in element.iter("*"):
            self.mark(inner, "ignored", reason)

    def take(self, element: _Element) -> None:
        """Take an element with all in it."""
        for inner in element.iter("*"):
            self.mark(inner, "taken")

    def wrong(self, element: _Element, problem: str) -> InputError:
        """Error about an element of a file, with its place."""
        file, xpath, line = self._places.get(element, ("", str(element.tag), 0))
        return InputError(problem, file=file, element=f"{xpath} (line {line})")

    def place(self, element: _Element) -> str:
        """Tag and line of an element, for people."""
        return f"{element.tag} in line {self._places.get(element, ('', '', 0))[2]}"

    def verdict(self, element: _Element) -> str:
        """Verdict of an element so far."""
        return self._marks.get(element, ("ignored", ""))[0]

    def lists(self) -> dict[str, list[ReportRow]]:
        """All elements by their verdict, in the order of the file."""
        found: dict[str, list[ReportRow]] = {verdict: [] for verdict in VERDICTS}
        places = RowPlaces(self.positions, self.starts)
        for element, place in self._places.items():
            verdict, reason = self._marks.get(element, ("ignored", _UNREAD))
            x, y = places.of(element) or (None, None)
            found[verdict].append(ReportRow(*place, reason, x, y))
        return found

    def children(self, element: _Element, *tags: str) -> Iterator[_Element]:
        """Children with one of these tags, or all; taken from now on."""
        for child in element.iterchildren(*(tags or ("*",))):
            self.mark(child, "taken")
            yield child

    def child(self, element: _Element, *tags: str) -> _Element | None:
        """First child with one of these tags."""
        return next(self.children(element, *tags), None)

    def only(self, element: _Element) -> _Element:
        """First child, whatever it is.

        Raises
        ------
        RefusedError
            If there is none.
        """
        found = self.child(element)
        if found is None:
            raise RefusedError(element, f"{element.tag} is empty")
        return found

    def number(self, element: _Element, name: str, default: float | None = None) -> float:
        """Read an attribute as a number.

        Raises
        ------
        InputError
            If it is none, or missing without a default.
        """
        text = element.get(name)
        if text is None and default is not None:
            return default
        if text is None:
            raise self.wrong(element, f"it has no {name}")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not abs(value) < 1e12:
            raise self.wrong(element, f"{name}={text!r} is no number")
        formula = self.formulas.get((element, name))
        if formula is None:
            return value
        return TracedNumber.of(value, formula, frozenset({(element, name)}))

    def word(self, element: _Element, name: str) -> str:
        """Read an attribute as text.

        Raises
        ------
        InputError
            If it is missing.
        """
        text = element.get(name)
        if text is None:
            raise self.wrong(element, f"attribute {name} is missing")
        return text
