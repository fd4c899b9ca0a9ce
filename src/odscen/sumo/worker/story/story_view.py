"""The road as rules see it: those that they name, read once a step through the session."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from odscen.base.frames import SumoPose, body_centre, sumo_to_xodr
from odscen.scenario.story.motion_laws import beside, line_length
from odscen.scenario.story.road_view import MOST_GAIN, ActorView, LastPose, leapt

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from odscen.records.run_plan import PlannedActor
    from odscen.scenario.story.road_view import Point
    from odscen.sumo.realize.rules.story_files import StoryPlan
    from odscen.sumo.worker.simulation.moved_actors import MovedActors

_STANDING = 0.1
"""m/s below which a road user stands."""
_USUAL_WALK = 1.39
"""m/s at which pedestrians walk, see :data:`odscen.sumo.realize.driving.KINDS`."""
_FASTEST = 110.0
"""m/s, more than any speed that a rule can say."""
_ON_LANE = 1.5
"""Metres from its centre line in which a place is on a lane."""
_ABREAST = 6.0
"""Metres beside a lane in which a place is abreast of it, as of one in the middle of a junction."""
_MORE = 0.5
"""m/s² more than a vehicle type gains, for what steps round."""
_BEHIND = -10.0
"""Metres; less than that is behind."""


class StoryView:
    """What conditions and actions ask, see :class:`odscen.scenario.story.road_view.RoadView`.

    Parameters
    ----------
    rule_changes
        Of the engine.

    Parameters
    ----------
    extra
        Metres that SUMO has counted more than a vehicle has covered.

    Attributes
    ----------
    whole
        Vehicles of which acceleration, metres travelled and lane are read, too.
    always
        Vehicles that are read in each step, as it is remembered how long they stand; others are
        read when they are asked for. Persons always are.
    """

    def __init__(
        self,
        plan: StoryPlan,
        actors: Mapping[str, PlannedActor],
        *,
        net_offset: tuple[float, float],
        rule_changes: Callable[[str, str], tuple[float, ...]],
        extra: Callable[[str], float],
    ) -> None:
        self._plan = plan
        self._actors = actors
        self._offset = net_offset
        self._extra = extra
        self.rule_changes = rule_changes
        self.whole: set[str] = set()
        self.always: set[str] = set()
        self._now, self._step = 0.0, 0.0
        self._driven: Mapping[str, float] = {}
        self._road: MovedActors
        self._views: dict[str, ActorView | None] = {}
        self._before: Mapping[str, ActorView | LastPose | None] = {}
        self._restored: Mapping[str, LastPose] = {}
        self._nearest: dict[Point, tuple[str, float, int]] = {}
        self._half_widths: dict[str, float] = {}
        self._gains: dict[str, float] = {}
        self._gone: set[str] = set()
        self._eager: tuple[str, ...] | None = None
        self._travelled: dict[str, float] = {}
        self._odometers: dict[str, tuple[float, float, float]] = {}
        self._standing: dict[str, float] = {}
        self._last: dict[str, tuple[float, float, float]] = {}

    @property
    def time(self) -> float:
        """Seconds."""
        return self._now

    def look(
        self, road: MovedActors, time: float, step: float, driven: Mapping[str, float]
    ) -> None:
        """Begin to read a step; ``driven`` are speeds of persons that were moved, m/s."""
        self._road, self._now, self._step, self._driven = road, time, step, driven
        self._before, self._views, self._restored = self._restored or self._views, {}, {}
        if self._eager is None:
            own = self._actors.items()
            self._eager = tuple(name for name, actor in own if actor.person or name in self.always)
        for name in self._eager:
            self.actor(name)

    def others_named(self) -> None:
        """Take note that rules name more actors, or ask more of them."""
        self._eager = None

    def actor(self, name: str) -> ActorView | None:
        """Return an actor, ``None`` if it is not on the road."""
        views = self._views
        if name in views:
            return views[name]
        planned = self._actors.get(name)
        view = None
        if planned is not None and name not in self._gone:
            view = self._view_person(planned) if planned.person else self._view_vehicle(planned)
            if view is None and name in self._gains and not self._road.knows(name):
                self._gone.add(name)  # asking SUMO for it would cost more than all who are there
        views[name] = view
        return view

    @property
    def names(self) -> Collection[str]:
        """Actors that rules name, on the road or not."""
        return self._actors.keys()

    def named(self) -> Sequence[ActorView]:
        """All actors on the road that rules name."""
        return tuple(
            actor_view for actor_view in map(self.actor, self._actors) if actor_view is not None
        )

    def leapt(self, name: str) -> bool:
        """Whether an actor who was read a step before has leapt since."""
        before, now = self._before.get(name), self.actor(name)
        return before is not None and now is not None and leapt(before, now, self._step)

    def gone(self, name: str) -> bool:
        """Whether an actor has left the road for good."""
        return name in self._gone

    def _required_actor(self, name: str) -> ActorView:
        body = self.actor(name)
        if body is None:
            raise KeyError(name)
        return body

    def place(self, place: str | Point) -> Point:
        """X and y of a place."""
        if isinstance(place, str):
            known = self._plan.places[place]
            return known.x, known.y
        return place

    def lane_distance(self, actor: str, to: str | Point) -> float | None:
        """Metres along the lanes from the centre of an actor to another's, or to a place."""
        own = self._required_actor(actor)
        if own.person:
            return None
        ahead = own.length / 2.0
        other = self.actor(to) if isinstance(to, str) else None
        if other is not None:
            if other.person:
                where = self._nearest_lane_position((other.x, other.y))
            else:
                where, ahead = self._road.road_place(other.id), ahead - other.length / 2.0
        else:
            where = self._lane_position_of(to)
        if other is None and self._road.is_in_junction(where[0]):
            abreast = self._metres_abreast(own, self.place(to))
            if abreast is not None:
                return abreast
        metres = self._road.driving_distance(actor, *where)
        if metres is None and other is None:
            under = _metres_under_body(own, self.place(to))
            return self._metres_abreast(own, self.place(to)) if under is None else under
        return None if metres is None or metres < _BEHIND else metres + ahead

    def _metres_abreast(self, own: ActorView, place: Point) -> float | None:
        """Metres from the centre of an actor to where a place lies beside the lane that it takes.

        In a junction the lane nearest to a place may be one that turns off before.
        """
        line = self.lane_line(own.id, 0)
        if line is None:
            return None
        there, here = beside(line, place), beside(line, (own.x, own.y))
        ahead = there.along - here.along
        within = ahead > 0.0 and there.along < line_length(line) and abs(there.left) < _ABREAST
        return ahead if within else None

    def lane_line(self, actor: str, by: int) -> tuple[Point, ...] | None:
        """Centre line of the lane ``by`` lanes to the left of an actor's."""
        own = self._required_actor(actor)
        for shape in self._road.lane_lines.beside(actor, by):
            line = tuple((x - self._offset[0], y - self._offset[1]) for x, y in shape)
            left = -beside(line, (own.x, own.y)).left
            if by == 0 or (left > 0.0) == (by > 0):
                return line
        return None

    def lane_line_to(self, actor: str, place: str | Point) -> tuple[Point, ...] | None:
        """Centre line of the lane beside an actor, or its own, that leads to a place."""
        point = self.place(place)
        found = []
        for shape in self._road.lane_lines.own(actor):
            line = tuple((x - self._offset[0], y - self._offset[1]) for x, y in shape)
            along, left = beside(line, point)
            if 0.0 <= along <= line_length(line) and abs(left) < _ON_LANE:
                found.append((abs(left), line))
        return min(found)[1] if found else None

    def walking_speed(self, actor: str) -> float:
        """Speed at which a person walks if no rule says otherwise, m/s."""
        planned = self._actors[actor]
        return planned.speed or _USUAL_WALK

    def signal(self, light: str, movement: str) -> str | None:
        """Letter that a movement shows."""
        found = self._plan.signals.get((light, movement))
        return None if found is None else self._road.light_letter(*found)

    def state(self) -> dict[str, Any]:
        """What has to be remembered, for JSON."""
        return {
            "travelled": self._travelled,
            "odometers": {name: list(odometer) for name, odometer in self._odometers.items()},
            "standing": self._standing,
            "gone": sorted(self._gone),
            "last": {name: list(pose) for name, pose in self._last.items()},
            "seen": {
                n: [view.x, view.y, view.hdg, view.speed] for n, view in self._views.items() if view
            },
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._travelled = dict(state["travelled"])
        odometers = state.get("odometers", {}).items()
        self._odometers = {name: (t, metres, jumped) for name, (t, metres, jumped) in odometers}
        self._standing = dict(state["standing"])
        self._gone = set(state["gone"])
        self._last = {name: (x, y, v) for name, (x, y, v) in state["last"].items()}
        self._restored = {name: LastPose(*pose) for name, pose in state.get("seen", {}).items()}

    def _lane_position_of(self, place: str | Point) -> tuple[str, float, int]:
        if not isinstance(place, str):
            return self._nearest_lane_position(place)
        known = self._plan.places[place]
        if known.edge is None:
            return self._nearest_lane_position((known.x, known.y))
        return known.edge, known.pos, known.lane

    def _nearest_lane_position(self, place: Point) -> tuple[str, float, int]:
        if place not in self._nearest:
            x, y = place[0] + self._offset[0], place[1] + self._offset[1]
            self._nearest[place] = self._road.nearest_road(x, y)
        return self._nearest[place]

    def _view_vehicle(self, planned: PlannedActor) -> ActorView | None:
        if planned.id not in self.whole:
            moves = self._road.motion(planned.id)
            return None if moves is None else self._make_view(planned, *moves)
        seen = self._road.vehicle(planned.id)
        if seen is None:
            return None
        x, y, angle, speed, faster, odometer, lane, left = seen
        travelled = self._leave_out_jumps(planned.id, odometer) - self._extra(planned.id)
        off_road = not lane or abs(left) > self._half_width(lane)
        return self._make_view(planned, x, y, angle, speed, faster, travelled, off_road=off_road)

    def _half_width(self, lane: str) -> float:
        known = self._half_widths.get(lane)
        if known is None:
            known = self._half_widths[lane] = self._road.lane_width(lane) / 2.0
        return known

    def _view_person(self, planned: PlannedActor) -> ActorView | None:
        seen = self._road.person(planned.id)
        if seen is None:
            return None
        x, y, before = self._last.get(planned.id, (seen.x, seen.y, seen.speed))
        moved = math.hypot(seen.x - x, seen.y - y)
        if moved > _FASTEST * self._step:  # put somewhere else: no distance that it travels
            moved = 0.0
        # SUMO says 0 of persons that are moved.
        speed = self._driven.get(planned.id, seen.speed)
        self._travelled[planned.id] = self._travelled.get(planned.id, 0.0) + moved
        self._last[planned.id] = seen.x, seen.y, speed
        travelled, faster = self._travelled[planned.id], (speed - before) / self._step
        return self._make_view(
            planned, seen.x, seen.y, seen.angle_deg, speed, faster, travelled,
            off_road=not seen.lane,
        )  # fmt: skip

    def _leave_out_jumps(self, vehicle: str, odometer: float) -> float:
        """Metres that a vehicle has travelled, without those by which it was put somewhere else."""
        time, before, jumped = self._odometers.get(vehicle, (self._now - self._step, 0.0, 0.0))
        if odometer - before > _FASTEST * (self._now - time + self._step):
            jumped += odometer - before
        self._odometers[vehicle] = self._now, odometer, jumped
        return odometer - jumped

    def _make_view(
        self,
        planned: PlannedActor,
        front_x: float,
        front_y: float,
        angle: float,
        speed: float,
        acceleration: float = 0.0,
        travelled: float = 0.0,
        *,
        off_road: bool = False,
    ) -> ActorView:
        name, length, standing = planned.id, planned.length, None
        if speed < _STANDING:
            standing = self._standing.setdefault(name, self._now)
        elif name in self._standing:
            del self._standing[name]
        gain = self._gains.get(name)
        if gain is None:
            gain = MOST_GAIN if planned.person else min(self._road.gain(name) + _MORE, MOST_GAIN)
            self._gains[name] = gain
        x, y = body_centre(front_x, front_y, angle, length=length, net_offset=self._offset)
        hdg = math.remainder(math.radians(90.0 - angle), math.tau)
        return ActorView(  # by place: by name it takes twice as long
            name, x, y, hdg, speed, acceleration, length, planned.width, travelled,
            planned.person, standing, off_road, gain,
        )  # fmt: skip


def _metres_under_body(actor_view: ActorView, place: Point) -> float | None:
    """Metres that a place is ahead of a body's centre if it is under the body.

    Where the front has left the edge of the place, SUMO knows of no way there any more.
    """
    c, s = math.cos(actor_view.hdg), math.sin(actor_view.hdg)
    dx, dy = place[0] - actor_view.x, place[1] - actor_view.y
    ahead, aside = dx * c + dy * s, dy * c - dx * s
    inside = abs(ahead) <= actor_view.length / 2.0 + 1.0 and abs(aside) <= actor_view.width
    return ahead if inside else None


def stranger(
    road: MovedActors, planned: PlannedActor, net_offset: tuple[float, float]
) -> ActorView | None:
    """Body of a road user that no rule names."""
    if planned.person:
        seen = road.person(planned.id)
        moves = None if seen is None else seen[:4]
    else:
        moves = road.motion(planned.id)
    if moves is None:
        return None
    x, y, angle, speed = moves
    pose = sumo_to_xodr(SumoPose(x, y, 0.0, angle), length=planned.length, net_offset=net_offset)
    return ActorView(
        planned.id, float(pose.x), float(pose.y), float(pose.hdg), speed, 0.0,
        planned.length, planned.width, 0.0, planned.person,
    )  # fmt: skip
