"""What child processes do: each job takes names of files and values that JSON can have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

# Imported before there is work, for a child that waits for some.
import odscen.convert.building.network  # noqa: F401
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.lanegraph.centrelines import MOST_LANES
from odscen.maps.converters import GivenNetwork
from odscen.maps.map_build import build_map

Progress = Callable[[str, float], None]


def _map(
    *,
    folder: str,
    name: str,
    file: str,
    sha256: str,
    builder: str,
    spacing: float,
    converter: Any,
    given: str | None,
    source: str,
    times_usual: float,
    progress: Progress,
) -> Mapping[str, Any]:
    """Build the map whose .xodr lies in ``folder`` there."""
    build_map(
        Path(folder),
        name=name,
        file=file,
        sha256=sha256,
        settings=ConversionSettings(spacing=spacing, converter=converter),
        builder=builder,
        given=None if given is None else GivenNetwork(Path(given).read_bytes(), source),
        most_lanes=MOST_LANES * times_usual,
        progress=progress,
    )
    return {}


def _scenario(*, path: str, file: str | None, progress: Progress) -> Mapping[str, Any]:
    """Read a scenario in any form, and write its document over it."""
    from odscen.scenario.document.json_form import dumps
    from odscen.scenario.forms.any_form import read_any

    progress("reading the scenario", 0.0)
    target = Path(path)
    target.write_text(dumps(read_any(target.read_bytes(), file=file)), encoding="utf-8")
    return {}


JOBS: Mapping[str, Callable[..., Mapping[str, Any]]] = {"map": _map, "scenario": _scenario}
