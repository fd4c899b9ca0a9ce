from __future__ import annotations

import json
import math
from typing import Any

import pytest

from odscen.base.errors import InputError
from odscen.figures.judging.expectations import parse_expectation
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("seed", -1),
        ("seed", 2**31),
        ("until", 0.0),
        ("until", math.inf),
        ("until", math.nan),
        ("step_length", 1.5),
        ("step_length", -0.1),
        ("slice_length", 0.0),
        ("time_limit", -1.0),
    ],
)
def test_a_value_that_is_not_possible_is_refused_by_its_name(field: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{field} must"):
        RunSettings(**{field: value})


def test_criticality_is_refused_where_there_are_only_queues() -> None:
    with pytest.raises(InputError, match="meso"):
        RunSettings(recording=Recording(criticality=True), meso=True)
    with pytest.raises(InputError, match="meso"):
        RunSettings(expectations=(parse_expectation("min_ttc>=1"),), meso=True)


@pytest.mark.parametrize(("text", "wanted"), [("min_ttc>=1", True), ("arrived>=0.9", False)])
def test_criticality_is_recorded_where_an_expectation_asks_for_it(text: str, wanted: bool) -> None:
    settings = RunSettings(expectations=(parse_expectation(text),))
    assert not settings.recording.criticality
    assert settings.recorded.criticality is wanted


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"seed": 3, "until": 600.0, "step_length": 0.25, "weather": False, "meso": True},
        {"slice_length": 60.0, "time_limit": 10.0},
        {"slice_length": None, "expectations": (parse_expectation("arrived >= 95%"),)},
        {"recording": Recording(every=2.0, region=(0.0, 1.0, 2.0, 3.0), columns=("lane", "pos"))},
    ],
)
def test_settings_come_back_from_json_as_they_were(values: dict[str, Any]) -> None:
    settings = RunSettings(**values)
    assert RunSettings.from_dict(json.loads(json.dumps(settings.to_dict()))) == settings
