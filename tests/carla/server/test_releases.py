"""What differs between releases is known in one place, and the rest of the package does not ask."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from odscen.base.errors import CarlaError
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address
from odscen.carla.server.releases import RELEASES, release_number, release_of
from tests.carla.conftest import MAPS
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

ROOT = Path(__file__).parents[3]
CROSSING = MAPS / "signal_crossing.xodr"
_NUMBER = re.compile(r"\b0\.(9|10)\.\d+\b")


def test_no_module_outside_the_door_knows_a_release() -> None:
    door = ROOT / "src/odscen/carla/server"
    knowing = [
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "src/odscen").rglob("*.py")
        if door not in path.parents and _NUMBER.search(path.read_text(encoding="utf-8"))
    ]
    assert knowing == []


def test_every_release_has_its_column_in_the_document() -> None:
    text = (ROOT / "docs/carla-server.md").read_text(encoding="utf-8")
    [head] = [line for line in text.splitlines() if line.startswith("| | 0.9.")]
    assert [one.number for one in RELEASES] == re.findall(r"\d+\.\d+\.\d+", head)


@pytest.mark.parametrize(
    ("words", "number"),
    [("0.9.16", "0.9.16"), ("0.9.16-12-g0123abc", "0.9.16"), ("0.10.0", "0.10.0"), ("7a1b", None)],
)
def test_a_release_is_known_by_how_what_it_says_begins(words: str, number: str | None) -> None:
    assert release_number(words) == number


def test_what_a_release_lacks_and_that_another_was_never_tried_is_said() -> None:
    assert [one.number for one in RELEASES if not one.warning] == ["0.9.16"]
    assert "does not turn the wheels" in release_of("0.9.15").warning
    assert "makes no worlds of OpenDRIVE files" in release_of("0.10.0").warning
    assert "0.9.17 was never tried" in release_of("0.9.17").warning
    assert release_of("0.9.17").generates_worlds


@pytest.mark.slow
def test_a_release_that_makes_no_worlds_says_what_to_do_instead() -> None:
    with StandIn(CROSSING) as stand_in, Server(Address(stand_in.host, stand_in.port)) as server:
        server.release = release_of("0.10.0")
        with pytest.raises(CarlaError, match="makes no world of an OpenDRIVE file: load a map"):
            server.load_opendrive(CROSSING.read_text(encoding="utf-8"))
        assert stand_in.calls()["copy_opendrive_to_file"] == 0


def test_what_is_ground_is_known_by_its_label_where_labels_are_known() -> None:
    assert not release_of("0.9.16").is_ground("Car")
    assert release_of("0.9.16").is_ground("Sidewalks")
    assert release_of("0.10.0").is_ground("Car")


def test_a_step_that_was_never_set_is_not_read() -> None:
    """Which ends the process of some packages (0.9.15), and raises in others (0.10.0)."""

    class Settings:
        def __init__(self) -> None:
            self.synchronous_mode = False
            self._delta: float | None = None

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Settings) and vars(self) == vars(other)

        __hash__ = None  # type: ignore[assignment]

        @property
        def fixed_delta_seconds(self) -> float:
            assert self._delta is not None, "bad optional access"
            return self._delta

    settings = Settings()
    settings.synchronous_mode = True
    assert release_of("0.10.0").fixed_delta(settings) is None
    settings._delta = 0.05
    assert release_of("0.10.0").fixed_delta(settings) == 0.05


@pytest.mark.parametrize(("read", "meant"), [(None, None), (4.7e-310, None), (0.05, 0.05)])
def test_a_number_that_was_never_set_is_no_step(read: float | None, meant: float | None) -> None:
    settings = SimpleNamespace(fixed_delta_seconds=read)
    assert release_of("0.9.16").fixed_delta(settings) == meant
