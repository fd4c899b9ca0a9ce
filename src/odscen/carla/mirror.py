"""What to do in a tick so that a server shows a step of SUMO's: pure planning, no server needed.

A :class:`Mirror` knows which actor on the server represents which road user. Each tick it turns
where road users are into a :class:`~odscen.carla.batch.Batch`, and learns what came of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.frames import XodrPose, xodr_to_carla
from odscen.carla.batch import ActorPlace, Batch, Move, Shine, Spawn, Velocity
from odscen.carla.blueprints import Shape
from odscen.carla.nearby import Nearby
from odscen.sumo.runner.in_step import Step
from odscen.sumo.worker.snapshots import VehicleSignal

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.results.records.run_records import Plan

ROLE = "odscen."
"""Beginning of the ``role_name`` of every actor that we make; its id in the scenario follows."""
LIFTS = (0.0, 0.3, 1.0)
"""Metres above its place at which a spawn is tried, one after the other."""
PAUSE = 10
"""Ticks between two more tries, once all lifts were refused."""
JUMP = 12.0
"""Metres that a road user moves in a step more than driving takes: a teleport, shown as one."""

POSITION, LOW_BEAM, HIGH_BEAM, BRAKE, RIGHT, LEFT, FOG, SIREN = 1, 2, 4, 8, 16, 32, 128, 512
"""Bits of CARLA's ``VehicleLightState``; the siren's light is its ``Special1``."""

_NO_SHAPE = Shape((0.0, 0.0, 0.0))


@dataclass(slots=True)
class Refusal:
    """A road user whom the server would not take, and why in its own words."""

    actor: str
    tries: int
    reason: str


class Mirror:
    """Which actor represents which road user.

    Parameters
    ----------
    blueprints
        One for each actor of the plan.
    shapes
        Bounding boxes by blueprint.
    nearby
        Who is shown.
    lights
        Lights that every vehicle has on, by night or in fog.
    left_out
        Row of the plan of the one who is driven in CARLA.

    Attributes
    ----------
    refusals
        By row of the plan; those who were taken at last are not in it.
    spawned
        How many actors have been made so far.
    """

    def __init__(
        self,
        plan: Plan,
        blueprints: Sequence[str],
        shapes: Mapping[str, Shape],
        *,
        nearby: Nearby | None = None,
        lights: int = 0,
        left_out: int | None = None,
    ) -> None:
        self.refusals: dict[int, Refusal] = {}
        self.spawned = 0
        self._plan = plan
        self._blueprints = tuple(blueprints)
        self._walks = np.array([actor.person for actor in plan.actors], dtype=np.bool_)
        self._ego = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
        self._left_out = left_out
        self._nearby = nearby or Nearby()
        self._lights = lights
        known = [shapes.get(name, _NO_SHAPE) for name in self._blueprints]
        self._ahead = np.array([shape.centre[0] for shape in known])
        self._height = np.array([shape.extent[2] - shape.centre[2] for shape in known])
        self._actor: dict[int, int] = {}
        self._flags: dict[int, int] = {}
        self._wait: dict[int, int] = {}
        self._asked: tuple[int, ...] = ()
        self._last: Step | None = None

    @property
    def actors(self) -> Mapping[int, int]:
        """Actor on the server for each row of the plan that is shown."""
        return self._actor

    def batches(self, step: Step, ticks: int) -> Iterator[Batch]:
        """Plan the ticks between the last step and this one; the last of them is exactly it.

        After each batch :meth:`answered` is to be called before the next one is taken.
        """
        wanted = self._wanted(step)
        last, self._last = self._last, step
        for tick in range(1, ticks + 1):
            if tick == ticks:
                yield self._batch(step, wanted, whole=True)
            elif last is not None:
                shown = between(last, step, tick / ticks)
                yield self._batch(shown, self._shown(shown), whole=False)
            else:
                yield Batch()

    def answered(self, answers: Sequence[int | str]) -> None:
        """Learn what came of the spawns of the last batch: an actor's id, or why there is none."""
        for row, answer in zip(self._asked, answers, strict=True):
            if isinstance(answer, int):
                self._actor[row] = answer
                self.spawned += 1
                self.refusals.pop(row, None)
                continue
            self._flags.pop(row, None)
            refusal = self.refusals.setdefault(row, Refusal(self._plan.actors[row].id, 0, answer))
            refusal.tries += 1
            refusal.reason = answer
            if refusal.tries >= len(LIFTS):
                self._wait[row] = PAUSE
        self._asked = ()

    def _wanted(self, step: Step) -> np.ndarray:
        wanted = self._nearby.chosen(step.x, step.y, self._shown(step), self._centre(step))
        if self._left_out is not None:
            wanted &= step.index != self._left_out
        return wanted

    def _shown(self, step: Step) -> np.ndarray:
        return np.array([row in self._actor for row in step.index.tolist()], dtype=np.bool_)

    def _centre(self, step: Step) -> tuple[float, float] | None:
        if self._ego is None:
            return None
        found = np.flatnonzero(step.index == self._ego)
        return (float(step.x[found[0]]), float(step.y[found[0]])) if len(found) else None

    def _batch(self, step: Step, here: np.ndarray, *, whole: bool) -> Batch:
        """Plan one tick; who comes and who goes does so when the step is ``whole``."""
        rows = step.index[here].tolist()
        gone = sorted(self._actor.keys() - set(rows)) if whole else []
        destroy = tuple(self._actor.pop(row) for row in gone)
        for row in gone:
            self._flags.pop(row, None)
        places, velocities = self._places(step, here)
        speeds = step.speed[here].tolist()
        flags = self._all_flags(step.signals[here])
        moves, shines, spawns, asked = [], [], [], []
        for number, row in enumerate(rows):
            actor, walks = self._actor.get(row), bool(self._walks[row])
            at, velocity, speed = places[number], velocities[number], speeds[number]
            own = 0 if walks else flags[number]
            if actor is not None:
                moves.append(Move(actor, at, velocity, speed, walks))
                if not walks and self._flags.get(row) != own:
                    self._flags[row] = own
                    shines.append(Shine(actor, own))
            elif whole and self._may_try(row):
                self._flags[row] = own
                asked.append(row)
                spawns.append(
                    Spawn(
                        self._blueprints[row],
                        ROLE + self._plan.actors[row].id,
                        at,
                        velocity,
                        speed,
                        walks,
                        self._lift(row),
                        own,
                    )
                )
        self._asked = tuple(asked)
        return Batch(destroy, tuple(spawns), tuple(moves), tuple(shines))

    def _places(self, step: Step, here: np.ndarray) -> tuple[list[ActorPlace], list[Velocity]]:
        """Origins of the actors: the box's middle is where the body centre is.

        A vehicle's origin is on the ground, a walker's half its height above; walkers are upright.
        """
        index = step.index[here]
        walks = self._walks[index]
        pitch = np.where(walks, 0.0, step.pitch[here])
        hdg = step.hdg[here]
        level, ahead = np.cos(pitch), self._ahead[index]
        pose = xodr_to_carla(
            XodrPose(
                step.x[here] - ahead * level * np.cos(hdg),
                step.y[here] - ahead * level * np.sin(hdg),
                step.z[here] - ahead * np.sin(pitch) + np.where(walks, self._height[index], 0.0),
                hdg,
                pitch,
            )
        )
        speed = step.speed[here]
        columns = np.column_stack([pose.x, pose.y, pose.z, pose.pitch_deg, pose.yaw_deg])
        velocity = np.column_stack(
            [
                speed * level * np.cos(hdg),
                -speed * level * np.sin(hdg),
                speed * np.sin(step.pitch[here]),
            ]
        )
        return (
            [ActorPlace(*values) for values in columns.tolist()],
            [Velocity(*values) for values in velocity.tolist()],
        )

    def _all_flags(self, signals: np.ndarray) -> list[int]:
        hazard = signals & VehicleSignal.BLINKER_EMERGENCY
        flags = np.full(len(signals), self._lights)
        flags += BRAKE * ((signals & VehicleSignal.BRAKE) > 0)
        flags += RIGHT * (((signals & VehicleSignal.BLINKER_RIGHT) | hazard) > 0)
        flags += LEFT * (((signals & VehicleSignal.BLINKER_LEFT) | hazard) > 0)
        # Lights of the time of day are on already; a rule may switch on more.
        flags |= LOW_BEAM * ((signals & VehicleSignal.FRONT) > 0)
        flags |= FOG * ((signals & VehicleSignal.FOG) > 0)
        flags += HIGH_BEAM * ((signals & VehicleSignal.HIGH_BEAM) > 0)
        flags += SIREN * ((signals & VehicleSignal.EMERGENCY_BLUE) > 0)
        listed: list[int] = flags.tolist()
        return listed

    def _may_try(self, row: int) -> bool:
        left = self._wait.get(row, 0)
        if left:
            self._wait[row] = left - 1
        return not left

    def _lift(self, row: int) -> float:
        refusal = self.refusals.get(row)
        return LIFTS[refusal.tries % len(LIFTS)] if refusal else LIFTS[0]


def between(last: Step, step: Step, share: float) -> Step:
    """All who are in both steps, so much of the way from one to the other.

    Headings turn the short way. Who has jumped stays where it was until the step is complete.
    """
    _, old, new = np.intersect1d(last.index, step.index, return_indices=True)
    dx, dy = step.x[new] - last.x[old], step.y[new] - last.y[old]
    usual = (step.speed[new] + last.speed[old]) * max(step.time - last.time, 0.0)
    part = np.where(np.hypot(dx, dy) > usual + JUMP, 0.0, share)
    turn = np.mod(step.hdg[new] - last.hdg[old] + np.pi, 2 * np.pi) - np.pi
    return Step(
        time=last.time + share * (step.time - last.time),
        index=step.index[new],
        ids=step.ids[new],
        x=last.x[old] + part * dx,
        y=last.y[old] + part * dy,
        z=last.z[old] + part * (step.z[new] - last.z[old]),
        hdg=last.hdg[old] + part * turn,
        pitch=last.pitch[old] + part * (step.pitch[new] - last.pitch[old]),
        speed=last.speed[old] + part * (step.speed[new] - last.speed[old]),
        signals=last.signals[old],
        lights=last.lights,
    )
