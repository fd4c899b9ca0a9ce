"""Messages to programs that drive: there and back, served, and refused with what is wrong."""

from __future__ import annotations

import io
from dataclasses import fields

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.learning.behaviour import behaviour_messages as messages
from odscen.learning.behaviour.behaviour_model import DrivingAction, DrivingKind
from odscen.learning.behaviour.intelligent_driver import IntelligentDriver
from tests.learning.behaviour.road import scene, seen

ROAD = scene(3)
SEEN = seen(ROAD, [0, 1, 0], [10.0, 20.0, 90.0], [5.0, 6.0, 7.0], time=12.5)


def test_scene_and_observation_come_back_as_they_were() -> None:
    road, seed = messages.scene_from_bytes(messages.scene_bytes(ROAD, 7))
    assert seed == 7
    for one, other, given in ((road, ROAD, fields(ROAD)), (
        messages.observation_from_bytes(messages.observation_bytes(SEEN)), SEEN, fields(SEEN),
    )):  # fmt: skip
        for field in given:
            a, b = getattr(one, field.name), getattr(other, field.name)
            np.testing.assert_array_equal(a, b)
            assert np.asarray(a).dtype == np.asarray(b).dtype, field.name


def test_an_action_comes_back_with_the_fields_that_it_has() -> None:
    action = DrivingAction(DrivingKind.SPEED_UNCHECKED, speed=np.array([1.0, 2.0, 3.0]))
    mask = np.array([True, False, True])
    back, controlled = messages.action_from_bytes(messages.action_bytes(action, mask), 3)
    np.testing.assert_array_equal(controlled, mask)
    np.testing.assert_array_equal(back.kind, [1, 1, 1])
    np.testing.assert_array_equal(back.speed, [1.0, 2.0, 3.0])
    assert back.lane is None


def test_a_served_model_answers_as_it_does_in_process() -> None:
    given = b"".join(
        messages.framed(one)
        for one in (messages.scene_bytes(ROAD, 7), messages.observation_bytes(SEEN))
    )
    back = io.BytesIO()
    messages.serve(IntelligentDriver(), io.BytesIO(given), back)
    model = IntelligentDriver()
    own, mask = model.act(SEEN, model.init(np.random.default_rng(7), ROAD))
    assert back.getvalue() == messages.framed(b"") + messages.framed(
        messages.action_bytes(own, mask)
    )


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"nothing", "is no .npy array"),
        (messages._pack_npy(np.zeros(3)), "no field 'controlled'"),
        (messages._pack_npy(np.zeros(3, dtype=[("controlled", "?"), ("sped", "f8")])), "'sped'"),
        (messages._pack_npy(np.zeros(2, dtype=[("controlled", "?")])), r"shape \(2,\), not \(3,\)"),
    ],
)
def test_an_answer_that_is_none_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        messages.action_from_bytes(data, 3)
