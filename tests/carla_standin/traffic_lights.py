"""Traffic lights: groups whose controllers take turns, as CARLA's do by itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from tests.carla_standin import wire
from tests.carla_standin.actors import Actor


class Light(IntEnum):
    """State on the wire."""

    RED = 0
    YELLOW = 1
    GREEN = 2
    OFF = 3
    UNKNOWN = 4


@dataclass(slots=True, eq=False)
class TrafficLight:
    """One light; times in seconds."""

    actor: Actor
    group: Group
    pole: int
    state: Light = Light.RED
    green: float = 10.0
    yellow: float = 3.0
    red: float = 2.0

    def set_state(self, state: int) -> None:
        """Show a state until the group's next step, or for ever while frozen."""
        self.state = Light(state)

    def duration(self, phase: Light) -> float:
        """Seconds that a phase lasts."""
        return {Light.GREEN: self.green, Light.YELLOW: self.yellow}.get(phase, self.red)

    def write(self, *, frozen: bool) -> None:
        """Bring its part of the state message up to date."""
        self.actor.tail = wire.LIGHT_TAIL.pack(
            self.actor.sign_id.encode(),
            self.green,
            self.yellow,
            self.red,
            self.group.elapsed,
            self.pole,
            frozen,
            self.state,
        )


@dataclass(slots=True, eq=False)
class Group:
    """Lights of one junction: one set after the other has green, yellow, then all have red."""

    turns: list[list[TrafficLight]] = field(default_factory=list)
    turn: int = 0
    phase: Light = Light.GREEN
    elapsed: float = 0.0

    @property
    def lights(self) -> list[TrafficLight]:
        """All its lights."""
        return [light for turn in self.turns for light in turn]

    def reset(self) -> None:
        """Begin again with the first turn."""
        self.turn, self.phase, self.elapsed = 0, Light.GREEN, 0.0
        self._show()

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""
        self.elapsed += dt
        if self.elapsed < self.turns[self.turn][0].duration(self.phase):
            return
        self.elapsed = 0.0
        if self.phase is Light.RED:
            self.turn = (self.turn + 1) % len(self.turns)
        order = {Light.GREEN: Light.YELLOW, Light.YELLOW: Light.RED, Light.RED: Light.GREEN}
        self.phase = order[self.phase]
        self._show()

    def _show(self) -> None:
        for number, turn in enumerate(self.turns):
            for light in turn:
                light.state = self.phase if number == self.turn else Light.RED


class TrafficLights:
    """All lights of the world."""

    def __init__(self) -> None:
        self.frozen = False
        self.groups: list[Group] = []
        self._by_actor: dict[int, TrafficLight] = {}

    def add_group(self, turns: list[list[Actor]]) -> None:
        """Add the lights of one junction, one list of actors for each turn."""
        group = Group()
        pole = 0
        for turn in turns:
            lights = []
            for actor in turn:
                lights.append(TrafficLight(actor, group, pole))
                pole += 1
            group.turns.append(lights)
        group.reset()
        self.groups.append(group)
        self._by_actor.update({light.actor.id: light for light in group.lights})
        self.write()

    def __getitem__(self, actor: int) -> TrafficLight:
        """Light of an actor; refuses what is none."""
        if actor not in self._by_actor:
            raise wire.RefusedError(f"Actor is not a traffic light. Actor Id: {actor}")
        return self._by_actor[actor]

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass, unless time is frozen."""
        if not self.frozen:
            for group in self.groups:
                group.advance(dt)
        self.write()

    def write(self) -> None:
        """Bring the state messages up to date."""
        for light in self._by_actor.values():
            light.write(frozen=self.frozen)
