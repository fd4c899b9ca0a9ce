from __future__ import annotations

import json

import pytest

from odscen.base.error_data import error_from_data, error_to_data
from odscen.base.errors import (
    ConflictError,
    LimitError,
    NotFoundError,
    OdscenError,
    OpenDriveError,
    ScenarioError,
    ToolError,
    WorkspaceError,
)


@pytest.mark.parametrize(
    "error",
    [
        OpenDriveError("length=-3", file="a.xodr", element="road 1"),
        ScenarioError("2 problems", problems=["one", "\udc80 other"], file="a.json"),
        NotFoundError("map", "Tovn01", ["Town01", "Town02"]),
        ConflictError("taken", current=4),
        LimitError("too much"),
        ToolError("netconvert refused the map", output="Error: no\n"),
        WorkspaceError("no"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_is_the_same_after_a_way_through_json(error: OdscenError) -> None:
    again = error_from_data(json.loads(json.dumps(error_to_data(error))))
    assert type(again) is type(error)
    assert (str(again), vars(again), again.exit_code) == (str(error), vars(error), error.exit_code)
