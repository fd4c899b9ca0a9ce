"""JSON with an indent is what the standard library writes."""

import json

import pytest

from odscen.base.json_text import indented

VALUES = [
    {},
    [],
    "ü",
    1.5,
    {"a": 1, "b": [], "c": {}, "d": None, "e": True, "f": 'a\n"ü,: '},
    {"rows": [{"x": 1e-7, "y": 1e22, "z": -0.0}, {}, [], [1, [2, [3]]]], "last": {"a": {"b": 1}}},
    [1, "two", None, (3, 4), {"five": (6,)}],
]


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("indent", [1, 2])
@pytest.mark.parametrize("ensure_ascii", [True, False])
def test_the_text_is_that_of_the_standard_library(value, indent, ensure_ascii):
    expected = json.dumps(value, indent=indent, ensure_ascii=ensure_ascii)
    assert indented(value, indent=indent, ensure_ascii=ensure_ascii) == expected


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_numbers_that_are_not_finite_are_refused(number):
    with pytest.raises(ValueError, match="JSON compliant"):
        indented({"a": [{"b": number}]}, indent=1)
