"""The models of a CARLA server as rows of the asset catalogue (requirement R11)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.categories import Body, Category
from odscen.simulators.assets import AssetSource, Blueprint

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.carla.server.carla_server import Server
    from odscen.simulators.assets import Assets

SOURCE = "server"
"""``dimensions_source`` of boxes that were measured on the server."""


class ServerModels(AssetSource):
    """The models of a CARLA server.

    Weather presets belong to the Python package carla, not to a server: there are none.

    Parameters
    ----------
    known
        The catalogue until now, for what the server does not say.
    """

    def __init__(self, server: Server, known: Assets) -> None:
        self._server, self._known = server, known

    def models(self) -> list[Blueprint]:
        """Every vehicle and pedestrian of the server, by id, with the box that it gives it.

        One of each is made aloft and taken away again. Where the server does not say what a model
        is (two cars of 0.9.16, and pedestrians), the catalogue's word holds, else the number of
        wheels. Models that the server refuses to make are left out.

        Raises
        ------
        CarlaError
            If the server does not answer.
        """
        described = self._server.describe(("vehicle.", "walker.pedestrian."))
        shapes = self._server.shapes(tuple(described))
        known = self._known.blueprints
        return [
            _describe_model(name, described[name], known.get(name), shapes[name].extent)
            for name in sorted(shapes)
        ]


def _describe_model(
    name: str,
    attributes: dict[str, str],
    known: Blueprint | None,
    extent: tuple[float, float, float],
) -> Blueprint:
    length, width, height = (round(2 * half, 4) for half in extent)
    generation: Any = attributes.get("generation")
    if known is not None:
        category, age = known.category, known.age
    else:
        category, age = category_of(name, attributes), None
    return Blueprint(
        id=name,
        category=category,
        base_type=attributes.get("base_type", ""),
        special_type=attributes.get("special_type", ""),
        generation=int(generation) if generation and category is not Category.PEDESTRIAN else None,
        age=age,
        body=Body(length, width, height),
        dimensions_source=SOURCE,
    )


def category_of(name: str, attributes: Mapping[str, str]) -> Category:
    """Category of a blueprint from what the server says of it."""
    if name.startswith("walker."):
        return Category.PEDESTRIAN
    base_type = attributes.get("base_type", "").lower()
    if base_type in set(Category):
        return Category(base_type)
    return Category.MOTORCYCLE if attributes.get("number_of_wheels") == "2" else Category.CAR
