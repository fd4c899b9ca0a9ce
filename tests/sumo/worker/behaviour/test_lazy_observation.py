"""Fields are read when looked at, once, and before the road moves on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from odscen.learning.behaviour.behaviour_model import RoadObservation
from odscen.sumo.worker.behaviour.lazy_observation import LazyObservation


def lazy(asked: list[str]) -> LazyObservation:
    def read(field: str, seen: RoadObservation) -> dict[str, Any]:
        asked.append(field)
        if field in ("leader", "gap"):
            return {"leader": np.array([-1]), "gap": seen.pos + 1.0}
        return {field: np.array([float(len(asked))])}

    return LazyObservation(2.0, np.array([7], dtype=np.int32), read)


def test_a_field_is_read_once_and_with_it_what_comes_along() -> None:
    asked: list[str] = []
    seen = lazy(asked)
    assert (len(seen), seen.time, asked) == (1, 2.0, [])
    assert seen.speed is seen.speed
    assert seen.gap[0] == 3.0 + 1.0
    assert seen.leader[0] == -1
    assert asked == ["speed", "gap", "pos"]


def test_all_is_read_for_one_that_is_kept_and_what_is_no_field_is_refused() -> None:
    asked: list[str] = []
    seen = lazy(asked)
    seen.read_all()
    assert len(asked) == 13  # of 16 fields; time and index are there, gap comes with leader
    before = list(asked)
    assert seen.light is seen.light
    assert asked == before
    with pytest.raises(AttributeError, match="an observation has no 'colour'"):
        _ = seen.colour
