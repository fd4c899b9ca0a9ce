"""A day of traffic on a whole map, made in the background: with a trial it takes minutes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from odscen.app.demand import demands
from odscen.app.demand.sized_demand import sized
from odscen.base.atomic_folders import scratch_folder
from odscen.base.text_files import write_text
from odscen.maps.allowances import for_trial_runs
from odscen.maps.child_process import work_in_child
from odscen.scenario.document.json_form import dumps, loads
from odscen.web.jobs import JobResult
from odscen.web.messages import DayMade

if TYPE_CHECKING:
    from odscen.maps.store import ProgressCallback
    from odscen.web.messages import WholeDay
    from odscen.web.services import Services

_CHILD = "odscen.web.large.child_requests:whole_day"


def make_day(
    shared: Services, name: str, wish: WholeDay, *, progress: ProgressCallback
) -> JobResult:
    """Give a scenario a day of traffic, made and tried in a child.

    Raises
    ------
    ConflictError
        If the scenario was changed, before or meanwhile.
    InputError, ScenarioError
        If no such day is possible.
    """
    large = shared.large is not None and shared.large.is_large(name)
    with scratch_folder() as scratch:
        day = work_in_child(
            _CHILD,
            what=f"making a day of traffic for scenario {name!r}",
            arguments={
                "workspace": str(shared.workspace.root),
                "name": name,
                "wish": wish.model_dump(mode="json"),
                "made": None if large else f"{scratch}/made",
            },
            folders=(scratch,),
            allowance=for_trial_runs(),
            progress=progress,
        )
        if not large:
            text = Path(scratch, "made").read_text(encoding="utf-8")
            shared.drafts.change(name, wish.version, _label_of_day(wish), lambda _: loads(text))
    return JobResult(name, day=DayMade(**day))


def day_made(
    shared: Services,
    name: str,
    wish: WholeDay,
    *,
    made: Path | None,
    progress: ProgressCallback,
) -> DayMade:
    """Make the day: written to the file ``made``, else into the scenario."""
    progress("spreading trips over the map", 0.0)
    scenario = shared.drafts.of_version(name, wish.version).scenario
    scenario, load = demands.with_whole_day(
        shared.map_of(scenario), scenario, trips=wish.trips, day=wish.day
    )
    found = None
    if wish.trial:
        tried: list[str] = []

        def tell(words: str) -> None:
            tried.append(words)
            progress(words, len(tried) / (len(tried) + 2))  # how many there will be, nobody knows

        progress("trying the busiest hour", 0.0)
        scenario, sizing = sized(shared.workspace, scenario, only=wish.day, tell=tell)
        load, found = load.times(sizing.share), sizing.words
    if made is None:
        shared.drafts.change(name, wish.version, _label_of_day(wish), lambda _: scenario)
    else:
        write_text(made, dumps(scenario))
    return DayMade(found=found, **load._asdict())


def _label_of_day(wish: WholeDay) -> str:
    return f"A {wish.day} of the whole town"
