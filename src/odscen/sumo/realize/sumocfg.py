"""The sumocfg: everything a run needs beyond network and routes, so that plain ``sumo -c`` does it.

Paths are relative to the file. What each setting is for is said in ``docs/runs.md``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from odscen.figures.measures.conflicts import SEEN_DRAC, SEEN_PET, SEEN_TTC, WATCHED_ON
from odscen.runs.layout import (
    CLOSURES_FILE,
    MEASURES_FILE,
    NET_FILE,
    PARKING_FILE,
    POSITIONS_FILE,
    REGION_FILE,
    ROUTES_FILE,
    SIGNALS_FILE,
    SSM_FILE,
    STOPINFO_FILE,
    STOPS_FILE,
    TRAJECTORIES_FILE,
    TRIPINFO_FILE,
)
from odscen.runs.recording import REGION_ID, Recording

if TYPE_CHECKING:
    from collections.abc import Mapping

POSITIONS_EVERY = 5.0
"""Seconds between the positions of a run without trajectories, which are not kept."""

LANE_CHANGE = 3.0
"""Seconds that a change of lanes takes; Toledo and Zohar, "Modeling duration of lane changes",
Transportation Research Record 1999, 2007, have 1 to 13 s with a mean of 4.6 s.

Vehicles are on both lanes meanwhile. Slow ones take longer, see
:data:`odscen.sumo.realize.driving.LATERAL_SHARE`. SUMO's sublane model moves by itself.
"""

SQUEEZE = 120.0
"""Seconds after which persons who stand in each other's way squeeze past; SUMO waits 300 s.

Longer than a red light, at which they stand behind each other for a reason.
"""


SSM_PARAMETER = ("has.ssm.device", "true")
"""By which every vType has SUMO's SSM device: devices given by probability are gone from vehicles
that come in with a saved state."""

SSM_OPTIONS = {
    "device.ssm.measures": "TTC DRAC PET",
    "device.ssm.thresholds": f"{SEEN_TTC:g} {SEEN_DRAC:g} {SEEN_PET:g}",
    "device.ssm.range": "50",
    "device.ssm.extratime": f"{WATCHED_ON:g}",
}
"""What the SSM device measures; range in metres."""


REROUTING = {
    "device.rerouting.probability": "0",
    "device.rerouting.pre-period": "0",
    "device.rerouting.adaptation-interval": "10",
    "device.rerouting.adaptation-steps": "18",
    "device.rerouting.threshold.factor": "1.1",
}
"""Which drivers have the device is said at each; nothing is looked for before the departure.

Travel times are means of the last 3 min, and a route is changed for one that is a tenth quicker.
"""


_NOT_OF_PROJECTS = (
    "ignore-route-errors", "collision.action", "collision.mingap-factor",
    "collision.check-junctions", "intermodal-collision.action", "pedestrian.striping.jamtime",
    "lanechange.duration",
)  # fmt: skip
"""What a SUMO project has as SUMO itself has it, so that it runs as it did before."""


@dataclass(frozen=True, slots=True)
class SumocfgSettings:
    """What a sumocfg says.

    Attributes
    ----------
    until
        End of the simulation, seconds, if somebody is still under way then.
    step_length
        Seconds.
    seed
        Of SUMO's own random numbers (dawdling of drivers; speed factors are drawn by us).
    time_to_teleport
        Seconds that a vehicle may stand at the head of its lane before SUMO moves it on; 0: never.
    action_step, lateral_resolution, pedestrians
        As in :class:`~odscen.scenario.document.scenario_document.Simulation`.
    elevation
        Whether the network has heights, so that z is recorded.
    signals
        Whether there are programs of traffic lights beside the network's own.
    stops
        Whether there are stops of lines, and what vehicles do there is recorded.
    project_stops
        Whether files of a SUMO project have stops, and what vehicles do there is recorded.
    parking
        Whether trips park, and when they take and leave their places is recorded.
    closures
        Whether measures of the scenario close lanes or set limits.
    recording
        What is recorded.
    measures
        Whether ``measures.add.xml`` is there, which makes SUMO measure lanes.
    meso
        Queues on road sections instead of single vehicles that follow each other: for scale.
    informed
        Whether there are drivers who look for quicker routes on the way.
    begin
        When the simulation begins, s.
    routes, additional
        Further files, of a SUMO project.
    options
        Options of a SUMO project; ``None`` without one. With one SUMO's own defaults hold where it
        says nothing.
    """

    until: float
    step_length: float
    seed: int
    time_to_teleport: float = 300.0
    action_step: float | None = None
    lateral_resolution: float | None = None
    pedestrians: str = "striping"
    elevation: bool = False
    signals: bool = False
    stops: bool = False
    project_stops: bool = False
    parking: bool = False
    closures: bool = False
    recording: Recording = field(default_factory=Recording)
    measures: bool = False
    meso: bool = False
    informed: bool = False
    begin: float = 0.0
    routes: tuple[str, ...] = ()
    additional: tuple[str, ...] = ()
    options: Mapping[str, str] | None = None


def sumo_config(settings: SumocfgSettings) -> str:
    """Text of ``scenario.sumocfg``."""
    recording = settings.recording
    inputs = {"net-file": NET_FILE, "route-files": ",".join((*settings.routes, ROUTES_FILE))}
    additional = [*settings.additional, *([SIGNALS_FILE] if settings.signals else [])]
    if settings.stops:
        additional.append(STOPS_FILE)
    additional += [PARKING_FILE] if settings.parking else []
    additional += [CLOSURES_FILE] if settings.closures else []
    if recording.region is not None:
        additional.append(REGION_FILE)
    if settings.measures:
        additional.append(MEASURES_FILE)
    if additional:
        inputs["additional-files"] = ",".join(additional)
    sections: dict[str, dict[str, str]] = {
        "input": inputs,
        "output": _output_options(settings),
        "time": {
            "begin": f"{settings.begin:.10g}",
            "end": f"{settings.until:g}",
            "step-length": f"{settings.step_length:g}",
        },
        "processing": {
            "ignore-route-errors": "true",
            "collision.action": "warn",
            "collision.mingap-factor": "0",
            "collision.check-junctions": "true",
            "intermodal-collision.action": "warn",
            "pedestrian.model": settings.pedestrians,
            "pedestrian.striping.jamtime": f"{SQUEEZE:g}",
            "time-to-teleport": f"{settings.time_to_teleport or -1.0:g}",
            **_optional_value("default.action-step-length", settings.action_step),
            **(
                {"lanechange.duration": f"{LANE_CHANGE:g}"}
                if settings.lateral_resolution is None
                else {"lateral-resolution": f"{settings.lateral_resolution:g}"}
            ),
        },
        "random_number": {"seed": str(settings.seed)},
        "report": {
            "aggregate-warnings": "20",
            "duration-log.disable": "true",
            "no-step-log": "true",
            "xml-validation": "never",
        },
    }
    if settings.options is not None:
        own = sections["processing"]
        for name in _NOT_OF_PROJECTS:
            own.pop(name, None)
        own |= {name: value for name, value in settings.options.items() if name not in own}
    if settings.informed:
        given = settings.options or {}
        sections["routing"] = {n: v for n, v in REROUTING.items() if n not in given}
    if recording.criticality:
        sections["ssm_device"] = {**SSM_OPTIONS, "device.ssm.file": SSM_FILE}
    if settings.meso:
        sections["mesoscopic"] = {
            "mesosim": "true",
            "meso-junction-control": "true",
            "meso-interpolate-pos": "true",
        }
        # The striping model needs lanes with places on them, which meso does not keep.
        sections["processing"]["pedestrian.model"] = "nonInteracting"
        for option in ("lateral-resolution", "lanechange.duration"):
            sections["processing"].pop(option, None)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<sumoConfiguration>"]
    for section, options in sections.items():
        lines.append(f"    <{section}>")
        lines.extend(
            f"        <{name} value={quoteattr(value)}/>" for name, value in options.items()
        )
        lines.append(f"    </{section}>")
    return "\n".join([*lines, "</sumoConfiguration>"]) + "\n"


def _optional_value(option: str, value: float | None) -> dict[str, str]:
    return {} if value is None else {option: f"{value:g}"}


def _output_options(settings: SumocfgSettings) -> dict[str, str]:
    recording = settings.recording
    trips = {
        "tripinfo-output": TRIPINFO_FILE,
        "tripinfo-output.write-unfinished": "true",
        "precision": "4",
    }
    if settings.stops or settings.project_stops or settings.parking:
        unended = {"stop-output.write-unfinished": "true"} if settings.parking else {}
        trips = {"stop-output": STOPINFO_FILE, **unended, **trips}
    if not recording.trajectories:
        return {**(_position_options() if settings.measures and not settings.meso else {}), **trips}
    outputs = {
        "fcd-output": TRAJECTORIES_FILE,
        "fcd-output.attributes": ",".join(recording.attributes(elevation=settings.elevation)),
        "fcd-output.skip-empty": "true",
    }
    if recording.every is not None:
        outputs["device.fcd.period"] = f"{recording.every:g}"
    if recording.region is not None:
        outputs["fcd-output.filter-shapes"] = REGION_ID
    return {**outputs, **trips}


def _position_options() -> dict[str, str]:
    """Positions now and then, from which the parts of lanes have their shares."""
    return {
        "fcd-output": POSITIONS_FILE,
        "fcd-output.attributes": "id,lane,pos,speed",
        "fcd-output.skip-empty": "true",
        "device.fcd.period": f"{POSITIONS_EVERY:g}",
    }
