from __future__ import annotations

import pytest

from odscen.base.errors import ScenarioError
from odscen.scenario.document.sampling_config import loads_config


@pytest.mark.parametrize(
    "text",
    [
        "[behaviour]\ndepart = 1e18",
        "[behaviour]\ndepart = { kind = 'uniform', low = 0, high = 1e308 }",
        "[behaviour]\nwalking_speed = {kind = 'normal', mean = 1, std = 1e300, low = 0, high = 9}",
        "[roi.segments]\nkind = 'choice'\nvalues = [nan]",
        "[environment.parameters]\nfog_density = -inf",
    ],
)
def test_what_no_field_of_a_scenario_can_be_is_not_drawn(text: str) -> None:
    with pytest.raises(ScenarioError, match="the sampling configuration has problems"):
        loads_config(text)


@pytest.mark.parametrize("text", ["{" * 100_000, "a = " + "[" * 100_000, "a = " + "9" * 5000])
def test_a_configuration_without_end_is_refused(text: str) -> None:
    with pytest.raises(ScenarioError, match="configuration"):
        loads_config(text)
