"""The workspace: maps, scenarios and runs on disk.

A map is built once (requirement R7) into a folder of its own; the folder is written beside the
final place and renamed into it, so that a half-written map is never visible. Names are checked
before they become paths.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.base.atomic_folders import clear_leftovers, discard, new_folder
from odscen.base.checksums import digest, sums_of, write_sums
from odscen.base.errors import DamagedError, InputError, NotFoundError, OdscenError, in_file
from odscen.base.folder_locks import locked
from odscen.base.given_files import as_path, read_given, read_given_text
from odscen.base.shown import printable
from odscen.base.system_errors import disk_errors
from odscen.convert.model.conversion_settings import USUAL, ConversionSettings
from odscen.maps.allowances import BY_SIZE
from odscen.maps.background import (
    BACKGROUNDS,
    MOST_BYTES,
    find_world_file,
    place_picture,
    read_background,
    write_background,
)
from odscen.maps.folder_names import check_name, is_name, name_from_file
from odscen.maps.importers.base import DETECTED
from odscen.maps.map_entry import INFO_FILE, XODR_FILE, BrokenMap, MapEntry, read_entry
from odscen.maps.map_files import read_map_file
from odscen.maps.map_tiles import MERCATOR, are_tiles, join_tiles
from odscen.simulators.assets import assets_in

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from odscen.base.given_files import GivenPath
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.background import Background, PicturePoint
    from odscen.maps.converters import GivenNetwork
    from odscen.maps.importers.base import ImportSettings
    from odscen.simulators.assets import Assets

BUILDER = "20"
"""Raised whenever what a map folder contains changes; older folders are rebuilt when opened."""

ENVIRONMENT_VARIABLE = "ODSCEN_WORKSPACE"

PATIENCE = 600.0
"""Wall seconds to wait for another process that builds the same map."""

_SUITES = "suite-maps"

ProgressCallback = Callable[[str, float], None]
"""Called with what is being done and the share done, 0 to 1, again and again while nothing changes
too. What it raises ends the work, and nothing is left of it."""


def is_outdated(entry: MapEntry) -> bool:
    """Whether an older odscen or importer has built a map, so that it is rebuilt when opened.

    The map of an importer that is not installed any more is used as it is.
    """
    if entry.info["builder"] != BUILDER:
        return True
    if "import" not in entry.info:
        return False
    from odscen.maps.importers.registry import map_importers

    importer = map_importers().usable.get(entry.info["import"]["importer"])
    return importer is not None and importer.version != entry.info["import"]["version"]


@dataclass(frozen=True, slots=True, init=False)
class Workspace:
    """A folder with ``maps/``, ``scenarios/`` and ``runs/``, and more as needed.

    Attributes
    ----------
    root
        The folder.

    Examples
    --------
    >>> workspace = Workspace.open(Path("my-workspace"))
    >>> workspace.add_map(Path("Town01.xodr")).name
    'Town01'
    """

    root: Path

    def __init__(self, root: GivenPath) -> None:
        object.__setattr__(self, "root", as_path(root))

    @classmethod
    def open(cls, root: GivenPath | None = None) -> Workspace:
        """Open the workspace at ``root``, else ``$ODSCEN_WORKSPACE``, else the user's data folder.

        Raises
        ------
        WorkspaceError
            If it cannot be created or written.
        """
        if root is None:
            root = os.environ.get(ENVIRONMENT_VARIABLE)
            if not root:
                from platformdirs import user_data_path

                root = user_data_path("odscen", appauthor=False)
        own = as_path(root).absolute()
        with _workspace_errors(own):
            (own / "maps").mkdir(parents=True, exist_ok=True)
        for folder in ("maps", f"maps/{BACKGROUNDS}", "runs", "recordings"):
            clear_leftovers(own / folder)
        return cls(own)

    @property
    def scenarios(self) -> Path:
        """Folder that scenarios are written to by default."""
        return self.root / "scenarios"

    @property
    def assets_folder(self) -> Path:
        """Folder of models that were fetched from a simulator."""
        return self.root / "assets"

    def assets(self) -> Assets:
        """Models and weather: those fetched into this workspace, else those that ship."""
        return assets_in(self.assets_folder)

    @property
    def runs(self) -> Path:
        """Folder that runs are written to by default."""
        return self.root / "runs"

    @property
    def sweeps(self) -> Path:
        """Folder of sweeps that were started in the page."""
        return self.root / "sweeps"

    @property
    def recordings(self) -> Path:
        """Folder of recordings that were opened in the page."""
        return self.root / "recordings"

    @property
    def studies(self) -> Path:
        """Folder of studies that were started in the page."""
        return self.root / "studies"

    def of_suites(self) -> Workspace:
        """Where maps are that suites of tests name and this one does not have.

        They are no maps to choose from: a suite is there to be run on changed ones.

        Raises
        ------
        WorkspaceError
            If it cannot be created or written.
        """
        return Workspace.open(self.root / _SUITES)

    def map_names(self) -> list[str]:
        """Names of all maps, sorted; some may be broken, see :meth:`catalogue`."""
        return sorted(name for name in self._map_folders() if self._is_map(name))

    def _map_folders(self) -> list[str]:
        return [folder.name for folder in (self.root / "maps").iterdir()]

    def _is_map(self, name: str) -> bool:
        folder = self.root / "maps" / name
        files = (INFO_FILE, XODR_FILE)
        return is_name(name) and any((folder / file).is_file() for file in files)

    def _has_map(self, name: str) -> bool:
        """Whether there is such a map; asked for each run of many, and does not look at others."""
        return name in self._map_folders() and self._is_map(name)

    def maps(self) -> list[MapEntry]:
        """All maps that can be used, as :meth:`stored` gives them, sorted by name."""
        return self.catalogue()[0]

    def catalogue(self) -> tuple[list[MapEntry], list[BrokenMap]]:
        """All maps, sorted by name: those that can be used, and those that cannot, with why.

        They are as :meth:`stored` gives them: listing builds nothing.
        """
        entries, broken = [], []
        for name in self.map_names():
            try:
                entries.append(self.stored(name))
            except OdscenError as error:
                broken.append(BrokenMap(name, str(error)))
        return entries, broken

    def first_map(self, fits: Callable[[MapEntry], bool]) -> MapEntry | None:
        """Open the first map by name that fits, as it is stored, and is not damaged.

        Those of suites come after all others, see :meth:`of_suites`.
        """
        for map_entry in self.maps():
            if fits(map_entry):
                with suppress(DamagedError):
                    return self.map(map_entry.name)
        suites = Workspace(self.root / _SUITES)
        return suites.first_map(fits) if (suites.root / "maps").is_dir() else None

    def stored(self, name: str) -> MapEntry:
        """One map by name as it is stored: to be listed or compared, as it may be outdated.

        Raises
        ------
        NotFoundError
            If there is no such map.
        DamagedError
            If it is broken.
        """
        if not self._has_map(name):
            raise NotFoundError("map", name, self.map_names())
        return read_entry(self.root / "maps" / name)

    def map(self, name: str) -> MapEntry:
        """Open one map by name; rebuilt first if an older odscen has built it.

        Raises
        ------
        NotFoundError
            If there is no such map.
        DamagedError
            If it is broken.
        OdscenError
            If it is outdated and cannot be rebuilt, as of :meth:`add_map`.
        """
        entry = self.stored(name)
        if not is_outdated(entry):
            return entry
        return self.add_map_content(
            entry.read(entry.source_key),
            file=str(entry.info["source"]),
            name=name,
            settings=entry.conversion,
            importing=entry.importing,
        )

    def map_for(self, name: str, sha256: str) -> MapEntry:
        """Map that a scenario refers to: of the same content, and of the same name if it can be.

        Raises
        ------
        NotFoundError
            If there is no map of that name and none with that content.
        InputError
            If the map of that name has other content.
        """
        broken: OdscenError | None = None
        if self._has_map(name):
            try:
                entry = self.map(name)
            except DamagedError as error:
                broken = error
            else:
                if entry.sha256 == sha256:
                    return entry
        other = self.first_map(lambda map_entry: map_entry.sha256 == sha256)
        if other is not None:
            return other
        if broken is not None:
            raise broken
        if not self._has_map(name):
            raise NotFoundError("map", name, self.map_names())
        raise InputError(
            f"map {name!r} in {self.root} has other content (sha256 {entry.sha256[:12]}...) "
            f"than the one the scenario was made on ({sha256[:12]}...); "
            "add that .xodr under another name"
        )

    def add_map(
        self,
        source: GivenPath,
        *,
        name: str | None = None,
        settings: ConversionSettings = USUAL,
        importing: ImportSettings = DETECTED,
        limits: BuildLimits = BY_SIZE,
        progress: ProgressCallback | None = None,
    ) -> MapEntry:
        """Build everything that later steps need from a file of a map, once.

        Whatever an importer recognises is taken: OpenDRIVE, and the formats of installed packages.
        The original of another format stays in the map's folder.

        A map of the same name is replaced if the file, the settings or the builder differ, and left
        as it is otherwise. A network that was brought in for it stays, unless the file is another
        one or the settings name a converter. The work is done in a child process.

        Parameters
        ----------
        source
            The file, ``.xodr`` or another that an importer recognises.
        name
            Name in the catalogue; the file's stem if not given.
        settings
            How it is converted.
        importing
            Which importer reads it, and with what options.
        limits
            What all of that may use.

        Raises
        ------
        InputError
            If the name, the spacing or the file cannot be used; names file, element and value. It
            says what a file seems to be that no importer takes.
        LimitError
            If the map needs more memory or time than it may have.
        ToolError
            If netconvert cannot convert the map.
        WorkspaceError
            If the workspace cannot be written.
        """
        file = as_path(source)
        name = check_name(name_from_file(file) if name is None else name)
        return self.add_map_content(
            read_map_file(file),
            file=file.name,
            name=name,
            settings=settings,
            importing=importing,
            limits=limits,
            progress=progress,
        )

    def add_map_content(
        self,
        content: bytes,
        *,
        file: str,
        name: str,
        settings: ConversionSettings = USUAL,
        importing: ImportSettings = DETECTED,
        limits: BuildLimits = BY_SIZE,
        network: GivenNetwork | None = None,
        progress: ProgressCallback | None = None,
    ) -> MapEntry:
        """Build a map as :meth:`add_map` does, from the text of a file of that name.

        ``network`` is one that is to be its SUMO network, as of :meth:`set_network`.
        """
        name, file = check_name(name), printable(file)
        final = self.root / "maps" / name
        with _workspace_errors(self.root), self._lock_map(name):
            built = _read_whole_map(final)
            same = built if built and built.source_sha256 == digest(content) else None
            if built:
                importing = importing.with_edits_of(built.importing)
            if network is not None:
                return self._build_and_store(
                    name,
                    content,
                    file,
                    replace(settings, converter="file"),
                    importing,
                    network,
                    limits,
                    progress,
                )
            if settings.converter is None:
                settings = replace(settings, converter=same.converter if same else "odscen")
            if same:
                importing = importing.completed_from(same.importing)
                unchanged = same.conversion == settings and same.importing == importing
                if unchanged and not is_outdated(same):
                    return same
            kept = same is not None and same.converter == settings.converter == "file"
            given = same.given() if same and kept else None
            return self._build_and_store(
                name, content, file, settings, importing, given, limits, progress
            )

    def mend_map(
        self,
        name: str,
        edits: GivenPath | Sequence[Mapping[str, Any]],
        *,
        out: str | None = None,
        anew: bool = False,
        limits: BuildLimits = BY_SIZE,
        progress: ProgressCallback | None = None,
    ) -> MapEntry:
        """Mend a map by edits, which follow those that it has; it is built anew.

        The edits are kept with the map: added from another file under the same name it has them
        again. The import report says of each what it did, or why it does not fit the map.

        Parameters
        ----------
        name
            Of the map.
        edits
            A file, JSON or TOML, or the edits as JSON has them; see ``docs/mending.md``.
        out
            Name of the mended map; the map itself is replaced if not given.
        anew
            Whether these edits take the place of those that the map has.

        Raises
        ------
        NotFoundError
            If there is no such map.
        InputError
            If an edit is wrong; names the edit, the field and the value.
        LimitError
            If it needs more memory or time than it may have.
        WorkspaceError
            If the workspace cannot be written.
        """
        from odscen.maps.map_edits import check_edits, edits_text, read_edits

        entry = self.map(name)
        if isinstance(edits, str | os.PathLike):
            file = as_path(edits)
            with in_file(file.name):
                added = read_edits(read_given_text(file))
        else:
            added = check_edits(list(edits))
        before = read_edits(entry.importing.edits or "[]") if not anew else []
        out = name if out is None else out
        mended = self.add_map_content(
            entry.read(entry.source_key),
            file=str(entry.info["source"]),
            name=out,
            settings=entry.conversion,
            importing=replace(
                entry.importing,
                edits=edits_text([*before, *added]) if before or added else "",
            ),
            limits=limits,
            progress=progress,
        )
        self._copy_background(name, out)
        return mended

    def renew_map(
        self,
        name: str,
        content: bytes,
        *,
        file: str,
        out: str | None = None,
        limits: BuildLimits = BY_SIZE,
        progress: ProgressCallback | None = None,
    ) -> MapEntry:
        """Import a newer file of the same place, with the edits that a map has.

        The import report says of each edit whether it still fits. Options of the importer stay
        where the file ends as the one before; a network that was brought in does not.

        Parameters
        ----------
        name
            Of the map.
        content, file
            The newer file, and its name.
        out
            Name of the map that is made; the map itself is replaced if not given.

        Raises
        ------
        NotFoundError
            If there is no such map.
        InputError
            If the file is refused.
        LimitError
            If it needs more memory or time than it may have.
        WorkspaceError
            If the workspace cannot be written.
        """
        entry = self.map(name)
        importing = entry.importing
        if Path(file).suffix.lower() != Path(str(entry.info["source"])).suffix.lower():
            importing = replace(DETECTED, edits=importing.edits)
        settings = entry.conversion
        if settings.converter == "file":
            settings = replace(settings, converter="odscen")
        out = name if out is None else out
        renewed = self.add_map_content(
            content,
            file=file,
            name=out,
            settings=settings,
            importing=replace(importing, edits=importing.edits or ""),
            limits=limits,
            progress=progress,
        )
        self._copy_background(name, out)
        return renewed

    def _copy_background(self, name: str, out: str) -> None:
        under = self.background(name)
        if under is not None and self.background(out) is None:
            write_background(self._background_folder(out), under.read(), under)

    def background(self, name: str) -> Background | None:
        """Picture under a map; ``None`` if it has none.

        Raises
        ------
        NotFoundError
            If there is no such map.
        DamagedError
            If what is said of its place is not as it was written.
        """
        return read_background(self._background_folder(name))

    def set_background(
        self,
        name: str,
        picture: GivenPath | bytes,
        *,
        source: str | None = None,
        world: str | None = None,
        crs: str | None = None,
        points: Sequence[PicturePoint] = (),
    ) -> Background:
        """Lay a picture under a map, in place of the one that it has.

        Parameters
        ----------
        picture
            PNG, JPEG or TIFF: a file, whose world file is looked for beside it, or its content; or
            tiles of a web map, a folder or an MBTiles file, see :mod:`odscen.maps.map_tiles`.
        source
            Name that is shown; of the file if not given.
        world
            Text of a world file; its numbers are in ``crs``, or in metres of the map.
        crs
            Coordinate reference system, for example ``EPSG:25832``.
        points
            Two or more places that are known in the picture and on the map; they go before the
            world file and the tags of a GeoTIFF.

        Raises
        ------
        NotFoundError
            If there is no such map.
        InputError
            If the picture cannot be read or is too large, or its place is not known.
        MissingDependencyError
            Of a TIFF or tiles, if Pillow is not installed.
        WorkspaceError
            If it cannot be written.
        """
        from odscen.opendrive.parse import parse

        entry = self.stored(name)
        header = parse(entry.read("xodr"), file=entry.name).header
        bounds = entry.statistics().bounds
        if isinstance(picture, bytes):
            content, file = picture, None
        elif are_tiles(file := as_path(picture)):
            with in_file(file.name):
                content, world = join_tiles(file, header, bounds)
            crs = MERCATOR
        else:
            content = read_given(file, most=MOST_BYTES)
        if file is not None and world is None and (beside := find_world_file(file)) is not None:
            world = read_given_text(beside)
        with in_file(source or (file.name if file else "picture")):
            content, placed = place_picture(
                content,
                source=source or (file.name if file else "picture"),
                header=header,
                bounds=bounds,
                world=world,
                crs=crs,
                points=points,
            )
        return write_background(self._background_folder(name), content, placed)

    def remove_background(self, name: str) -> None:
        """Take the picture under a map away, if it has one.

        Raises
        ------
        NotFoundError
            If there is no such map.
        WorkspaceError
            If it cannot be removed.
        """
        folder = self._background_folder(name)
        if folder.is_dir():
            with disk_errors(f"the picture under map {name!r}"):
                discard(folder)

    def _background_folder(self, name: str) -> Path:
        if not self._has_map(name):
            raise NotFoundError("map", name, self.map_names())
        return self.root / "maps" / BACKGROUNDS / name

    def set_network(
        self,
        name: str,
        source: GivenPath,
        *,
        limits: BuildLimits = BY_SIZE,
        progress: ProgressCallback | None = None,
    ) -> MapEntry:
        """Make a SUMO network from outside that of a map; the lane table is made anew by geometry.

        Parameters
        ----------
        name
            Of the map.
        source
            The ``.net.xml``: the map's own after changes in netedit, or any other of this map.
        limits
            What building the map may use.

        Raises
        ------
        NotFoundError
            If there is no such map.
        InputError
            If the file cannot be read, is no network, or none of this map; the map stays as it is.
        LimitError
            If it needs more memory or time than it may have.
        WorkspaceError
            If the workspace cannot be written.
        """
        from odscen.maps.converters import GivenNetwork

        entry = self.map(name)
        network = as_path(source)
        given = GivenNetwork(read_given(network), network.name)
        settings = replace(entry.conversion, converter="file")
        content, file = entry.read(entry.source_key), str(entry.info["source"])
        with _workspace_errors(self.root), self._lock_map(name):
            return self._build_and_store(
                name, content, file, settings, entry.importing, given, limits, progress
            )

    def _lock_map(self, name: str) -> AbstractContextManager[int]:
        """Hold the lock of a map; another process that builds it is waited for."""
        return locked(self.root / "maps" / name, what=f"map {name!r}", patience=PATIENCE)

    def _build_and_store(
        self,
        name: str,
        content: bytes,
        file: str,
        settings: ConversionSettings,
        importing: ImportSettings,
        given: GivenNetwork | None,
        limits: BuildLimits,
        progress: ProgressCallback | None,
    ) -> MapEntry:
        from odscen.maps.guarded_build import build_in_child

        final = self.root / "maps" / name
        with in_file(file), new_folder(final) as folder:
            source = build_in_child(
                content,
                folder,
                name=name,
                file=file,
                settings=settings,
                builder=BUILDER,
                given=given,
                importing=importing,
                limits=limits,
                progress=progress,
            )
            write_sums(folder, sums_of(folder, known={source: digest(content)}))
            info = read_entry(folder).info
        logging.getLogger("odscen").info("map %s: built in %s", name, final)
        return MapEntry(name, final, info)


def _read_whole_map(folder: Path) -> MapEntry | None:
    """A map that is there with all of its files as they were written, else ``None``."""
    try:
        entry = read_entry(folder)
    except DamagedError:
        return None
    return None if entry.damaged() else entry


def _workspace_errors(root: Path) -> AbstractContextManager[None]:
    return disk_errors(f"workspace {root}")
