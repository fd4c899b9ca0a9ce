"""Actions of rules as private and global actions."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.interchange.openscenario.dialect import xml
from odscen.interchange.openscenario.xosc_places import GroundPose
from odscen.interchange.openscenario.xosc_triggers import CannotSayError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from lxml.etree import _Element

    from odscen.interchange.openscenario.dialect import Dialect, ExportNotes
    from odscen.interchange.openscenario.xosc_places import Places
    from odscen.scenario.document.scenario_document import Actor

_SHAPES: Final = {"step": "step", "linear": "linear", "cosine": "sinusoidal"}
_WALKING: Final = 1.4
"""m/s of pedestrians whose speed is not given."""


@dataclass(frozen=True, slots=True)
class Actions:
    """Makes actions; ``actors`` are those of the scenario by id."""

    places: Places
    dialect: Dialect
    notes: ExportNotes
    actors: Mapping[str, Actor]

    def actions(self, kind: str, part: Any, actor: str, where: str) -> list[_Element]:
        """Contents of the actions that an action of a rule is in OpenSCENARIO.

        Raises
        ------
        CannotSayError
            If there is none.
        """
        make = _MAKERS.get(kind)
        if make is None:
            msg = f"OpenSCENARIO has no action {kind!r}"
            raise CannotSayError(msg)
        return make(self, part, actor, where)

    def trajectory(
        self, name: str, spots: Sequence[GroundPose], times: Sequence[float], *, timed: bool
    ) -> _Element:
        """``RoutingAction`` that leads along points; times are relative to its begin."""
        vertices = [
            xml("Vertex", spot.element(), time=float(time))
            for spot, time in zip(spots, times, strict=True)
        ]
        shape = xml("Shape", xml("Polyline", *vertices))
        line = xml("Trajectory", xml("ParameterDeclarations"), shape, name=name, closed=False)
        timing = xml("Timing", domainAbsoluteRelative="relative", scale=1.0, offset=0.0)
        follow = xml(
            "FollowTrajectoryAction",
            line if self.dialect.minor == 0 else None,
            xml("TimeReference", timing if timed else xml("None")),
            xml("TrajectoryFollowingMode", followingMode="position"),
            None if self.dialect.minor == 0 else xml("TrajectoryRef", line),
        )
        return private(xml("RoutingAction", follow))


def private(content: _Element) -> _Element:
    """``PrivateAction``."""
    return xml("PrivateAction", content)


def speed_action(speed: float, shape: str, dimension: str, value: float) -> _Element:
    """``PrivateAction`` that changes the speed."""
    return private(
        xml(
            "LongitudinalAction",
            xml(
                "SpeedAction",
                xml(
                    "SpeedActionDynamics",
                    dynamicsShape=shape,
                    dynamicsDimension=dimension,
                    value=float(value),
                ),
                xml("SpeedActionTarget", xml("AbsoluteTargetSpeed", value=float(speed))),
            ),
        )
    )


def _speed(_made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    given = (("rate", part.rate), ("time", part.over), ("distance", part.within))
    dimension, value = next((pair for pair in given if pair[1] is not None), ("time", 0.0))
    return [speed_action(part.to, _SHAPES[part.shape], dimension, value)]


def _brake(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    if part.hold is not None:
        made.notes.approximated.append((where, "what follows does not wait for the hold"))
    return [speed_action(0.0, "linear", "rate", part.by)]


def _stop(_made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    if part.within is None:
        return [speed_action(0.0, "step", "time", 0.0)]
    return [speed_action(0.0, "linear", "distance", part.within)]


def _controller(made: Actions, **axes: bool) -> _Element:
    action = xml("ActivateControllerAction", **axes)
    if made.dialect.minor == 0:
        return private(action)
    return private(xml("ControllerAction", action))


def _go(made: Actions, _part: Any, _actor: str, _where: str) -> list[_Element]:
    return [_controller(made, longitudinal=True)]


def _release(made: Actions, _part: Any, _actor: str, _where: str) -> list[_Element]:
    return [_controller(made, lateral=True, longitudinal=True)]


def _lane_change(over: float, target: _Element) -> _Element:
    dynamics = xml(
        "LaneChangeActionDynamics",
        dynamicsShape="sinusoidal",
        dynamicsDimension="time",
        value=float(over),
    )
    change = xml("LaneChangeAction", dynamics, xml("LaneChangeTarget", target))
    return private(xml("LateralAction", change))


def _lane(_made: Actions, part: Any, actor: str, _where: str) -> list[_Element]:
    if part.by is None:
        msg = "a change to the lane that leads to a place"
        raise CannotSayError(msg)
    target = xml("RelativeTargetLane", entityRef=actor, value=int(part.by))
    return [_lane_change(part.over, target)]


def _cut_in(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    if part.gap is not None:
        made.notes.approximated.append((where, "the gap in front of it is not reached by itself"))
    return [_lane_change(part.over, xml("RelativeTargetLane", entityRef=part.to, value=0))]


def _offset(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    made.notes.approximated.append((where, "an offset has no duration but an acceleration"))
    greatest = math.pi**2 * abs(part.to) / (2.0 * part.over**2)
    dynamics = xml(
        "LaneOffsetActionDynamics",
        dynamicsShape="sinusoidal",
        maxLateralAcc=max(greatest, 1e-3),
    )
    target = xml("LaneOffsetTarget", xml("AbsoluteTargetLaneOffset", value=float(part.to)))
    return [
        private(xml("LateralAction", xml("LaneOffsetAction", dynamics, target, continuous=True)))
    ]


def _keep_gap(made: Actions, part: Any, _actor: str, where: str) -> list[_Element]:
    if part.lasting is not None:
        made.notes.approximated.append((where, "the gap is kept without end"))
    about: dict[str, object] = {}
    if made.dialect.minor >= 1:
        about = {"coordinateSystem": "entity", "displacement": "trailingReferencedEntity"}
    limits = xml("DynamicConstraints", maxAcceleration=part.rate, maxDeceleration=part.rate,
                 maxSpeed=70.0)  # fmt: skip
    return [
        private(
            xml(
                "LongitudinalAction",
                xml(
                    "LongitudinalDistanceAction",
                    limits,
                    entityRef=part.to,
                    continuous=True,
                    freespace=True,
                    distance=part.metres,
                    timeGap=part.seconds,
                    **about,
                ),
            )
        )
    ]


def _walk(made: Actions, part: Any, actor: str, where: str) -> list[_Element]:
    speed = part.speed or made.actors[actor].speed or _WALKING
    made.notes.approximated.append((where, "the walk begins where the walker is, not at a point"))
    spots = [made.places.spot(place) for place in (*part.through, part.to)]
    return [
        made.trajectory(f"{actor}: {where}", *_timed(spots, speed), timed=len(spots) > 1),
        speed_action(speed, "step", "time", 0.0),
    ]


def _timed(spots: Sequence[GroundPose], speed: float) -> tuple[list[GroundPose], list[float]]:
    steps = [math.hypot(b.x - a.x, b.y - a.y) / speed for a, b in itertools.pairwise(spots)]
    times = [0.0, *itertools.accumulate(steps)]
    if len(spots) == 1:  # a line has two points at least
        return [*spots, *spots], [0.0, 1.0]
    return list(spots), times


def _path(made: Actions, part: Any, actor: str, where: str) -> list[_Element]:
    spots = [made.places.spot(place) for place in part.points]
    if part.times:
        times = list(map(float, part.times))
        return [made.trajectory(f"{actor}: {where}", spots, times, timed=True)]
    if part.speeds:
        made.notes.approximated.append((where, "speeds at the points are left out"))
    line = made.trajectory(f"{actor}: {where}", *_timed(spots, part.speed or 10.0), timed=False)
    return [line] if part.speed is None else [line, speed_action(part.speed, "step", "time", 0.0)]


def _replay(made: Actions, part: Any, actor: str, where: str) -> list[_Element]:
    back = made.places.centre_ahead(made.actors[actor])
    level = made.places.start(made.actors[actor]).z
    spots = [GroundPose(x, y, level, hdg).back(back) for _, x, y, hdg in part.rows]
    times = [row[0] for row in part.rows]
    return [made.trajectory(f"{actor}: {where}", spots, times, timed=True)]


def _goal(made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    return [acquire(made.places, part.to)]


def acquire(places: Places, node: str) -> _Element:
    """``PrivateAction`` that leads to a node."""
    position = places.lane_position(node)
    return private(xml("RoutingAction", xml("AcquirePositionAction", position)))


def _arrive(made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    master, own = (made.places.spot(place).element() for place in (part.when_at, part.at))
    master.tag, own.tag = "TargetPositionMaster", "TargetPosition"
    return [private(xml("SynchronizeAction", master, own, masterEntityRef=part.to))]


def _vanish(_made: Actions, _part: Any, actor: str, _where: str) -> list[_Element]:
    return [xml("GlobalAction", xml("EntityAction", xml("DeleteEntityAction"), entityRef=actor))]


def appear(actor: Actor, at: GroundPose) -> _Element:
    """``GlobalAction`` that adds an entity."""
    added = xml("AddEntityAction", at.element())
    return xml("GlobalAction", xml("EntityAction", added, entityRef=actor.id))


def _appear(made: Actions, part: Any, actor: str, _where: str) -> list[_Element]:
    own = made.actors[actor]
    spot = made.places.start(own)
    if part.at is not None:
        spot = GroundPose(part.at[0], part.at[1], spot.z, part.at[2]).back(
            made.places.centre_ahead(own)
        )
    speed = own.initial_speed if part.speed is None else part.speed
    return [appear(own, spot), speed_action(speed or 0.0, "step", "time", 0.0)]


_LIGHTS: Final = {
    "brake": "brakeLights",
    "front": "lowBeam",
    "high_beam": "highBeam",
    "fog": "fogLights",
    "emergency": "specialPurposeLights",
}
_INDICATORS: Final = {"left": "indicatorLeft", "right": "indicatorRight", "hazard": "warningLights"}


def _lights(made: Actions, part: Any, _actor: str, _where: str) -> list[_Element]:
    if made.dialect.minor < 3:  # the schema of 1.2 wants a light of the vehicle and one of the user
        msg = "lights of vehicles, which can be written from 1.3 on"
        raise CannotSayError(msg)
    states = {name: "on" if getattr(part, field) else "off" for field, name in _LIGHTS.items()
              if getattr(part, field) is not None}  # fmt: skip
    if part.indicator is not None:
        states |= {
            name: "flashing" if side == part.indicator else "off"
            for side, name in _INDICATORS.items()
        }
    return [
        private(
            xml(
                "AppearanceAction",
                xml(
                    "LightStateAction",
                    xml("LightType", xml("VehicleLight", vehicleLightType=name)),
                    xml("LightState", mode=mode),
                    transitionTime=0.0,
                ),
            )
        )
        for name, mode in states.items()
    ]


_MAKERS: Final[Mapping[str, Callable[[Actions, Any, str, str], list[_Element]]]] = {
    "speed": _speed,
    "brake": _brake,
    "stop": _stop,
    "go": _go,
    "lane": _lane,
    "cut_in": _cut_in,
    "offset": _offset,
    "keep_gap": _keep_gap,
    "walk": _walk,
    "path": _path,
    "replay": _replay,
    "goal": _goal,
    "arrive": _arrive,
    "appear": _appear,
    "vanish": _vanish,
    "lights": _lights,
    "release": _release,
}
