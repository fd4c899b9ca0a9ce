"""How a junction is ruled: who meets whom, who goes first, and what SUMO calls it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.convert.model.major_road import major_edges, stands_out
from odscen.convert.model.right_of_way import (
    Rules,
    Sign,
    find_conflicts,
    in_turn,
    making_room,
    requests,
)
from odscen.convert.model.sight import sight_before

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.model.net import Request
    from odscen.convert.model.right_of_way import Conflicts, Movement, Walkway


class Ruling(NamedTuple):
    """Who meets whom, and who goes first.

    ``zipped`` are the movements that go in turn with others, ``yielding`` those that make room for
    others; where all have equal right, ``equal``.
    """

    movements: Sequence[Movement]
    conflicts: Conflicts
    rules: Rules
    rights: Sequence[Request]
    zipped: frozenset[int]
    yielding: frozenset[int]
    equal: bool


def ruled(
    movements: Sequence[Movement],
    walkways: Sequence[Walkway],
    cars: Sequence[bool],
    *,
    high_low: frozenset[tuple[str, str]],
    lefthand: bool,
    signalled: bool,
) -> Ruling:
    """Say who meets whom in a junction and who goes first.

    Parameters
    ----------
    cars
        Whether each movement is open to cars.
    high_low
        Pairs of OpenDRIVE roads, incoming or connecting, of which the first has priority.
    """
    conflicts = find_conflicts(movements, walkways)
    signs = {movement.source[0]: movement.sign for movement in movements}
    all_stop = len(signs) > 1 and not signalled and set(signs.values()) == {Sign.STOP}
    unruled = len(set(signs.values())) <= 1 and not high_low
    major: frozenset[str] = frozenset()
    # Signs to give way on all approaches distinguish none, but say that there is a major road.
    if signalled or (unruled and (any(signs.values()) or stands_out(movements, cars))):
        major = major_edges(movements, cars)
    rules = Rules(high_low, lefthand, all_stop, signalled, major)
    zipped = frozenset(n for pair in in_turn(movements, conflicts, rules) for n in pair)
    yielding = frozenset(waits for waits, _ in making_room(movements, conflicts, rules))
    equal = unruled and not major and not all_stop and not zipped and not yielding
    rights = requests(movements, conflicts, rules)
    return Ruling(movements, conflicts, rules, rights, zipped, yielding, equal)


def signposts(ruling: Ruling, rows: Mapping[int, int]) -> list[tuple[str, float | None]]:
    """For each movement SUMO's letter, and from where its drivers see whom to let go."""
    posts: list[tuple[str, float | None]] = []
    for n, (movement, right) in enumerate(zip(ruling.movements, ruling.rights, strict=False)):
        if n in ruling.zipped:
            posts.append(("Z", None))
            continue
        sight = sight_before(movement, right, ruling.movements, room=n in ruling.yielding)
        posts.append((_state(ruling, movement, right, lit=n in rows), sight))
    return posts


def junction_kind(ruling: Ruling) -> str:
    """SUMO's type of a junction."""
    if ruling.rules.signalled:
        return "traffic_light"
    if ruling.rules.all_stop:
        return "allway_stop"
    if not ruling.conflicts.pairs:
        return "priority"
    if ruling.zipped:
        return "zipper"
    if any(movement.sign is Sign.STOP for movement in ruling.movements):
        return "priority_stop"
    return "right_before_left" if ruling.equal else "priority"


def _state(ruling: Ruling, movement: Movement, right: Request, *, lit: bool) -> str:
    """SUMO's letter for the right of way of a movement."""
    if lit:
        # Persons are waited for whatever the letter; it says whether vehicles are.
        count = len(ruling.movements)
        return "o" if any(other < count for other in right.yields_to) else "O"
    if ruling.rules.all_stop:
        return "w"
    if movement.sign is Sign.STOP:
        return "s"
    if not right.yields_to:
        return "M"
    return "=" if ruling.equal else "m"
