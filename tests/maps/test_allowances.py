from __future__ import annotations

import bz2
import gzip

import pytest

from odscen.base.errors import InputError
from odscen.maps.allowances import (
    BY_SIZE,
    MOST_MEMORY,
    Allowance,
    BuildLimits,
    for_document,
    unpacked_size,
)


def test_a_larger_map_and_a_closer_spacing_may_use_more() -> None:
    small, large = (BY_SIZE.for_map(size, spacing=2.0) for size in (10_000, 3_000_000))
    close = BY_SIZE.for_map(1_000_000, spacing=0.5)
    assert small.memory < large.memory <= MOST_MEMORY
    assert (large.seconds, close.seconds) == (90.0, 100.0)
    assert close.memory > BY_SIZE.for_map(1_000_000, spacing=2.0).memory


@pytest.mark.parametrize("size", [0, 50_000_000, 256_000_000])
def test_no_file_may_use_more_than_a_gigabyte_and_a_half_unasked(size: int) -> None:
    assert BY_SIZE.for_map(size, spacing=0.1).memory <= 1.5e9
    assert for_document(size).memory <= 1.5e9


def test_options_go_before_the_environment_and_that_before_the_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ODSCEN_BUILD_MEMORY", "4")
    monkeypatch.setenv("ODSCEN_BUILD_MINUTES", "0.5")
    assert BY_SIZE.for_map(1, spacing=2.0)[:2] == (4_000_000_000, 30.0)
    assert BuildLimits(3, 2).for_map(1, spacing=2.0)[:2] == (3_000_000_000, 120.0)


def test_a_large_network_that_is_brought_in_may_use_more_and_a_small_one_hardly() -> None:
    town = BY_SIZE.for_map(61_000_000, spacing=2.0, network=22_900_000)
    assert town.memory == pytest.approx(3.65e9, rel=0.01)
    assert town.times_usual == pytest.approx(2.5, rel=0.01)
    assert BY_SIZE.for_map(10_000, spacing=2.0, network=20_000).memory < 1.21e9


@pytest.mark.parametrize("text", ["much", "0", "-1", "nan", "inf", "1e9"])
def test_a_limit_that_is_no_number_above_zero_is_refused(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ODSCEN_BUILD_MEMORY", text)
    with pytest.raises(InputError, match=f"ODSCEN_BUILD_MEMORY='{text}' must be a number"):
        BY_SIZE.for_map(1, spacing=2.0)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), 1e9])
def test_an_option_that_is_no_number_above_zero_is_refused(value: float) -> None:
    with pytest.raises(InputError, match="--build-minutes must be above 0"):
        BuildLimits(minutes=value)


def test_a_map_that_may_use_more_memory_than_any_may_unasked_may_have_more_lanes() -> None:
    assert BY_SIZE.for_map(256_000_000, spacing=2.0).times_usual == 1.0
    assert BuildLimits(memory=0.5).for_map(1, spacing=2.0).times_usual == 1.0
    assert BuildLimits(memory=14.5).for_map(1, spacing=2.0).times_usual == pytest.approx(10.0)


def test_a_passed_limit_says_how_to_allow_twice_as_much_and_ends_with_exit_code_3() -> None:
    error = Allowance(2_000_000_000, 60.0, raise_it=True).passed("building the map", "memory")
    assert error.exit_code == 3
    assert str(error) == (
        "building the map needs more than 2.00 GB of memory, the limit for a map of its size; "
        "to allow more: --build-memory 4.00 (GB), or ODSCEN_BUILD_MEMORY=4.00"
    )
    for limit in ("time", "wall"):
        error = Allowance(1, 60.0, raise_it=True).passed("building the map", limit)
        assert "--build-minutes 2, or ODSCEN_BUILD_MINUTES=2" in str(error)


def test_less_memory_than_the_libraries_need_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"--build-memory must be at least 0\.25 \(GB\), not 0\.1"):
        BuildLimits(memory=0.1)
    monkeypatch.setenv("ODSCEN_BUILD_MEMORY", "0.1")
    with pytest.raises(InputError, match=r"ODSCEN_BUILD_MEMORY must be at least 0\.25"):
        BY_SIZE.for_map(1_000, spacing=2.0)


def test_a_packed_extract_may_use_what_its_xml_may() -> None:
    """A town of 0.6 MB of PBF was refused: it may use what 6 MB of XML may."""
    xml = b"<osm version='0.6'/>"
    assert unpacked_size(xml) == len(xml)
    for packed in (gzip.compress(xml), bz2.compress(xml), b"\0\0\0\x0e\n\tOSMHeader" + xml):
        assert unpacked_size(packed) == 10 * len(packed)
