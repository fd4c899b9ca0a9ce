"""Completes slices beside the worker: ``python -m odscen.sumo.worker.completer RUN FD``.

A process and not a thread: libsumo holds Python's lock while it steps, so that a thread of the
worker would slow down the simulation and be slow itself. What became of each actor is kept here
too, so that the results of 50,000 actors are there soon after the last slice. Started by
:class:`odscen.sumo.worker.completion.Completion` only, with a connection as FD.
"""

from __future__ import annotations

import gc
import sys
from dataclasses import dataclass, replace
from itertools import chain
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import OdscenError
from odscen.figures.measures.summary import Outcomes
from odscen.records.run_events import Event, event_from_line, event_line
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.checkpoint import (
    EVENTS_LINES,
    STATE_FILE,
    Checkpoint,
    check_state,
    complete,
    fingerprints,
    last_number,
    recorded_part,
    slice_folder,
)
from odscen.runs.parts import tidy_part
from odscen.runs.run_status import write_status
from odscen.sumo.outputs.conflict_files import tidy_conflicts
from odscen.sumo.outputs.output_tables import tidy_outputs, tidy_positions, trips_in, write_results
from odscen.sumo.outputs.signal_log import tidy_signals

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.figures.measures.summary import Trip

_CONTENTS = (STATE_FILE, EVENTS_LINES, *layout.RECORDED)


@dataclass(frozen=True, slots=True)
class WrittenSlice:
    """A slice that SUMO has written into ``part``, and that is not complete.

    Attributes
    ----------
    checkpoint
        Without ``files``.
    events
        What has happened in it.
    lengths
        Of lanes for vehicles by edge, metres.
    lanes
        How many vehicles came in on each lane with the state.
    parked
        Those who came in with it in the places that their trips have ended in.
    """

    part: Path
    checkpoint: Checkpoint
    events: list[Event]
    lengths: Mapping[str, Mapping[str, float]]
    lanes: Mapping[str, int]
    parked: frozenset[str] = frozenset()

    def complete(self, plan: Plan, run: Path) -> None:
        """Tidy what SUMO has written and make the slice complete."""
        part, last = self.part, self.checkpoint.last
        with (part / EVENTS_LINES).open("w", encoding="utf-8") as out:
            out.writelines(event_line(event) + "\n" for event in self.events)
        if not last:
            check_state(part / STATE_FILE)
        tidy_part(part / layout.TRAJECTORIES_FILE)
        tidy_outputs(part, self.lengths, plan, present=self.lanes, parked=self.parked, last=last)
        tidy_positions(part, run)
        tidy_conflicts(part, plan)
        tidy_signals(part)
        checkpoint = replace(self.checkpoint, files=fingerprints(part, _CONTENTS))
        complete(run, part, checkpoint)
        write_status(run, plan, checkpoint)


def main() -> int:
    """Complete slices for as long as a worker asks for it; 0 when it asked for the results."""
    run, connection = Path(sys.argv[1]), Connection(int(sys.argv[2]))
    plan = Plan.from_json((run / layout.PLAN_FILE).read_text(encoding="utf-8"))
    outcomes = Outcomes(plan)
    gc.freeze()  # plan and outcomes stay, and need not be gone through again and again
    for number in range(1, last_number(run) + 1):
        outcomes.hear(*_read_slice(run, number))
    while True:
        outcomes.settle()  # while the worker simulates
        try:
            written: WrittenSlice | None = connection.recv()
        except (EOFError, ConnectionError):  # the worker is gone; what it asked for is done
            return 1
        try:
            if written is None:
                _write_results(run, outcomes)
            else:
                written.complete(plan, run)
                outcomes.hear(*_read_slice(run, written.checkpoint.number))
        except (OdscenError, OSError) as error:
            connection.send(error)
            return 1
        connection.send(None)
        if written is None:
            return 0


def _read_slice(run: Path, number: int) -> tuple[Iterator[Event], dict[str, Trip]]:
    """Events and trips of a complete slice, from its files: the same in a run that was resumed."""
    lines = _event_lines(run, number)
    return map(event_from_line, lines), trips_in(recorded_part(run, layout.TRIPS_FILE, number))


def _event_lines(run: Path, number: int) -> Iterator[str]:
    with (slice_folder(run, number) / EVENTS_LINES).open(encoding="utf-8") as lines:
        for line in lines:
            yield line.rstrip("\n")


def _write_results(run: Path, outcomes: Outcomes) -> None:
    """Write events and actors of the whole run."""
    lines = chain.from_iterable(_event_lines(run, n) for n in range(1, last_number(run) + 1))
    write_results(run, lines, outcomes.rows())


if __name__ == "__main__":
    sys.exit(main())
