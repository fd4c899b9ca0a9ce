"""A traffic light as a scenario sees it: its movements, their names, and which conflict.

=========================== ====================================================================
name                        movements
=========================== ====================================================================
``r12``                     all of vehicles from segment ``r12``
``r12 left``                those that turn so (``left``, ``straight``, ``right``, ``turnaround``)
``r12>r8``, ``r12>j54>r8``  those from segment ``r12`` to segment ``r8``
``12.0.-1``                 all from that lane
``12.0.-1>8.1.-1``          from lane to lane
``walk r12``                the crossings over leg ``r12``
=========================== ====================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


class SignalMovement(NamedTuple):
    """What one letter of a light's states is for.

    Attributes
    ----------
    approach, exit
        Segments before and behind the junction; of a crossing the leg that it leads over, twice.
    turn
        ``left``, ``straight``, ``right``, ``turnaround``, or ``walk`` for a crossing;
        empty for a letter that the network has no connection for.
    lanes
        OpenDRIVE lanes before and behind, ``12.0.-1``; empty for a crossing.
    yellow
        Seconds, by the speed of the approach; 0 for a crossing.
    legs
        All segments that a crossing leads over.
    """

    approach: str
    exit: str
    turn: str
    lanes: tuple[str, str] = ("", "")
    yellow: float = 0.0
    legs: tuple[str, ...] = ()

    @property
    def walk(self) -> bool:
        """Whether it is a crossing."""
        return self.turn == "walk"

    @property
    def drive(self) -> bool:
        """Whether it is for vehicles."""
        return bool(self.turn) and not self.walk

    @property
    def name(self) -> str:
        """As one would call it in a program."""
        return f"walk {self.approach}" if self.walk else f"{self.approach}>{self.exit}"

    @property
    def exact_name(self) -> str:
        """Name that says the lanes too."""
        return self.name if self.walk else ">".join(self.lanes)


class Meeting(NamedTuple):
    """Two movements of a light that meet, by their places in its states.

    Attributes
    ----------
    yields
        The one that gives way to the other; -1 if neither does.
    shares
        Whether drivers expect both to have green together, so that one may give way.
    clearing, clearing_back
        Seconds from the end of yellow (of a crossing: of green) of ``one`` until ``other`` may
        begin, and of ``other`` until ``one`` may.
    """

    one: int
    other: int
    yields: int
    shares: bool
    clearing: float
    clearing_back: float


@dataclass(frozen=True)
class Light:
    """A traffic light of the map.

    Attributes
    ----------
    names
        What a scenario may call it: its OpenDRIVE junctions, or the SUMO id of a light in none.
    green
        Seconds of green of each stage in the map's program.
    movements
        In the order of the letters of its states.
    meetings
        Which of them meet.
    """

    names: tuple[str, ...]
    green: tuple[float, ...]
    movements: tuple[SignalMovement, ...] = ()
    meetings: tuple[Meeting, ...] = ()

    @cached_property
    def met(self) -> Mapping[tuple[int, int], Meeting]:
        """Meetings by the two movements, smaller first."""
        return {(min(m.one, m.other), max(m.one, m.other)): m for m in self.meetings}

    def clearing(self, ending: int, beginning: int) -> float | None:
        """Seconds until ``beginning`` may have green after ``ending``; ``None`` if they miss."""
        meeting = self.met.get((min(ending, beginning), max(ending, beginning)))
        if meeting is None:
            return None
        return meeting.clearing if meeting.one == ending else meeting.clearing_back


def find_light(lights: Sequence[Light], junction: str) -> Light | None:
    """Light that a scenario means by ``junction``, if there is one."""
    return next((light for light in lights if junction in light.names), None)


def lights_by_name(lights: Sequence[Light]) -> dict[str, Light]:
    """Lights by all that a scenario may call them, as :func:`find_light` finds them."""
    return {name: light for light in reversed(lights) for name in light.names}


TURNS = ("left", "straight", "right", "turnaround")


def find_movements(name: str, movements: Sequence[SignalMovement]) -> tuple[int, ...]:
    """Places of the movements that ``name`` refers to; empty if there are none."""
    first, _, rest = name.strip().partition(" ")
    if first == "walk":
        return tuple(
            n for n, movement in enumerate(movements) if movement.walk and rest in movement.legs
        )
    if rest:
        return tuple(
            n
            for n, movement in enumerate(movements)
            if movement.approach == first and movement.turn == rest
        )
    parts = first.split(">")
    source, target = parts[0], parts[-1] if len(parts) > 1 else None
    return tuple(
        n
        for n, movement in enumerate(movements)
        if movement.drive
        and source in (movement.approach, movement.lanes[0])
        and target in (None, movement.exit, movement.lanes[1])
    )


def shortest_names(wanted: Iterable[int], movements: Sequence[SignalMovement]) -> tuple[str, ...]:
    """Fewest names that refer to exactly the movements ``wanted``, from the general to the exact.

    Crossings over the same legs cannot be told apart, and are named together.
    """
    left, names = set(wanted), []
    goal = frozenset(left)
    while left:
        first = min(left)
        for name in _names_of_movement(movements[first]):
            found = frozenset(find_movements(name, movements))
            if found <= goal:
                break
        names.append(name)
        left -= found | {first}
    return tuple(names)


def known_names(movements: Sequence[SignalMovement]) -> tuple[str, ...]:
    """Names of all movements, by segments, for messages."""
    return tuple(dict.fromkeys(movement.name for movement in movements if movement.turn))


def _names_of_movement(signal_movement: SignalMovement) -> tuple[str, ...]:
    if signal_movement.walk:
        return tuple(f"walk {leg}" for leg in signal_movement.legs)
    return (
        signal_movement.approach,
        f"{signal_movement.approach} {signal_movement.turn}",
        signal_movement.name,
        signal_movement.lanes[0],
        signal_movement.exact_name,
    )
