from __future__ import annotations

import queue
from typing import Any

import numpy as np
import pytest

from tests.carla_standin.conftest import Connected

carla = pytest.importorskip("carla", reason="the real client asks the stand-in")

WIDTH, HEIGHT = 64, 48


def camera(connected: Connected, *, sensor_tick: float = 0.0) -> tuple[Any, queue.Queue[Any]]:
    blueprint = connected.blueprint("sensor.camera.rgb")
    blueprint.set_attribute("image_size_x", str(WIDTH))
    blueprint.set_attribute("image_size_y", str(HEIGHT))
    blueprint.set_attribute("sensor_tick", str(sensor_tick))
    at = carla.Transform(carla.Location(0.0, 0.0, 10.0))
    sensor = connected.world.spawn_actor(blueprint, at)
    images: queue.Queue[Any] = queue.Queue()
    sensor.listen(images.put)
    return sensor, images


def pixels(image: Any) -> np.ndarray:
    # Of its own: the client's memory is taken for the next picture once this one is let go.
    flat = np.frombuffer(image.raw_data, dtype=np.uint8).copy()
    return flat.reshape(image.height, image.width, 4)


def test_a_picture_comes_with_every_tick(connected: Connected) -> None:
    sensor, images = camera(connected)
    assert sensor.is_listening()
    for _ in range(5):
        frame = connected.world.tick()
        image = images.get(timeout=5.0)
        assert image.frame == frame
        assert (image.width, image.height, image.fov) == (WIDTH, HEIGHT, 90.0)
        assert len(image.raw_data) == WIDTH * HEIGHT * 4
        now = connected.world.get_snapshot().timestamp.elapsed_seconds
        assert image.timestamp == pytest.approx(now)
    assert images.empty()


@pytest.mark.slow
def test_what_stands_before_the_camera_is_in_the_upper_half(connected: Connected) -> None:
    sensor, images = camera(connected)
    assert sensor.is_listening()
    connected.world.tick()
    empty = pixels(images.get(timeout=5.0))
    assert len(np.unique(empty.reshape(-1, 4), axis=0)) == 1
    connected.spawn("vehicle.tesla.model3", carla.Transform(carla.Location(20.0, 0.0)))
    connected.world.tick()
    rows, columns, _ = np.nonzero(pixels(images.get(timeout=5.0)) != empty)
    assert 0 < rows.min() <= rows.max() < HEIGHT / 2
    assert columns.mean() == pytest.approx(WIDTH / 2, abs=1.0)


@pytest.mark.slow
def test_a_slow_camera_takes_fewer_pictures(connected: Connected) -> None:
    sensor, images = camera(connected, sensor_tick=0.2)
    assert sensor.is_listening()
    frames = [connected.world.tick() for _ in range(12)]
    taken = [images.get(timeout=5.0).frame for _ in range(3)]
    assert taken == frames[::4]
    assert images.empty()


@pytest.mark.slow
def test_a_camera_that_stops_gets_no_more_pictures(connected: Connected) -> None:
    sensor, images = camera(connected)
    connected.world.tick()
    images.get(timeout=5.0)
    sensor.stop()
    assert sensor.destroy()
    connected.world.tick()
    assert images.empty()
