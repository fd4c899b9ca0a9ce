"""Answers of models that cannot be are refused with the field, the row and the value."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.learning.behaviour.behaviour_model import CheckedAction, DrivingAction, DrivingKind

BOTH = np.array([True, True])


@pytest.mark.parametrize(
    ("action", "mask", "words"),
    [
        (DrivingAction(speed=np.array([1.0, np.nan])), BOTH, "speed of row 1 is nan"),
        (DrivingAction(speed=np.zeros(3)), BOTH, r"speed has shape \(3,\), not \(2,\)"),
        (DrivingAction(speed=np.array(["fast", "x"])), BOTH, "speed is no array of numbers"),
        (
            DrivingAction(speed=np.zeros(2)),
            np.ones(2),
            r"is_controlled is float64 \(2,\), not bool",
        ),
        (
            DrivingAction(speed=np.array([-1.0, 0.0])),
            BOTH,
            "a speed of -1 m/s is not between 0 and 150",
        ),
        (DrivingAction(), BOTH, "an action of kind SPEED needs speed"),
        (DrivingAction(DrivingKind.POSE, x=np.zeros(2)), BOTH, "an action of kind POSE needs y"),
        (DrivingAction(np.array([0, 9]), speed=np.zeros(2)), BOTH, "there is no kind of action 9"),
    ],
)
def test_what_cannot_be_is_refused(action: DrivingAction, mask: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        CheckedAction(action, mask, 2)


def test_values_of_vehicles_that_are_not_controlled_are_not_looked_at() -> None:
    action = DrivingAction(np.array([0, 9]), speed=np.array([4.0, np.nan]), change=np.array([1, 0]))
    asked = CheckedAction(action, np.array([True, False]), 2)
    assert asked.rows.tolist() == [0]
    assert asked.speed is not None
    assert asked.speed[0] == 4.0
    assert asked.change is not None
    assert asked.change.tolist() == [1, 0]
