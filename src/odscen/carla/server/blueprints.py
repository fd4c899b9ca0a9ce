"""Which blueprint of the server's library represents which road user."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.base.errors import CarlaError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.records.run_plan import PlannedActor
    from odscen.simulators.assets import Assets, Blueprint

ALIKE = 0.25
"""Metres that bodies may differ more than the best one's and still be as good a choice."""

_PREFIX = {Category.PEDESTRIAN: "walker.pedestrian."}


@dataclass(frozen=True, slots=True)
class Shape:
    """Bounding box of a blueprint on the server: half sizes, and its centre from the origin."""

    extent: tuple[float, float, float]
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)


def choose_blueprints(
    actors: Sequence[PlannedActor], assets: Assets, library: Iterable[str]
) -> tuple[str, ...]:
    """Blueprint for each road user: its model if the server has that, else one of like size.

    The same plan and library give the same choice; among bodies that fit alike the actor's id
    decides, so that a street is not full of one model.

    Raises
    ------
    CarlaError
        If the library has nothing at all for a category.
    """
    known = sorted(library)
    return tuple(_choose_blueprint(actor, assets, known) for actor in actors)


def _choose_blueprint(actor: PlannedActor, assets: Assets, library: Sequence[str]) -> str:
    if actor.model in library:
        return str(actor.model)
    category = Category(actor.category)
    fitting = [model for model in assets.of_category(category) if model.id in library]
    if not fitting:
        return _choose_unknown_model(category, library)
    best = min(_size_difference(actor, model) for model in fitting)
    alike = [model.id for model in fitting if _size_difference(actor, model) <= best + ALIKE]
    return alike[zlib.crc32(actor.id.encode()) % len(alike)]


def _size_difference(actor: PlannedActor, model: Blueprint) -> float:
    return abs(actor.length - model.body.length) + abs(actor.width - model.body.width)


def _choose_unknown_model(category: Category, library: Sequence[str]) -> str:
    """Something of a library that has no model we know."""
    prefix = _PREFIX.get(category, "vehicle.")
    found = next((name for name in library if name.startswith(prefix)), None)
    if found is None:
        raise CarlaError(f"the CARLA server has no blueprint for a {category.value} ({prefix}*)")
    return found


def size_differences(
    actors: Sequence[PlannedActor], blueprints: Sequence[str], shapes: Mapping[str, Shape]
) -> dict[str, float]:
    """By how many metres the longest-off length is wrong, per blueprint that differs by 0.1 m."""
    worst: dict[str, float] = {}
    for actor, name in zip(actors, blueprints, strict=True):
        if name in shapes:
            off = 2.0 * shapes[name].extent[0] - actor.length
            if abs(off) > max(0.1, abs(worst.get(name, 0.0))):
                worst[name] = round(off, 3)
    return worst
