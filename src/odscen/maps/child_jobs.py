"""What child processes do: each job takes names of files and values that JSON can have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

# Imported before there is work, for a child that waits for some.
import odscen.convert.building.network  # noqa: F401
from odscen.base.checksums import digest
from odscen.base.errors import OpenDriveError
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.lanegraph.centrelines import MOST_LANES
from odscen.maps.converters import GivenNetwork
from odscen.maps.importers.base import ImportSettings
from odscen.maps.importers.registry import import_map
from odscen.maps.map_build import build_map
from odscen.maps.map_entry import XODR_FILE
from odscen.opendrive.parse import ReadRoads

Progress = Callable[[str, float], None]


def _build_map_job(
    *,
    folder: str,
    name: str,
    file: str,
    builder: str,
    spacing: float,
    converter: Any,
    given: str | None,
    source: str,
    importer: str | None,
    options: Mapping[str, Any],
    edits: str | None,
    times_usual: float,
    progress: Progress,
) -> Mapping[str, Any]:
    """Build the map whose file lies in ``folder`` as its .xodr; tells where that file is then."""
    place = Path(folder)
    xodr = place / XODR_FILE
    content = xodr.read_bytes()
    wish = ImportSettings(importer, options, edits)
    known = ReadRoads()
    opendrive, imported = import_map(content, file, wish, progress=progress, known=known)
    if imported is not None:
        xodr.rename(place / imported.original)
        xodr.write_bytes(opendrive)
    try:
        build_map(
            place,
            name=name,
            file=file,
            sha256=digest(opendrive),
            settings=ConversionSettings(spacing=spacing, converter=converter),
            builder=builder,
            given=None if given is None else GivenNetwork(Path(given).read_bytes(), source),
            imported=imported,
            most_lanes=MOST_LANES * times_usual,
            progress=progress,
            known=known,
        )
    except OpenDriveError as error:
        if imported is not None:
            words = f"importer {imported.importer!r} made OpenDRIVE that cannot be used"
            error.problem = f"{words}: {error.problem}"
        raise
    return {"content": imported.original if imported else XODR_FILE}


def _read_scenario_job(*, path: str, file: str | None, progress: Progress) -> Mapping[str, Any]:
    """Read a scenario in any form, and write its document over it."""
    from odscen.scenario.document.json_form import dumps
    from odscen.scenario.forms.any_form import read_any

    progress("reading the scenario", 0.0)
    target = Path(path)
    target.write_text(dumps(read_any(target.read_bytes(), file=file)), encoding="utf-8")
    return {}


JOBS: Mapping[str, Callable[..., Mapping[str, Any]]] = {
    "map": _build_map_job,
    "scenario": _read_scenario_job,
}
