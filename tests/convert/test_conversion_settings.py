from __future__ import annotations

import math

import pytest

from odscen.convert.conversion_settings import ConversionSettings
from odscen.errors import InputError


@pytest.mark.parametrize("spacing", [0.0, 0.09, 100.1, math.nan])
def test_a_spacing_that_is_not_possible_is_refused(spacing: float) -> None:
    with pytest.raises(InputError, match=r"between 0\.1 and 100 m"):
        ConversionSettings(spacing=spacing)


@pytest.mark.parametrize("spacing", [0.1, 2.0, 100.0])
def test_both_ends_are_possible(spacing: float) -> None:
    assert ConversionSettings(spacing=spacing).spacing == spacing
