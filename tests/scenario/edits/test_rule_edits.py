from __future__ import annotations

from collections.abc import Iterator

import pytest

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.checks import rule_checks
from odscen.scenario.document.rules_document import RulePart, StoryRule, rule_parts
from odscen.scenario.document.scenario_document import Scenario
from tests.graphs import fork

GRAPH = fork()


def scenario() -> Scenario:
    empty = edits.new_scenario(GRAPH, name="test", roi=("r1", "j9", "r2", "r3"))
    return edits.add_actor(empty, GRAPH, category="car", spawn="1.0.-1.10")


def rule(name: str = "halt", *, by: float = 4, **fields: object) -> StoryRule:
    whole = {
        "id": name,
        "actor": "car-1",
        "when": {"time": {"after": 2}},
        "then": [{"brake": {"by": by}}],
    }
    return StoryRule.model_validate({**whole, **fields})


def test_a_rule_is_added_replaced_in_its_place_and_removed() -> None:
    one = edits.set_rule(scenario(), GRAPH, rule=rule())
    two = edits.set_rule(one, GRAPH, rule=rule("other"))
    three = edits.set_rule(two, GRAPH, rule=rule(by=6))
    assert three.rules == (rule(by=6), rule("other"))
    assert edits.remove_rule(three, rule="halt").rules == (rule("other"),)
    assert one.rules == (rule(),)


def test_an_edit_of_a_rule_looks_at_no_other_rule_but_for_its_id(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked_at: list[str] = []

    def counted(one: StoryRule, where: str) -> Iterator[RulePart]:
        looked_at.append(where)
        return rule_parts(one, where)

    monkeypatch.setattr(rule_checks, "rule_parts", counted)
    changed = scenario()
    for n in range(50):
        changed = edits.set_rule(changed, GRAPH, rule=rule(f"r{n}"))
    assert looked_at == [f"rules[{n}]" for n in range(50)]
    with pytest.raises(ScenarioError, match="id 'r3' is taken by"):
        edits.set_rule(changed, GRAPH, rule=rule("r3"), instead_of="r7")


def test_a_rule_about_what_is_not_there_is_refused() -> None:
    with pytest.raises(ScenarioError, match="van-7"):
        edits.set_rule(scenario(), GRAPH, rule=rule(actor="van-7"))
    with pytest.raises(ScenarioError, match=r"99\.0\.-1\.3"):
        edits.set_rule(
            scenario(), GRAPH, rule=rule(when={"reaches": {"place": "99.0.-1.3", "within": 2}})
        )


def test_rules_about_a_removed_actor_are_mended_one_after_another() -> None:
    both = edits.set_rule(scenario(), GRAPH, rule=rule())
    both = edits.set_rule(both, GRAPH, rule=rule("other"))
    both = edits.add_actor(both, GRAPH, category="car", spawn="1.0.-1.20")
    lost = edits.remove_actors(both, ["car-1"])
    one = edits.set_rule(lost, GRAPH, rule=rule(actor="car-2"))
    assert [each.actor for each in one.rules] == ["car-2", "car-1"]


def test_a_rule_that_is_not_there_cannot_be_removed() -> None:
    with pytest.raises(NotFoundError, match="no rule named 'halt'"):
        edits.remove_rule(scenario(), rule="halt")


def test_a_renamed_rule_keeps_its_place_and_those_that_wait_for_it_follow() -> None:
    wait = {"not": {"any": [{"rule": {"id": "halt"}}, {"time": {"after": 9}}], "delay": 1}}
    three = scenario()
    for one in (rule(), rule("later", when=wait), rule("other")):
        three = edits.set_rule(three, GRAPH, rule=one)
    renamed = edits.set_rule(three, GRAPH, rule=rule("stop"), instead_of="halt")
    assert [one.id for one in renamed.rules] == ["stop", "later", "other"]
    inside = renamed.rules[1].when.not_
    assert inside is not None
    assert inside.any is not None
    assert inside.any[0].rule is not None
    assert (inside.any[0].rule.id, inside.delay) == ("stop", 1)
    assert renamed.rules[2] == three.rules[2]


def test_a_rule_is_not_renamed_to_a_name_that_is_taken_or_from_one_that_is_not_there() -> None:
    two = edits.set_rule(scenario(), GRAPH, rule=rule())
    two = edits.set_rule(two, GRAPH, rule=rule("other"))
    with pytest.raises(ScenarioError, match="id 'other' is taken"):
        edits.set_rule(two, GRAPH, rule=rule("other"), instead_of="halt")
    with pytest.raises(NotFoundError, match="no rule named 'gone'"):
        edits.set_rule(two, GRAPH, rule=rule("new"), instead_of="gone")
