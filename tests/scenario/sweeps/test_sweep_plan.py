import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.scenario.sweeps.sweep_plan import (
    Range,
    SweepPlan,
    Table,
    axis_from_text,
    plan_from_data,
)


@pytest.mark.parametrize(
    ("text", "axis"),
    [
        ("gap=1..4:7", Range("gap", 1.0, 4.0, 7)),
        ("gap = 0.5..4.5", Range("gap", 0.5, 4.5)),
        ("gap=-1..-.5:3", Range("gap", -1.0, -0.5, 3)),
        ("gap=1e-1..2", Range("gap", 0.1, 2.0)),
        ("gap=1,2.5,-4", Table(("gap",), ((1.0,), (2.5,), (-4.0,)))),
        ("gap=3", Table(("gap",), ((3.0,),))),
    ],
)
def test_a_range_and_a_set_are_read(text: str, axis: Range | Table) -> None:
    assert axis_from_text(text) == axis


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("gap", "varies nothing; write gap=1..4:7"),
        ("=3", "varies nothing"),
        ("gap=a,2", "'a' in 'gap=a,2' is not a number"),
        ("gap=4..1", r"gap: the range 4\.\.1 ends before it begins"),
        ("gap=1..2:1", "steps: 1 is not a whole number from 2 on"),
        ("gap=1..2:2.5", "steps: 2.5 is not a whole number"),
        ("gap=1..inf", "is not a finite number"),
        ("gap=nan", "is not a finite number"),
    ],
)
def test_what_is_neither_is_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        axis_from_text(text)


def test_a_grid_has_all_combinations_the_last_changing_first() -> None:
    plan = SweepPlan((Range("a", 0.0, 1.0, 3), Table(("b", "c"), ((1.0, 2.0), (3.0, 4.0)))))
    cases = plan.cases()
    assert [tuple(case.values()) for case in cases] == [
        (0.0, 1.0, 2.0), (0.0, 3.0, 4.0), (0.5, 1.0, 2.0),
        (0.5, 3.0, 4.0), (1.0, 1.0, 2.0), (1.0, 3.0, 4.0),
    ]  # fmt: skip
    assert plan.names == ("a", "b", "c")


@given(st.sampled_from(["latin", "sobol", "random"]), st.integers(1, 70), st.integers(0, 2**31 - 1))
def test_samples_are_as_many_as_asked_inside_and_the_same_again(
    method: str, count: int, seed: int
) -> None:
    data = {
        "vary": [
            {"parameter": "a", "from": -2, "to": 6},
            {"parameter": "b", "values": [1, 5, 9]},
        ],
        "method": method,
        "samples": count,
        "seed": seed,
    }
    plan = plan_from_data(data)
    cases = plan.cases()
    assert len(cases) == count
    assert all(-2 <= case["a"] <= 6 and case["b"] in (1.0, 5.0, 9.0) for case in cases)
    assert plan_from_data(plan.to_dict()).cases() == cases


def test_a_latin_hypercube_and_sobol_cover_each_parameter_evenly() -> None:
    for method in ("latin", "sobol"):
        plan = plan_from_data(
            {"vary": [{"parameter": n, "from": 0, "to": 1} for n in "ab"], "method": method}
            | {"samples": 64, "seed": 5}
        )
        for name in "ab":
            values = [case[name] for case in plan.cases()]
            counts, _ = np.histogram(values, bins=8, range=(0, 1))
            assert counts.tolist() == [8] * 8


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"vary": [{"parameters": 5, "table": [[1]]}]}, "parameters must be a list of names"),
        ({"vary": [], "method": ["grid"]}, "method must be a name"),
        ({"vary": [{"parameter": "a", "values": [10**400]}]}, "so many digits is not finite"),
        ({}, "nothing is varied"),
        ({"vary": 3}, "vary must be a list"),
        ({"vary": [{"parameter": "a"}]}, r"vary\[0\] has parameter; give parameter, from, to"),
        ({"vary": [{"parameter": "a", "values": []}]}, r"vary\[0\] has no values"),
        ({"vary": [{"parameter": "a", "values": [True]}]}, r"vary\[0\].values: True is not"),
        ({"vary": [{"parameters": ["a", "b"], "table": [[1]]}]}, "does not have a value of each"),
        ({"vary": [{"parameter": "a", "values": [1]}] * 2}, "'a' is varied twice"),
        ({"vary": [{"parameter": "a", "from": 1, "to": 2}]}, None),
        ({"vary": [], "many": 3}, "a sweep has no 'many'"),
        ({"vary": [{"parameter": "a", "values": [1]}], "method": "best"}, "'best' is not one of"),
        ({"vary": [{"parameter": "a", "values": [1]}], "method": "latin"}, "needs a number of"),
        (
            {"vary": [{"parameter": "a", "values": [1]}], "method": "grid", "samples": 3},
            "takes no number of samples",
        ),
        ({"vary": [{"parameter": "a", "values": [1]}], "samples": 2.5}, "not a whole number"),
        ({"vary": [{"parameter": "a", "values": [1]}], "samples": 200_000}, "at most 100,000"),
        (
            {"vary": [{"parameter": n, "from": 0, "to": 1, "steps": 400} for n in "ab"]},
            "has 160,000 cases; at most 100,000",
        ),
    ],
)
def test_a_plan_that_is_none_is_refused_in_words(data: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words or "a grid needs the number of steps"):
        plan_from_data(data).cases()


@pytest.mark.parametrize("steps", [30_000_000, 10**11])
def test_a_grid_is_counted_before_it_is_built(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    def built(axis: Range) -> list[float]:
        raise AssertionError(f"{axis.name} is built")

    monkeypatch.setattr(Range, "shares", property(built))
    axes = axis_from_text(f"gap=6..46:{steps}"), axis_from_text("speed=5,10")
    words = f"has {2 * steps:,} cases; .*: gap has {steps:,} values and speed has 2 values"
    with pytest.raises(InputError, match=words):
        SweepPlan(axes)
    vary = [{"parameter": "gap", "from": 6, "to": 46, "steps": steps}]
    with pytest.raises(InputError, match=f": gap has {steps:,} values"):
        plan_from_data({"vary": vary})
    with pytest.raises(InputError, match=f"samples: the sweep has {steps:,} cases"):
        plan_from_data({"vary": vary, "samples": steps})
