from __future__ import annotations

import pytest

from odscen.errors import InputError, ScenarioError
from odscen.scenario.config import SamplingConfig
from odscen.scenario.distributions import Constant
from odscen.scenario.generation_settings import GenerationSettings


@pytest.mark.parametrize("values", [{"count": 0}, {"seed": -1}, {"seed": 2**31 - 1, "count": 2}])
def test_a_number_that_is_not_possible_is_refused(values: dict[str, int]) -> None:
    with pytest.raises(InputError):
        GenerationSettings(**values)  # type: ignore[arg-type]


def test_a_share_or_size_that_is_not_possible_is_refused_before_anything_is_sampled() -> None:
    with pytest.raises(ScenarioError, match="fill"):
        GenerationSettings(fill=1.5)
    with pytest.raises(ScenarioError, match="at least 1 segment"):
        GenerationSettings(roi_segments=0)


def test_what_is_given_stands_in_for_the_configuration_and_nothing_else_changes() -> None:
    config = SamplingConfig(ego=True)
    sampling = GenerationSettings(config=config, fill=0.25).sampling
    assert sampling == config.model_copy(update={"fill": Constant(value=0.25)})
