"""A picture under a map: an aerial photograph or a plan, and where on the map it lies.

A place comes from a world file, from the tags of a GeoTIFF, or from points whose places in the
picture and on the map are both known. Nothing is fetched from anywhere.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, cast

import numpy as np

from odscen.base.atomic_folders import new_folder, scratch_folder
from odscen.base.checksums import SUMS_FILE, read_checked, read_sums, sums_of, write_sums
from odscen.base.errors import InputError, MissingDependencyError, in_file
from odscen.base.shown import shown
from odscen.base.stored_files import stored_document
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_file, write_text
from odscen.maps.allowances import for_picture
from odscen.maps.child_process import work_in_child

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.base.arrays import Bounds, FloatArray
    from odscen.opendrive.road_model import Header

BACKGROUNDS = ".backgrounds"
"""Folder beside maps with the pictures that lie under them, and inside a removed map."""
MOST_BYTES = 100 * 1024 * 1024
MOST_SIDE = 16_384
"""Pixels of a side: what browsers draw."""
MOST_PIXELS = 100_000_000
_FARTHEST = 1e9
"""Units of any coordinate reference system, and pixels, beyond which nothing lies."""
_LARGEST = 1e6
"""Metres that a side of a picture may have on the map."""
_MOST_CRS = 4000
"""Letters of a coordinate reference system as WKT."""
_FORM, _VERSION = "odscen-background", 1
_FILE = "background.json"
_SENT, _UNPACKED = "sent.tif", "picture.png"
_SHIFT = 0.5
"""Metres by which a straight picture may miss its places once they are on the map's projection."""
_WORLD_SUFFIXES = (".wld", ".pgw", ".pngw", ".jgw", ".jpgw", ".jpegw", ".tfw", ".tifw")

Affine = tuple[float, float, float, float, float, float]
"""``a, b, c, d, e, f`` of ``x = a column + b row + c``, ``y = d column + e row + f``, metres of the
map. Columns and rows count from the upper left corner of the picture."""

MediaType = Literal["image/png", "image/jpeg"]
_ENDINGS: dict[MediaType, str] = {"image/png": "png", "image/jpeg": "jpg"}


class PicturePoint(NamedTuple):
    """A place that is known in the picture, pixels, and on the map, metres."""

    column: float
    row: float
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Background:
    """A picture that lies under a map.

    Attributes
    ----------
    path
        The picture's file.
    source
        What the file was called that it came from.
    media_type
        PNG or JPEG.
    width, height
        Pixels.
    affine
        From pixels to metres of the map.
    """

    path: Path
    source: str
    media_type: MediaType
    width: int
    height: int
    affine: Affine

    def read(self) -> bytes:
        """Content of the picture, which is as it was written.

        Raises
        ------
        DamagedError
            If it was changed since.
        """
        folder = self.path.parent
        return read_checked(folder, self.path.name, read_sums(folder) or {})

    def to_dict(self) -> dict[str, object]:
        """As JSON has it."""
        return {
            "file": str(self.path),
            "source": self.source,
            "media_type": self.media_type,
            "width": self.width,
            "height": self.height,
            "affine": list(self.affine),
            "bounds": list(self.bounds()),
        }

    def bounds(self) -> Bounds:
        """Least and largest x and y, m."""
        x, y = _place_pixels(self.affine, _find_corners(self.width, self.height))
        return float(x.min()), float(y.min()), float(x.max()), float(y.max())


class _Decoded(NamedTuple):
    """A picture that a browser can draw, and the place that its own tags give."""

    content: bytes
    media_type: MediaType
    width: int
    height: int
    placed: Affine | None = None
    crs: str | None = None


def find_world_file(picture: Path) -> Path | None:
    """Return the world file beside a picture, by its name."""
    for suffix in _WORLD_SUFFIXES:
        for ending in (suffix, suffix.upper()):
            if (file := picture.with_suffix(ending)).is_file():
                return file
    return None


def parse_world_file(text: str) -> Affine:
    """Read the six numbers of a world file, which are for the middles of pixels.

    Raises
    ------
    InputError
        If they are not six numbers, or do not span a plane.
    """
    words = text.split()
    try:
        a, d, b, e, c, f = (float(word) for word in words)
    except ValueError:
        raise InputError(f"a world file has six numbers, not {' '.join(words)[:60]!r}") from None
    return _refuse_flat((a, b, c - (a + b) / 2, d, e, f - (d + e) / 2))


def fit_points(points: Sequence[PicturePoint]) -> Affine:
    """Turn, scale and move a picture so that its points lie where they are on the map.

    Two points say it; of more the one that misses them least is taken.

    Raises
    ------
    InputError
        If there are fewer than two points, or all are at one place.
    """
    if len(points) < 2:
        raise InputError(f"two points or more place a picture, not {len(points)}")
    rows = np.array(points, dtype=np.float64)
    if not (np.abs(rows) <= _FARTHEST).all():
        raise InputError(f"points of a picture must be numbers up to {_FARTHEST:,.0f}")
    # Rows go down and y goes up: a similarity of complex numbers after that.
    there, here = rows[:, 0] - 1j * rows[:, 1], rows[:, 2] + 1j * rows[:, 3]
    spread = there - there.mean()
    if np.abs(spread).max() < 1.0 or np.ptp(here.real) + np.ptp(here.imag) < 1e-3:
        raise InputError("the points of a picture must be at different places")
    turn = complex((spread.conj() @ (here - here.mean())) / (spread.conj() @ spread))
    move = complex(here.mean() - turn * there.mean())
    return _refuse_flat((turn.real, turn.imag, move.real, turn.imag, -turn.real, move.imag))


def place_picture(
    content: bytes,
    *,
    source: str,
    header: Header,
    bounds: Bounds,
    world: str | None = None,
    crs: str | None = None,
    points: Sequence[PicturePoint] = (),
) -> tuple[bytes, Background]:
    """Read a picture and find where it lies on a map.

    Parameters
    ----------
    content
        PNG, JPEG or TIFF.
    source
        Name of its file.
    header, bounds
        Of the map.
    world
        Text of a world file; its numbers are in ``crs``, or in the map's own coordinates.
    crs
        Coordinate reference system of the world file, or of a GeoTIFF whose tags do not say it.
    points
        Places that are known; they go before everything else.

    Returns
    -------
    tuple of bytes and Background
        The picture as PNG or JPEG, and its place; ``path`` is its name only.

    Raises
    ------
    InputError
        If the picture cannot be read or is too large, nothing says where it lies, or it lies
        outside the map.
    MissingDependencyError
        Of a TIFF, if Pillow is not installed.
    """
    decoded = _decode_picture(content)
    if points:
        affine = fit_points(points)
    elif world is not None:
        affine = _onto_map(parse_world_file(world), crs, header, decoded)
    elif decoded.placed is not None:
        affine = _onto_map(decoded.placed, decoded.crs or crs, header, decoded)
    else:
        raise InputError(
            "nothing says where the picture lies: give a world file, a GeoTIFF, or two points"
        )
    placed = Background(
        Path(f"picture.{_ENDINGS[decoded.media_type]}"),
        source,
        decoded.media_type,
        decoded.width,
        decoded.height,
        affine,
    )
    _refuse_elsewhere(placed.bounds(), bounds)
    return decoded.content, placed


def write_background(folder: Path, content: bytes, background: Background) -> Background:
    """Put a picture into a folder, in place of the one that is there.

    Raises
    ------
    WorkspaceError
        If it cannot be written.
    """
    with disk_errors("the picture under a map"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        with new_folder(folder) as made:
            write_file(made / background.path.name, content)
            described = {
                "format": _FORM,
                "version": _VERSION,
                "file": background.path.name,
                "source": background.source,
                "media_type": background.media_type,
                "width": background.width,
                "height": background.height,
                "affine": list(background.affine),
            }
            write_text(made / _FILE, json.dumps(described, indent=2) + "\n")
            write_sums(made, sums_of(made), hidden=True)
    found = read_background(folder)
    assert found is not None
    return found


def read_background(folder: Path) -> Background | None:
    """Read the picture of a folder; ``None`` if there is none.

    Raises
    ------
    DamagedError
        If what is said of its place is not as it was written.
    """
    if not (folder / SUMS_FILE).is_file():
        return None
    file = folder / _FILE
    content = read_checked(folder, _FILE, read_sums(folder) or {})
    with (
        in_file(str(file)),
        stored_document(
            content, form=_FORM, version=_VERSION, what="the place of a picture"
        ) as told,
    ):
        media = cast("MediaType", str(told["media_type"]))
        a, b, c, d, e, f = (float(value) for value in told["affine"])
        return Background(
            folder / f"picture.{_ENDINGS[media]}",
            str(told["source"]),
            media,
            *_checked_size(int(told["width"]), int(told["height"])),
            _refuse_flat((a, b, c, d, e, f)),
        )


# --------------------------------------------------------------------------------- the picture


def _decode_picture(content: bytes) -> _Decoded:
    if len(content) > MOST_BYTES:
        raise InputError(
            f"a picture may have {MOST_BYTES >> 20} MB, this one has {len(content) >> 20}"
        )
    if content.startswith(b"\x89PNG\r\n\x1a\n") and content[12:16] == b"IHDR":
        width = int.from_bytes(content[16:20], "big")
        height = int.from_bytes(content[20:24], "big")
        return _Decoded(content, "image/png", *_checked_size(width, height))
    if content.startswith(b"\xff\xd8"):
        return _Decoded(content, "image/jpeg", *_checked_size(*_find_jpeg_size(content)))
    if content[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return _decode_tiff(content)
    raise InputError("a picture must be a PNG, JPEG or TIFF file")


def _checked_size(width: int, height: int) -> tuple[int, int]:
    if not 0 < width <= MOST_SIDE or not 0 < height <= MOST_SIDE or width * height > MOST_PIXELS:
        raise InputError(
            f"a picture may have {MOST_SIDE} pixels a side and {MOST_PIXELS // 1_000_000} million "
            f"in all, this one has {width} x {height}"
        )
    return width, height


def _find_jpeg_size(content: bytes) -> tuple[int, int]:
    """Width and height of the first frame of a JPEG file."""
    at = 2
    while at + 9 < len(content) and content[at] == 0xFF:
        marker, length = content[at + 1], int.from_bytes(content[at + 2 : at + 4], "big")
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = (int.from_bytes(content[at + k : at + k + 2], "big") for k in (5, 7))
            return width, height
        at += 2 + max(length, 2)
    raise InputError("the JPEG file is cut off: it has no frame")


def _decode_tiff(content: bytes) -> _Decoded:
    """Have a child write a TIFF as PNG, which browsers draw, and read the tags of GeoTIFF 1.1.

    A file of a few kB may unpack to a picture of the largest size.
    """
    with disk_errors("reading the picture"), scratch_folder() as folder:
        (folder / _SENT).write_bytes(content)
        answer = work_in_child(
            f"{__name__}:write_tiff_as_png",
            what="reading the picture",
            arguments={"folder": str(folder)},
            folders=(folder,),
            allowance=for_picture(),
        )
        png = (folder / _UNPACKED).read_bytes()
    placed = None if answer["placed"] is None else cast("Affine", tuple(answer["placed"]))
    return _Decoded(png, "image/png", answer["width"], answer["height"], placed, answer["crs"])


def write_tiff_as_png(*, folder: str, progress: Callable[[str, float], None]) -> dict[str, object]:
    """Write the TIFF of a folder as PNG; a job of a child.

    Returns
    -------
    dict
        ``width``, ``height``, and ``placed`` and ``crs``, which its tags tell.

    Raises
    ------
    InputError
        If it cannot be read, is too large, or its tags are damaged.
    MissingDependencyError
        If Pillow is not installed.
    """
    progress("reading the picture", 0.0)
    sent, made = Path(folder) / _SENT, Path(folder) / _UNPACKED
    try:
        from PIL import Image, UnidentifiedImageError

        Image.MAX_IMAGE_PIXELS = MOST_PIXELS  # of this child; Pillow's own is a little less
    except ImportError:
        raise MissingDependencyError(
            "TIFF files need Pillow: pip install 'odscen[png]'; or save the picture as PNG "
            "with a world file"
        ) from None
    try:
        with (
            warnings.catch_warnings(action="error"),  # Pillow warns of what is damaged, and goes on
            Image.open(sent, formats=("TIFF",)) as image,
        ):
            width, height = _checked_size(*image.size)
            if image.mode not in ("1", "L", "LA", "P", "RGB", "RGBA", "CMYK", "YCbCr"):
                raise InputError(
                    f"a TIFF of the mode {image.mode} has no colours of 8 bits; save it with them"
                )
            tags = dict(getattr(image, "tag_v2", {}))
            wanted = "RGBA" if image.mode in ("LA", "RGBA") else "RGB"
            drawn = image if image.mode == wanted else image.convert(wanted)
            drawn.save(made, "PNG", compress_level=1)  # more hardly makes photographs smaller
    except InputError:
        raise
    except (UnidentifiedImageError, OSError, ValueError, LookupError, SyntaxError, TypeError,
            ArithmeticError, Warning) as error:  # fmt: skip
        raise InputError(f"the TIFF file cannot be read: {error}") from error
    placed, crs = _read_geotiff_tags(tags)
    return {"width": width, "height": height, "placed": placed, "crs": crs}


def _read_geotiff_tags(tags: dict[int, object]) -> tuple[Affine | None, str | None]:
    """Place and coordinate reference system that a GeoTIFF tells, OGC 19-008r4."""
    scale, tie, matrix, keys = (tags.get(tag) for tag in (33550, 33922, 34264, 34735))
    tag_values: dict[int, int] = {}
    try:
        if keys is not None:
            numbers = [int(value) for value in cast("Sequence[int]", keys)]
            rows = [numbers[at : at + 4] for at in range(4, len(numbers) - 3, 4)]
            tag_values = {key: value for key, location, _, value in rows if location == 0}
        if matrix is not None:
            m = [float(value) for value in cast("Sequence[float]", matrix)]
            affine = (m[0], m[1], m[3], m[4], m[5], m[7])
        elif scale is not None and tie is not None:
            sx, sy = (float(value) for value in cast("Sequence[float]", scale)[:2])
            column, row, _, x, y = (float(v) for v in cast("Sequence[float]", tie)[:5])
            affine = (sx, 0.0, x - sx * column, 0.0, -sy, y + sy * row)
        else:
            return None, None
    except (TypeError, ValueError, IndexError) as error:
        raise InputError(f"the tags of the GeoTIFF are damaged: {error}") from error
    if tag_values.get(1025) == 2:  # places are those of the middles of pixels
        a, b, c, d, e, f = affine
        affine = (a, b, c - (a + b) / 2, d, e, f - (d + e) / 2)
    code = tag_values.get(3072) or tag_values.get(2048)
    return _refuse_flat(affine), f"EPSG:{code}" if code and code < 32_767 else None


# ----------------------------------------------------------------------------------- its place


def _refuse_flat(affine: Affine) -> Affine:
    a, b, _, d, e, _ = affine
    # A comparison that holds of no number that is none.
    if not all(abs(number) <= _FARTHEST for number in affine) or abs(a * e - b * d) < 1e-16:
        raise InputError("the numbers that place the picture do not span a plane")
    return affine


def _find_corners(width: int, height: int) -> FloatArray:
    """Corners and middle of a picture, (5, 2): column and row."""
    w, h = float(width), float(height)
    return np.array([(0.0, 0.0), (w, 0.0), (w, h), (0.0, h), (w / 2, h / 2)])


def _place_pixels(affine: Affine, pixels: FloatArray) -> tuple[FloatArray, FloatArray]:
    a, b, c, d, e, f = affine
    column, row = pixels[:, 0], pixels[:, 1]
    return a * column + b * row + c, d * column + e * row + f


def _onto_map(affine: Affine, crs: str | None, header: Header, picture: _Decoded) -> Affine:
    """Carry a place from its coordinate reference system to the map's coordinates."""
    if crs is None:
        return affine
    convert = _make_transformation(crs, header)
    pixels = _find_corners(picture.width, picture.height)
    with np.errstate(invalid="ignore"):  # where a projection has no place there is no number
        x, y = convert(*_place_pixels(affine, pixels))
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError(f"the picture lies where {crs} cannot be carried over to the map")
    terms = np.column_stack((pixels, np.ones(len(pixels))))
    fitted = np.linalg.lstsq(terms, np.column_stack((x, y)), rcond=None)[0]
    missed = float(np.hypot(*(terms @ fitted - np.column_stack((x, y))).T).max())
    if missed > _SHIFT:
        raise InputError(
            f"in the map's projection the picture is bent by {missed:.1f} m; cut it smaller, or "
            "save it in the map's projection"
        )
    (a, d), (b, e), (c, f) = fitted.tolist()
    return _refuse_flat((a, b, c, d, e, f))


def _make_transformation(
    crs: str, header: Header
) -> Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    import pyproj

    from odscen.opendrive.parse import names_projection  # late: no run needs what reads OpenDRIVE

    if header.crs is None:
        raise InputError(
            "the map has no georeference that is understood; place the picture by two points",
            element="geoReference",
        )
    # Any other word would be looked for in all of the database, and a grid is a file.
    if not names_projection(crs) or len(crs) > _MOST_CRS or "grids=" in crs:
        raise InputError(f"no coordinate reference system: {shown(crs)}")
    try:
        with warnings.catch_warnings(action="ignore"):  # of old ways to write one
            transformer = pyproj.Transformer.from_crs(crs, header.crs, always_xy=True)
    except pyproj.exceptions.ProjError as error:
        raise InputError(f"no coordinate reference system: {shown(crs)}") from error
    x0, y0, _, hdg = header.offset

    def convert(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        east, north = transformer.transform(x, y)
        east, north = east - x0, north - y0
        cos, sin = math.cos(hdg), math.sin(hdg)
        return cos * east + sin * north, cos * north - sin * east

    return convert


def _refuse_elsewhere(picture: Bounds, map_bounds: Bounds) -> None:
    side = max(picture[2] - picture[0], picture[3] - picture[1])
    if side > _LARGEST:
        raise InputError(
            f"the picture would be {side:,.0f} m wide, and {_LARGEST:,.0f} m are the most"
        )
    apart = max(
        picture[0] - map_bounds[2],
        map_bounds[0] - picture[2],
        picture[1] - map_bounds[3],
        map_bounds[1] - picture[3],
    )
    if apart > 0.0:
        raise InputError(
            f"the picture lies {apart:,.0f} m beside the map; name its coordinate reference system "
            "(EPSG:...), or place it by two points"
        )
