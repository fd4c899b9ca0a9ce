from __future__ import annotations

import pytest

from odscen.figures.measures.emissions import FIGURES

CO2_PER_KM = next(one for one in FIGURES if one.name == "co2_per_km")


@pytest.mark.parametrize(
    ("kilograms", "words"),
    [(0.034, "34 g in all"), (1.25, "1,250 g in all"), (1250.0, "1,250 kg in all")],
)
def test_a_short_run_has_its_carbon_dioxide_in_grams_and_never_as_none(kilograms, words):
    assert CO2_PER_KM.note({"co2_total": kilograms}) == words
