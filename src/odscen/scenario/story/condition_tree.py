"""A rule's condition over one step: leaves read once, combined to the instant.

A leaf that is not met, and whose margin grows, is taken to come true where the line through its
last two readings says; if the next reading shows that it did not, it turns back there. Between
readings before and after a leap there is no line: SUMO changes lanes within one step.

Conditions are looked at once a step, but come true at any instant; what they are combined of keeps
that instant.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from odscen.scenario.story.condition_kinds import seconds_of
from odscen.scenario.story.own_kinds import condition_kind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.scenario.document.rules_document import Condition, StoryRule
    from odscen.scenario.story.condition_kinds import Reading
    from odscen.scenario.story.road_view import RoadView


class Flips(NamedTuple):
    """``was`` holds before the first of the instants ``at``; at each it turns, that included."""

    was: bool
    at: tuple[float, ...] = ()

    def holds(self, instant: float) -> bool:
        """Whether it is true at an instant."""
        return self.was ^ (sum(flip <= instant for flip in self.at) % 2 == 1)

    @property
    def last(self) -> bool:
        """Whether it is true after all."""
        return self.was ^ (len(self.at) % 2 == 1)

    def opposite(self) -> Flips:
        """What is true where this is not."""
        return Flips(not self.was, self.at)

    def shifted(self, seconds: float) -> Flips:
        """The same, so much later."""
        return Flips(self.was, tuple(flip + seconds for flip in self.at))

    def after(self, begin: float) -> Flips:
        """The same without the instants before ``begin``."""
        early = sum(flip < begin for flip in self.at)
        return Flips(self.was ^ (early % 2 == 1), self.at[early:])

    def risings(self, lasting: float) -> Flips:
        """What is true for so many seconds from each instant at which this comes true."""
        changes: list[float] = []
        now = self.was
        for flip in self.at:
            now = not now
            if not now:
                continue
            if changes and flip <= changes[-1]:
                changes[-1] = flip + lasting
            else:
                changes += [flip, flip + lasting]
        return Flips(False, tuple(changes))

    def first(self, begin: float, end: float) -> float | None:
        """First instant from ``begin`` on, before ``end``, at which it is true."""
        if begin >= end:
            return None
        if not self.at:  # the usual case, asked of each rule in each step
            return begin if self.was else None
        if self.holds(begin):
            return begin
        return next((flip for flip in self.at if begin < flip < end and self.holds(flip)), None)

    def first_rise(self, begin: float, end: float, *, after: float) -> float | None:
        """First instant from ``begin`` on, ``after`` one and before ``end``, of coming true."""
        rises = self.at[int(self.was) :: 2]
        return next((rise for rise in rises if begin <= rise < end and rise > after), None)


def together(parts: Sequence[Flips], *, every: bool) -> Flips:
    """What is true where all parts are (``every``), or any of them."""
    was, steady = every, True
    for part in parts:
        if part.was != every:
            was = not every
        if part.at:
            steady = False
    if steady:  # nearly always
        return Flips(was)
    meet = all if every else any
    changes, now = [], was
    for instant in sorted({flip for part in parts for flip in part.at}):
        if (holds := meet(part.holds(instant) for part in parts)) != now:
            now = holds
            changes.append(instant)
    return Flips(was, tuple(changes))


def joined(before: Flips, instants: Iterable[float]) -> Flips:
    """Flips that go on with more of them."""
    return Flips(before.was, (*before.at, *instants))


_ALWAYS, NEVER_IN_STEP = Flips(was=True), Flips(was=False)
CLOSE = 1e-6
"""Of a margin: as good as on the bound, where it counts as met unless it is leaving it."""


class LeafMemory(NamedTuple):
    """A leaf after a step: its last reading, and whether it held at the end."""

    margin: float | None
    holds: bool
    value: float | None = None
    ratio: tuple[float, float] | None = None

    def value_after(self, before: LeafMemory | None, share: float) -> float | None:
        """Value at a share of the step that follows, on a line through this reading and the last.

        ``None`` where it has none.
        """
        if before is None or not share:
            return self.value
        if self.ratio is not None and before.ratio is not None:
            pairs = zip(before.ratio, self.ratio, strict=True)
            metres, speed = (now + (now - then) * share for then, now in pairs)
            value = seconds_of(metres, speed)
            return value if value < math.inf else None
        if self.value is None or before.value is None:
            return self.value
        return self.value + (self.value - before.value) * share


class ConditionTree:
    """The condition of a rule, taken apart once, with what it remembers from step to step.

    Parameters
    ----------
    step
        Seconds between two looks.
    """

    def __init__(self, rule: StoryRule, step: float) -> None:
        self._start = f"{rule.id}.when"
        self._step = step
        self._leaves: list[_Leaf] = []
        self._late: list[_Delayed] = []
        self._root = self._build_node(rule.when, self._start, rule.actor)

    def look(self, view: RoadView) -> Flips:
        """When the condition holds from ``view.time`` on, for one step.

        It can be asked several times for one step, and knows better each time which rules have
        started and ended meanwhile; :meth:`next_step` ends the step.
        """
        return self._root.look(view)

    def values(self, seconds: float) -> dict[str, float]:
        """What leaves are about so many seconds after the last look, by their place in the tree."""
        values = {}
        for leaf in self._leaves:
            if leaf.flips is None:
                continue
            value = leaf.now.value_after(leaf.before, seconds / self._step)
            if value is not None:
                values[leaf.key.removeprefix(self._start).lstrip(".")] = value
        return values

    def forget(self) -> None:
        """Forget the last readings: the rule is not looked at for a while."""
        for leaf in self._leaves:
            leaf.now = LeafMemory(None, leaf.now.holds)
            if leaf.before is not None:
                leaf.before = LeafMemory(None, leaf.before.holds)

    def next_step(self) -> None:
        """Keep what was seen in this step."""
        for leaf in self._leaves:
            if leaf.flips is not None:
                leaf.before, leaf.flips = leaf.now, None
        for late in self._late:
            late.past = late.now

    def state(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """What leaves and what is delayed have to remember, by place in the tree, for JSON."""
        leaves = {leaf.key: list(leaf.before) for leaf in self._leaves if leaf.before is not None}
        late = {leaf.key: [leaf.past.was, list(leaf.past.at)] for leaf in self._late if leaf.past}
        return leaves, late

    def restore(self, leaves: Mapping[str, Any], late: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        for leaf in self._leaves:
            if (kept := leaves.get(leaf.key)) is not None:
                leaf.before = leaf.now = LeafMemory(*kept)
        for node in self._late:
            if (past := late.get(node.key)) is not None:
                node.past = node.now = Flips(past[0], tuple(past[1]))

    def _build_node(self, condition: Condition, where: str, actor: str) -> _Node:
        kind = condition.kind
        part = getattr(condition, kind)
        node: _Node
        if kind == "not_":
            node = _Negated(self._build_node(part, f"{where}.not", actor))
        elif kind in ("all", "any"):
            below = [
                self._build_node(child, f"{where}.{kind}[{n}]", actor)
                for n, child in enumerate(part)
            ]
            node = _Combined(below, every=kind == "all")
        elif (read := condition_kind(condition).read) is None:
            node = _AfterRule(part.id, part.has)
        else:
            node = _Leaf(f"{where}.{kind}", read, part, actor, self._step)
            self._leaves.append(node)
        rising = condition.edge == "rising"
        if condition.delay or rising:
            node = _Delayed(where, node, condition.delay, self._step, rising=rising)
            self._late.append(node)
        return node


class _Node(Protocol):
    """A part of a condition."""

    def look(self, view: RoadView) -> Flips:
        """When it holds from ``view.time`` on, for one step."""


class _Leaf:
    """A condition that is read; ``flips`` are ``None`` until it has been in this step."""

    __slots__ = ("_actor", "_part", "_read", "_step", "before", "flips", "key", "now")

    def __init__(
        self,
        key: str,
        read: Callable[[Any, str, RoadView], Reading | None],
        part: Any,
        actor: str,
        step: float,
    ) -> None:
        self.key = key
        self.before: LeafMemory | None = None
        self.now = LeafMemory(None, holds=False)
        self.flips: Flips | None = None
        self._read, self._part, self._actor, self._step = read, part, actor, step

    def look(self, view: RoadView) -> Flips:
        """When it holds; it is read once a step."""
        flips = self.flips
        if flips is None:
            flips = self.flips = self._look_at(view)
        return flips

    def _look_at(self, view: RoadView) -> Flips:
        reading = self._read(self._part, self._actor, view)
        before = self.before
        if reading is None:
            was = before is not None and before.holds
            self.now = LeafMemory(None, holds=False)
            return Flips(was, (view.time,) if was else ())
        value, margin, rate, ratio = reading
        flips = self._find_flips(margin, rate, before, view)
        near = -math.inf < margin < math.inf
        far = not -math.inf < value < math.inf
        self.now = LeafMemory(
            margin if near else None, flips.last, None if far else value, ratio if near else None
        )
        return flips

    def _find_flips(
        self, margin: float, rate: float | None, before: LeafMemory | None, view: RoadView
    ) -> Flips:
        time, last = view.time, None if before is None else before.margin
        if rate is None and last is not None:
            change = margin - last
            near = abs(margin) <= max(abs(change), CLOSE)  # it could come to the bound in this step
            rate = None if near and self._has_leapt(view) else change / self._step
        holds = margin >= 0.0
        if abs(margin) <= CLOSE:
            holds = rate is None or rate * self._step >= -CLOSE
        was = holds if before is None else before.holds
        at = () if holds == was else (time,)
        if rate and (rate > 0.0) != holds and abs(margin) < math.inf:
            turn = max(time - margin / rate, time)
            if turn < time + self._step:
                at = (*at, turn)
        if not at:  # nearly always
            return _ALWAYS if was else NEVER_IN_STEP
        return Flips(was, at)

    def _has_leapt(self, view: RoadView) -> bool:
        names = (getattr(self._part, "of", None) or self._actor, getattr(self._part, "to", None))
        return any(view.leapt(name) for name in names if name is not None)


class _AfterRule:
    """Another rule has started, or ended."""

    def __init__(self, rule: str, has: str) -> None:
        self._rule, self._has = rule, has

    def look(self, view: RoadView) -> Flips:
        """When it holds."""
        return Flips(False, view.rule_changes(self._rule, self._has)[:1]).after(view.time)


class _Negated:
    def __init__(self, below: _Node) -> None:
        self._below = below

    def look(self, view: RoadView) -> Flips:
        """When it holds."""
        return self._below.look(view).opposite()


class _Combined:
    def __init__(self, below: Sequence[_Node], *, every: bool) -> None:
        self._below, self._every = below, every

    def look(self, view: RoadView) -> Flips:
        """When it holds; all parts are read, as each remembers its readings."""
        return together([below.look(view) for below in self._below], every=self._every)


class _Delayed:
    """A condition with a delay, or its risings; both need what was before this step."""

    def __init__(self, key: str, below: _Node, delay: float, step: float, *, rising: bool) -> None:
        self.key = key
        self.past: Flips | None = None
        self.now: Flips | None = None
        self._below, self._delay, self._step, self._rising = below, delay, step, rising

    def look(self, view: RoadView) -> Flips:
        """When it holds."""
        flips, time = self._below.look(view), view.time
        past = self.past or Flips(flips.was)
        whole = Flips(past.was, (*(flip for flip in past.at if flip < time), *flips.at))
        self.now = whole.after(time - self._delay - 2.0 * self._step)
        if self._rising:
            whole = whole.risings(self._step)
        return whole.shifted(self._delay).after(time)
