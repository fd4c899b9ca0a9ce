"""A scenario in SUMO and CARLA at once: SUMO drives, the server shows every step of it."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.app.running.runs import carry_out, check_file, prepare_run
from odscen.carla.mirror.cosim_report import CosimReport
from odscen.carla.mirror.mirrored import MirroredPlan
from odscen.carla.mirror.run_witnesses import RunWitnesses
from odscen.carla.mirror.step_clock import FollowedTicks, OwnTicks
from odscen.carla.mirror.step_show import StepShow
from odscen.carla.server.carla_server import Server
from odscen.carla.server.interruption import interrupts
from odscen.carla.server.server_map import ensure_map
from odscen.convert.lane_table.light_heads import Heads
from odscen.runs.run_settings import AS_DESIGNED
from odscen.sumo.runner.elevation import ElevationLookup
from odscen.sumo.runner.in_step import InStep

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.carla.mirror.cosim_options import CosimOptions
    from odscen.carla.mirror.step_clock import StepClock
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.run_settings import RunSettings
    from odscen.sumo.worker.protocol import OnProgress


def cosim(
    workspace: Workspace,
    path: Path,
    options: CosimOptions,
    *,
    settings: RunSettings = AS_DESIGNED,
    out: Path | None = None,
    progress: OnProgress | None = None,
) -> tuple[Run, CosimReport]:
    """Run a scenario in SUMO and show it on a CARLA server.

    The run folder is that of :func:`odscen.app.running.runs.run`, whatever happens to the server:
    if that fails, SUMO stops and what it did so far is kept.

    Parameters
    ----------
    path
        Scenario file.
    options
        How it is mirrored.
    settings
        How it is run; always in one piece.
    out
        Folder that gets the run's folder; the workspace's ``runs`` if not given.
    progress
        Called in this thread, a few times a second.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    CarlaError
        If the server is not there or does not fit; nothing has run then.
    """
    options.check()
    run = check_file(workspace, path, out=out, settings=replace(settings, slice_length=None))
    prepared = prepare_run(run)
    report = CosimReport(str(options.address))
    with (
        interrupts() as interrupted,
        Server(options.address, follows=options.follow) as server,
        ExitStack() as stack,
    ):
        xodr = run.entry.read("xodr").decode()
        may_load = options.load_map and not options.follow
        report.map = ensure_map(server, run.entry.name, xodr, load=may_load)
        clock = _clock(server, options, prepared.plan.step_length)
        report.warnings = server.warnings
        mirrored = MirroredPlan.on(server, run, prepared.plan, options)
        report.sizes = mirrored.sizes
        heads = Heads(run.map.sumo.lights)
        show = StepShow(
            server, mirrored, heads, clock, report, interrupted, carla_signals=options.carla_signals
        )
        in_step = InStep(
            prepared.plan,
            ElevationLookup(run.map.sumo.graph, run.entry.lane_table()),
            show.on_step,
            placed=mirrored.ego.row if mirrored.ego else None,
        )
        show.stop, show.outside = in_step.stop, in_step.show_outside
        witnesses = RunWitnesses(stack, server, run, prepared.plan, mirrored, options, show)
        if options.on_step is not None:
            show.on_shown = options.on_step
        result = carry_out(run, prepared, progress=progress, ended=witnesses.ended, live=in_step)
        show.conclude()
    report.left_behind = server.left_behind
    witnesses.conclude(report)
    return result, report


def _clock(server: Server, options: CosimOptions, step_length: float) -> StepClock:
    """Have ticks made, by us unless another client does."""
    if options.follow:
        return FollowedTicks(server, step_length)
    ticks = options.ticks(step_length)
    delta = step_length / ticks
    server.synchronize(delta, sensed_speed=options.sensed_speed)
    return OwnTicks(server, ticks, delta)
