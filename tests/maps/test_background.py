"""A picture under a map lies where a world file, a GeoTIFF or two points say."""

from __future__ import annotations

import io
import math
import re
import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, TiffImagePlugin

from odscen.base.errors import InputError, LimitError
from odscen.maps import background, map_tiles
from odscen.maps.allowances import Allowance
from odscen.maps.background import (
    PicturePoint,
    _place_pixels,
    fit_points,
    parse_world_file,
    place_picture,
)
from odscen.maps.store import Workspace
from odscen.opendrive.parse import parse

MAPS = Path(__file__).parents[2] / "maps"
HEADER = parse((MAPS / "bus_street.xodr").read_bytes()).header
BOUNDS = (-100.0, -100.0, 100.0, 100.0)
LOCAL = "+proj=tmerc +lat_0=48 +lon_0=11 +k=1 +datum=WGS84 +units=m +no_defs"


def picture(width: int = 40, height: int = 20, form: str = "PNG", **more: object) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (width, height), (90, 120, 60)).save(out, form, **more)
    return out.getvalue()


def geotiff(*, epsg: int | None, x: float, y: float, size: float, point: bool = False) -> bytes:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[33550], tags.tagtype[33550] = (size, size, 0.0), 12
    tags[33922], tags.tagtype[33922] = (0.0, 0.0, 0.0, x, y, 0.0), 12
    keys = [(1025, 0, 1, 2 if point else 1)] + ([(3072, 0, 1, epsg)] if epsg else [])
    tags[34735] = (1, 1, 0, len(keys), *(number for key in keys for number in key))
    tags.tagtype[34735] = 3
    return picture(form="TIFF", tiffinfo=tags)


def places(affine: tuple[float, ...], *pixels: tuple[float, float]) -> list[tuple[float, float]]:
    x, y = _place_pixels(affine, np.array(pixels, dtype=float))  # type: ignore[arg-type]
    return list(zip(x.tolist(), y.tolist(), strict=True))


def test_a_world_file_is_for_the_middle_of_the_first_pixel() -> None:
    affine = parse_world_file("0.5\n0\n0\n-0.5\n10.25\n49.75\n")
    assert places(affine, (0, 0), (0.5, 0.5), (40, 20)) == [(10, 50), (10.25, 49.75), (30, 40)]


@given(
    turn=st.floats(-math.pi, math.pi),
    scale=st.floats(0.01, 10.0),
    x=st.floats(-1e6, 1e6),
    y=st.floats(-1e6, 1e6),
)
def test_two_points_turn_scale_and_move_the_picture(
    turn: float, scale: float, x: float, y: float
) -> None:
    def on_map(column: float, row: float) -> tuple[float, float]:
        u, v = scale * column, -scale * row
        return (
            x + u * math.cos(turn) - v * math.sin(turn),
            y + u * math.sin(turn) + v * math.cos(turn),
        )

    affine = fit_points([PicturePoint(c, r, *on_map(c, r)) for c, r in ((10, 5), (310, 120))])
    for pixel in ((0.0, 0.0), (400.0, 0.0), (17.0, 230.0)):
        assert places(affine, pixel)[0] == pytest.approx(on_map(*pixel), abs=1e-6 * (1 + abs(x)))


def test_a_geotiff_in_utm_lies_where_its_corners_are_on_the_map() -> None:
    east, north = pyproj.Transformer.from_crs(LOCAL, "EPSG:25832", always_xy=True).transform(
        -20.0, 30.0
    )
    content, placed = place_picture(
        geotiff(epsg=25832, x=east, y=north, size=0.5),
        source="photo.tif",
        header=HEADER,
        bounds=BOUNDS,
    )
    assert content.startswith(b"\x89PNG")
    assert (placed.media_type, placed.width, placed.height) == ("image/png", 40, 20)
    back = pyproj.Transformer.from_crs("EPSG:25832", LOCAL, always_xy=True)
    corners = [(0.0, 0.0), (40.0, 0.0), (40.0, 20.0)]
    for corner, at in zip(corners, places(placed.affine, *corners), strict=True):
        there = back.transform(east + 0.5 * corner[0], north - 0.5 * corner[1])
        assert at == pytest.approx(there, abs=0.001)


def test_a_geotiff_whose_places_are_of_pixels_lies_half_a_pixel_further() -> None:
    lying = [
        place_picture(
            geotiff(epsg=None, x=10.0, y=20.0, size=1.0, point=point),
            source="photo.tif",
            header=HEADER,
            bounds=BOUNDS,
        )[1].affine
        for point in (False, True)
    ]
    assert places(lying[0], (0, 0)) == [(10.0, 20.0)]
    assert places(lying[1], (0.5, 0.5)) == [(10.0, 20.0)]


def test_the_size_of_a_jpeg_is_read_without_decoding_it() -> None:
    points = [PicturePoint(0, 0, 0, 0), PicturePoint(60, 0, 60, 0)]
    content = picture(60, 30, "JPEG", exif=b"Exif\0\0" + bytes(500))
    kept, placed = place_picture(
        content, source="p.jpg", header=HEADER, bounds=BOUNDS, points=points
    )
    assert kept == content
    assert (placed.media_type, placed.width, placed.height) == ("image/jpeg", 60, 30)
    assert placed.bounds() == pytest.approx((0, -30, 60, 0))


def huge_png() -> bytes:
    return picture()[:16] + struct.pack(">II", 20_000, 20_000) + picture()[24:]


@pytest.mark.parametrize(
    ("content", "more", "problem"),
    [
        (b"GIF89a", {}, "a picture must be a PNG, JPEG or TIFF file"),
        (huge_png(), {}, "this one has 20000 x 20000"),
        (picture(form="JPEG")[:30], {}, "the JPEG file is cut off"),
        (picture(form="TIFF")[:60], {}, "the TIFF file cannot be read"),
        (picture(), {}, "nothing says where the picture lies"),
        (picture(), {"world": "1 2 3"}, "a world file has six numbers, not '1 2 3'"),
        (picture(), {"world": "0 0 0 0 5 5"}, "do not span a plane"),
        (picture(), {"world": "1 0 0 -1 nan 5"}, "do not span a plane"),
        (picture(), {"world": "1 0 0 -1 0 0", "crs": "EPSG:nine"}, "no coordinate reference"),
        (picture(), {"world": "1 0 0 -1 500000 5000000"}, "4,999,880 m beside the map"),
        (picture(), {"world": "1e308 0 0 1e308 0 0"}, "do not span a plane"),
        (picture(), {"world": "1e6 0 0 -1e6 0 0"}, "40,000,000 m wide, and 1,000,000 m are the"),
        (picture(), {"world": "1 0 0 -1 0 0", "crs": "/etc/passwd"}, "no coordinate reference"),
        (picture(), {"world": "1 0 0 -1 0 0", "crs": "EPSG:" + "9" * 9999}, "no coordinate"),
        (
            picture(),
            {"world": "1 0 0 -1 0 0", "crs": "+proj=longlat +nadgrids=/etc/passwd"},
            "no coordinate reference",
        ),
        (picture(), {"points": [PicturePoint(1, 1, 0, 0)]}, "two points or more"),
        (
            picture(),
            {"points": [PicturePoint(1e308, 1, 0, 0), PicturePoint(-1e308, 1, 1, 1)]},
            "numbers up to 1,000,000,000",
        ),
        (picture(), {"points": [PicturePoint(1, 1, 0, 0)] * 2}, "must be at different places"),
    ],
)
def test_what_cannot_be_placed_is_refused_with_its_reason(
    content: bytes, more: dict[str, object], problem: str
) -> None:
    with pytest.raises(InputError) as refused:
        place_picture(content, source="p", header=HEADER, bounds=BOUNDS, **more)  # type: ignore[arg-type]
    assert problem in str(refused.value)


def test_a_tiff_of_a_few_kilobytes_that_unpacks_to_gigabytes_ends_a_child_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = io.BytesIO()
    Image.new("1", (10_000, 10_000)).save(out, "TIFF", compression="group4")
    assert len(out.getvalue()) < 10_000
    monkeypatch.setattr(background, "for_picture", lambda: Allowance(350_000_000, 60.0))
    points = [PicturePoint(0, 0, 0, 0), PicturePoint(60, 0, 60, 0)]
    with pytest.raises(LimitError, match=r"reading the picture needs more than 0\.35 GB"):
        place_picture(out.getvalue(), source="p.tif", header=HEADER, bounds=BOUNDS, points=points)


# ------------------------------------------------------------------------------------------ tiles


def tile_of(lat: float, lon: float, zoom: int) -> tuple[int, int]:
    """Column and row from the north, by the formula of OpenStreetMap's wiki (Slippy map)."""
    n = 2**zoom
    row = (1.0 - math.asinh(math.tan(math.radians(lat))) / math.pi) / 2.0 * n
    return int((lon + 180.0) / 360.0 * n), int(row)


def colour_tile(red: int, green: int, size: int = 256) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (size, size), (red % 256, green % 256, 7)).save(out, "PNG")
    return out.getvalue()


def georeferenced_map(tmp_path: Path) -> tuple[Workspace, str]:
    text = (MAPS / "bus_street.xodr").read_text(encoding="utf-8")
    head = re.sub(r"<geoReference>.*?</geoReference>", "", text, flags=re.DOTALL)
    reference = f"<geoReference><![CDATA[{LOCAL}]]></geoReference>"
    placed = re.sub(r"(<header[^>]*?)(/>|>)", lambda m: m[1] + ">" + reference + (
        "</header>" if m[2] == "/>" else ""), head, count=1)  # fmt: skip
    (tmp_path / "placed.xodr").write_text(placed, encoding="utf-8")
    workspace = Workspace.open(tmp_path / "workspace")
    workspace.add_map(tmp_path / "placed.xodr")
    return workspace, "placed"


@pytest.mark.parametrize("kind", ["folder", "mbtiles"])
def test_tiles_lie_where_web_mercator_has_them(tmp_path: Path, kind: str) -> None:
    workspace, name = georeferenced_map(tmp_path)
    x0, y0, x1, y1 = workspace.map(name).statistics().bounds
    to_degrees = pyproj.Transformer.from_crs(LOCAL, "EPSG:4326", always_xy=True)
    zoom = 18
    west, south = to_degrees.transform(x0 - 30.0, y0 - 30.0)
    east, north = to_degrees.transform(x1 + 30.0, y1 + 30.0)
    (first, top), (last, bottom) = tile_of(north, west, zoom), tile_of(south, east, zoom)
    tiles = {
        (column, row): colour_tile(column, row)
        for column in range(first - 1, last + 2)
        for row in range(top - 1, bottom + 2)
    }
    if kind == "folder":
        source = tmp_path / "tiles"
        for (column, row), content in tiles.items():
            file = source / str(zoom) / str(column) / f"{row}.png"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
    else:
        source = tmp_path / "tiles.mbtiles"
        with closing(sqlite3.connect(source)) as connection:
            connection.execute(
                "CREATE TABLE tiles (zoom_level INT, tile_column INT, tile_row INT, tile_data BLOB)"
            )
            rows = [(zoom, c, 2**zoom - 1 - r, content) for (c, r), content in tiles.items()]
            connection.executemany("INSERT INTO tiles VALUES (?, ?, ?, ?)", rows)
            connection.commit()
    under = workspace.set_background(name, source)
    picture = Image.open(under.path).convert("RGB")
    a, b, c, d, e, f = under.affine
    for x, y in [(x0, y0), (x1, y1), ((x0 + x1) / 2, (y0 + y1) / 2), (x0, y1)]:
        column, row = np.linalg.solve([[a, b], [d, e]], [x - c, y - f])
        lon, lat = to_degrees.transform(x, y)
        there = tile_of(lat, lon, zoom)
        assert picture.getpixel((int(column), int(row))) == (there[0] % 256, there[1] % 256, 7)


def test_tiles_whose_picture_would_be_too_large_give_way_to_a_lower_zoom(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace, name = georeferenced_map(tmp_path)
    lon, lat = pyproj.Transformer.from_crs(LOCAL, "EPSG:4326", always_xy=True).transform(0.0, 0.0)
    for zoom in (15, 18):
        column, row = tile_of(lat, lon, zoom)
        file = tmp_path / "tiles" / str(zoom) / str(column) / f"{row}.png"
        file.parent.mkdir(parents=True)
        file.write_bytes(colour_tile(column, row, 512))
    monkeypatch.setattr(map_tiles, "_MOST_SIDE", 512 * 3)
    under = workspace.set_background(name, tmp_path / "tiles")
    metres = math.hypot(under.affine[0], under.affine[3])  # of a pixel of zoom 15, at 48 degrees
    assert metres == pytest.approx(40_075_017 / 2**15 / 512 * math.cos(math.radians(48)), rel=0.01)


def test_tiles_that_are_damaged_or_elsewhere_are_refused(tmp_path: Path) -> None:
    workspace, name = georeferenced_map(tmp_path)
    (tmp_path / "elsewhere" / "18" / "0").mkdir(parents=True)
    (tmp_path / "elsewhere" / "18" / "0" / "0.png").write_bytes(colour_tile(1, 2))
    with pytest.raises(InputError, match=r"elsewhere: no tile lies under the map"):
        workspace.set_background(name, tmp_path / "elsewhere")
    (tmp_path / "no.mbtiles").write_bytes(b"no database at all, and longer than a header" * 9)
    with pytest.raises(InputError, match=r"no.mbtiles: no MBTiles file"):
        workspace.set_background(name, tmp_path / "no.mbtiles")
    lon, lat = pyproj.Transformer.from_crs(LOCAL, "EPSG:4326", always_xy=True).transform(0.0, 0.0)
    column, row = tile_of(lat, lon, 3)
    (tmp_path / "odd" / "3" / str(column)).mkdir(parents=True)
    file = tmp_path / "odd" / "3" / str(column) / f"{row}.png"
    for content, words in [(colour_tile(1, 2, 100), "100 x 100"), (b"no picture", "no PNG")]:
        file.write_bytes(content)
        with pytest.raises(InputError, match=words):
            workspace.set_background(name, tmp_path / "odd")
    assert workspace.background(name) is None
