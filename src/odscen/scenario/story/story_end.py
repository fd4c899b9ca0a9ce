"""When a story has ended: no rule is under way, and none can fire any more.

A rule can fire no more when it has fired as often as it may; or when its condition is about an
actor who has left the road; or about another rule that will neither begin nor end any more; or,
once nobody has moved for :data:`STILL` seconds, when it is about motion alone.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.scenario.document.rules_document import Action, Condition, StoryRule
    from odscen.scenario.story.rule_states import RuleState, Running

STILL = 60.0
"""Seconds for which nobody has moved: longer than most red lights."""
_REPLAY_REST = 0.01
"""Metres within which a replay stays at one place."""
_TIMED = frozenset({"time", "signal", "own", "not_"})
"""Conditions that can come true although nobody moves, and whoever is there."""


def story_has_ended(
    rules: Mapping[str, StoryRule],
    states: Mapping[str, RuleState],
    *,
    now: float,
    gone: Callable[[str], bool],
    still: bool,
) -> bool:
    """Whether no rule is under way and none can fire any more.

    What goes on without an end of its own, such as a gap that is kept, counts as over.

    Parameters
    ----------
    gone
        Whether an actor has left the road for good.
    still
        Whether nobody has moved for :data:`STILL` seconds.
    """
    if any(_is_under_way(rules[name], state, now) for name, state in states.items()):
        return False
    # A rule that waits for others fires after one that waits for none of those that are left.
    return not any(
        states[name].fired < rule.times and _can_hold(rule.when, rule.actor, states, gone, still)
        for name, rule in rules.items()
    )


def longest_delay(rules: Mapping[str, StoryRule], states: Mapping[str, RuleState]) -> float:
    """Seconds after which a condition that has held may still let one of the rules fire."""
    waiting = (rule for name, rule in rules.items() if states[name].fired < rule.times)
    return max((_sum_delays(rule.when) for rule in waiting), default=0.0)


def _sum_delays(condition: Condition) -> float:
    kind = condition.kind
    parts: tuple[Condition, ...] = ()
    if kind in ("all", "any"):
        parts = getattr(condition, kind)
    elif condition.not_ is not None:
        parts = (condition.not_,)
    return condition.delay + max(map(_sum_delays, parts), default=0.0)


def _can_hold(
    condition: Condition,
    actor: str,
    states: Mapping[str, RuleState],
    gone: Callable[[str], bool],
    still: bool,
) -> bool:
    """Whether a condition of a rule of ``actor`` may come true if no other rule fires."""
    kind = condition.kind
    part: Any = getattr(condition, kind)
    if kind in ("all", "any"):
        parts = (_can_hold(inner, actor, states, gone, still) for inner in part)
        return all(parts) if kind == "all" else any(parts)
    if kind in _TIMED:
        return True
    if kind == "rule":
        state = states.get(part.id)
        return state is not None and bool(state.started if part.has == "started" else state.ended)
    names = {part.of or actor, *((part.to,) if getattr(part, "to", None) else ())}
    if any(map(gone, names)):
        return False
    if kind == "stopped":
        return not still or part.seconds > STILL
    return kind == "appeared" or not still


def _is_under_way(rule: StoryRule, state: RuleState, now: float) -> bool:
    if state.item is None:
        return False
    parts = rule.then[state.item].parts
    return not all(_has_no_end(parts[action.number], action, now) for action in state.running)


def _has_no_end(action: Action, running: Running, now: float) -> bool:
    """Whether an action has no end of its own, or none of which anything would be seen."""
    if action.keep_gap is not None:
        return running.end == math.inf and not action.keep_gap.once
    if action.replay is not None and running.end < math.inf:
        begin = running.end - action.replay.rows[-1][0]
        rows = action.replay.rows
        passed = sum(row[0] <= now - begin for row in rows)
        left = rows[max(0, passed - 1) :]
        return all(math.dist(row[1:3], left[0][1:3]) < _REPLAY_REST for row in left)
    return False
