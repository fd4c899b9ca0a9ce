"""A scenario in SUMO and CARLA at once: SUMO drives, the server shows every step of it."""

from __future__ import annotations

import shutil
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from odscen.app.running.runs import carry_out, check_file, prepare_run
from odscen.base.atomic_folders import passing_folder
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.cosim_report import CosimReport
from odscen.carla.mirror.mirrored import MirroredPlan
from odscen.carla.mirror.parity_recorder import StateRecorder
from odscen.carla.mirror.sheet_recorder import SheetRecorder
from odscen.carla.mirror.step_clock import FollowedTicks, OwnTicks
from odscen.carla.mirror.step_show import StepShow
from odscen.carla.mirror.tick_hook import ShownActors, call_hook
from odscen.carla.sensors.camera import first_view, watch_from_above
from odscen.carla.sensors.sensor_recording import SensorRecording
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address
from odscen.carla.server.interruption import interrupts
from odscen.carla.server.server_map import ensure_map
from odscen.convert.lane_table.light_heads import SignalHeads
from odscen.convert.lane_table.table_json import table_from_json
from odscen.drawing.map_drawing import MapDrawing
from odscen.reports.picture_sheet import render_picture_sheet
from odscen.runs import layout
from odscen.runs.new_run import refuse_finished_run
from odscen.runs.reporter import SILENT
from odscen.runs.run_settings import AS_DESIGNED
from odscen.simulators.base import Simulator
from odscen.sumo.realize.run_map import RunMap
from odscen.sumo.runner.elevation import ElevationLookup
from odscen.sumo.runner.in_step import InStep
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import simulate
from odscen.sumo.runner.sumo_simulator import SumoSimulator

if TYPE_CHECKING:
    from odscen.carla.mirror.step_clock import StepClock
    from odscen.carla.sensors.camera import Camera
    from odscen.carla.server.batch import ActorPlace
    from odscen.maps.store import Workspace
    from odscen.records.run_plan import Plan
    from odscen.runs.finished_run import Run
    from odscen.runs.new_run import SimulationOutcome
    from odscen.runs.reporter import Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.base import SimulatedMap
    from odscen.sumo.runner.in_step import Step


# ----------------------------------------------------------------------- who watches a mirrored run
class RunWitnesses:
    """All that are wished for.

    Parameters
    ----------
    stack
        Ends what they have begun.
    show
        Calls them.
    """

    def __init__(
        self,
        stack: ExitStack,
        server: Server,
        folder: Path,
        on: RunMap,
        plan: Plan,
        mirrored: MirroredPlan,
        options: CosimOptions,
        show: StepShow,
    ) -> None:
        self._server, self._on, self._plan, self._mirrored = server, on, plan, mirrored
        self._recorder: StateRecorder | None = None
        self._camera: Camera | None = None
        self._sheet: SheetRecorder | None = None
        self._sensors: SensorRecording | None = None
        self._seen = Path()
        if options.parity:
            self._recorder = StateRecorder(plan, mirrored.blueprints, mirrored.shapes)
            show.witnesses.append(partial(show.record, recorder=self._recorder))
        if options.pictures.any or options.on_picture:
            self._put_up_camera(stack, options, show)
        if options.sensors:
            self._attach_sensors(stack, folder, options, show)
        if options.hook is not None:
            ids = [actor.id for actor in plan.actors]
            shown = ShownActors(server.world, ids, mirrored.mirror.actors)
            show.hooks.append(partial(call_hook, options.hook, server.world, shown))

    def write(self, folder: Path) -> None:
        """Write what they have seen into the run's folder.

        Raises
        ------
        WorkspaceError
            If a sensor's file could not be written.
        """
        if self._recorder is not None:
            self._recorder.write(folder, self._read_drawing())
        if self._sheet is not None:
            page = render_picture_sheet(
                self._sheet.moments(), self._read_drawing(),
                scenario=self._plan.scenario, shown_by="CARLA",
            )  # fmt: skip
            (folder / layout.PICTURE_SHEET_FILE).write_text(page, encoding="utf-8")
        if self._sensors is not None:
            self._sensors.close()
            if self._seen.is_dir():
                shutil.move(self._seen, folder)

    def _read_drawing(self) -> MapDrawing:
        return MapDrawing.from_json(self._on.file("drawing").read_bytes())

    def conclude(self, report: CosimReport) -> None:
        """Fill in how much they have seen, when all has ended."""
        if self._camera is not None:
            report.pictures, report.pictures_dropped = self._camera.taken, self._camera.dropped
        if self._sensors is not None:
            report.sensors = dict(self._sensors.counts)

    def _put_up_camera(self, stack: ExitStack, options: CosimOptions, show: StepShow) -> None:
        wish = options.pictures
        view = first_view(self._plan, wish)
        sheet = (
            SheetRecorder(self._server, self._plan, view, wanted=wish.sheet) if wish.sheet else None
        )
        self._sheet = sheet
        self._camera = stack.enter_context(
            watch_from_above(
                self._server, view, wish, options.on_picture,
                keep=None if sheet is None else sheet.take,
            )
        )  # fmt: skip
        show.views.append(self._place_camera)
        if sheet is not None:
            show.hooks.append(sheet.ticked)

    def _attach_sensors(
        self, stack: ExitStack, folder: Path, options: CosimOptions, show: StepShow
    ) -> None:
        # Of one that is killed the next run removes it.
        staging = stack.enter_context(passing_folder(folder.parent))
        self._seen = staging / layout.SENSORS_FOLDER
        self._sensors = SensorRecording(self._server, options.sensors, self._seen)
        stack.callback(self._sensors.detach)
        show.witnesses.append(partial(self._sense_from_ego, self._sensors))

    def _sense_from_ego(self, sensors: SensorRecording, _step: Step) -> None:
        """Have the sensors on the ego while it is there."""
        shown, driven = self._mirrored.mirror.actors, self._mirrored.ego
        egos = [shown[row] for row in shown if self._plan.actors[row].ego]
        ego = driven.hero if driven is not None else next(iter(egos), None)
        if ego is not None and not sensors.attached:
            sensors.attach(ego)
        elif ego is None and sensors.attached:
            sensors.detach()

    def _place_camera(self, shown: Step) -> dict[int, ActorPlace]:
        """Where the camera is to be in a tick that shows this."""
        places = self._camera_places(shown)
        if self._sheet is not None:
            self._sheet.look(shown, places)
        return places

    def _camera_places(self, shown: Step) -> dict[int, ActorPlace]:
        camera = self._camera
        if camera is None:
            return {}
        if self._mirrored.ego is not None:
            return {camera.number: camera.above(*self._mirrored.ego.place())}
        for k, row in enumerate(shown.index.tolist()):
            if self._plan.actors[row].ego:
                return {camera.number: camera.above(shown.x[k], shown.y[k], shown.z[k])}
        return {}


# ------------------------------------------------------------- A scenario in SUMO and CARLA at once
@dataclass(frozen=True, slots=True, kw_only=True)
class MirroredRun(SumoPreparedRun):
    """A run of SUMO with what a CARLA server has to be told of it."""

    scenario: Scenario
    on: RunMap


class CarlaMirror(Simulator[MirroredRun]):
    """SUMO, shown actor for actor on a CARLA server.

    Parameters
    ----------
    address
        Of the server, ``HOST:PORT``.

    Attributes
    ----------
    report
        What has come of the last run.
    """

    label = "CARLA, mirrored"
    options: ClassVar = {
        "type": "object",
        "properties": {
            "address": {
                "type": "string",
                "title": "Address of the CARLA server",
                "default": "127.0.0.1:2000",
            }
        },
    }

    def __init__(self, address: str = "127.0.0.1:2000") -> None:
        self.mirroring = CosimOptions(address=Address.parse(address))
        self.report = CosimReport(address)

    @classmethod
    def with_options(cls, options: CosimOptions) -> CarlaMirror:
        """Make one that mirrors in a certain way.

        Raises
        ------
        InputError
            If options contradict each other.
        """
        options.check()
        made = cls(str(options.address))
        made.mirroring = options
        return made

    def check_settings(self, settings: RunSettings) -> None:
        """Refuse what SUMO refuses."""
        SumoSimulator().check_settings(settings)

    def prepare(
        self, scenario: Scenario, on: SimulatedMap, settings: RunSettings, reporter: Reporter
    ) -> MirroredRun:
        """Prepare a run of SUMO; it is always in one piece."""
        if not isinstance(on, RunMap):
            raise TypeError("SUMO runs on maps of the catalogue, which have its network")
        whole = replace(settings, slice_length=None)
        made = SumoSimulator().prepare(scenario, on, whole, reporter)
        values = {name: getattr(made, name) for name in SumoPreparedRun.__dataclass_fields__}
        return MirroredRun(**values, scenario=scenario, on=on)

    def run(self, prepared: MirroredRun, folder: Path, reporter: Reporter) -> SimulationOutcome:
        """Let SUMO drive, and the server show each step.

        Whatever happens to the server: if that fails, SUMO stops and what it did so far is kept.

        Raises
        ------
        CarlaError
            If the server is not there or does not fit; nothing has run then.
        """
        options, plan, on = self.mirroring, prepared.plan, prepared.on
        report = self.report = CosimReport(str(options.address))
        with (
            interrupts() as interrupted,
            Server(options.address, follows=options.follow) as server,
            ExitStack() as stack,
        ):
            xodr = on.file("xodr").read_bytes().decode()
            may_load = options.load_map and not options.follow
            report.map = ensure_map(server, on.name, xodr, load=may_load)
            clock = _choose_clock(server, options, plan.step_length)
            report.warnings = server.warnings
            mirrored = MirroredPlan.on(server, prepared.scenario, on, plan, options)
            report.sizes = mirrored.sizes
            show = StepShow(
                server,
                mirrored,
                SignalHeads(on.sumo.lights),
                clock,
                report,
                interrupted,
                carla_signals=options.carla_signals,
            )
            table = table_from_json(on.file("lane_table").read_bytes())
            in_step = InStep(
                plan,
                ElevationLookup(on.graph, table),
                show.on_step,
                placed=mirrored.ego.row if mirrored.ego else None,
            )
            show.stop, show.outside = in_step.stop, in_step.show_outside
            witnesses = RunWitnesses(stack, server, folder, on, plan, mirrored, options, show)
            if options.on_step is not None:
                show.on_shown = options.on_step
            outcome = simulate(prepared, folder, reporter=reporter, live=in_step)
            if outcome.sim_seconds is not None:
                witnesses.write(folder)
            show.conclude()
        if report.refused and not report.spawned and report.error is None:
            report.error = f"the server has taken none of {len(report.refused)} road users"
        report.left_behind = server.left_behind
        witnesses.conclude(report)
        return outcome


def cosim(
    workspace: Workspace,
    path: Path,
    options: CosimOptions,
    *,
    settings: RunSettings = AS_DESIGNED,
    out: Path | None = None,
    overwrite: bool = False,
    reporter: Reporter = SILENT,
) -> tuple[Run, CosimReport]:
    """Run a scenario in SUMO and show it on a CARLA server, see :class:`CarlaMirror`.

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
    overwrite
        Whether a run that has ended is replaced in ``out``; in the workspace's ``runs`` it is.
    reporter
        Hears how far it is, in this thread.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    CarlaError
        If the server is not there or does not fit; nothing has run then.
    """
    mirror = CarlaMirror.with_options(options)
    run = check_file(workspace, path, out=out, settings=settings, simulator=mirror)
    if out is not None and not overwrite:
        refuse_finished_run(run.folder)
    result = carry_out(run, prepare_run(run), reporter=reporter)
    return result, mirror.report


def _choose_clock(server: Server, options: CosimOptions, step_length: float) -> StepClock:
    """Have ticks made, by us unless another client does."""
    if options.follow:
        return FollowedTicks(server, step_length)
    ticks = options.ticks(step_length)
    delta = step_length / ticks
    server.synchronize(delta, sensed_speed=options.sensed_speed)
    return OwnTicks(server, ticks, delta)
