"""What is written reads back as the same map."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from odscen.maps.shipped import shipped_maps
from odscen.opendrive.parse import parse
from odscen.opendrive.write import write_opendrive
from tests.opendrive.full import FULL

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.opendrive.road_model import OpenDrive


def leaves(value: Any, path: str = "") -> dict[str, Any]:
    """Every number, text and truth of a model by its place."""
    if dataclasses.is_dataclass(value):
        value = {item.name: getattr(value, item.name) for item in dataclasses.fields(value)}
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    elif isinstance(value, tuple):
        value = dict(enumerate(value))
    if not isinstance(value, dict):
        return {path: value}
    return {
        place: leaf
        for name, item in value.items()
        for place, leaf in leaves(item, f"{path}.{name}").items()
    }


def without_slivers(model: OpenDrive) -> OpenDrive:
    """A map without notes, and without geometries that are shorter than what is written."""
    roads = {
        key: dataclasses.replace(road, geometry=tuple(g for g in road.geometry if g.length > 1e-9))
        for key, road in model.roads.items()
    }
    return dataclasses.replace(model, roads=roads, notes=())


def assert_same(first: OpenDrive, second: OpenDrive) -> None:
    """All values equal, numbers to the digits that are written; angles but for whole turns."""
    mine, theirs = (leaves(without_slivers(model)) for model in (first, second))
    assert list(mine) == list(theirs)
    for place, value in mine.items():
        other = theirs[place]
        if isinstance(value, float) and math.isfinite(value):
            turns = ".hdg" in place or place.endswith((".pitch", ".roll", ".h_offset"))
            difference = math.remainder(value - other, math.tau) if turns else value - other
            # Twice half of the ninth digit: s of a lane is that of its section and its own.
            assert abs(difference) <= 1.1e-9 + 1e-11 * abs(value), (place, value, other)
        else:
            assert value == other, place


def test_every_element_that_is_read_is_written() -> None:
    """A file with all elements and attributes: nothing is lost, nothing comes."""
    model = parse(FULL)
    again = parse(write_opendrive(model))
    assert_same(model, again)
    assert len(leaves(again)) > 300


@pytest.mark.slow
@pytest.mark.parametrize("path", shipped_maps(), ids=lambda path: path.stem)
def test_shipped_maps_are_the_same_after_writing(path: Path) -> None:
    """Same model; and what is written, read and written again has the same bytes."""
    model = parse(path.read_bytes())
    text = write_opendrive(model)
    again = parse(text)
    assert_same(model, again)
    assert write_opendrive(again) == text


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["carla-2019/Town03", "carla-2020/Town07", "esmini/e6mini-lht", "esmini/fabriksgatan"]
)
def test_real_maps_are_the_same_after_writing(shared_maps: Path, name: str) -> None:
    """Maps of other writers."""
    model = parse((shared_maps / f"{name}.xodr").read_bytes())
    assert_same(model, parse(write_opendrive(model)))


@pytest.mark.parametrize(
    ("speed", "text", "unit"),
    [(13.88888888888889, "50", "km/h"), (11.176, "25", "mph"), (13.2, "13.2", "m/s")],
)
def test_limits_are_written_as_signs_have_them(speed: float, text: str, unit: str) -> None:
    """The unit in which a limit is a whole number."""
    model = parse(FULL)
    road = next(iter(model.roads.values()))
    road = dataclasses.replace(road, types=(road.types[0]._replace(speed=speed),))
    written = etree.fromstring(
        write_opendrive(dataclasses.replace(model, roads={**model.roads, road.id: road}))
    )
    limit = written.find("road/type/speed")
    assert limit is not None
    assert (limit.get("max"), limit.get("unit")) == (text, unit)
    assert parse(etree.tostring(written)).roads[road.id].types[0].speed == pytest.approx(speed)


def test_access_of_1_8_is_in_elements() -> None:
    """Restrictions of one place and rule are below one element from 1.8 on."""
    text = FULL.replace('revMinor="7"', 'revMinor="8"')
    model = parse(text)
    lanes = [
        lane for road in model.roads.values() for s in road.sections for lane in s.lanes.values()
    ]
    assert any(lane.access for lane in lanes)
    written = write_opendrive(model)
    assert b"<restriction type=" in written
    assert_same(model, parse(written))
