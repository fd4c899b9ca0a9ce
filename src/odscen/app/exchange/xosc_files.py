"""Where the files lie that an OpenSCENARIO file names: catalogs, its scenario, its map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

from odscen.base.checksums import digest
from odscen.base.errors import InputError, NotFoundError
from odscen.base.given_files import read_given
from odscen.base.xml_reading import read_xml

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lxml.etree import _Element

    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace

_MOST = 20_000_000
"""Bytes of an OpenSCENARIO file or catalog."""
_ABOVE = 3
"""Folders above a file that may have the catalogs it names."""


class XoscFiles(Protocol):
    """An OpenSCENARIO file, and what it names."""

    @property
    def name(self) -> str:
        """What the report calls the file."""

    @property
    def where(self) -> str:
        """What messages call it."""

    def tree(self) -> _Element:
        """Its root element."""

    def other(self, named: str) -> XoscFiles:
        """A file that it names as its scenario."""

    def catalogs(self, folders: tuple[str, ...]) -> Iterator[tuple[_Element, str]]:
        """Roots of files that may be its catalogs, and their names."""

    def map(self, workspace: Workspace, named: str) -> MapEntry:
        """The map that it names; added to the workspace if need be."""


@dataclass(frozen=True, slots=True)
class FolderFiles:
    """A file on the disk, and what lies around it.

    Attributes
    ----------
    file
        The file.
    maps
        Another folder of maps.
    on_map
        The map that is taken whatever the file names.
    """

    file: Path
    maps: Path | None = None
    on_map: MapEntry | None = None

    @property
    def name(self) -> str:
        """Name of the file without its folder."""
        return self.file.name

    @property
    def where(self) -> str:
        """The file with its folder."""
        return str(self.file)

    def tree(self) -> _Element:
        """Its root element."""
        return read_tree(self.file, name=self.where)

    def other(self, named: str) -> FolderFiles:
        """A file that it names, relative to its folder."""
        return FolderFiles(self.file.parent / _slashes(named), self.maps, self.on_map)

    def catalogs(self, folders: tuple[str, ...]) -> Iterator[tuple[_Element, str]]:
        """All OpenSCENARIO files in these folders, relative to its own or one above.

        Euro NCAP's collection names those in ``NCAP/SET/`` as if from ``NCAP/``.
        """
        above = (self.file.parent, *self.file.absolute().parents[1 : 1 + _ABOVE])
        for folder in folders:
            places = [one / _slashes(folder) for one in above]
            there = next((one for one in places if one.is_dir()), places[0])
            for other in sorted(there.glob("*.xosc")):
                yield read_tree(other, name=str(other)), other.name

    def map(self, workspace: Workspace, named: str) -> MapEntry:
        """The map: a file that is found is added to the workspace.

        Raises
        ------
        NotFoundError
            If there is no such file, and no map of that name in the workspace.
        """
        if self.on_map is not None:
            return self.on_map
        bare = bare_map(named)
        if not bare:
            raise NotFoundError("map", "", workspace.map_names())
        folders = (self.file.parent, self.file.parent.parent / "xodr")
        places = [self.file.parent / _slashes(named)]
        places += [one / f"{bare}.xodr" for one in (*folders, *((self.maps,) if self.maps else ()))]
        for place in places:
            if place.is_file():
                return known_or_added(workspace, place)
        if bare in workspace.map_names():
            return workspace.map(bare)
        raise NotFoundError("map", bare, workspace.map_names())


class GivenXosc(NamedTuple):
    """A file that was sent: the name that its sender gave it, which is no path, and its content."""

    name: str
    path: Path


@dataclass(frozen=True, slots=True)
class SentFiles:
    """A file that was sent, together with others; nothing else on the disk is looked at.

    Attributes
    ----------
    main
        Which of them is the scenario, or the distribution.
    given
        All that were sent.
    map_name
        The map in the workspace, once that is settled.
    """

    main: int
    given: tuple[GivenXosc, ...]
    map_name: str | None = None

    @property
    def name(self) -> str:
        """Name that the sender gave it."""
        return self.given[self.main].name

    @property
    def where(self) -> str:
        """The same."""
        return self.name

    def tree(self) -> _Element:
        """Its root element."""
        return read_tree(self.given[self.main].path, name=self.name)

    def other(self, named: str) -> SentFiles:
        """The file of that name, whatever folder is named with it.

        Raises
        ------
        InputError
            If it was not sent.
        """
        bare = _slashes(named).rpartition("/")[2]
        for row, one in enumerate(self.given):
            if one.name == bare and row != self.main:
                return SentFiles(row, self.given, self.map_name)
        raise InputError(
            f"it varies the scenario {bare!r}, which was not sent with it; send both files",
            file=self.name,
        )

    def catalogs(self, folders: tuple[str, ...]) -> Iterator[tuple[_Element, str]]:  # noqa: ARG002 - they are told by their names
        """All other files of OpenSCENARIO, whatever folders are named."""
        for row, one in sorted(enumerate(self.given), key=lambda pair: pair[1].name):
            if row != self.main:
                yield read_tree(one.path, name=one.name), one.name

    def map(self, workspace: Workspace, named: str) -> MapEntry:
        """The map that was settled.

        Raises
        ------
        NotFoundError
            If none was.
        """
        name = self.map_name or bare_map(named)
        return workspace.map(name)


def given_map(workspace: Workspace, given: str) -> MapEntry:
    """Map that somebody names: an OpenDRIVE file, or the name of a map of the workspace.

    Raises
    ------
    InputError
        If the file cannot be read.
    NotFoundError
        If there is no map of that name.
    """
    if given.lower().endswith(".xodr"):
        return known_or_added(workspace, Path(given))
    return workspace.map(given)


def known_or_added(workspace: Workspace, file: Path) -> MapEntry:
    """The map of the workspace that has the content of a file; added if there is none."""
    sha256 = digest(read_given(file))
    there = workspace.first_map(lambda one: one.sha256 == sha256)
    return workspace.add_map(file) if there is None else there


def bare_map(named: str) -> str:
    """Name of a map as a file names it, without folder and ending."""
    return _slashes(named).rpartition("/")[2].removesuffix(".xodr")


def read_tree(path: Path, *, name: str) -> _Element:
    """Root element of an OpenSCENARIO file.

    Raises
    ------
    InputError
        If it cannot be read, or is something else; names the file as ``name``.
    """
    try:
        root = read_xml(read_given(path, most=_MOST), bare=True)
    except InputError as error:
        raise InputError(error.problem, file=name) from error
    if root.tag != "OpenSCENARIO":
        raise InputError(f"the root element is {root.tag!r}, not 'OpenSCENARIO'", file=name)
    return root


def _slashes(path: str) -> str:
    return path.replace("\\", "/")
