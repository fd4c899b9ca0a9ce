import pytest

from odscen.base.errors import (
    InputError,
    NotFoundError,
    OpenDriveError,
    ScenarioError,
    ToolError,
    in_file,
)


def test_a_message_names_file_then_element_then_problem():
    error = OpenDriveError("length is -3", file="a.xodr", element="road 7")
    assert str(error) == "a.xodr: road 7: length is -3"


def test_the_file_is_added_once_at_the_boundary():
    with pytest.raises(InputError, match=r"^a\.xodr: road 7: bad$"), in_file("a.xodr"):
        raise OpenDriveError("bad", element="road 7")
    with pytest.raises(InputError, match=r"^inner\.xodr: bad$"), in_file("a.xodr"):
        raise OpenDriveError("bad", file="inner.xodr")


def test_an_unknown_name_is_answered_with_close_ones():
    error = NotFoundError("map", "Towm01", ["Town01", "Town02", "crossing"])
    assert str(error).startswith("no map named 'Towm01'; did you mean Town01")
    assert error.exit_code == 2


def test_an_unknown_name_in_an_empty_catalogue_says_so():
    assert str(NotFoundError("map", "x", [])) == "no map named 'x'; there is no map yet"


def test_all_problems_of_a_scenario_are_shown():
    error = ScenarioError("2 problems", problems=["a", "b"])
    assert str(error) == "2 problems\n  - a\n  - b"


def test_a_tool_speaks_in_its_own_words():
    error = ToolError("netconvert failed", output="Error: no\n")
    assert str(error) == "netconvert failed\nError: no"
