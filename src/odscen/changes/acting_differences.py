"""Two scenarios held against each other by what acts: order, names and ways of saying it apart."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, Final

from odscen.base.categories import Category
from odscen.changes.scenario_differences import field_differences

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.changes.scenario_differences import ScenarioChange
    from odscen.scenario.document.scenario_document import Scenario

Parts = dict[str, Any]
Pose = Sequence[float]
_DIGITS: Final = 4
"""Of metres, seconds and radians: a file may round more than a document does."""
_MOST_GROUPS: Final = 256
_ALWAYS: Final[Parts] = {"time": {"after": 0.0}}


def acting_differences(
    before: Scenario, after: Scenario, *, placed: Mapping[str, Pose] | None = None
) -> tuple[ScenarioChange, ...]:
    """Find what two scenarios do differently.

    Names of scenarios and rules, the order of lists of which it does not matter, and differences
    below 0.0001 do not count; nor does whether conditions are nested, who a condition is about is
    said, or a rule brakes, stops, or changes its speed to 0 likewise. Places are as of
    :func:`~odscen.changes.scenario_differences.scenario_differences`, but ``when`` is whole and
    ``then`` has numbers: ``("rules", "cut-in", "then", "0")``.

    Parameters
    ----------
    placed
        Where the centres of actors are placed, by id: x and y (m) and heading (rad). An actor that
        appears ``at`` that place appears where it is placed.
    """
    at = {name: _round_values(list(pose)) for name, pose in (placed or {}).items()}
    old, new = (_plain_document(scenario, at) for scenario in (before, after))
    old["rules"] = {rule["id"]: _plain_rule(rule, old, {}) for rule in old["rules"]}
    new["rules"] = _rules_by_name(new, old["rules"])
    return tuple(field_differences(old, new))


def _plain_document(scenario: Scenario, placed: Mapping[str, Pose]) -> Parts:
    data: Parts = _round_values(scenario.model_dump(mode="json", exclude={"name", "formulas"}))
    data["roi"] = sorted(data["roi"])
    for name in ("actors", "flows", "measures"):
        data[name] = {part["id"]: part for part in data[name]}
    for rule in data["rules"]:
        own = data["actors"].get(rule["actor"], {}).get("initial_speed")
        for part in _action_parts(rule["then"]):
            if part.get("appear") and part["appear"].get("speed") is None:
                part["appear"]["speed"] = own or 0.0
            if part.get("appear") and part["appear"]["at"] == placed.get(rule["actor"], 0):
                part["appear"]["at"] = None
    return data


def _action_parts(then: list[Parts]) -> Iterator[Parts]:
    """Actions of a rule, those that run together one by one."""
    for item in then:
        yield item
        yield from _action_parts(item.get("together") or [])


def _round_values(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, _DIGITS) + 0.0
    if isinstance(value, list):
        return [_round_values(item) for item in value]
    if isinstance(value, dict):
        return {key: _round_values(part) for key, part in value.items()}
    return value


def _rules_by_name(new: Parts, old: Mapping[str, Parts]) -> Parts:
    """Rules by name, those with a new name by that of a rule with the same content in ``old``."""
    there = {rule["id"] for rule in new["rules"]}
    free = {_sorted_text(rule): name for name, rule in old.items() if name not in there}
    names: dict[str, str] = {}
    for _ in new["rules"]:  # those that wait for others are found after them
        before = len(names)
        for rule in new["rules"]:
            if rule["id"] not in old and rule["id"] not in names:
                known = free.pop(_sorted_text(_plain_rule(rule, new, names)), None)
                names |= {} if known is None else {rule["id"]: known}
        if len(names) == before:
            break
    return {
        names.get(rule["id"], rule["id"]): _plain_rule(rule, new, names) for rule in new["rules"]
    }


def _sorted_text(part: Parts) -> str:
    return json.dumps(part, sort_keys=True)


def _plain_rule(rule: Parts, scenario: Parts, names: Mapping[str, str]) -> Parts:
    actor = scenario["actors"].get(rule["actor"], {})
    walks = actor.get("category") == Category.PEDESTRIAN
    groups = _condition_groups(rule["when"], rule["actor"], names, negated=False, delay=0.0)
    when = sorted({json.dumps(sorted(group)) for group in groups})
    then = {str(n): _plain_action(action, walks=walks) for n, action in enumerate(rule["then"])}
    return {"actor": rule["actor"], "when": when, "then": then, "times": rule["times"]}


def _condition_groups(
    when: Parts, actor: str, names: Mapping[str, str], *, negated: bool, delay: float
) -> list[set[str]]:
    """Groups of conditions, any of which is enough; conditions as texts."""
    delay += when["delay"]
    (kind,) = (key for key in when if key not in ("delay", "edge") and when[key] is not None)
    rising = when["edge"] == "rising"
    if kind in ("all", "any", "not") and not rising:
        if kind == "not":
            return _condition_groups(when["not"], actor, names, negated=not negated, delay=delay)
        parts = [
            _condition_groups(inner, actor, names, negated=negated, delay=delay)
            for inner in when[kind]
        ]
        if (kind == "any") != negated:
            return [group for part in parts for group in part]
        if len(list(product(*parts))) <= _MOST_GROUPS:
            return [_without_always(set().union(*inner)) for inner in product(*parts)]
    part = when[kind]
    if isinstance(part, dict):
        part = part | ({"of": actor} if part.get("of", "") is None else {})
        part |= {"id": names.get(part["id"], part["id"])} if kind == "rule" else {}
        part, negated = _split_bound(part, negated=negated)
    leaf = {kind: part, "delay": delay, "negated": negated, "rising": rising}
    return [{json.dumps(leaf, sort_keys=True)}]


def _split_bound(part: Parts, *, negated: bool) -> tuple[Parts, bool]:
    """A bound that does not hold is the other one."""
    if not negated or "below" not in part or "above" not in part:
        return part, negated
    return part | {"below": part["above"], "above": part["below"]}, False


def _without_always(group: set[str]) -> set[str]:
    always = json.dumps(_ALWAYS | {"delay": 0.0, "negated": False, "rising": False}, sort_keys=True)
    return group - {always} or group


def _plain_action(action: Parts, *, walks: bool) -> Parts:
    if action["together"] is not None:
        return {"together": [_plain_action(inner, walks=walks) for inner in action["together"]]}
    (kind,) = (key for key in action if action[key] is not None)
    part: Parts = action[kind]
    if not walks and kind == "brake" and part["hold"] is None:
        return {"speed": _stop_action(rate=part["by"])}
    if not walks and kind == "stop":
        return {"speed": _stop_action(within=part["within"])}
    return {kind: part}


def _stop_action(*, rate: float | None = None, within: float | None = None) -> Parts:
    shape = "step" if rate is None and within is None else "linear"
    return {"to": 0.0, "shape": shape, "rate": rate, "over": None, "within": within}
