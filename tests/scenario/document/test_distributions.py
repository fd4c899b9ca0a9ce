from __future__ import annotations

import numpy as np
import pytest
from pydantic import TypeAdapter

from odscen.base.errors import ScenarioError
from odscen.scenario.document.distributions import (
    Normal,
    Uniform,
    WrittenDistribution,
    draw_place,
)
from odscen.scenario.document.sampling_config import loads_config


class _Highest(np.random.Generator):
    """Draws the greatest number that rounding lets a uniform distribution give."""

    def uniform(self, low: float = 0.0, high: float = 1.0, _size: object = None) -> float:  # type: ignore[override]
        return float(np.nextafter(high, np.inf)) if low else high


HIGHEST = _Highest(np.random.PCG64(1))


@pytest.mark.parametrize(("weights", "place"), [((1.0,), 0), ((0.1, 0.2, 0.3, 0.0, 0.0), 2)])
def test_a_draw_that_is_rounded_up_to_the_sum_is_the_last_that_has_a_weight(
    weights: tuple[float, ...], place: int
) -> None:
    assert draw_place(weights, HIGHEST) == place


def test_a_draw_that_is_rounded_beyond_its_range_stays_inside() -> None:
    assert Uniform(low=0.1, high=0.7).draw(HIGHEST) == 0.7


@pytest.mark.parametrize(
    "text",
    [
        "[vehicles]\ncar = 1e308\nbus = 1e308",
        'fill = {kind = "choice", values = [0.1, 0.2], weights = [1e308, 1e308]}',
    ],
)
def test_weights_whose_sum_is_no_number_are_refused_where_they_are_read(text: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        loads_config(text, file="c.toml")
    assert "is no number" in " ".join(refused.value.problems)


@pytest.mark.parametrize(
    "text",
    [
        "3.5",
        '{"kind":"uniform","low":1.0,"high":2.0}',
        '{"kind":"normal","mean":1.5,"std":0.5,"low":1.0,"high":2.0}',
        '{"kind":"choice","values":[1.0]}',
        '{"kind":"choice","values":[1.0,2.0],"weights":[3.0,1.0]}',
    ],
)
def test_what_is_written_of_a_distribution_is_read_as_strictly_as_documents_are(text: str) -> None:
    kinds: TypeAdapter[object] = TypeAdapter(WrittenDistribution)
    assert kinds.dump_json(kinds.validate_json(text, strict=True)).decode() == text


def test_a_deviation_of_minus_zero_is_none() -> None:
    rng = np.random.default_rng(0)
    assert Normal(mean=1.5, std=-0.0, low=1.0, high=2.0).draw(rng) == 1.5
