"""The asset catalogue that ships: blueprints and weather presets, as plain data.

The files under ``data/`` name their sources; ``docs/assets.md`` discusses them. Another simulator
needs only another pair of such files (requirement R13).
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Literal

from odscen.base.categories import Body, Category
from odscen.base.errors import NotFoundError, WorkspaceError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

Age = Literal["adult", "child"]
TimeOfDay = Literal["day", "sunset", "night"]


@dataclass(frozen=True, slots=True)
class Blueprint:
    """A model of road user.

    Attributes
    ----------
    base_type
        What a CARLA server says, which is nothing for walkers and for two cars: choose by
        ``category``.
    special_type
        ``electric``, ``emergency``, ``taxi`` or empty.
    generation
        Of the vehicle's artwork, ``None`` for pedestrians.
    age
        ``None`` for vehicles, and for pedestrians that CARLA's documentation does not list.
    body
        Bounding box, metres.
    dimensions_source
        Key of the file's ``sources`` where the body comes from; ``typical`` if it was not measured.
    """

    id: str
    category: Category
    base_type: str
    special_type: str
    generation: int | None
    age: Age | None
    body: Body
    dimensions_source: str


@dataclass(frozen=True, slots=True)
class WeatherPreset:
    """Weather and time of day.

    ``parameters`` have CARLA's names and units: shares from 0 to 100, angles in degrees,
    ``fog_distance`` in metres.
    """

    name: str
    kind: str
    time_of_day: TimeOfDay
    source: str
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Assets:
    """Blueprints by id and presets by name, in the order of their files."""

    blueprints: Mapping[str, Blueprint]
    presets: Mapping[str, WeatherPreset]

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


def parse_assets(blueprints: str, weather: str) -> Assets:
    """Make the catalogue from the text of the two data files."""
    models = [_blueprint(row) for row in json.loads(blueprints)["blueprints"]]
    presets = [WeatherPreset(**row) for row in json.loads(weather)["presets"]]
    return Assets(
        {model.id: model for model in models}, {preset.name: preset for preset in presets}
    )


@cache
def shipped_assets() -> Assets:
    """The catalogue that ships with odscen."""
    data = files("odscen.maps") / "data"
    return parse_assets(
        (data / "blueprints.json").read_text(encoding="utf-8"),
        (data / "weather.json").read_text(encoding="utf-8"),
    )


BLUEPRINTS_FILE = "blueprints.json"


def assets_in(folder: Path) -> Assets:
    """The catalogue of a workspace: models that were fetched into its folder, else those shipped.

    Raises
    ------
    WorkspaceError
        If the file there cannot be read.
    """
    file = folder / BLUEPRINTS_FILE
    if not file.is_file():
        return shipped_assets()
    return _fetched(file, file.stat().st_mtime_ns)


@lru_cache(maxsize=4)
def _fetched(file: Path, _changed: int) -> Assets:
    shipped = shipped_assets()
    try:
        rows = json.loads(file.read_text(encoding="utf-8"))["blueprints"]
        models = {row["id"]: _blueprint(row) for row in rows}
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise WorkspaceError(
            f"{file}: not a catalogue of models ({error}); remove it or fetch it again"
        ) from error
    return Assets(models, shipped.presets)


def blueprint_row(model: Blueprint) -> dict[str, Any]:
    """One model as a row of the file; the inverse of reading it."""
    row = asdict(model)
    length, width, height = row.pop("body")
    return {**row, "length": length, "width": width, "height": height}


def _blueprint(row: Mapping[str, Any]) -> Blueprint:
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
