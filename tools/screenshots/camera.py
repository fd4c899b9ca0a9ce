"""What pictures are taken with: views of the page in one colour scheme, cropped, of few bytes."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Locator

from tests.browser.pages import OdscenPage, settle
from tools import page as tool

WIDTH, HEIGHT = 1200, 760
"""Pixels of the window; a page of the documentation shows about 900 of them across."""
COLOURS = 256
"""Of a picture."""
LARGEST = 130_000
"""Bytes of one picture."""


class PictureTooLargeError(Exception):
    """A picture has more bytes than the documentation is to carry."""


@dataclass(frozen=True)
class Studio:
    """Where pictures of one colour scheme are taken, and where they are kept."""

    browser: Browser
    url: str
    scheme: str
    folder: Path

    @contextmanager
    def visit(self, *, width: int = WIDTH, height: int = HEIGHT) -> Iterator[Camera]:
        """The page in a window of its own, of somebody who has seen the tour."""
        with self.browser.new_context(
            base_url=self.url,
            viewport={"width": width, "height": height},
            color_scheme=self.scheme,  # type: ignore[arg-type]
            locale="en-GB",
            timezone_id="UTC",
            reduced_motion="reduce",
        ) as context:
            context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
            yield Camera(OdscenPage(context.new_page()), self.scheme, self.folder)


@dataclass(frozen=True)
class Camera:
    """Takes pictures of one page."""

    user: OdscenPage
    scheme: str
    folder: Path

    def take(self, view: str, *shown: Locator, margin: int = 0) -> None:
        """Keep what is seen now, once nothing moves, under the view's name.

        Parameters
        ----------
        view
            Name of the picture: ``page-VIEW-SCHEME.png``.
        *shown
            What it is cropped to; without any it is the whole window.
        margin
            Pixels around that.

        Raises
        ------
        PictureTooLargeError
            It has more than :data:`LARGEST` bytes.
        """
        page = self.user.page
        page.mouse.move(1, 1)
        page.evaluate("document.activeElement?.blur()")
        settle(page)
        raw = Image.open(io.BytesIO(page.screenshot(animations="disabled", caret="hide")))
        few = in_few_colours(
            raw.convert("RGB").crop(_around(shown, raw.size, margin) if shown else None)
        )
        path = self.folder / f"page-{view}-{self.scheme}.png"
        few.save(path, optimize=True)
        size = path.stat().st_size
        if size > LARGEST:
            raise PictureTooLargeError(f"{path} has {size} bytes, more than {LARGEST}")
        print(f"{path.name}: {few.width} x {few.height}, {size // 1000} kB", flush=True)

    def look_at(self, place: tuple[float, float], *, closer: int) -> None:
        """Bring a place of the map to its middle, in metres, and zoom in by so many steps."""
        self.user.map.area.focus()
        for _ in range(closer):
            self.user.map.steer(place)
            self.user.page.keyboard.press("+")
        self.user.map.steer(place)


Scene = Callable[[Studio], None]
"""Takes the pictures of one part of the page."""


def in_few_colours(picture: Image.Image) -> Image.Image:
    """The picture with a palette, which looks the same and has about half of the bytes.

    Each colour of the palette is the one that is farthest from those before it, weighted by its
    pixels, so that areas keep theirs exactly and small marks on the map are not averaged away.
    """
    pixels = np.asarray(picture).reshape(-1, 3)
    packed = pixels.astype(np.uint32) @ np.array([65536, 256, 1], dtype=np.uint32)
    keys, inverse, number = np.unique(packed, return_inverse=True, return_counts=True)
    colours = np.stack([keys >> 16, keys >> 8 & 255, keys & 255], axis=1).astype(np.int64)
    palette = [int(np.argmax(number))]
    away, nearest = _distances(colours, palette[0]), np.zeros(len(colours), dtype=np.uint8)
    while len(palette) < min(COLOURS, len(colours)):
        worst = int(np.argmax(away * number))
        closer = (distances := _distances(colours, worst)) < away
        away[closer], nearest[closer] = distances[closer], len(palette)
        palette.append(worst)
    few = Image.fromarray(nearest[inverse].reshape(picture.height, picture.width))
    few.putpalette(colours[palette].astype(np.uint8).tobytes())
    return few


def _distances(colours: np.ndarray, one: int) -> np.ndarray:
    return np.square(colours - colours[one]).sum(axis=1)


def _around(
    shown: Sequence[Locator], size: tuple[int, int], margin: int
) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of all that is to be seen, inside the window."""
    boxes = [box for one in shown if (box := one.bounding_box()) is not None]
    return (
        max(0, round(min(box["x"] for box in boxes)) - margin),
        max(0, round(min(box["y"] for box in boxes)) - margin),
        min(size[0], round(max(box["x"] + box["width"] for box in boxes)) + margin),
        min(size[1], round(max(box["y"] + box["height"] for box in boxes)) + margin),
    )
