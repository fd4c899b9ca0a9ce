"""The texts of the live view, told apart by ``type``; see ``docs/server.md``.

They go over a WebSocket, of which OpenAPI knows nothing: :data:`LiveMessage` is put among the
components of the schema by :mod:`odscen.web.application`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import orjson
from pydantic import Field

from odscen.base.categories import Category
from odscen.sumo.worker.snapshots import origin
from odscen.web.messages import Answer
from odscen.web.wire.run_messages import IncidentInfo, RunState

if TYPE_CHECKING:
    from odscen.records.run_plan import Plan


class LiveActor(Answer):
    """A road user that will ever be in a frame, and the row by which frames name them; metres."""

    index: int
    id: str
    category: Category
    model: str | None
    length: float
    width: float
    ego: bool
    flow: str | None
    depart: float


class LiveHello(Answer):
    """What the run is, once; ``origin`` is what is subtracted from all x and y in frames.

    Made by :func:`introduction` without this class, for it may be large.
    """

    type: Literal["hello"] = "hello"
    scenario: str
    until: float
    step_length: float
    origin: tuple[float, float]
    actors: list[LiveActor]


class LiveState(Answer):
    """What the run does now, and how fast it is to go; ``None`` is as fast as it can."""

    type: Literal["state"] = "state"
    state: RunState
    speed: float | None


class LiveLights(Answer):
    """Traffic lights that have changed, by id: a letter per link as SUMO writes it."""

    type: Literal["lights"] = "lights"
    lights: dict[str, str]


class LiveDetectors(Answer):
    """Detectors of traffic lights that road users came onto or left, by id: whether on them now."""

    type: Literal["detectors"] = "detectors"
    detectors: dict[str, bool]


class LiveIncidents(Answer):
    """What has happened since the last of these."""

    type: Literal["events"] = "events"
    events: list[IncidentInfo]


class LiveEnd(Answer):
    """The run has ended; nothing follows."""

    type: Literal["end"] = "end"
    state: RunState
    error: str | None


LiveMessage = Annotated[
    LiveHello | LiveState | LiveLights | LiveDetectors | LiveIncidents | LiveEnd,
    Field(discriminator="type"),
]
"""Any text that the server sends."""


def introduction(plan: Plan) -> str:
    """Introduce every road user that will ever be in a frame.

    A :class:`~odscen.web.wire.live_messages.LiveHello`, but written at once: a day in a town has
    tens of thousands of actors.
    """
    names = [name for name in LiveActor.model_fields if name != "index"]
    hello = {
        "type": "hello",
        "scenario": plan.scenario,
        "until": plan.until,
        "step_length": plan.step_length,
        "origin": origin(plan),
        "actors": [
            {"index": index, **{name: getattr(actor, name) for name in names}}
            for index, actor in enumerate(plan.actors)
        ],
    }
    return orjson.dumps(hello).decode()
