"""SUMO's run kept step by step, and what another simulator makes of it, as a run and compared."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.arrays import offsets
from odscen.convert.lane_table.table_json import table_from_json
from odscen.drawing.map_drawing import MapDrawing
from odscen.runs.reporter import Progress
from odscen.simulators.parity_files import PARITY_STATES, write_parity
from odscen.simulators.positions import Position, PositionRecord
from odscen.sumo.runner.elevation import ElevationLookup
from odscen.sumo.runner.in_step import InStep
from odscen.sumo.runner.run_jobs import simulate

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence
    from pathlib import Path

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.runs.new_run import PreparedRun, SimulationOutcome
    from odscen.runs.reporter import Reporter
    from odscen.sumo.realize.run_map import RunMap
    from odscen.sumo.runner.in_step import Step
    from odscen.sumo.runner.run_folder import SumoPreparedRun

APART = 2.0
"""Seconds without a contact after which one of the same two is another collision."""


class SumoTracks(NamedTuple):
    """Where SUMO had road users, as of :class:`~odscen.sumo.runner.in_step.Step`, step by step."""

    times: FloatArray
    start: IntArray
    row: IntArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    speed: FloatArray

    @classmethod
    def of(cls, steps: Sequence[Step]) -> SumoTracks:
        """All steps, one after the other."""

        def join(name: str) -> Any:
            parts = [getattr(step, name) for step in steps]
            return np.concatenate(parts) if parts else np.empty(0)

        return cls(
            np.array([step.time for step in steps], dtype=np.float64),
            offsets([len(step.index) for step in steps]),
            join("index").astype(np.int64),
            *(join(name).astype(np.float64) for name in ("x", "y", "z", "hdg", "speed")),
        )

    @property
    def when(self) -> FloatArray:
        """Time of each row, s."""
        return np.repeat(self.times, np.diff(self.start))


def simulate_tracked(
    sumo: SumoPreparedRun, on: RunMap, place: Path, reporter: Reporter
) -> tuple[SimulationOutcome, SumoTracks]:
    """Run SUMO in a folder of its own, which is made, and keep where all are after each step."""
    place.mkdir()
    sumo.write(place)
    table = table_from_json(on.file("lane_table").read_bytes())
    steps: list[Step] = []
    live = InStep(sumo.plan, ElevationLookup(on.graph, table), steps.append)
    outcome = simulate(sumo, place, reporter=reporter, live=live)
    return outcome, SumoTracks.of(steps)


class ShownUser(NamedTuple):
    """Where another simulator has a road user.

    Attributes
    ----------
    row
        In the plan.
    x, y, z, hdg
        Centre of the body, the ground below it for z; OpenDRIVE frame, metres, rad.
    speed
        m/s.
    """

    row: int
    x: float
    y: float
    z: float
    hdg: float
    speed: float


class ShownRun:
    """What another simulator shows, as records of a run and beside what SUMO had.

    Parameters
    ----------
    prepared
        With the plan whose rows are meant.
    tracks
        SUMO's.
    shown_by
        What people call the simulator.
    compared
        Rows that it is to show; all if not given.
    """

    def __init__(
        self,
        prepared: PreparedRun,
        on: RunMap,
        tracks: SumoTracks,
        shown_by: str,
        *,
        compared: Collection[int] | None = None,
    ) -> None:
        self._plan, self._on, self._tracks = prepared.plan, on, tracks
        self._shown_by, self._compared = shown_by, compared
        self._record = PositionRecord(prepared)
        self._rows: list[np.ndarray] = []
        self._touched: Counter[tuple[int, int]] = Counter()
        self._touching: dict[tuple[int, int], float] = {}
        self._seen: set[int] = set()
        self._here: list[int] = []
        self._time = 0.0
        self.steps = 0

    def take(
        self, time: float, users: Sequence[ShownUser], contacts: Iterable[Sequence[int]]
    ) -> None:
        """Take a step down: who is where at a time, s, and which rows touch each other."""
        self._time = time
        names = [self._plan.actors[user.row].id for user in users]
        self._record.add(
            time,
            [
                Position(name, user.x, user.y, user.hdg, user.speed, user.z)
                for name, user in zip(names, users, strict=True)
            ],
        )
        states = [(time, user.row, user.x, user.y, user.z, user.hdg) for user in users]
        self._rows.append(np.array(states, dtype=np.float64).reshape(-1, 6))
        self._take_contacts({user.row: (user.x, user.y) for user in users}, contacts)
        self._here = [user.row for user in users]
        self._seen.update(self._here)
        self.steps += 1

    def _take_contacts(
        self, places: dict[int, tuple[float, float]], contacts: Iterable[Sequence[int]]
    ) -> None:
        """Record each contact when it begins; between those who are still there."""
        now = {(min(pair), max(pair)) for pair in contacts}
        for row, other in sorted(now):
            self._touched[row, other] += 1
            last = self._touching.get((row, other), -math.inf)
            self._touching[row, other] = self._time
            if self._time - last < APART or not {row, other} <= places.keys():
                continue
            x, y = np.mean([places[row], places[other]], axis=0).tolist()
            names = self._plan.actors[row].id, self._plan.actors[other].id
            self._record.collide(self._time, *names, x, y)

    def progress(self) -> Progress:
        """How far the simulator is."""
        running = len(self._here)
        arrived = len(self._seen) - running
        planned = len(self._plan.actors)
        return Progress(self._time, self._plan.until, running, len(self._seen), arrived, planned)

    def write(self, folder: Path) -> SimulationOutcome:
        """Write the records, and how far both simulators agree."""
        import polars as pl

        outcome = self._record.write(folder)
        tracks = self._tracks
        sumo = pl.DataFrame(
            {"time": tracks.when.round(6), "row": tracks.row}
            | {name: getattr(tracks, name) for name in ("x", "y", "z", "hdg")}
        )
        if self._compared is not None:
            sumo = sumo.filter(pl.col("row").is_in(sorted(self._compared)))
        columns = ("time", "row", "carla_x", "carla_y", "carla_z", "carla_hdg")
        shown = pl.DataFrame(
            np.concatenate([np.empty((0, 6)), *self._rows]), schema=columns, orient="row"
        ).with_columns(pl.col("row").cast(pl.Int64))
        states = sumo.join(shown, on=["time", "row"], how="left", maintain_order="left")
        states = states.with_columns(pl.col(columns[2:]).fill_null(float("nan")))
        drawing = MapDrawing.from_json(self._on.file("drawing").read_bytes())
        write_parity(
            folder,
            states.select(PARITY_STATES),
            None,
            self._plan,
            drawing,
            shown_by=self._shown_by,
        )
        return outcome

    def notes(self) -> list[str]:
        """Who touched whom."""
        plan, shown_by = self._plan, self._shown_by
        words = []
        for (row, other), count in sorted(self._touched.items()):
            name, partner = plan.actors[row].id, plan.actors[other].id
            seconds = f"{count * plan.step_length:.1f}"
            words.append(f"{name} touched {partner} in {shown_by} for {seconds} s")
        return words
