"""Bands and offsets of green waves, against values found by hand."""

from __future__ import annotations

import pytest

from odscen.scenario.signals.green_wave import (
    GreenWindow,
    WaveLight,
    green_bands,
    widest_offsets,
)


def light(seconds: float, out_time: float, back_time: float, begin: float = 0.0) -> WaveLight:
    window = (GreenWindow(begin, seconds),)
    return WaveLight(window, window, out_time, back_time)


def test_two_lights_at_once_lose_the_travel_time_in_both_directions() -> None:
    # 20 s apart, 40 of 80 s green, no offset: each band is 20 s shorter than the green.
    lights = [light(40.0, 0.0, 20.0), light(40.0, 20.0, 0.0)]
    out, back = green_bands(lights, (0.0, 0.0), 80.0)
    assert (out.begin, out.seconds) == (0.0, 20.0)
    assert (back.begin, back.seconds) == (0.0, 20.0)


def test_an_offset_of_the_travel_time_opens_one_direction_and_narrows_the_other() -> None:
    lights = [light(40.0, 0.0, 20.0), light(40.0, 20.0, 0.0)]
    out, back = green_bands(lights, (0.0, 20.0), 80.0)
    assert (out.begin, out.seconds) == (0.0, 40.0)
    assert back.seconds == 0.0
    assert widest_offsets(lights, 80.0, favoured="out") == (0.0, 20.0)
    assert widest_offsets(lights, 80.0, favoured="back") == (0.0, 60.0)


def test_lights_half_a_cycle_apart_have_full_bands_in_both_directions() -> None:
    lights = [light(30.0, 0.0, 40.0), light(30.0, 40.0, 0.0)]
    assert widest_offsets(lights, 80.0) == (0.0, 40.0)
    assert [band.seconds for band in green_bands(lights, (0.0, 40.0), 80.0)] == [30.0, 30.0]


def test_offsets_count_modulo_the_cycle() -> None:
    lights = [light(40.0, 0.0, 20.0), light(40.0, 20.0, 0.0)]
    assert green_bands(lights, (0.0, 20.0), 80.0) == green_bands(lights, (80.0, 100.0), 80.0)
    far = [light(40.0, 0.0, 180.0), light(40.0, 180.0, 0.0)]
    assert widest_offsets(far, 80.0, favoured="out") == (0.0, 20.0)


def test_the_green_of_a_later_stage_and_one_over_the_end_of_the_cycle_count_where_they_are() -> (
    None
):
    # Green from 70 to 10 s of the next cycle, and from 50 to 75 s: 60 s later the same moment.
    lights = [light(20.0, 0.0, 20.0, begin=70.0), light(25.0, 20.0, 0.0, begin=50.0)]
    (offset, other) = widest_offsets(lights, 80.0, favoured="out")
    out, _ = green_bands(lights, (offset, other), 80.0)
    assert out.seconds == pytest.approx(20.0)
    assert out.begin == pytest.approx(70.0)


@pytest.mark.parametrize("favoured", ["both", "out", "back"])
def test_no_other_offsets_have_wider_bands(favoured: str) -> None:
    cycle = 30.0
    lights = [
        light(12.0, 0.0, 25.0),
        WaveLight((GreenWindow(3.0, 10.0),), (GreenWindow(6.0, 14.0),), 11.0, 14.0),
        light(13.0, 25.0, 0.0, begin=5.0),
    ]

    def value(offsets: tuple[float, ...]) -> tuple[float, float]:
        out, back = (band.seconds for band in green_bands(lights, offsets, cycle))
        if favoured == "both":
            return min(out, back), out + back
        return (out, back) if favoured == "out" else (back, out)

    found = value(widest_offsets(lights, cycle, favoured=favoured))  # type: ignore[arg-type]
    every = max(value((0.0, float(a), float(b))) for a in range(30) for b in range(30))
    assert found == pytest.approx(every)


def test_one_direction_is_favoured_at_the_price_of_the_other() -> None:
    lights = [light(20.0, 0.0, 12.0), light(20.0, 6.0, 6.0), light(20.0, 12.0, 0.0)]
    for favoured, best in (("out", 0), ("back", 1)):
        offsets = widest_offsets(lights, 60.0, favoured=favoured)  # type: ignore[arg-type]
        bands = [band.seconds for band in green_bands(lights, offsets, 60.0)]
        assert bands[best] == 20.0
        assert bands[1 - best] == 0.0


def test_a_road_that_leads_one_way_has_a_band_in_one_direction() -> None:
    window = (GreenWindow(0.0, 30.0),)
    lights = [WaveLight(window, (), 0.0, 0.0), WaveLight(window, (), 25.0, 0.0)]
    offsets = widest_offsets(lights, 70.0, favoured="out")
    assert offsets == (0.0, 25.0)
    assert [band.seconds for band in green_bands(lights, offsets, 70.0)] == [30.0, 0.0]
