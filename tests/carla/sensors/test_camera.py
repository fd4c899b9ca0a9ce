"""The picture from above: what is where, and that it becomes files."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from odscen.base.errors import InputError, WorkspaceError
from odscen.carla.sensors.camera import EGO_SPAN, View, open_camera
from odscen.carla.sensors.pictures import Picture, Wish, picture_files, still
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address
from tests.carla.conftest import MAPS
from tests.carla_standin.process import StandIn

av = pytest.importorskip("av", reason="pictures need the package av")

CROSSING = MAPS / "signal_crossing.xodr"
WIDTH, HEIGHT = 320, 180


def plain(time: float, color: tuple[int, int, int]) -> Picture:
    """Picture of one colour (B, G, R)."""
    pixels = np.zeros((HEIGHT, WIDTH, 4), dtype=np.uint8)
    pixels[:] = (*color, 255)
    return Picture(time, WIDTH, HEIGHT, pixels.tobytes())


def pixels_of(data: bytes, tmp_path: Path, name: str) -> np.ndarray:
    file = tmp_path / name
    file.write_bytes(data)
    with av.open(str(file)) as opened:
        [frame] = opened.decode(video=0)
    return np.asarray(frame.to_ndarray(format="rgb24"))


@pytest.mark.parametrize("kind", ["png", "jpeg"])
def test_a_still_has_the_colours_of_its_picture(kind: str, tmp_path: Path) -> None:
    shown = pixels_of(still(plain(0.0, (10, 120, 240)), kind), tmp_path, f"one.{kind}")
    assert shown.shape == (HEIGHT, WIDTH, 3)
    assert np.abs(shown.reshape(-1, 3).mean(axis=0) - (240, 120, 10)).max() < 4.0


@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".webm"])
def test_a_film_has_all_pictures_at_its_rate(suffix: str, tmp_path: Path) -> None:
    film = tmp_path / f"film{suffix}"
    wish = Wish(frames=tmp_path / "frames", film=film, rate=5.0, width=WIDTH, height=HEIGHT)
    with picture_files(wish) as write:
        for k in range(15):
            write(plain(k / 5.0, (0, 0, 16 * k)))
    names = sorted(path.name for path in (tmp_path / "frames").iterdir())
    assert names == [f"{k:06d}.png" for k in range(1, 16)]
    with av.open(str(film)) as opened:
        frames = list(opened.decode(video=0))
    assert len(frames) == 15
    assert frames[10].time == pytest.approx(2.0, abs=0.01)


def test_a_film_of_another_kind_is_refused_before_anything_begins() -> None:
    with pytest.raises(InputError, match=r"a video ends in \.mp4"):
        Wish(film=Path("film.txt")).check()


def test_a_folder_that_cannot_be_is_told_by_name(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with (
        pytest.raises(WorkspaceError, match="file"),
        picture_files(Wish(frames=tmp_path / "file")),
    ):
        pass


@pytest.mark.slow
def test_the_picture_shows_what_is_there_north_up_and_follows() -> None:
    pytest.importorskip("carla", reason="co-simulation needs the package carla")
    pictures: list[Picture] = []
    with StandIn(CROSSING) as standin:
        with Server(Address(standin.host, standin.port, 5.0)) as server:
            server.synchronize(0.1)
            # 20 m east and 10 m north of where the camera looks first; CARLA's y is south.
            command = server.spawn_command(
                "vehicle.tesla.model3", "odscen.car", (120.0, -60.0, 0.0)
            )
            [car] = server.spawn([command])
            assert isinstance(car, int)
            view = View(100.0, 50.0, 0.0)
            with open_camera(
                server, view, pictures.append, width=WIDTH, height=HEIGHT, rate=10.0
            ) as camera:
                for _ in range(5):
                    server.tick()
                camera.follow(120.0, 60.0, 0.0)
                for _ in range(5):
                    server.tick()
        left = [a for a in standin.actors() if a["type_id"].startswith(("sensor", "vehicle"))]
    assert left == []
    assert len(pictures) >= 8
    metre = WIDTH / EGO_SPAN
    assert middle(pictures[1]) == pytest.approx((20.0 * metre, -10.0 * metre), abs=1.0)
    assert middle(pictures[-1]) == pytest.approx((0.0, 0.0), abs=1.0)


@pytest.mark.slow
def test_pictures_that_come_faster_than_they_are_written_are_counted() -> None:
    pytest.importorskip("carla", reason="co-simulation needs the package carla")
    written: list[Picture] = []
    go_on = threading.Event()

    def write(picture: Picture) -> None:
        go_on.wait(30.0)
        written.append(picture)

    with StandIn(CROSSING) as standin, Server(Address(standin.host, standin.port, 5.0)) as server:
        server.synchronize(0.1)
        view = View(100.0, 50.0, 0.0)
        with open_camera(server, view, write, width=16, height=9, rate=10.0) as camera:
            for _ in range(70):
                server.tick()
            while camera.taken < 70:
                time.sleep(0.01)
            go_on.set()
    assert camera.dropped >= 15
    assert len(written) == camera.taken - camera.dropped


def middle(picture: Picture) -> tuple[float, float]:
    """Where the only vehicle is, in pixels to the right of and below the picture's middle."""
    pixels = np.frombuffer(picture.bgra, dtype=np.uint8).reshape(HEIGHT, WIDTH, 4)
    rows, columns = np.nonzero(pixels[:, :, 0] > 150)
    assert len(rows)
    right = float(columns.mean()) + 0.5 - WIDTH / 2
    return right, float(rows.mean()) + 0.5 - HEIGHT / 2
