from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.figures.judging.expectations import NAMES, evaluate, parse_expectation
from odscen.figures.measures.figure import Figure
from odscen.figures.measures.registry import COUNTS

SUMMARY = {
    "sim_seconds": 120.0,
    "actors": {"planned": 200, "inserted": 199, "arrived": 190, "collided": 0, "waiting": 1},
    "figures": {"insertion_error_max": 0.04, "mean_travel_time": None},
}


@pytest.mark.parametrize(
    ("text", "value", "passed"),
    [
        ("arrived>=0.95", 0.95, True),
        ("arrived > 0.95", 0.95, False),
        ("arrived>=95%", 0.95, True),
        ("arrived>=190", 190.0, True),
        ("arrived>=1", 190.0, True),
        ("arrived==1.0", 0.95, False),
        ("collided==0", 0.0, True),
        ("waiting < 1", 1.0, False),
        ("insertion_error_max<=0.10", 0.04, True),
        ("sim_seconds<=1.2e2", 120.0, True),
        ("mean_travel_time<100", None, False),
        ("teleported==0", None, False),
    ],
)
def test_an_expectation_is_judged(text: str, value: float | None, passed: bool) -> None:
    (verdict,) = evaluate([parse_expectation(text)], SUMMARY)
    assert (verdict.value, verdict.passed) == (value, passed)


def test_a_failed_run_fails_every_expectation() -> None:
    failed = {"sim_seconds": None, "actors": {"planned": 5}, "figures": {}}
    wanted = [parse_expectation(f"{name}>=0") for name in NAMES if name != "planned"]
    assert not any(verdict.passed for verdict in evaluate(wanted, failed))


def test_figures_of_ones_own_are_expected_as_others_are() -> None:
    own = {"queue": Figure(name="queue", unit="m", label="", definition="", source="")}
    longer = parse_expectation("queue <= 2 km", own=own)
    assert (longer.bound, longer.share) == (2000.0, False)
    summary = {"sim_seconds": 1.0, "actors": {"planned": 1}, "figures": {"queue": 2001.0}}
    (verdict,) = evaluate([longer], summary)
    assert (verdict.value, verdict.passed) == (2001.0, False)
    with pytest.raises(InputError, match="no figure is named 'queue'"):
        parse_expectation("queue <= 2 km")


def test_shares_of_nobody_are_not_met() -> None:
    empty = {"sim_seconds": 1.0, "actors": {"planned": 0, "arrived": 0}, "figures": {}}
    (verdict,) = evaluate([parse_expectation("arrived>=0.95")], empty)
    assert not verdict.passed


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("arrived", "not of the form NAME OP NUMBER"),
        ("arrived=>0.9", "not of the form NAME OP NUMBER"),
        ("arrived>=nan", "not of the form NAME OP NUMBER"),
        ("arived>=0.95", "did you mean arrived"),
        ("zzz>=1", "known are sim_seconds"),
        ("mean_travel_time<50%", "no percentage"),
        ("mean_travel_time<50 m", "written in s, min, h, not in 'm'"),
        ("arrived>=5 s", "written in no unit"),
    ],
)
def test_a_bad_expectation_says_what_is_wrong(text: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        parse_expectation(text)


@given(
    st.sampled_from(NAMES),
    st.sampled_from([">=", "<=", ">", "<", "=="]),
    st.floats(-1e6, 1e6),
    st.sampled_from(["", " "]),
)
def test_every_name_operator_and_number_is_read(name: str, op: str, bound: float, gap: str) -> None:
    expectation = parse_expectation(f"{name}{gap}{op}{gap}{bound!r}")
    assert (expectation.name, expectation.op, expectation.bound) == (name, op, bound)
    assert not (expectation.share and name not in COUNTS)


@given(st.text(max_size=30))
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(InputError):
        parse_expectation(text)


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("mean_delay <= 40 s", 40.0),
        ("mean_delay <= 2 min", 120.0),
        ("mean_speed >= 36 km/h", 10.0),
        ("insertion_error_max < 25cm", 0.25),
    ],
)
def test_a_bound_may_have_a_unit(text: str, bound: float) -> None:
    assert parse_expectation(text).bound == pytest.approx(bound)
