"""When which plan of the day is active in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.scenario.signals.program_design import TimedPlan

DAY = 86_400.0


def active_plans(
    plans: Iterable[TimedPlan], *, clock: float, until: float | None
) -> tuple[tuple[float, str], ...]:
    """Plans of a run and the seconds after its start from which on they are to run.

    The first begins at 0: what is active at ``clock``. Every day is alike.

    Parameters
    ----------
    clock
        Time of day at the start, seconds.
    until
        Seconds that the run lasts; a day if not given.
    """
    listed = list(plans)
    begins = sorted((time, plan.id) for plan in listed for time in plan.times)
    if not begins:
        return ((0.0, listed[0].id),)
    end = DAY if until is None else until
    now = [name for time, name in begins if time <= clock] or [begins[-1][1]]
    found = [(0.0, now[-1])]
    days = range(int((clock + end) // DAY) + 1)
    for day in days:
        for time, name in begins:
            after = day * DAY + time - clock
            if 0.0 < after < end and name != found[-1][1]:
                found.append((after, name))
    return tuple(found)
