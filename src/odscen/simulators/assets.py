"""Models of road users and weather presets, and the seam of where they come from.

The catalogue that ships is a pair of files under ``maps/data/``, which name their sources;
``docs/assets.md`` discusses them. An installed package adds to it by its ``pyproject.toml``::

    [project.entry-points."odscen.asset_sources"]
    mine = "my_package.assets:MyAssets"
"""

from __future__ import annotations

import json
import logging
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from importlib.metadata import entry_points
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Literal, Self

from odscen.base.categories import Body, Category
from odscen.base.errors import NotFoundError, WorkspaceError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

Age = Literal["adult", "child"]
TimeOfDay = Literal["day", "sunset", "night"]
GROUP = "odscen.asset_sources"
"""Of entry points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Blueprint:
    """A model of road user; what has a default is for simulators that know of it.

    Attributes
    ----------
    body
        Bounding box, metres.
    base_type
        What a CARLA server says, which is nothing for walkers and for two cars: choose by
        ``category``.
    special_type
        ``electric``, ``emergency``, ``taxi`` or empty.
    generation
        Of the vehicle's artwork, ``None`` for pedestrians.
    age
        ``None`` for vehicles, and for pedestrians that CARLA's documentation does not list.
    dimensions_source
        Key of the file's ``sources`` where the body comes from; ``typical`` if it was not measured.
    """

    id: str
    category: Category
    base_type: str = ""
    special_type: str = ""
    generation: int | None = None
    age: Age | None = None
    body: Body
    dimensions_source: str = "typical"


@dataclass(frozen=True, slots=True, kw_only=True)
class WeatherPreset:
    """Weather and time of day.

    Attributes
    ----------
    kind
        What it is like: ``clear``, ``rain``, ``fog``, ...
    source
        Where it comes from.
    parameters
        By the names that CARLA has for them, those left out as in clear weather: shares from 0 to
        100 (``cloudiness``, ``precipitation``, ``precipitation_deposits``, ``wind_intensity``,
        ``wetness``, ``fog_density``), degrees (``sun_altitude_angle``, ``sun_azimuth_angle``),
        metres (``fog_distance``).
    """

    name: str
    kind: str = ""
    time_of_day: TimeOfDay = "day"
    source: str = ""
    parameters: Mapping[str, float]


class AssetSource:
    """Offers models of road users and weather presets to scenarios.

    >>> class Cargo(AssetSource):
    ...     def models(self):
    ...         trike = Body(2.6, 1.0, 1.9)
    ...         return [Blueprint(id="cargo.trike", category=Category.BICYCLE, body=trike)]
    >>> Assets.of(Cargo()).dimensions("cargo.trike")
    Body(length=2.6, width=1.0, height=1.9)
    """

    def models(self) -> Iterable[Blueprint]:
        """Models of road users; ids are words with dots between."""
        return ()

    def weather(self) -> Iterable[WeatherPreset]:
        """Weather presets."""
        return ()


@dataclass(frozen=True, slots=True)
class Assets:
    """Blueprints by id and presets by name, in the order of their files."""

    blueprints: Mapping[str, Blueprint]
    presets: Mapping[str, WeatherPreset]

    @classmethod
    def of(cls, *sources: AssetSource) -> Self:
        """All that some sources offer; of one name, what comes first."""
        blueprints: dict[str, Blueprint] = {}
        presets: dict[str, WeatherPreset] = {}
        for source in sources:
            for model in source.models():
                blueprints.setdefault(model.id, model)
            for preset in source.weather():
                presets.setdefault(preset.name, preset)
        return cls(blueprints, presets)

    def blueprint(self, name: str) -> Blueprint:
        """One blueprint; :class:`NotFoundError` with close names if there is none."""
        if name not in self.blueprints:
            raise NotFoundError("model", name, list(self.blueprints))
        return self.blueprints[name]

    def preset(self, name: str) -> WeatherPreset:
        """One weather preset; :class:`NotFoundError` with close names if there is none."""
        if name not in self.presets:
            raise NotFoundError("weather preset", name, list(self.presets))
        return self.presets[name]

    def of_category(self, category: Category) -> tuple[Blueprint, ...]:
        """All blueprints of a category."""
        return tuple(b for b in self.blueprints.values() if b.category is category)

    def category_of(self, model: str) -> Category | None:
        """Category of a model, ``None`` if there is no such model."""
        found = self.blueprints.get(model)
        return found.category if found else None

    def dimensions(self, model: str) -> Body | None:
        """Size of a model, ``None`` if there is no such model."""
        found = self.blueprints.get(model)
        return found.body if found else None

    def electric(self, model: str) -> bool:
        """Whether a model is electric; false if there is no such model."""
        found = self.blueprints.get(model)
        return found is not None and found.special_type == "electric"

    def weather(self, preset: str) -> Mapping[str, float] | None:
        """Parameters of a preset as they act on driving, ``None`` if there is no such preset.

        CARLA's night presets have dense fog to look dark; it hides nothing from drivers there.
        """
        found = self.presets.get(preset)
        if found is None:
            return None
        if found.time_of_day == "night" and found.kind not in ("fog", "dust"):
            return {**found.parameters, "fog_density": 0.0}
        return found.parameters


class ShippedCatalogue(AssetSource):
    """What ships with odscen: the models and weather presets of CARLA."""

    def models(self) -> list[Blueprint]:
        """Read the models."""
        return [_read_blueprint(row) for row in _shipped_rows("blueprints.json", "blueprints")]

    def weather(self) -> list[WeatherPreset]:
        """Read the weather presets."""
        return [WeatherPreset(**row) for row in _shipped_rows("weather.json", "presets")]


def _shipped_rows(file: str, key: str) -> list[dict[str, Any]]:
    text = (files("odscen.maps") / "data" / file).read_text(encoding="utf-8")
    rows: list[dict[str, Any]] = json.loads(text)[key]
    return rows


@dataclass(frozen=True, slots=True)
class FetchedModels(AssetSource):
    """Models that were fetched from a server into a file of the workspace."""

    file: Path

    def models(self) -> list[Blueprint]:
        """Read the models.

        Raises
        ------
        WorkspaceError
            If the file cannot be read.
        """
        try:
            rows = json.loads(self.file.read_text(encoding="utf-8"))["blueprints"]
            return [_read_blueprint(dict(row)) for row in rows]
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise WorkspaceError(
                f"{self.file}: not a catalogue of models ({error}); remove it or fetch it again"
            ) from error


@cache
def shipped_assets() -> Assets:
    """The catalogue that ships with odscen."""
    return Assets.of(ShippedCatalogue())


@cache
def installed_assets() -> Assets:
    """What installed packages offer; one that breaks is left out, and the log says why."""
    found = Assets({}, {})
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            own = _own_assets(point.load()())
        except Exception as error:  # whatever code from outside may raise
            logging.getLogger("odscen").warning(
                "the models and weather of %s are left out: %r", point.value, error
            )
            continue
        found = Assets({**own.blueprints, **found.blueprints}, {**own.presets, **found.presets})
    return found


def _own_assets(source: AssetSource) -> Assets:
    """What a source offers, all of the right kind; raises what its code raises, or a TypeError."""
    own = Assets.of(source)
    typed: list[tuple[object, type[object]]] = [
        (blueprint, Blueprint) for blueprint in own.blueprints.values()
    ]
    typed += [(preset, WeatherPreset) for preset in own.presets.values()]
    for offered, kind in typed:
        if not isinstance(offered, kind):
            raise TypeError(f"{offered!r} is no {kind.__name__}")
    return own


BLUEPRINTS_FILE = "blueprints.json"
_FIELD_KINDS: dict[str, tuple[type[object], ...]] = {
    **dict.fromkeys(("id", "category", "base_type", "special_type", "dimensions_source"), (str,)),
    **dict.fromkeys(("length", "width", "height"), (int, float)),
    "generation": (int, type(None)),
    "age": (str, type(None)),
}
"""What a row of that file has in each field."""


def assets_in(folder: Path) -> Assets:
    """The catalogue of a workspace.

    Models that were fetched into its folder, else those shipped; then those of installed packages,
    which cannot take the name of one that is there.

    Raises
    ------
    WorkspaceError
        If the file there cannot be read.
    """
    file = folder / BLUEPRINTS_FILE
    known = _read_fetched(file, file.stat().st_mtime_ns) if file.is_file() else shipped_assets()
    more = installed_assets()
    if not more.blueprints and not more.presets:
        return known
    return Assets({**more.blueprints, **known.blueprints}, {**more.presets, **known.presets})


@lru_cache(maxsize=4)
def _read_fetched(file: Path, _changed: int) -> Assets:
    models = {model.id: model for model in FetchedModels(file).models()}
    return Assets(models, shipped_assets().presets)


def blueprint_row(model: Blueprint) -> dict[str, Any]:
    """One model as a row of the file; the inverse of reading it."""
    row = asdict(model)
    length, width, height = row.pop("body")
    return {**row, "length": length, "width": width, "height": height}


def _read_blueprint(row: Mapping[str, Any]) -> Blueprint:
    """Inverse of :func:`blueprint_row`; ``TypeError`` if a field has a value of another kind."""
    for name, kinds in _FIELD_KINDS.items():
        value = row.get(name)
        if not isinstance(value, kinds) or isinstance(value, bool):
            raise TypeError(f"{name} cannot be {json.dumps(value)[:40]}")
    return Blueprint(
        id=row["id"],
        category=Category(row["category"]),
        base_type=row["base_type"],
        special_type=row["special_type"],
        generation=row.get("generation"),
        age=row.get("age"),
        body=Body(row["length"], row["width"], row["height"]),
        dimensions_source=row["dimensions_source"],
    )
