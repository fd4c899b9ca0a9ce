import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.scenario.document.formulas import evaluate, names_in

VALUES = {"gap": 3.0, "speed": -20.0, "_x1": 0.25}
numbers = st.floats(-1e6, 1e6, allow_nan=False)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("$gap", 3.0),
        ("2 * $gap + 1", 7.0),
        ("2 * ($gap + 1)", 8.0),
        ("-$speed / 4", 5.0),
        ("$gap - -$gap", 6.0),
        ("$gap/$_x1", 12.0),
        ("7 % $gap", 1.0),
        ("-7 % $gap", -1.0),
        ("round(2.5)", 3.0),
        ("round(-2.5)", -3.0),
        ("floor($speed / 3)", -7.0),
        ("ceil($speed / 3)", -6.0),
        ("pow($gap, 2) + sqrt(16)", 13.0),
        ("max(min($gap, 2), sign($speed)) + abs($speed)", 22.0),
        (" 1e-3 * $gap ", 0.003),
        ("acos(cos($gap)) + atan(tan(1)) + asin(sin(0.5))", 4.5),
        ("not ($gap - 3) and $_x1", 1.0),
        ("($gap - 3) or 0", 0.0),
    ],
)
def test_an_expression_is_computed_as_openscenario_does(text: str, value: float) -> None:
    assert evaluate(text, VALUES) == pytest.approx(value, rel=1e-12)


@given(numbers, numbers, numbers)
def test_operators_bind_as_in_python(a: float, b: float, c: float) -> None:
    assert evaluate("$a + $b * $c - ($a - $b)", {"a": a, "b": b, "c": c}) == a + b * c - (a - b)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("$gapp", r"\$gapp, which is no parameter; there are \$gap, \$speed"),
        ("2 *", "no expression"),
        ("gap", "no expression"),
        ("$gap ** 2", "no expression"),
        ("$gap.real", "no expression"),
        ("__import__('os')", "no expression"),
        ("[$gap][0]", "no expression"),
        ("'a'", "no expression|no value"),
        ("$gap * True", "no expression"),
        ("pow($gap)", "no expression"),
        ("($gap" + ")" * 300, "no expression"),
        ("(" * 240 + "1" + ")" * 240, "no expression"),
        ("1 / ($gap - 3)", "has no value: "),
        ("sqrt($speed)", "has no value: "),
        ("pow(1e200, 2)", "has no value: "),
        ("1e200 * 1e200", "is inf, not a finite number"),
        ("1 + " * 200 + "1", "longer than 500 characters"),
    ],
)
def test_what_is_no_expression_or_has_no_value_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        evaluate(text, VALUES)


def test_names_are_found_without_their_sign() -> None:
    assert names_in("$gap + 2*$_x1/$gap") == {"gap", "_x1"}
    assert names_in("$5 and $") == frozenset()
    assert math.isclose(evaluate("$a", {"a": 0.1}), 0.1)
