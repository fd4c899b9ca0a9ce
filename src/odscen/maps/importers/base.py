"""The seam for maps of other formats: an importer recognises a file and makes OpenDRIVE of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from odscen.base.checksums import digest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.model.conversion_report import ReportEntry
    from odscen.learning.offered_options import OptionValue


class ImportedMap(NamedTuple):
    """What an importer has made of a file.

    Attributes
    ----------
    xodr
        OpenDRIVE 1.4 to 1.8. It is read as any other file is: what is wrong in it is refused.
    entries
        Rows of the import report: what became of the elements of the file, each with the id that it
        has there (``source_id``) and how sure the importer is (``confidence``, 0 to 1).
    """

    xodr: str | bytes
    entries: Sequence[ReportEntry] = ()


class MapImporter(ABC):
    """One format that maps can have.

    Packages offer theirs by entry points of the group ``odscen.map_importers``, under their names;
    ``odscen maps add`` then takes such files. Both methods run in a child process with limits of
    memory and time, and what they raise refuses the file: an
    :class:`~odscen.base.errors.InputError` in its own words, with place and value.

    The same bytes and options must give the same OpenDRIVE: a map is made anew from the original
    file whenever ``version`` changes, and scenarios name their map by the hash of its OpenDRIVE.

    Attributes
    ----------
    name
        Of the format, as ``--importer`` takes it.
    label
        Its name for people.
    suffixes
        Endings of its files, with the dot, in lower case.
    version
        Raised whenever the OpenDRIVE or the rows of a file change.
    options
        JSON Schema of an object: what can be chosen; see :mod:`odscen.learning.offered_options`.

    Examples
    --------
    >>> class Square(MapImporter):
    ...     name, label, suffixes, version = "square", "squares of one number", (".square",), "1"
    ...     options = {"properties": {"speed": {"type": "number", "default": 13.9}}}
    ...
    ...     def to_opendrive(self, content, options):
    ...         side = float(content)
    ...         row = ReportEntry(ElementOutcome.GUESSED, "road 1", "a lane of 3.5 m", 0.5, "side")
    ...         return ImportedMap(f"<OpenDRIVE>{side:g} m, {options['speed']:g} m/s...", [row])
    >>> Square().detect(b"80", "town.square"), Square().detect(b"80", "town.txt")
    (True, False)
    >>> Square().to_opendrive(b"80", {"speed": 8.3}).xodr
    '<OpenDRIVE>80 m, 8.3 m/s...'
    """

    name: ClassVar[str]
    label: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    version: ClassVar[str]
    options: ClassVar[Any] = {"properties": {}}

    def detect(self, content: bytes, file: str) -> bool:
        """Whether a file is of this format; by the ending of its name, if not overridden.

        Parameters
        ----------
        content
            All of it; tens of megabytes may be searched, but should not be parsed here.
        file
            Its name without folders.
        """
        return bool(content) and file.lower().endswith(self.suffixes)

    @abstractmethod
    def to_opendrive(self, content: bytes, options: Mapping[str, OptionValue]) -> ImportedMap:
        """Make OpenDRIVE of a file that :meth:`detect` has recognised.

        Parameters
        ----------
        options
            All of :attr:`options`, checked, the usual values for those that were not given.
        """


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """What a user wishes of the import of a file.

    Attributes
    ----------
    importer
        Its name; ``None`` is the one that recognises the file.
    options
        Of the importer; those that are not given have their usual values.
    edits
        Text of the edits that mend its OpenDRIVE (:mod:`odscen.maps.map_edits`); ``None`` are those
        that a map of the same name has, if there is one.
    """

    importer: str | None = None
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    edits: str | None = None

    def completed_from(self, stored: ImportSettings) -> ImportSettings:
        """The same wish for a map that is there already: what it does not name stays."""
        if self.importer not in (None, stored.importer):
            return self
        return ImportSettings(stored.importer, {**stored.options, **self.options}, self.edits)

    def with_edits_of(self, stored: ImportSettings) -> ImportSettings:
        """The same wish; edits of the map that is there stay, if it names none."""
        return replace(self, edits=stored.edits) if self.edits is None else self


DETECTED = ImportSettings()
"""An import without any wish."""


class ImportRecord(NamedTuple):
    """How a map was made from a file of another format.

    Attributes
    ----------
    importer, version, options
        Of the importer; all options, with usual values.
    sha256
        Of the original file, hexadecimal.
    original
        Its name in the map's folder.
    entries
        Rows of the importer, for the import report, and of the edits.
    edits
        Text of the edits that mend its OpenDRIVE.
    """

    importer: str
    version: str
    options: Mapping[str, OptionValue]
    sha256: str
    original: str
    entries: tuple[ReportEntry, ...]
    edits: str | None = None

    @classmethod
    def of(
        cls,
        importer: MapImporter,
        content: bytes,
        *,
        original: str,
        options: Mapping[str, OptionValue],
        entries: tuple[ReportEntry, ...],
    ) -> ImportRecord:
        """Record the import of a file."""
        return cls(importer.name, importer.version, options, digest(content), original, entries)

    def to_dict(self) -> dict[str, Any]:
        """Form for ``map.json``, without the rows, which are in the import report."""
        values = {key: value for key, value in self._asdict().items() if key != "entries"}
        return {key: value for key, value in values.items() if key != "edits" or value}
