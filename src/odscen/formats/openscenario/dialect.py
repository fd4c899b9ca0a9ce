"""What the versions of OpenSCENARIO XML write differently, and how elements are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from lxml import etree

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from lxml.etree import _Element

VERSIONS: Final = ("1.0", "1.1", "1.2", "1.3")
_DIGITS: Final = 6


def xml(tag: str, /, *children: _Element | None, **attributes: object) -> _Element:
    """Make an element; children and attributes that are ``None`` are left out.

    Numbers are written with six decimals at most, truth values as ``true`` and ``false``.
    """
    found = etree.Element(tag)
    for key, value in attributes.items():
        if value is not None:
            found.set(key.rstrip("_"), _format_attribute(value))
    found.extend(child for child in children if child is not None)
    return found


def _format_attribute(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        text = f"{value:.{_DIGITS}f}".rstrip("0").rstrip(".")
        return "0" if text in ("-0", "") else text
    return str(value)


@dataclass(frozen=True, slots=True)
class Dialect:
    """A version of OpenSCENARIO XML, ``minor`` after 1."""

    minor: int

    @classmethod
    def of(cls, version: str) -> Dialect:
        """The dialect of a version.

        Raises
        ------
        InputError
            If there is no such version.
        """
        if version not in VERSIONS:
            raise InputError(
                f"OpenSCENARIO {version!r} cannot be written; choose one of {', '.join(VERSIONS)}"
            )
        return cls(int(version[2:]))

    @property
    def for_scenario_runner(self) -> bool:
        """Whether ScenarioRunner is to read it, which takes 1.0 only, and of that a part.

        It refuses a file whole, so that nothing is written that it has no counterpart of. Rules:
        ``srunner/tools/openscenario_parser.py`` and
        ``srunner/scenarioconfigs/openscenario_configuration.py``.
        """
        return self.minor == 0

    def rule(self, *, above: bool) -> str:
        """How a value is held against its bound, which counts as met from 1.1 on."""
        if self.minor == 0:
            return "greaterThan" if above else "lessThan"
        return "greaterOrEqual" if above else "lessOrEqual"

    def distance(self, kind: str, *, along_route: bool = False) -> dict[str, object]:
        """Attributes that say along what a distance is: ``longitudinal``, ``lateral``, ..."""
        if self.minor == 0:
            return {"alongRoute": along_route}
        system = "road" if along_route else "entity"
        return {"coordinateSystem": system, "relativeDistanceType": kind}
