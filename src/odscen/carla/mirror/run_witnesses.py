"""Who watches a mirrored run: parity recorder, camera from above, sensors, a user's hook."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from odscen.carla.mirror.parity_recorder import StateRecorder
from odscen.carla.mirror.tick_hook import ShownActors, call_hook
from odscen.carla.sensors.camera import first_view, watch_from_above
from odscen.carla.sensors.sensor_recording import SensorRecording
from odscen.drawing.map_drawing import MapDrawing
from odscen.runs import layout

if TYPE_CHECKING:
    from contextlib import ExitStack

    from odscen.carla.mirror.cosim_options import CosimOptions
    from odscen.carla.mirror.cosim_report import CosimReport
    from odscen.carla.mirror.mirrored import MirroredPlan
    from odscen.carla.mirror.step_show import StepShow
    from odscen.carla.sensors.camera import Camera
    from odscen.carla.server.batch import ActorPlace
    from odscen.carla.server.carla_server import Server
    from odscen.records.run_plan import Plan
    from odscen.sumo.realize.run_map import RunMap
    from odscen.sumo.runner.in_step import Step


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
        self._sensors: SensorRecording | None = None
        self._seen = Path()
        if options.parity:
            self._recorder = StateRecorder(plan, mirrored.blueprints, mirrored.shapes)
            show.witnesses.append(partial(show.record, recorder=self._recorder))
        if options.pictures.any or options.on_picture:
            view = first_view(plan, options.pictures)
            self._camera = stack.enter_context(
                watch_from_above(server, view, options.pictures, options.on_picture)
            )
            show.views.append(self._above_ego)
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
            drawing = MapDrawing.from_json(self._on.file("drawing").read_bytes())
            self._recorder.write(folder, drawing)
        if self._sensors is not None:
            self._sensors.close()
            if self._seen.is_dir():
                shutil.move(self._seen, folder)

    def conclude(self, report: CosimReport) -> None:
        """Fill in how much they have seen, when all has ended."""
        if self._camera is not None:
            report.pictures, report.pictures_dropped = self._camera.taken, self._camera.dropped
        if self._sensors is not None:
            report.sensors = dict(self._sensors.counts)

    def _attach_sensors(
        self, stack: ExitStack, folder: Path, options: CosimOptions, show: StepShow
    ) -> None:
        staging = stack.enter_context(TemporaryDirectory(dir=folder.parent, prefix=".sensors-"))
        self._seen = Path(staging) / layout.SENSORS_FOLDER
        self._sensors = SensorRecording(self._server, options.sensors, self._seen)
        stack.callback(self._sensors.detach)
        show.witnesses.append(partial(self._sense_from_ego, self._sensors))

    def _sense_from_ego(self, sensors: SensorRecording, _step: Step) -> None:
        """Have the sensors on the ego while it is there."""
        shown, driven = self._mirrored.mirror.actors, self._mirrored.ego
        found = [shown[row] for row in shown if self._plan.actors[row].ego]
        ego = driven.hero if driven is not None else next(iter(found), None)
        if ego is not None and not sensors.attached:
            sensors.attach(ego)
        elif ego is None and sensors.attached:
            sensors.detach()

    def _above_ego(self, shown: Step) -> dict[int, ActorPlace]:
        """Where the camera is to be in a tick that shows this."""
        camera = self._camera
        if camera is None:
            return {}
        if self._mirrored.ego is not None:
            return {camera.number: camera.above(*self._mirrored.ego.place())}
        for k, row in enumerate(shown.index.tolist()):
            if self._plan.actors[row].ego:
                return {camera.number: camera.above(shown.x[k], shown.y[k], shown.z[k])}
        return {}
