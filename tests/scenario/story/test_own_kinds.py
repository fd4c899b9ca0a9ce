"""Kinds of conditions and actions of installed packages: found, and refused in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.own_package import forget, install
from tests.scenario.checks.test_scenario_checks import actor, problems

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

NEAR = {"kind": "seconds_to_place", "place": "1.0.-1.20", "values": {"below": 3}}
EASE = {"kind": "ease", "values": {"to": 5, "over": 2}}


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    yield
    forget()


def found(when: dict[str, Any], then: dict[str, Any]) -> list[tuple[str, str, str]]:
    rule = {"id": "r", "actor": "a", "when": {"own": when}, "then": [{"own": then}]}
    return [(one.code, one.where, one.message) for one in problems(actor(), rules=[rule])]


def test_a_kind_that_no_package_gives_is_a_problem() -> None:
    assert [(code, where) for code, where, _ in found(NEAR, EASE)] == [
        ("own_kind", "rules[0].when.own.kind"),
        ("own_kind", "rules[0].then[0].own.kind"),
    ]


def test_the_example_of_the_guide_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, monkeypatch)
    assert found(NEAR, EASE) == []
    [(code, where, message)] = found(NEAR | {"values": {"above": 3}}, EASE)
    assert (code, where) == ("own_kind", "rules[0].when.own")
    assert message == "'seconds_to_place': it needs a place, and a value 'below' in seconds"
    [(_, where, message)] = found(NEAR, EASE | {"kind": "eases"})
    assert where == "rules[0].then[0].own.kind"
    assert message == "no installed package gives 'eases'; there are ease"


def test_places_and_actors_that_it_names_are_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, monkeypatch)
    assert [(code, where) for code, where, _ in found(NEAR | {"place": "9.9.9.9"}, EASE)] == [
        ("unknown_place", "rules[0].when.own.place")
    ]
    assert [(code, where) for code, where, _ in found(NEAR | {"to": "lorry"}, EASE)] == [
        ("unknown_actor", "rules[0].when.own.to")
    ]


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import nothing_like_this", "cannot be imported from my_kinds:SECONDS_TO_PLACE"),
        ("SECONDS_TO_PLACE = EASE = 7", "is not the ConditionKind that odscen.conditions"),
    ],
)
def test_a_package_that_is_broken_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, words: str
) -> None:
    install(tmp_path, monkeypatch, code)
    assert words in found(NEAR, EASE)[0][2]
