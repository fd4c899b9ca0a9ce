"""What a template is: its parameters, where they come from, and what it makes of a map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.scenario.placing.region import Region
    from odscen.scenario.placing.usable_nodes import Usable
    from odscen.scenario.signals.light import Light
    from odscen.scenario.templates.lane_stretches import LaneStretches
    from odscen.scenario.templates.walk_sides import WalkSides


class TemplateParameter(NamedTuple):
    """A number of a template; ``default`` ``None`` follows from the others, as ``meaning`` says."""

    name: str
    default: float | None
    low: float
    high: float
    unit: str
    meaning: str


class TemplateSite(NamedTuple):
    """A map as templates look at it."""

    region: Region
    usable: Usable
    lights: Sequence[Light]
    stretches: LaneStretches
    sides: WalkSides


@dataclass(frozen=True)
class TemplateScene:
    """What a template has placed, as parts of a document.

    Attributes
    ----------
    actors, rules
        As in the document.
    duration
        Of the run, s.
    wanted
        The geometry that follows from the parameters, in words with numbers.
    """

    actors: tuple[dict[str, Any], ...]
    rules: tuple[dict[str, Any], ...]
    duration: float
    wanted: str


@dataclass(frozen=True)
class SceneTemplate:
    """A scene that can be placed on maps.

    Attributes
    ----------
    name, title, summary
        How it is called, and what happens in it.
    source
        Where its numbers come from.
    needs
        What a map must have.
    parameters
        Its numbers.
    place
        Places it, or raises :class:`~odscen.scenario.templates.no_place.NoPlaceError`.
    """

    name: str
    title: str
    summary: str
    source: str
    needs: str
    parameters: tuple[TemplateParameter, ...]
    place: Callable[[TemplateSite, Mapping[str, float]], TemplateScene]

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """Numbers to place it with; those that follow from others are left out.

        Raises
        ------
        InputError
            If a name is unknown or a number out of its range.
        """
        known = {one.name: one for one in self.parameters}
        for name, value in given.items():
            one = known.get(name)
            if one is None:
                raise InputError(
                    f"template {self.name!r} has no parameter {name!r}; it has {', '.join(known)}"
                )
            if not (math.isfinite(value) and one.low <= value <= one.high):
                raise InputError(
                    f"{name} must be {one.low:g} to {one.high:g} {one.unit}, not {value:g}"
                )
        usual = {one.name: one.default for one in self.parameters if one.default is not None}
        return usual | dict(given)
