"""What the time bar of the editor gets: where road users are planned to be."""

from __future__ import annotations

from odscen.base.categories import Category
from odscen.web.messages import Answer


class PlannedUser(Answer):
    """A road user that is planned; metres. ``flow`` is the flow that it is a member of."""

    id: str
    category: Category
    length: float
    width: float
    ego: bool
    flow: str | None


class PlannedColumns(Answer):
    """Planned motion: rows ``first[i]`` up to ``first[i + 1]`` belong to ``users[i]``.

    Per row a time (seconds after the start of the run), the centre of the body (metres) and its
    heading (radians); between two rows it moves straight on, evenly in time. ``left_out`` are ids
    of actors and flows that cannot be planned; ``not_planned`` is how many road users more there
    are than are planned at most.
    """

    users: list[PlannedUser]
    first: list[int]
    time: list[float]
    x: list[float]
    y: list[float]
    hdg: list[float]
    left_out: list[str]
    not_planned: int
