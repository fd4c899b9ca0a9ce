from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from odscen.scenario.document.drivers_document import Drivers, DriverSet


def refused(**fields: Any) -> str:
    with pytest.raises(ValidationError) as caught:
        Drivers.model_validate(fields)
    return str(caught.value)


def test_parameters_are_refused_by_name_and_range() -> None:
    sets = [{"id": "a", "parameters": {"minGapp": 2.0}}]
    assert "drivers have no parameter 'minGapp'; did you mean minGap?" in refused(sets=sets)
    sets = [{"id": "a", "parameters": {"tau": 0.01}}]
    assert "tau must be 0.1 to 10 s, not 0.01" in refused(sets=sets)
    wide = {"kind": "uniform", "low": 0.5, "high": 20.0}
    assert "tau must be 0.1 to 10 s, not 0.5 to 20" in refused(
        sets=[{"id": "a", "parameters": {"tau": wide}}]
    )


def test_ids_of_sets_are_unique_and_no_driving_styles() -> None:
    assert "'sporty' is a driving style; give the set another id" in refused(
        sets=[{"id": "sporty"}]
    )
    assert "several driver sets have the id 'a'" in refused(sets=[{"id": "a"}, {"id": "a"}])


def test_shares_name_styles_and_sets_only() -> None:
    assert "shares name 'b', which is neither" in refused(sets=[{"id": "a"}], shares={"b": 1.0})
    assert Drivers(sets=(DriverSet(id="a"),), shares={"a": 1.0, "normal": 3.0}).styles == (
        "cautious", "normal", "sporty", "a",
    )  # fmt: skip


def test_a_constant_is_written_as_the_number_that_it_is() -> None:
    one = DriverSet.model_validate({"id": "a", "parameters": {"tau": 2.0}})
    assert one.model_dump(mode="json")["parameters"] == {"tau": 2.0}
    assert DriverSet.model_validate(one.model_dump(mode="json")) == one
