"""Options of generators: read from a schema, checked before a generator is made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import pytest
from pydantic import BaseModel, Field

from odscen.base.errors import InputError
from odscen.learning.offered_options import (
    OfferedOption,
    offered,
    option_values,
    options_of,
    values_for,
)


def saying(options: object) -> type:
    return type("Some", (), {"options": options})


def schema(**properties: object) -> dict[str, object]:
    return {"type": "object", "properties": properties}


class Wishes(BaseModel):
    share: Annotated[float, Field(ge=0, le=1, title="Share", description="of all")] = 0.5
    mood: Literal["calm", "busy"] = "calm"


def test_a_class_that_says_nothing_has_no_options() -> None:
    assert options_of(object) == ()
    assert option_values((), {}) == {}


def test_a_pydantic_model_has_its_fields_as_options() -> None:
    share, mood = options_of(saying(Wishes))
    assert share == OfferedOption("share", "number", "Share", "of all", 0.5, 0, 1, ())
    assert (mood.kind, mood.usual, mood.choices) == ("string", "calm", ("calm", "busy"))


class Own:
    """Has an attribute of that name for itself."""

    options = property(lambda self: self.kept)

    def __init__(self, **kept: object) -> None:
        self.kept = kept


@pytest.mark.parametrize("said", ["many", 3, [], {}, {"gap": 2.0}, {"gap": {"low": 1}}, lambda: 1])
def test_an_attribute_that_is_nothing_like_a_schema_offers_no_options(said: object) -> None:
    assert options_of(saying(said)) == ()
    assert options_of(Own) == ()


def test_an_option_of_a_dataclass_may_be_called_options() -> None:
    @dataclass
    class Choosy:
        options: int = offered(3, "Options", low=1)

    (one,) = options_of(Choosy)
    assert (one.name, one.usual, one.low) == ("options", 3, 1)


def test_a_class_is_given_what_it_offers_checked_and_the_rest_as_it_is() -> None:
    some = saying(schema(n={"type": "integer", "default": 2}))
    assert values_for(some, {"n": 3.0}, name="some") == {"n": 3}
    assert values_for(some, {"own": "x"}, name="some", others=True) == {"own": "x", "n": 2}
    assert values_for(Own, {"own": "x"}, name="own", others=True) == {"own": "x"}
    for others in (False, True):
        with pytest.raises(InputError, match=r"^some: option 'n' is 1\.5, not a whole number"):
            values_for(some, {"n": 1.5}, name="some", others=others)
    with pytest.raises(InputError, match=r"^some: it has no option 'own'; there are n"):
        values_for(some, {"own": "x"}, name="some")


@pytest.mark.parametrize("others", [False, True])
def test_a_wrong_offer_and_options_for_no_class_are_refused_by_name(others: bool) -> None:
    wrong = saying({"a": {"type": "number"}})
    with pytest.raises(InputError, match=r"^wrong: its `options` are no JSON Schema"):
        values_for(wrong, {}, name="wrong", others=others)
    with pytest.raises(InputError, match=r"^made: it has no option 'a'; it has none"):
        values_for(Own(), {"a": 1.0}, name="made", others=others)
    assert values_for(Own(), {}, name="made", others=others) == {}


def test_values_are_completed_and_of_the_kind_that_is_said() -> None:
    options = options_of(
        saying(schema(n={"type": "integer"}, x={"type": "number", "default": 2}, b={
            "type": "boolean", "default": False,
        }))
    )  # fmt: skip
    found = option_values(options, {"n": 3.0})
    assert found == {"n": 3, "x": 2.0, "b": False}
    assert [type(one) for one in found.values()] == [int, float, bool]


@pytest.mark.parametrize(
    ("one", "value", "said"),
    [
        ({"type": "number"}, None, "option 'a' has to be given: a number"),
        ({"type": "number"}, "3", "option 'a' is '3', not a number"),
        ({"type": "number"}, True, "option 'a' is True, not a number"),
        ({"type": "number"}, float("nan"), "option 'a' is nan, not a number"),
        ({"type": "integer"}, 1.5, "option 'a' is 1.5, not a whole number"),
        ({"type": "boolean"}, 2, "option 'a' is 2, not true or false"),
        ({"type": "string"}, "x" * 2000, "not a text"),
        ({"type": "string", "enum": ["b", "c"]}, "d", "option 'a' is 'd', not one of b, c"),
        ({"type": "number", "minimum": 0, "maximum": 4}, 5, "option 'a' is 5, not within 0..4"),
        ({"type": "number", "minimum": 0}, -1, "option 'a' is -1, not within 0.."),
    ],
)
def test_a_value_that_cannot_be_is_refused(one: dict[str, Any], value: Any, said: str) -> None:
    options = options_of(saying(schema(a=one)))
    with pytest.raises(InputError) as refused:
        option_values(options, {} if value is None else {"a": value})
    assert said in str(refused.value)


def test_an_option_that_there_is_not_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match="it has no option 'b'; there are a"):
        option_values(options_of(saying(schema(a={"type": "number"}))), {"b": 1})
    with pytest.raises(InputError, match="it has no option 'b'; it has none"):
        option_values((), {"b": 1})


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"type": "object"}, "are no JSON Schema"),
        (schema() | {"properties": ["a"]}, "are no JSON Schema"),
        ({"a": {"type": "number"}}, "are no JSON Schema"),
        (schema(a=3), "option 'a' is not one of number, integer"),
        (schema(a={"type": "array"}), "option 'a' is not one of number, integer"),
        (schema(a={"type": "string", "enum": [1]}), "an enum has texts"),
        (schema(a={"type": "number", "minimum": "low"}), "bounds of option 'a' are no numbers"),
        (schema(a={"type": "number", "default": "x"}), "option 'a' is 'x', not a number"),
    ],
)
def test_what_is_no_schema_of_plain_values_is_refused(options: object, said: str) -> None:
    with pytest.raises(InputError) as refused:
        options_of(saying(options))
    assert said in str(refused.value)
