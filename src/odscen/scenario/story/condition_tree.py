"""A rule's condition over one step: leaves read once, combined to the instant.

A leaf that is not met, and whose margin grows, is taken to come true where the line through its
last two readings says; if the next reading shows that it did not, it turns back there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.story.condition_kinds import CONDITIONS
from odscen.scenario.story.flips import Flips, together

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.document.conditions_document import Condition
    from odscen.scenario.story.condition_kinds import Reading
    from odscen.scenario.story.road_view import RoadView

_CLOSE = 1e-6
"""Of a margin: as good as on the bound, so that what was said before stays."""


class LeafMemory(NamedTuple):
    """A leaf after a step: its last reading, and whether it held at the end."""

    margin: float | None
    holds: bool
    value: float | None = None


class _Node(NamedTuple):
    """A condition, taken apart once: its kind, its part, its key if it is a leaf, what is below."""

    kind: str
    part: Any
    key: str | None
    children: tuple[tuple[Condition, str], ...] = ()


def _node(condition: Condition, where: str) -> _Node:
    kind = condition.kind
    part = getattr(condition, kind)
    if kind == "not_":
        return _Node(kind, part, None, ((part, f"{where}.not"),))
    if kind in ("all", "any"):
        below = tuple((one, f"{where}.{kind}[{n}]") for n, one in enumerate(part))
        return _Node(kind, part, None, below)
    return _Node(kind, part, None if kind == "rule" else f"{where}.{kind}")


@dataclass
class ConditionTrees:
    """The conditions of all rules, with what they remember from step to step.

    Attributes
    ----------
    step
        Seconds between two looks.
    """

    step: float
    _values: dict[str, tuple[float, float]] = field(default_factory=dict)
    _nodes: dict[str, _Node] = field(default_factory=dict)
    _leaves: dict[str, LeafMemory] = field(default_factory=dict)
    _past: dict[str, Flips] = field(default_factory=dict)
    _seen: dict[str, Flips] = field(default_factory=dict)
    _new_leaves: dict[str, LeafMemory] = field(default_factory=dict)
    _new_past: dict[str, Flips] = field(default_factory=dict)

    def look(self, condition: Condition, where: str, actor: str, view: RoadView) -> Flips:
        """When the condition of a rule holds from ``view.time`` on, for one step.

        It can be asked several times for one step, and knows better each time which rules have
        started and ended meanwhile; :meth:`next_step` ends the step.
        """
        node = self._nodes.get(where)
        if node is None:
            node = self._nodes[where] = _node(condition, where)
        kind, part, key, children = node
        if key is not None:
            flips = self._leaf(kind, part, key, actor, view)
        elif kind == "rule":
            flips = Flips(False, view.rule_changes(part.id, part.has)[:1]).after(view.time)
        elif kind == "not_":
            [(one, below)] = children
            flips = self.look(one, below, actor, view).opposite()
        else:
            parts = [self.look(one, below, actor, view) for one, below in children]
            flips = together(parts, every=kind == "all")
        if condition.delay or condition.edge == "rising":
            flips = self._later(condition, where, flips, view.time)
        return flips

    def values(self, start: str, seconds: float) -> dict[str, float]:
        """What leaves are about so many seconds after the last look.

        Parameters
        ----------
        start
            Of their places in the tree; they are named by what comes after it.
        """
        return {
            key.removeprefix(start).lstrip("."): value + (rate * seconds if seconds else 0.0)
            for key, (value, rate) in self._values.items()
            if key.startswith(start) and abs(value) < math.inf
        }

    def next_step(self) -> None:
        """Keep what was seen in this step."""
        self._leaves.update(self._new_leaves)
        self._past.update(self._new_past)
        self._seen, self._new_leaves, self._new_past = {}, {}, {}

    def state(self) -> dict[str, Any]:
        """What has to be remembered, for JSON."""
        return {
            "leaves": {key: list(value) for key, value in self._leaves.items()},
            "past": {key: [value.was, list(value.at)] for key, value in self._past.items()},
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._leaves = {key: LeafMemory(*value) for key, value in state["leaves"].items()}
        self._past = {key: Flips(was, tuple(at)) for key, (was, at) in state["past"].items()}

    def _leaf(self, name: str, part: Any, where: str, actor: str, view: RoadView) -> Flips:
        known = self._seen.get(where)
        if known is not None:
            return known
        kind = CONDITIONS[name]
        reading = kind.read(part, actor, view) if kind.read else None
        before = self._leaves.get(where)
        if reading is None:
            self._values.pop(where, None)
            was = before is not None and before.holds
            flips = Flips(was, (view.time,) if was else ())
            self._new_leaves[where] = LeafMemory(None, holds=False)
        else:
            value = _finite(reading.value)
            last = before.value if before is not None else None
            rate = 0.0 if value is None or last is None else (value - last) / self.step
            self._values[where] = reading.value, rate
            flips = self._read(reading, before, view.time)
            self._new_leaves[where] = LeafMemory(_finite(reading.margin), flips.last, value)
        self._seen[where] = flips
        return flips

    def _read(self, reading: Reading, before: LeafMemory | None, time: float) -> Flips:
        margin = reading.margin
        holds = margin >= 0.0
        was = holds if before is None else before.holds
        if before is not None and abs(margin) <= _CLOSE:
            holds = before.holds
        at = (time,) if holds != was else ()
        rate = reading.rate
        if rate is None and before is not None and before.margin is not None:
            rate = (margin - before.margin) / self.step
        if rate and abs(margin) < math.inf and (rate > 0.0) != holds:
            turn = max(time - margin / rate, time)
            if turn < time + self.step:
                at = (*at, turn)
        return Flips(was, at)

    def _later(self, condition: Condition, where: str, flips: Flips, time: float) -> Flips:
        """Delay what is seen, or take its risings; both need what was before this step."""
        past = self._past.get(where, Flips(flips.was))
        whole = Flips(past.was, (*(one for one in past.at if one < time), *flips.at))
        self._new_past[where] = whole.after(time - condition.delay - 2.0 * self.step)
        if condition.edge == "rising":
            whole = whole.risings(self.step)
        return whole.shifted(condition.delay).after(time)


def _finite(number: float) -> float | None:
    return number if abs(number) < math.inf else None
