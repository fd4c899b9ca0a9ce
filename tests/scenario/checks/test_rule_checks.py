"""What is wrong with rules is named with its place, in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from odscen.scenario.checks import rule_checks
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.signals.light import Light
from tests.scenario.checks.test_scenario_checks import actor, problems

VAN = actor("1.0.-1.10", id="van")
EGO = actor("1.0.-1.20", id="ego")
CHILD = actor("ped.1.0.-2.0", id="child", category="pedestrian")


def rule(**fields: Any) -> StoryRule:
    data = {
        "id": "r", "actor": "van", "when": {"time": {"after": 1.0}},
        "then": [{"lane": {"by": 1}}],
    }  # fmt: skip
    return StoryRule.model_validate(data | fields)


def found(*rules: StoryRule) -> list[tuple[str, str, str]]:
    return [
        (one.severity, one.code, one.where)
        for one in problems(VAN, EGO, CHILD, rules=rules)
        if one.where.startswith("rules")
    ]


def test_good_rules_have_no_problems() -> None:
    cross = rule(
        id="cross", actor="child", then=[{"walk": {"to": "1.0.-1.5", "through": ["1.0.-1.4"]}}]
    )
    assert found(rule(when={"ttc": {"to": "ego", "below": 3}}), cross) == []


@pytest.mark.parametrize(
    ("one", "code", "where"),
    [
        (rule(actor="lorry"), "unknown_actor", "rules[0].actor"),
        (
            rule(when={"all": [{"ttc": {"to": "lorry", "below": 3}}]}),
            "unknown_actor",
            "rules[0].when.all[0].ttc.to",
        ),
        (
            rule(when={"not": {"reaches": {"place": "9.9.9.9"}}}),
            "unknown_place",
            "rules[0].when.not.reaches.place",
        ),
        (rule(when={"rule": {"id": "x"}}), "unknown_rule", "rules[0].when.rule.id"),
        (
            rule(then=[{"goal": {"to": "ped.1.0.-2.0"}}]),
            "action_not_possible",
            "rules[0].then[0].goal.to",
        ),
        (
            rule(then=[{"path": {"points": ["1.0.-1.4", "9.9.9.9"], "speed": 5}}]),
            "unknown_place",
            "rules[0].then[0].path.points[1]",
        ),
        (
            rule(then=[{"cut_in": {"to": "lorry"}}]),
            "unknown_actor",
            "rules[0].then[0].cut_in.to",
        ),
        (
            rule(then=[{"go": {}}, {"walk": {"to": "1.0.-1.5"}}]),
            "action_not_possible",
            "rules[0].then[1].walk",
        ),
        (rule(actor="child"), "action_not_possible", "rules[0].then[0].lane"),
        (
            rule(
                then=[{"together": [{"keep_gap": {"to": "x", "metres": 9}}, {"lane": {"by": 1}}]}]
            ),
            "unknown_actor",
            "rules[0].then[0].together[0].keep_gap.to",
        ),
    ],
)
def test_each_mistake_in_a_rule_is_named_with_its_place(
    one: StoryRule, code: str, where: str
) -> None:
    assert found(one) == [("error", code, where)]


def test_two_rules_that_may_want_one_actor_at_once_are_warned_of() -> None:
    second = rule(id="s", when={"time": {"after": 2.0}})
    assert found(rule(), second) == [("warning", "rules_at_once", "rules[1]")]
    waits = rule(id="s", when={"rule": {"id": "r"}})
    assert found(rule(), waits) == []
    assert found(rule(), rule(id="s", then=[{"brake": {"by": 4}}])) == []


def test_of_very_many_rules_that_move_one_actor_some_pairs_are_listed_and_all_counted() -> None:
    rules = [rule(id=f"r{n}", when={"time": {"after": float(n)}}) for n in range(1000)]
    clashes = [one for one in problems(VAN, rules=rules) if one.code == "rules_at_once"]
    assert len(clashes) == 201
    assert [one.message[:22] for one in clashes[:2]] == [
        "rules 'r0' and 'r1' bo",
        "rules 'r0' and 'r2' bo",
    ]
    assert (clashes[-1].where, clashes[-1].message) == ("rules", "and 499,300 more of this kind")


def test_pairs_of_rules_that_are_not_listed_are_not_looked_at_either(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked_at = 0
    pairs = rule_checks._RuleClashes.pairs

    def counted_pairs(clashes: Any) -> Iterator[tuple[int, int]]:
        nonlocal looked_at
        for pair in pairs(clashes):
            looked_at += 1
            yield pair

    monkeypatch.setattr(rule_checks._RuleClashes, "pairs", counted_pairs)
    rules = [rule(id=f"r{n}") for n in range(300)]
    assert problems(VAN, rules=rules)[-1].message == "and 44,650 more of this kind"
    assert looked_at == 200


def test_rules_that_wait_or_move_otherwise_are_no_pairs_of_those_that_are_counted() -> None:
    speeds = [rule(id=f"s{n}", then=[{"brake": {"by": 4}}]) for n in range(25)]
    lanes = [rule(id=f"l{n}") for n in range(5)]
    both = [rule(id="both", then=[{"brake": {"by": 4}}, {"lane": {"by": 1}}])]
    waits = [rule(id="waits", when={"all": [{"rule": {"id": f"s{n}"}} for n in range(24)]},
                  then=[{"brake": {"by": 4}}])]  # fmt: skip
    clashes = [
        one
        for one in problems(VAN, rules=[*speeds, *lanes, *both, *waits])
        if one.code == "rules_at_once"
    ]
    # 25 speeds, 5 lanes, one rule with each of those, and one that waits for all but one of them.
    pairs = 25 * 24 // 2 + 5 * 4 // 2 + 25 + 5 + 2
    assert clashes[-1].message == f"and {pairs - 200} more of this kind"


def test_an_id_that_another_rule_has_is_refused() -> None:
    assert ("error", "duplicate_id", "rules[1].id") in found(rule(), rule())


def test_a_light_that_is_not_there_is_named() -> None:
    from odscen.scenario.checks.scenario_checks import check
    from tests.scenario.checks.test_scenario_checks import GRAPH, scenario

    asks = rule(when={"signal": {"light": "7", "movement": "r1>r2", "shows": "green"}})
    one = scenario(VAN, rules=[asks])
    codes = [problem.code for problem in check(one, GRAPH, None, [Light(("9",), (10.0,))])]
    assert codes == ["unknown_light"]
    codes = [problem.code for problem in check(one, GRAPH, None, [Light(("7",), (10.0,))])]
    assert codes == ["unknown_movement"]
