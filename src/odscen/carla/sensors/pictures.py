"""Pictures as files and streams: PNG, JPEG, and a film of them.

PyAV (extra ``carla``) does all three: it brings FFmpeg's own encoders as wheels, so that no program
has to be installed and none is started.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from odscen.base.errors import InputError, MissingDependencyError, WorkspaceError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

_STILL = {"png": ("png", "rgb24"), "jpeg": ("mjpeg", "yuvj420p")}
_FILM_SUFFIXES = (".mp4", ".mkv", ".webm")


class Picture(NamedTuple):
    """One picture of a camera: simulated seconds, size in pixels, bytes B, G, R, A by rows."""

    time: float
    width: int
    height: int
    bgra: bytes


def still(picture: Picture, kind: Literal["png", "jpeg"]) -> bytes:
    """Encode one picture as a file of its kind.

    Raises
    ------
    MissingDependencyError
        If PyAV is not installed.
    """
    name, pixels = _STILL[kind]
    codec = _import_av().CodecContext.create(name, "w")
    codec.width, codec.height, codec.pix_fmt = picture.width, picture.height, pixels
    codec.time_base = Fraction(1, 25)
    packets = [
        *codec.encode(_make_video_frame(picture).reformat(format=pixels)),
        *codec.encode(None),
    ]
    return b"".join(bytes(packet) for packet in packets)


@dataclass(frozen=True, slots=True)
class Wish:
    """Where pictures are to go. ``rate`` is in pictures per simulated second.

    Attributes
    ----------
    frames
        Folder for ``000001.png``, ``000002.png`` and so on.
    film
        File; its ending says which kind: ``.mp4``, ``.mkv`` or ``.webm``.
    sheet
        Instants of a page in the run's folder that has the plan beside what the camera saw.
    """

    frames: Path | None = None
    film: Path | None = None
    sheet: int = 0
    rate: float = 10.0
    width: int = 960
    height: int = 540

    @property
    def any(self) -> bool:
        """Whether any file is wanted."""
        return self.frames is not None or self.film is not None or self.sheet > 0

    def check(self) -> None:
        """Refuse what cannot be done before anything is begun.

        Raises
        ------
        InputError
            If the film's ending is not one of a film.
        MissingDependencyError
            If PyAV is not installed.
        """
        _import_av()
        if self.film is not None and self.film.suffix.lower() not in _FILM_SUFFIXES:
            raise InputError(f"a video ends in {', '.join(_FILM_SUFFIXES)}", file=str(self.film))


@contextmanager
def picture_files(wish: Wish) -> Iterator[Callable[[Picture], None]]:
    """Yield what takes pictures and writes them as wished; a film is whole when this ends.

    Raises
    ------
    WorkspaceError
        If a file cannot be written.
    """
    count = 0
    try:
        if wish.frames is not None:
            wish.frames.mkdir(parents=True, exist_ok=True)
        if wish.film is not None:
            wish.film.parent.mkdir(parents=True, exist_ok=True)
        film = None if wish.film is None else _Film(wish.film, wish)

        def take(picture: Picture) -> None:
            nonlocal count
            count += 1
            if wish.frames is not None:
                (wish.frames / f"{count:06d}.png").write_bytes(still(picture, "png"))
            if film is not None:
                film.add(picture)

        try:
            yield take
        finally:
            if film is not None:
                film.close()
    except OSError as error:
        raise WorkspaceError(
            f"pictures: {error.filename or ''}: {error.strerror or error}"
        ) from error


class _Film:
    def __init__(self, path: Path, wish: Wish) -> None:
        rate = Fraction(wish.rate).limit_denominator(1000)
        self._container = _import_av().open(str(path), "w")
        self._stream = self._container.add_stream(
            "libvpx-vp9" if path.suffix.lower() == ".webm" else "libx264", rate=rate
        )
        # 4:2:0 has one colour for two by two pixels.
        self._stream.width, self._stream.height = wish.width // 2 * 2, wish.height // 2 * 2
        self._stream.pix_fmt = "yuv420p"

    def add(self, picture: Picture) -> None:
        frame = _make_video_frame(picture).reformat(
            width=self._stream.width, height=self._stream.height, format="yuv420p"
        )
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        self._container.mux(self._stream.encode(None))
        self._container.close()


def _make_video_frame(picture: Picture) -> Any:
    pixels = np.frombuffer(picture.bgra, dtype=np.uint8)
    shape = (picture.height, picture.width, 4)
    return _import_av().VideoFrame.from_ndarray(
        np.ascontiguousarray(pixels.reshape(shape)), format="bgra"
    )


def _import_av() -> Any:
    try:
        import av
    except ImportError as error:
        raise MissingDependencyError(
            "pictures need the package av: pip install 'odscen[carla]'"
        ) from error
    return av
