"""``odscen cosim --selfcheck``: what a server does of what the mirror relies on."""

from __future__ import annotations

import platform
from typing import TYPE_CHECKING

from odscen.app.scenarios import read_scenario
from odscen.base.errors import CarlaReleaseError, NotFoundError
from odscen.base.version import __version__
from odscen.carla.selfcheck import body_checks, pace_checks, world_checks
from odscen.carla.selfcheck.body_checks import BodyChecks
from odscen.carla.selfcheck.check_line import (
    CheckLimits,
    CheckState,
    SelfcheckReport,
    attempt,
    judged,
    unchecked,
)
from odscen.carla.selfcheck.world_checks import WorldState
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import answering, import_carla
from odscen.carla.server.interruption import interrupts

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.carla.selfcheck.check_line import CheckLine
    from odscen.carla.server.client import Address
    from odscen.maps.store import Workspace

DELTA = 0.05
"""Seconds of a tick."""
Check = tuple["Sequence[str]", "Callable[[], list[CheckLine]]"]


def selfcheck(
    workspace: Workspace,
    address: Address,
    *,
    scenario: Path | None = None,
    limits: CheckLimits | None = None,
    notify: Callable[[str, float], None] | None = None,
) -> SelfcheckReport:
    """Measure on a server what the mirror relies on; the world is as it was afterwards.

    No map is loaded. Simulated time passes, some 15 s of it.

    Parameters
    ----------
    scenario
        Whose map the server's is compared with; else the catalogue's of the same name.
    limits
        By how much the server may differ.
    notify
        Called with what is checked next, and with the share that is done.

    Raises
    ------
    MissingDependencyError
        If the package ``carla`` is not installed.
    CarlaError
        If there is no server.
    """
    within = limits or CheckLimits()
    wanted = _map_of(workspace, scenario)
    report = SelfcheckReport(str(address), _package_versions())
    try:
        server = Server(address)
    except CarlaReleaseError as error:
        mine = report.versions["carla"]
        report.lines = [
            judged(world_checks.RELEASE, mine, str(error), ok=False),
            *(unchecked(name, "-", "another release") for name in _NAMES),
        ]
        return report
    with answering(address):
        report.versions["server"] = str(server.client.get_server_version())
    before = None
    with interrupts() as interrupted, server:
        report.map = server.map_name
        before = WorldState.of(server)
        server.synchronize(DELTA)
        before = _with_actors(before, WorldState.of(server))
        name, text = wanted or _find_known_map(workspace, report.map)
        report.lines = _run_all_checks(server, within, name, text, interrupted, notify)
        report.interrupted = interrupted.is_set()
    report.lines += attempt(
        [world_checks.GIVEN_BACK],
        lambda: [
            world_checks.given_back_line(before, WorldState.of(server), server.left_behind),
        ],
    )
    return report


_NAMES = (
    world_checks.MAP,
    world_checks.FRAMES,
    world_checks.SECONDS,
    body_checks.GROUND,
    *body_checks.BODY_NAMES,
    world_checks.SIGNALS,
    world_checks.STATES,
    pace_checks.PACE,
    pace_checks.GROUND_PACE,
    world_checks.GIVEN_BACK,
)
"""Of all lines behind the first."""


def _run_all_checks(
    server: Server,
    limits: CheckLimits,
    name: str,
    text: str | None,
    interrupted: threading.Event,
    notify: Callable[[str, float], None] | None,
) -> list[CheckLine]:
    bodies = BodyChecks(server, limits, DELTA)
    checks: tuple[Check, ...] = (
        ((world_checks.RELEASE,), lambda: [world_checks.release_line(server)]),
        (_NAMES[:1], lambda: [world_checks.map_line(server, name, text)]),
        (_NAMES[1:3], lambda: world_checks.time_lines(server, DELTA)),
        (_NAMES[3:4], bodies.prepare),
        (_NAMES[4:6], bodies.lifts),
        (_NAMES[6:10], bodies.car),
        (_NAMES[10:12], bodies.sensed),
        (_NAMES[12:14], bodies.walker),
        (_NAMES[14:16], lambda: world_checks.light_lines(server)),
        (_NAMES[16:17], lambda: pace_checks.pace_lines(server, limits)),
        (_NAMES[17:18], lambda: pace_checks.ground_pace_lines(server, limits)),
    )
    lines: list[CheckLine] = []
    for k, (names, check) in enumerate(checks):
        why = _why_not(interrupted, lines, names)
        if why:
            lines += [unchecked(name, "-", why) for name in names]
            continue
        if notify is not None:
            notify(names[0], k / len(checks))
        lines += attempt(names, check)
    return lines


def _why_not(interrupted: threading.Event, lines: Sequence[CheckLine], names: Sequence[str]) -> str:
    """Why a check makes no sense any more; empty if it does."""
    if interrupted.is_set():
        return "interrupted"
    state = {line.name: line.state for line in lines}
    if state.get(world_checks.FRAMES) is CheckState.DIFFERS:
        return "the ticks are not ours alone"
    ended = [line for line in lines if line.name == body_checks.GROUND and "ended" in line.note]
    if ended and set(names) & set(_NAMES[4:14]):
        return "there is no place for a car and a walker"
    return ""


def _map_of(workspace: Workspace, scenario: Path | None) -> tuple[str, str | None] | None:
    """Name and OpenDRIVE text of a scenario's map."""
    if scenario is None:
        return None
    reference = read_scenario(scenario).map
    entry = workspace.map_for(reference.name, reference.sha256)
    return entry.name, entry.read("xodr").decode()


def _find_known_map(workspace: Workspace, name: str) -> tuple[str, str | None]:
    """The catalogue's map of a name, if there is one."""
    try:
        return name, workspace.map(name).read("xodr").decode()
    except NotFoundError:
        return name, None


def _with_actors(before: WorldState, now: WorldState) -> WorldState:
    """Settings as they were; actors as a tick has shown them, for without one none are known."""
    return WorldState(before.settings, before.weather, now.frozen, now.actors)


def _package_versions() -> dict[str, str]:
    carla = import_carla()
    package = str(getattr(carla, "__version__", "")) or _distribution_version()
    return {
        "carla": package,
        "odscen": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
    }


def _distribution_version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("carla")
    except PackageNotFoundError:
        return "unknown"
