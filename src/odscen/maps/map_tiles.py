"""Tiles of a web map that lie on this machine, joined to one picture.

A folder ``ZOOM/COLUMN/ROW.png`` (or ``.jpg``), rows counted from the north as web maps do, or an
MBTiles file (https://github.com/mapbox/mbtiles-spec), which counts them from the south. Tiles are
squares in Web Mercator, EPSG:3857.
"""

from __future__ import annotations

import io
import math
import sqlite3
import warnings
from contextlib import closing, contextmanager, suppress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.errors import InputError, MissingDependencyError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from PIL import Image

    from odscen.base.arrays import Bounds
    from odscen.opendrive.road_model import Header

MERCATOR = "EPSG:3857"
_HALF = math.pi * 6_378_137.0
"""Metres from the middle of Web Mercator's square to its sides."""
_MOST_ZOOM = 24
_MOST_TILE = 4 << 20
"""Bytes of a tile."""
_SIZES = (256, 512)
"""Pixels of a side of a tile."""
_MOST_SIDE, _MOST_PIXELS = 8_192, 40_000_000
"""Of the picture: of more, tiles of a lower zoom are taken."""
_MARGIN = 20.0
"""Metres around the map."""


class JoinedTiles(NamedTuple):
    """A picture of tiles, PNG, and its world file, whose numbers are in :data:`MERCATOR`."""

    content: bytes
    world: str


def are_tiles(path: Path) -> bool:
    """Whether a path is a folder, or a file of tiles by its name."""
    return path.is_dir() or path.suffix.lower() == ".mbtiles"


def join_tiles(path: Path, header: Header, bounds: Bounds) -> JoinedTiles:
    """Join the tiles that lie under a map, of the highest zoom whose picture is not too large.

    Parameters
    ----------
    path
        A folder of tiles, or an MBTiles file.
    header, bounds
        Of the map.

    Raises
    ------
    InputError
        If the map has no georeference, there are no tiles under it, or one cannot be read.
    MissingDependencyError
        If Pillow is not installed.
    """
    west, south, east, north = _bounds_in_mercator(header, bounds)
    with closing(_open_source(path)) as source:
        for zoom in sorted(source.zooms(), reverse=True):
            side = 2.0 * _HALF / 2**zoom
            columns = range(
                math.floor((west + _HALF) / side), math.floor((east + _HALF) / side) + 1
            )
            rows = range(math.floor((_HALF - north) / side), math.floor((_HALF - south) / side) + 1)
            if _is_too_large(columns, rows, _SIZES[0]):
                continue
            tiles = {
                (column, row): content
                for column in columns
                for row in rows
                if (content := source.read(zoom, column, row)) is not None
            }
            if not tiles:
                continue
            if not _is_too_large(columns, rows, _measure_tile(*next(iter(tiles.items())))):
                corner = (columns.start * side - _HALF, _HALF - rows.start * side)
                return _paste_tiles(tiles, columns, rows, side, corner)
    raise InputError("no tile lies under the map")


def _is_too_large(columns: range, rows: range, pixels: int) -> bool:
    """Whether a picture of tiles with so many pixels a side is larger than it may be."""
    width, height = len(columns) * pixels, len(rows) * pixels
    return max(width, height) > _MOST_SIDE or width * height > _MOST_PIXELS


def _measure_tile(place: tuple[int, int], content: bytes) -> int:
    """Pixels of a side of a tile."""
    with _open_tile(place, content) as tile:
        return int(tile.size[0])


def _bounds_in_mercator(header: Header, bounds: Bounds) -> Bounds:
    import pyproj

    if header.crs is None:
        raise InputError(
            "the map has no georeference that is understood; tiles cannot be placed",
            element="geoReference",
        )
    x0, y0, _, hdg = header.offset
    x = np.array([bounds[0] - _MARGIN, bounds[2] + _MARGIN])[[0, 1, 0, 1]]
    y = np.array([bounds[1] - _MARGIN, bounds[3] + _MARGIN])[[0, 0, 1, 1]]
    cos, sin = math.cos(hdg), math.sin(hdg)
    with warnings.catch_warnings(action="ignore"):  # of old ways to write one
        transformer = pyproj.Transformer.from_crs(header.crs, MERCATOR, always_xy=True)
    east, north = transformer.transform(cos * x - sin * y + x0, sin * x + cos * y + y0)
    if not (np.isfinite(east).all() and np.isfinite(north).all()):
        raise InputError("the map lies where Web Mercator has no place")
    return float(east.min()), float(north.min()), float(east.max()), float(north.max())


def _paste_tiles(
    tiles: dict[tuple[int, int], bytes],
    columns: range,
    rows: range,
    side: float,
    corner: tuple[float, float],
) -> JoinedTiles:
    from PIL import Image

    pixels, joined = 0, None
    for (column, row), content in sorted(tiles.items()):
        with _open_tile((column, row), content) as tile:
            if joined is None:
                pixels = tile.size[0]
                joined = Image.new("RGBA", (len(columns) * pixels, len(rows) * pixels))
            elif tile.size[0] != pixels:
                name = f"tile {column}/{row}"
                raise InputError(f"{name} has another size than the others")
            place = (column - columns.start) * pixels, (row - rows.start) * pixels
            joined.paste(tile.convert("RGBA"), place)
    assert joined is not None
    out = io.BytesIO()
    joined.save(out, "PNG")
    size = side / pixels
    world = (size, 0.0, 0.0, -size, corner[0] + size / 2.0, corner[1] - size / 2.0)
    return JoinedTiles(out.getvalue(), "\n".join(f"{number!r}" for number in world))


@contextmanager
def _open_tile(place: tuple[int, int], content: bytes) -> Iterator[Image.Image]:
    """Open a tile for as long as it is looked at; whatever fails meanwhile is the tile's fault."""
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError:
        raise MissingDependencyError("tiles need Pillow: pip install 'odscen[png]'") from None
    column, row = place
    name = f"tile {column}/{row}"
    try:
        with (
            warnings.catch_warnings(action="error"),
            Image.open(io.BytesIO(content), formats=("PNG", "JPEG")) as tile,
        ):
            if tile.size not in [(size, size) for size in _SIZES]:
                raise InputError(f"{name} has {tile.size[0]} x {tile.size[1]} pixels")
            yield tile
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError, Warning) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name} is no PNG or JPEG that can be read") from error


def _open_source(path: Path) -> _Folder | _MBTiles:
    return _Folder(path) if path.is_dir() else _MBTiles(path)


class _Folder:
    def __init__(self, path: Path) -> None:
        self._path = path

    def zooms(self) -> list[int]:
        names = (entry.name for entry in self._path.iterdir() if entry.is_dir())
        return [int(name) for name in names if name.isdecimal() and int(name) <= _MOST_ZOOM]

    def read(self, zoom: int, column: int, row: int) -> bytes | None:
        for ending in ("png", "jpg", "jpeg"):
            file = self._path / str(zoom) / str(column) / f"{row}.{ending}"
            with suppress(FileNotFoundError), file.open("rb") as content:
                return _refuse_large(content.read(_MOST_TILE + 1), file.name)
        return None

    def close(self) -> None:
        """Nothing is open."""


class _MBTiles:
    def __init__(self, path: Path) -> None:
        if not path.is_file():
            raise InputError("there is no such file", file=path.name)
        self._connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)

    def zooms(self) -> list[int]:
        levels = self._select_rows("SELECT DISTINCT zoom_level FROM tiles")
        return [zoom for (zoom,) in levels if isinstance(zoom, int) and 0 <= zoom <= _MOST_ZOOM]

    def read(self, zoom: int, column: int, row: int) -> bytes | None:
        tiles = self._select_rows(
            "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?",
            (zoom, column, 2**zoom - 1 - row),
        )
        if not tiles or not isinstance(tiles[0][0], bytes):
            return None
        return _refuse_large(tiles[0][0], f"{zoom}/{column}/{row}")

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def _select_rows(self, query: str, values: tuple[int, ...] = ()) -> list[tuple[object, ...]]:
        try:
            return self._connection.execute(query, values).fetchall()
        except sqlite3.DatabaseError as error:
            raise InputError(f"no MBTiles file: {error}") from error


def _refuse_large(content: bytes, name: str) -> bytes:
    if len(content) > _MOST_TILE:
        raise InputError(f"tile {name} has more than {_MOST_TILE >> 20} MB")
    return content
