"""``odscen cosim --selfcheck``: what a server does of what the mirror relies on."""

from __future__ import annotations

import itertools
import platform
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.app.scenarios import read_scenario
from odscen.base.errors import CarlaReleaseError, NotFoundError, OdscenError
from odscen.base.version import __version__
from odscen.carla.selfcheck import body_checks, pace_checks
from odscen.carla.selfcheck.body_checks import BodyChecks
from odscen.carla.selfcheck.check_line import (
    CheckLimits,
    CheckState,
    SelfcheckReport,
    attempt,
    judged,
    unchecked,
)
from odscen.carla.server.batch import Batch
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import answering, import_carla
from odscen.carla.server.interruption import interrupts
from odscen.carla.server.releases import release_number
from odscen.carla.server.server_map import same_map
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.carla.selfcheck.check_line import CheckLine
    from odscen.carla.server.client import Address
    from odscen.maps.store import Workspace


# ----------------------------------------------------------------------------- checks of the world
RELEASE, MAP = "release", "map"
FRAMES, SECONDS = "frames of a tick", "seconds of a tick"
SIGNALS, STATES = "traffic lights of the map", "state of the traffic lights"
GIVEN_BACK = "given back"
TICKS = 10
"""Ticks in which the world's time is looked at."""
_HAIR = 1e-4
"""Seconds by which the time of a tick may be off."""
_LISTED = 8
_SETTINGS = (
    "synchronous_mode",
    "no_rendering_mode",
    "substepping",
    "max_substep_delta_time",
    "max_substeps",
    "deterministic_ragdolls",
    "tile_stream_distance",
    "actor_active_distance",
)


def release_line(server: Server) -> CheckLine:
    """Whether server and package are of one release."""
    with answering(server.address):
        mine = str(server.client.get_client_version())
        theirs = str(server.client.get_server_version())
    same = release_number(theirs) in (None, release_number(mine))
    return judged(RELEASE, mine, theirs, ok=same, note="; ".join(server.warnings))


def map_line(server: Server, name: str, known: str | None) -> CheckLine:
    """Whether the server's map is ours.

    Parameters
    ----------
    known
        OpenDRIVE text of the map that we have of that name, if any.
    """
    expected = f"the roads of {name}"
    if known is None:
        why = f"the catalogue has no map {name}: odscen maps pull {name} brings it"
        return unchecked(MAP, expected, why)
    shown, text = server.map_name, server.opendrive()
    if text.split() == known.split():
        return judged(MAP, expected, f"{shown}: the same text", ok=True)
    same = same_map(text, known)
    words = "the same roads, another text" if same else "other roads"
    note = "" if same else "a run would load another map, or be refused with --keep-map"
    return judged(MAP, expected, f"{shown}: {words}", ok=same, note=note)


def time_lines(server: Server, delta: float) -> list[CheckLine]:
    """By how much one tick of ours leads on; nobody else may tick."""
    world, frames, times = server.world, [], []
    with answering(server.address):
        for _ in range(TICKS + 1):
            frames.append(int(world.tick(server.address.timeout)))
            times.append(float(world.get_snapshot().timestamp.elapsed_seconds))
    steps = sorted({b - a for a, b in itertools.pairwise(frames)})
    lasted = sorted(b - a for a, b in itertools.pairwise(times))
    server.synchronize(delta)
    return [
        judged(
            FRAMES,
            "1",
            ", ".join(map(str, steps)),
            ok=steps == [1],
            note="more than one: another client ticks as well",
        ),
        judged(
            SECONDS,
            f"{delta:g} s",
            f"{lasted[0]:.4f} to {lasted[-1]:.4f} s",
            ok=lasted[0] > delta - _HAIR and lasted[-1] < delta + _HAIR,
        ),
    ]


def light_lines(server: Server) -> list[CheckLine]:
    """Whether every signal of the server's map has a light, and shows at once what it is set to."""
    expected = "a light for every signal of the OpenDRIVE file"
    try:
        roads = parse(server.opendrive().encode()).roads.values()
    except OdscenError as error:
        return [
            unchecked(SIGNALS, expected, f"the server's map cannot be read: {error}"),
            unchecked(STATES, "the state that was set", "the server's map cannot be read"),
        ]
    signals = {
        signal.id
        for road in roads
        for signal in road.signals
        if signal_kind(signal) == "traffic_light"
    }
    joined = server.take_lights()
    if not signals:
        why = "the map has no traffic lights"
        return [unchecked(SIGNALS, expected, why), unchecked(STATES, "what was set", why)]
    missing = sorted(signals - joined.keys())
    seen = f"{len(signals) - len(missing)} of {len(signals)}"
    if missing:
        more = ", ..." if len(missing) > _LISTED else ""
        seen += f"; without one: {', '.join(missing[:_LISTED])}{more}"
    mapping = judged(
        SIGNALS, expected, seen, ok=not missing, note="lights are found by their OpenDRIVE id"
    )
    wrong = {}
    for state in ("Green", "Red"):
        server.apply(Batch(signals=dict.fromkeys(joined.values(), state)))
        shown = server.light_states()
        wrong[state] = sum(shown[actor] != state for actor in joined.values())
    return [
        mapping,
        judged(
            STATES,
            "all lights show in the next tick what they are set to",
            f"{len(joined)} lights; wrong: {wrong['Green']} of green, {wrong['Red']} of red",
            ok=bool(joined) and not any(wrong.values()),
            note="a light that lags shows SUMO's state a tick late",
        ),
    ]


@dataclass(frozen=True, slots=True)
class WorldState:
    """What is to be as it was: settings, weather, whether lights are frozen, who is there."""

    settings: tuple[tuple[str, object], ...]
    weather: str
    frozen: tuple[bool, ...]
    actors: tuple[int, ...]

    @classmethod
    def of(cls, server: Server) -> WorldState:
        """State of a server's world.

        Raises
        ------
        CarlaError
            If the server does not answer.
        """
        with answering(server.address):
            world = server.world
            settings = world.get_settings()
            if not settings.synchronous_mode:
                world.wait_for_tick(server.address.timeout)
            actors = world.get_actors()
            lights = actors.filter("traffic.traffic_light*")
            return cls(
                (
                    ("fixed_delta_seconds", server.release.fixed_delta(settings)),
                    *((name, _read_setting(settings, name)) for name in _SETTINGS),
                ),
                str(world.get_weather()),
                tuple(sorted(light.is_frozen() for light in lights)),
                tuple(sorted(actor.id for actor in actors)),
            )


def given_back_line(before: WorldState, after: WorldState, left_behind: list[str]) -> CheckLine:
    """Whether the world is as it was."""
    kept = dict(before.settings)
    changed = [name for name, value in after.settings if kept[name] != value]
    if before.weather != after.weather:
        changed.append("weather")
    if before.frozen != after.frozen:
        changed.append("traffic lights frozen or not")
    added = len(set(after.actors) - set(before.actors))
    gone = len(set(before.actors) - set(after.actors))
    changed += [f"{added} actors more"] if added else []
    changed += [f"{gone} actors less"] if gone else []
    changed += left_behind
    return judged(
        GIVEN_BACK,
        "settings, weather, lights and actors as before",
        ", ".join(changed) or "as before",
        ok=not changed,
        note="simulated time has passed",
    )


def _read_setting(settings: Any, name: str) -> object:
    return getattr(settings, name, None)


# ------------------------------------------------------------------------- odscen cosim --selfcheck
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
            judged(RELEASE, mine, str(error), ok=False),
            *(unchecked(name, "-", "another release") for name in _NAMES),
        ]
        return report
    with answering(address):
        report.versions["carla"] = str(server.client.get_client_version())
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
        [GIVEN_BACK],
        lambda: [
            given_back_line(before, WorldState.of(server), server.left_behind),
        ],
    )
    return report


_NAMES = (
    MAP,
    FRAMES,
    SECONDS,
    body_checks.GROUND,
    *body_checks.BODY_NAMES,
    SIGNALS,
    STATES,
    pace_checks.PACE,
    pace_checks.GROUND_PACE,
    GIVEN_BACK,
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
        ((RELEASE,), lambda: [release_line(server)]),
        ((MAP,), lambda: [map_line(server, name, text)]),
        ((FRAMES, SECONDS), lambda: time_lines(server, DELTA)),
        ((body_checks.GROUND,), bodies.prepare),
        (body_checks.LIFT_NAMES, bodies.lifts),
        (body_checks.CAR_NAMES, bodies.car),
        (body_checks.SENSED_NAMES, bodies.sensed),
        (body_checks.WALKER_NAMES, bodies.walker),
        ((SIGNALS, STATES), lambda: light_lines(server)),
        ((pace_checks.PACE,), lambda: pace_checks.pace_lines(server, limits)),
        ((pace_checks.GROUND_PACE,), lambda: pace_checks.ground_pace_lines(server, limits)),
    )
    lines: list[CheckLine] = []
    for k, (names, check) in enumerate(checks):
        why = _explain_skipping(interrupted, lines, names)
        if why:
            lines += [unchecked(name, "-", why) for name in names]
            continue
        if notify is not None:
            notify(names[0], k / len(checks))
        lines += attempt(names, check)
    return lines


def _explain_skipping(
    interrupted: threading.Event, lines: Sequence[CheckLine], names: Sequence[str]
) -> str:
    """Why a check makes no sense any more; empty if it does."""
    if interrupted.is_set():
        return "interrupted"
    state = {line.name: line.state for line in lines}
    if state.get(FRAMES) is CheckState.DIFFERS:
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
