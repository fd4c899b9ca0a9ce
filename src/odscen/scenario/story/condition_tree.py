"""A rule's condition over one step: leaves read once, combined to the instant.

A leaf that is not met, and whose margin grows, is taken to come true where the line through its
last two readings says; if the next reading shows that it did not, it turns back there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.story.flips import Flips, together
from odscen.scenario.story.own_kinds import condition_kind

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.scenario.document.conditions_document import Condition
    from odscen.scenario.story.condition_kinds import Reading
    from odscen.scenario.story.road_view import RoadView

_ALWAYS, NEVER_IN_STEP = Flips(was=True), Flips(was=False)
_CLOSE = 1e-6
"""Of a margin: as good as on the bound, so that what was said before stays."""


class LeafMemory(NamedTuple):
    """A leaf after a step: its last reading, and whether it held at the end."""

    margin: float | None
    holds: bool
    value: float | None = None


class _Node(NamedTuple):
    """A condition, taken apart once.

    ``read`` and ``key`` are those of a leaf; ``late`` says that it has a delay or an edge.
    """

    kind: str
    part: Any
    late: bool
    key: str | None = None
    read: Callable[[Any, str, RoadView], Reading | None] | None = None
    children: tuple[tuple[Condition, str], ...] = ()


def _node(condition: Condition, where: str) -> _Node:
    kind = condition.kind
    part = getattr(condition, kind)
    late = bool(condition.delay) or condition.edge == "rising"
    if kind == "not_":
        return _Node(kind, part, late, children=((part, f"{where}.not"),))
    if kind in ("all", "any"):
        below = tuple((one, f"{where}.{kind}[{n}]") for n, one in enumerate(part))
        return _Node(kind, part, late, children=below)
    read = condition_kind(condition).read
    return _Node(kind, part, late, None if read is None else f"{where}.{kind}", read)


@dataclass
class ConditionTrees:
    """The conditions of all rules, with what they remember from step to step.

    Attributes
    ----------
    step
        Seconds between two looks.
    """

    step: float
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
        kind, part, late, key, read, children = node
        if key is not None and read is not None:
            flips = self._seen.get(key) or self._leaf(read, part, key, actor, view)
        elif kind == "rule":
            flips = Flips(False, view.rule_changes(part.id, part.has)[:1]).after(view.time)
        elif kind == "not_":
            [(one, below)] = children
            flips = self.look(one, below, actor, view).opposite()
        else:
            parts = [self.look(one, below, actor, view) for one, below in children]
            flips = together(parts, every=kind == "all")
        if late:
            flips = self._later(condition, where, flips, view.time)
        return flips

    def values(self, start: str, seconds: float) -> dict[str, float]:
        """What leaves are about so many seconds after the last look.

        Parameters
        ----------
        start
            Of their places in the tree; they are named by what comes after it.
        """
        found = {}
        for key, (_, _, value) in self._new_leaves.items():
            if value is not None and key.startswith(start):
                before = self._leaves.get(key)
                last = None if before is None else before.value
                rate = 0.0 if last is None else (value - last) / self.step
                name = key.removeprefix(start).lstrip(".")
                found[name] = value + (rate * seconds if seconds else 0.0)
        return found

    def forget(self, where: str) -> None:
        """Forget the last readings of a rule that is not looked at for a while."""
        for leaves in (self._leaves, self._new_leaves):
            for key in [key for key in leaves if key.startswith(where)]:
                leaves[key] = LeafMemory(None, leaves[key].holds)

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

    def _leaf(
        self,
        read: Callable[[Any, str, RoadView], Reading | None],
        part: Any,
        where: str,
        actor: str,
        view: RoadView,
    ) -> Flips:
        reading = read(part, actor, view)
        before = self._leaves.get(where)
        if reading is None:
            was = before is not None and before.holds
            flips = Flips(was, (view.time,) if was else ())
            self._new_leaves[where] = LeafMemory(None, holds=False)
        else:
            value, margin, rate = reading
            flips = self._read(margin, rate, before, view.time)
            near = -math.inf < margin < math.inf
            far = not -math.inf < value < math.inf
            self._new_leaves[where] = LeafMemory(
                margin if near else None, flips.last, None if far else value
            )
        self._seen[where] = flips
        return flips

    def _read(
        self, margin: float, rate: float | None, before: LeafMemory | None, time: float
    ) -> Flips:
        was = holds = margin >= 0.0
        if before is not None:
            last, was, _ = before
            if abs(margin) <= _CLOSE:
                holds = was
            if rate is None and last is not None:
                rate = (margin - last) / self.step
        at = () if holds == was else (time,)
        if rate and (rate > 0.0) != holds and abs(margin) < math.inf:
            turn = max(time - margin / rate, time)
            if turn < time + self.step:
                at = (*at, turn)
        if not at:  # nearly always
            return _ALWAYS if was else NEVER_IN_STEP
        return Flips(was, at)

    def _later(self, condition: Condition, where: str, flips: Flips, time: float) -> Flips:
        """Delay what is seen, or take its risings; both need what was before this step."""
        past = self._past.get(where, Flips(flips.was))
        whole = Flips(past.was, (*(one for one in past.at if one < time), *flips.at))
        self._new_past[where] = whole.after(time - condition.delay - 2.0 * self.step)
        if condition.edge == "rising":
            whole = whole.risings(self.step)
        return whole.shifted(condition.delay).after(time)
