"""Ends the run of a scene some seconds after its story has ended."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.records.run_events import Event, EventKind
from odscen.scenario.story.story_end import STILL
from odscen.sumo.worker.story.story_view import stranger

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.records.run_plan import Plan
    from odscen.scenario.story.road_view import ActorView
    from odscen.scenario.story.story_engine import StoryEngine
    from odscen.sumo.worker.simulation.moved_actors import MovedActors
    from odscen.sumo.worker.story.story_view import StoryView

_STANDING = 0.1
"""m/s below which a road user stands."""
_EVERY = 1.0
"""Seconds between two looks at who moves."""


class EndWatch:
    """Says when the story of a run has ended, and when the run is over for that.

    Attributes
    ----------
    over
        Whether the run is over.
    watches
        Whether it looks for that at all.
    """

    def __init__(self, plan: Plan, view: StoryView) -> None:
        self.over = False
        self.watches = plan.after_story is not None
        self._plan = plan
        self._view = view
        self._actors = tuple(actor for actor in plan.actors if actor.problem is None)
        self._without = frozenset(actor.id for actor in plan.actors if actor.problem is not None)
        waits_for = [actor.depart for actor in self._actors if not actor.appears]
        self._all_due = max(waits_for, default=0.0)
        self._seen: set[str] = set()
        self._gone: set[str] = set()
        self._looked = -_EVERY
        self._still_since: float | None = None
        self._ended: float | None = None

    def look(self, road: MovedActors, engine: StoryEngine, time: float) -> list[Event]:
        """Look at the road after a step at ``time``; what is to be reported."""
        settle = self._plan.after_story
        if settle is None or not self.watches or self.over:
            return []
        if time - self._looked >= _EVERY - 1e-9:
            self._look_at_all(road, time)
        still = self._still_since is not None and time - self._still_since >= STILL
        if not self._has_ended(engine, time, still=still):
            self._ended = None
            return []
        if self._ended is None:
            self._ended = time
        if time - self._ended < max(settle, engine.longest_delay()) - 1e-9:
            return []
        self.over = True
        words = "no road user moves any more" if still else "all rules are over"
        return [Event(self._ended, EventKind.STORY_ENDED, "story", detail=words)]

    def state(self) -> dict[str, Any]:
        """What has to be remembered, for JSON."""
        return {
            "seen": sorted(self._seen),
            "gone": sorted(self._gone),
            "looked": self._looked,
            "still_since": self._still_since,
            "ended": self._ended,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._seen, self._gone = set(state["seen"]), set(state["gone"])
        self._looked = state["looked"]
        self._still_since, self._ended = state["still_since"], state["ended"]

    def _has_ended(self, engine: StoryEngine, time: float, *, still: bool) -> bool:
        if time < self._all_due or not self._gone.issuperset(self._plan.awaits):
            return False
        if not still and not engine.has_rules:  # the story is that they drive
            return False
        return engine.has_ended(time, gone=self._has_left, still=still)

    def _has_left(self, name: str) -> bool:
        return name in self._gone or name in self._without or self._view.gone(name)

    def _look_at_all(self, road: MovedActors, time: float) -> None:
        """Note who is there and who has left, and since when nobody moves."""
        self._looked, moves = time, False
        for planned in self._actors:
            if planned.id in self._gone:
                continue
            view: ActorView | None = stranger(road, planned, self._plan.net_offset)
            if view is not None:
                self._seen.add(planned.id)
                moves = moves or view.speed >= _STANDING
            elif planned.id in self._seen and not road.knows(planned.id):
                self._gone.add(planned.id)
        if moves:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = time
