"""Actions that no motion follows from: who appears, what is switched, shown or sounded.

What is not about an actor on the road is asked of the simulator, on whole steps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.scenario.story.acting_actor import CannotAct

if TYPE_CHECKING:
    from odscen.scenario.document.actions_document import (
        Appearing,
        NewGoal,
        SignalSwitch,
        VehicleLights,
    )
    from odscen.scenario.story.acting_actor import ActingActor
    from odscen.scenario.story.road_view import RoadView


class WantedActor(NamedTuple):
    """An actor that is to appear: centre and heading of its body, m/s; ``None`` is as planned."""

    actor: str
    at: tuple[float, float, float] | None
    speed: float | None


class WantedSignal(NamedTuple):
    """A traffic light that is to be switched, see :class:`SignalSwitch`."""

    light: str
    shows: str
    movement: str | None


class WantedEnd(NamedTuple):
    """The run is to end."""


Wanted = WantedActor | WantedSignal | WantedEnd


def ask_to_appear(part: Appearing, actor: str, view: RoadView) -> Wanted:
    """Ask for an actor.

    Raises
    ------
    CannotAct
        If it is on the road.
    """
    if view.actor(actor) is not None:
        raise CannotAct(f"{actor!r} is on the road already")
    return WantedActor(actor, part.at, part.speed)


def ask_to_switch(part: SignalSwitch, _: str, __: RoadView) -> Wanted:
    """Ask for a traffic light."""
    return WantedSignal(part.light, part.shows, part.movement)


def ask_to_end(_: object, __: str, ___: RoadView) -> Wanted:
    """Ask for the end of the run."""
    return WantedEnd()


def said_of_end(_: object) -> str:
    """What is reported."""
    return "ends the run"


def said_of_signal(part: SignalSwitch) -> str:
    """What a light then shows."""
    return f"light {part.light}: {part.movement or ''} {part.shows}".replace("  ", " ")


def has_appeared(_: Appearing, one: ActingActor, __: float) -> float:
    """Instant at which it is seen on the road."""
    return one.view.time


def set_goal(part: NewGoal, one: ActingActor) -> float:
    """Take another goal."""
    one.channel.goal = part.to
    return one.instant


def said_of_goal(part: NewGoal) -> str:
    """Where it goes to."""
    return f"goal {part.to}"


def set_lights(part: VehicleLights, one: ActingActor) -> float:
    """Switch lights of a vehicle."""
    one.channel.lights = _lights(part) if part.model_fields_set else None
    return one.instant


def said_of_lights(part: VehicleLights) -> str:
    """Lights that are on."""
    if not part.model_fields_set:
        return "lights: the driver's"
    return f"lights: {', '.join(_lights(part)) or 'off'}"


def _lights(part: VehicleLights) -> tuple[str, ...]:
    shown = () if part.indicator in (None, "off") else (str(part.indicator),)
    names = ("brake", "front", "high_beam", "fog", "emergency")
    return shown + tuple(name for name in names if getattr(part, name))


def sound_horn(_: object, one: ActingActor) -> float:
    """Sound the horn: nothing moves."""
    return one.instant


def said_of_horn(_: object) -> str:
    """What is heard."""
    return "horn"
