"""All importers in one list, and the import of a file by the one that recognises it."""

from __future__ import annotations

import re
from importlib.metadata import entry_points
from pathlib import PurePath
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError, OdscenError
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.learning.offered_options import options_of, values_for
from odscen.maps.importers.argoverse import ArgoverseImporter
from odscen.maps.importers.base import ImportedMap, ImportRecord, MapImporter
from odscen.maps.importers.commonroad import CommonRoadImporter
from odscen.maps.importers.file_kinds import file_kind
from odscen.maps.importers.lanelet2.importer import Lanelet2Importer
from odscen.maps.importers.opendrive import OpenDriveImporter
from odscen.maps.importers.openstreetmap import OpenStreetMapImporter

if TYPE_CHECKING:
    from collections.abc import Callable, Container
    from importlib.metadata import EntryPoint

    from odscen.maps.importers.base import ImportSettings
    from odscen.opendrive.parse import ReadRoads

GROUP = "odscen.map_importers"
"""Group of entry points."""

SHIPPED: tuple[type[MapImporter], ...] = (
    OpenDriveImporter,
    Lanelet2Importer,
    OpenStreetMapImporter,
    CommonRoadImporter,
    ArgoverseImporter,
)
"""Importers of odscen's own, in the order in which they are listed."""

_ORIGINAL = "original"
_USUAL_SUFFIX = re.compile(r"\.[a-z0-9]{1,16}")


class Importers(NamedTuple):
    """Importers by name, and why others that are installed cannot be used, by name."""

    usable: dict[str, MapImporter]
    broken: dict[str, str]


def map_importers() -> Importers:
    """All importers: those that ship, then those of installed packages by name."""
    usable = {kind.name: kind() for kind in SHIPPED}
    broken = {}
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            usable[point.name] = _load_importer(point, taken=usable)
        except Exception as error:  # whatever an import may raise
            broken[point.name] = str(error) or repr(error)
    return Importers(usable, broken)


def _load_importer(point: EntryPoint, *, taken: Container[str]) -> MapImporter:
    """Make the importer of an entry point; raises whatever its package raises."""
    kind = point.load()
    if not (isinstance(kind, type) and issubclass(kind, MapImporter)):
        raise TypeError(f"{point.value} is no subclass of MapImporter")
    importer = kind()
    if importer.name != point.name:
        raise ValueError(f"{point.value} calls itself {importer.name!r}")
    if importer.name in taken:
        raise ValueError("there is an importer of that name already")
    options_of(kind)
    return importer


def importer_named(name: str) -> MapImporter:
    """The importer of a name.

    Raises
    ------
    InputError
        If there is none, or it cannot be used.
    """
    importers = map_importers()
    if name in importers.broken:
        raise InputError(f"importer {name!r} cannot be used: {importers.broken[name]}")
    if name not in importers.usable:
        known = ", ".join(importers.usable)
        raise InputError(
            f"no importer {name!r} is installed, but {known}; install the package that has it"
        )
    return importers.usable[name]


def importer_for(content: bytes, file: str) -> MapImporter:
    """The importer that recognises a file.

    Those that ship are asked first: no package that is installed changes what their files mean.

    Raises
    ------
    InputError
        If none does, with what the file seems to be and what to do; or if several do.
    """
    for kind in SHIPPED:
        if _importer_detects(importer := kind(), content, file):
            return importer
    importers = map_importers()
    found = [
        importer
        for importer in importers.usable.values()
        if _importer_detects(importer, content, file)
    ]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(importer.name for importer in found)
        raise InputError(f"several importers take this file ({names}); choose: --importer NAME")
    seems = file_kind(content, file)
    problem = f"no importer takes this file; it seems to be {seems.what}: {seems.advice}"
    for name, reason in importers.broken.items():
        problem += f"; importer {name!r} cannot be used: {reason}"
    raise InputError(problem)


def import_map(
    content: bytes,
    file: str,
    settings: ImportSettings,
    *,
    progress: Callable[[str, float], None],
    known: ReadRoads | None = None,
) -> tuple[bytes, ImportRecord | None]:
    """Make OpenDRIVE of a file.

    Parameters
    ----------
    known
        Keeps the roads that are read where a map is mended.

    Returns
    -------
    tuple
        The OpenDRIVE, and how it was made; ``None`` if the file is that already, without edits.

    Raises
    ------
    InputError
        If no importer takes the file, an option is not possible, or the importer refuses the file
        or fails; or if an edit cannot be read. Edits that do not fit are rows of the report.
    """
    importer = (
        importer_for(content, file)
        if settings.importer is None
        else importer_named(settings.importer)
    )
    options = values_for(type(importer), settings.options, name=f"importer {importer.name}")
    if isinstance(importer, OpenDriveImporter) and not settings.edits:
        importer.to_opendrive(content, options)
        return content, None
    progress("converting the file to OpenDRIVE", 0.0)
    try:
        imported = importer.to_opendrive(content, options)
        xodr, entries = _check_imported(imported)
    except (OdscenError, MemoryError, OSError):
        raise
    except Exception as error:  # whatever code from outside may raise
        raise InputError(f"importer {importer.name!r} failed: {error!r}") from error
    named = next((end for end in importer.suffixes if file.lower().endswith(end)), None)
    suffix = named or PurePath(file.lower()).suffix
    if not all(_USUAL_SUFFIX.fullmatch(f".{part}") for part in suffix.split(".")[1:]):
        suffix = ""
    record = ImportRecord.of(
        importer, content, original=_ORIGINAL + suffix, options=options, entries=entries
    )
    if settings.edits:
        from odscen.maps.map_edits import mend_map, read_edits

        progress("mending the map", 0.05)
        mended = mend_map(xodr, read_edits(settings.edits), file=file, known=known)
        xodr = mended.xodr
        record = record._replace(entries=(*entries, *mended.entries), edits=mended.edits)
    return xodr, record


def _importer_detects(importer: MapImporter, content: bytes, file: str) -> bool:
    """Whether an importer takes a file; one that fails at that does not, and hides no other."""
    try:
        return bool(importer.detect(content, file))
    except MemoryError:
        raise
    except Exception:  # whatever code from outside may raise
        return False


def _check_imported(imported: ImportedMap) -> tuple[bytes, tuple[ReportEntry, ...]]:
    """The parts of an imported map, of the types that everything else relies on."""
    xodr, rows = imported
    entries = tuple(
        ReportEntry(
            ElementOutcome(row.outcome),
            str(row.element),
            str(row.reason),
            None if row.confidence is None else float(row.confidence),
            None if row.source_id is None else str(row.source_id),
        )
        for row in rows
    )
    for entry in entries:
        if entry.confidence is not None and not 0.0 <= entry.confidence <= 1.0:
            raise ValueError(f"confidence of {entry.element!r} is {entry.confidence}, not 0 to 1")
    return xodr.encode() if isinstance(xodr, str) else bytes(xodr), entries
