from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from odscen.base.arrays import offsets
from odscen.opendrive.geometry import PlanView
from odscen.opendrive.profiles import CubicTable, StepTable, locate
from odscen.opendrive.road_model import Geometry, GeometryKind

lengths = st.floats(0.05, 300.0)
headings = st.floats(-7.0, 7.0)
curvatures = st.one_of(st.just(0.0), st.floats(-0.2, 0.2), st.floats(-1e-7, 1e-7))


def plan_of(
    kind: GeometryKind, length: float, params: tuple[float, ...], hdg: float = 0.0
) -> PlanView:
    return PlanView.of([(Geometry(0.0, 3.0, -2.0, hdg, length, kind, params),)])


def at(plan: PlanView, *s: float) -> tuple[np.ndarray, ...]:
    return plan.at(np.zeros(len(s), dtype=np.int64), np.array(s))


@given(lengths, headings, st.floats(0, 1))
def test_a_line_goes_straight_on(length: float, hdg: float, share: float) -> None:
    x, y, heading, curvature, _ = at(plan_of(GeometryKind.LINE, length, (), hdg), share * length)
    assert x[0] == pytest.approx(3.0 + share * length * math.cos(hdg), abs=1e-9)
    assert y[0] == pytest.approx(-2.0 + share * length * math.sin(hdg), abs=1e-9)
    assert (heading[0], curvature[0]) == (hdg, 0.0)


@given(lengths, headings, st.floats(0.001, 0.3), st.sampled_from([-1, 1]))
def test_an_arc_keeps_its_distance_to_its_centre(
    length: float, hdg: float, size: float, sign: int
) -> None:
    k = sign * size
    x, y, heading, _, _ = at(
        plan_of(GeometryKind.ARC, length, (k,), hdg), 0.0, 0.4 * length, length
    )
    centre = 3.0 - math.sin(hdg) / k, -2.0 + math.cos(hdg) / k
    assert np.hypot(x - centre[0], y - centre[1]) == pytest.approx(1 / size, rel=1e-9)
    assert heading[2] == pytest.approx(hdg + k * length)


def test_an_arc_without_curvature_is_a_line() -> None:
    arc, line = (
        plan_of(GeometryKind.ARC, 50.0, (0.0,), 0.3),
        plan_of(GeometryKind.LINE, 50.0, (), 0.3),
    )
    assert all(
        np.array_equal(a, b) for a, b in zip(at(arc, 0, 20, 50), at(line, 0, 20, 50), strict=True)
    )


@given(lengths, curvatures, curvatures)
def test_a_spiral_is_the_integral_of_its_heading(length: float, start: float, end: float) -> None:
    sigma = (end - start) / length

    def theta(tau: float) -> float:
        return 0.4 + start * tau + 0.5 * sigma * tau * tau

    x, y, heading, curvature, _ = at(
        plan_of(GeometryKind.SPIRAL, length, (start, end), 0.4), length
    )
    real = quad(lambda tau: math.cos(theta(tau)), 0, length, epsabs=1e-11, limit=400)[0]
    imag = quad(lambda tau: math.sin(theta(tau)), 0, length, epsabs=1e-11, limit=400)[0]
    assert x[0] == pytest.approx(3.0 + real, abs=1e-7)
    assert y[0] == pytest.approx(-2.0 + imag, abs=1e-7)
    assert heading[0] == pytest.approx(theta(length))
    assert curvature[0] == pytest.approx(end, abs=1e-12)


@given(lengths, curvatures)
def test_a_spiral_of_constant_curvature_is_an_arc(length: float, k: float) -> None:
    spiral = at(plan_of(GeometryKind.SPIRAL, length, (k, k)), 0.3 * length, length)
    arc = at(plan_of(GeometryKind.ARC, length, (k,)), 0.3 * length, length)
    for one, other in zip(spiral[:4], arc[:4], strict=True):
        assert one == pytest.approx(other, abs=1e-9)


@given(lengths, st.floats(0.001, 0.1), st.floats(1e-14, 1e-3))
def test_a_spiral_is_continuous_where_the_two_ways_to_compute_it_meet(
    length: float, k: float, difference: float
) -> None:
    """A spiral is close to the arc of its mean curvature: within ``difference length^2``."""
    spiral = at(plan_of(GeometryKind.SPIRAL, length, (k, k + difference)), length)
    arc = at(plan_of(GeometryKind.ARC, length, (k + difference / 2,)), length)
    assert math.hypot(spiral[0][0] - arc[0][0], spiral[1][0] - arc[1][0]) <= (
        difference * length * length / 4 + 1e-9
    )


def test_a_param_poly_that_describes_a_circle_runs_like_an_arc() -> None:
    # Taylor series of a circle of radius 50 for 0.15 rad: off by 1 mm.
    r, angle = 50.0, 0.15
    length = r * angle
    params = (0.0, 1.0, 0.0, -1 / (6 * r * r), 0.0, 0.0, 1 / (2 * r), 0.0)
    s = (0.0, 0.3 * length, length)
    curve = at(plan_of(GeometryKind.PARAM_POLY3, length, params), *s)
    arc = at(plan_of(GeometryKind.ARC, length, (1 / r,)), *s)
    assert curve[0] == pytest.approx(arc[0], abs=2e-3)
    assert curve[1] == pytest.approx(arc[1], abs=2e-3)
    assert curve[2] == pytest.approx(arc[2], abs=2e-3)


@pytest.mark.slow
@given(st.floats(-0.01, 0.01), st.floats(-1e-4, 1e-4), st.floats(1.0, 80.0))
def test_a_poly3_is_run_through_by_arc_length(c: float, d: float, length: float) -> None:
    plan = plan_of(GeometryKind.POLY3, length, (0.0, 0.0, c, d))
    x, _, _, _, _ = at(plan, length)
    run = quad(lambda u: math.hypot(1.0, 2 * c * u + 3 * d * u * u), 0, x[0] - 3.0)[0]
    assert run == pytest.approx(length, abs=1e-6)


@given(
    st.sampled_from(list(GeometryKind)),
    st.floats(5.0, 80.0),
    headings,
    st.lists(st.floats(-0.02, 0.02), min_size=4, max_size=4),
    st.floats(0.05, 0.95),
)
def test_heading_and_curvature_are_derivatives_of_the_position(
    kind: GeometryKind, length: float, hdg: float, values: list[float], share: float
) -> None:
    p, q, r, t = values
    params = {
        GeometryKind.LINE: (),
        GeometryKind.ARC: (p,),
        GeometryKind.SPIRAL: (p, q),
        GeometryKind.POLY3: (0.0, p, q, r / 100),
        GeometryKind.PARAM_POLY3: (0.0, 1.0, p / 5, q / 500, 0.0, t, r, p / 100),
    }[kind]
    plan = plan_of(kind, length, params, hdg)
    h = 1e-4
    before, here, after = (share * length + d for d in (-h, 0.0, h))
    x, y, heading, curvature, change = at(plan, before, here, after)
    # A paramPoly3 is run through in its length, whatever the arc length: scale to real metres.
    stretch = plan.curves.stretch[0] if plan.curves.stretch.size else 1.0
    step = 2 * h * stretch
    direction = math.atan2(y[2] - y[0], x[2] - x[0])
    assert math.remainder(direction - heading[1], 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert math.hypot(x[2] - x[0], y[2] - y[0]) == pytest.approx(step, rel=1e-6)
    assert math.remainder(heading[2] - heading[0], 2 * math.pi) / step == pytest.approx(
        curvature[1], abs=1e-6
    )
    assert (curvature[2] - curvature[0]) / step == pytest.approx(change[1], abs=1e-6)


@pytest.mark.slow
@given(st.lists(st.integers(0, 12), min_size=1, max_size=8), st.data())
def test_records_are_found_like_a_search_from_the_end_would(
    sizes: list[int], data: st.DataObject
) -> None:
    starts = np.concatenate(
        [np.sort(data.draw(st.lists(st.floats(0, 9), min_size=n, max_size=n))) for n in sizes]
        + [np.zeros(0)]
    )
    first = offsets(sizes)
    group = data.draw(st.integers(0, len(sizes) - 1))
    s = data.draw(st.one_of(st.floats(-1, 10), st.sampled_from([0.0, *starts.tolist()])))
    rows = range(first[group], first[group + 1])
    expected = max((row for row in rows if starts[row] <= s), default=first[group] if rows else -1)
    found = locate(np.append(starts, 0.0)[: starts.size], first, np.array([group]), np.array([s]))
    assert found[0] == expected


def test_empty_tables_answer_with_nothing() -> None:
    cubics, steps = CubicTable.of([(), ()]), StepTable.of([(), ()])
    group, s = np.array([0, 1]), np.array([1.0, 2.0])
    assert [part.tolist() for part in cubics.at(group, s)] == [[0, 0], [0, 0], [0, 0]]
    assert steps.at(group, s, default=7.0).tolist() == [7, 7]


def test_a_step_holds_from_its_place_on_and_not_before() -> None:
    steps = StepTable.of([((5.0, 1.0), (10.0, 2.0)), ()])
    group, s = np.array([0, 0, 0, 0, 1]), np.array([4.9, 5.0, 9.9, 10.0, 7.0])
    assert steps.at(group, s, default=-1.0).tolist() == [-1, 1, 1, 2, -1]
