"""Names of movements in programs: what they refer to, and how to call a set of movements.

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

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.scenario.signals.light import SignalMovement

TURNS = ("left", "straight", "right", "turnaround")


def find_movements(name: str, movements: Sequence[SignalMovement]) -> tuple[int, ...]:
    """Places of the movements that ``name`` refers to; empty if there are none."""
    first, _, rest = name.strip().partition(" ")
    if first == "walk":
        return tuple(n for n, one in enumerate(movements) if one.walk and rest in one.legs)
    if rest:
        return tuple(
            n for n, one in enumerate(movements) if one.approach == first and one.turn == rest
        )
    parts = first.split(">")
    source, target = parts[0], parts[-1] if len(parts) > 1 else None
    return tuple(
        n
        for n, one in enumerate(movements)
        if one.drive
        and source in (one.approach, one.lanes[0])
        and target in (None, one.exit, one.lanes[1])
    )


def shortest_names(wanted: Iterable[int], movements: Sequence[SignalMovement]) -> tuple[str, ...]:
    """Fewest names that refer to exactly the movements ``wanted``, from the general to the exact.

    Crossings over the same legs cannot be told apart, and are named together.
    """
    left, names = set(wanted), []
    goal = frozenset(left)
    while left:
        first = min(left)
        for name in _names(movements[first]):
            found = frozenset(find_movements(name, movements))
            if found <= goal:
                break
        names.append(name)
        left -= found | {first}
    return tuple(names)


def known_names(movements: Sequence[SignalMovement]) -> tuple[str, ...]:
    """Names of all movements, by segments, for messages."""
    return tuple(dict.fromkeys(one.name for one in movements if one.turn))


def _names(one: SignalMovement) -> tuple[str, ...]:
    if one.walk:
        return tuple(f"walk {leg}" for leg in one.legs)
    return one.approach, f"{one.approach} {one.turn}", one.name, one.lanes[0], one.exact_name
