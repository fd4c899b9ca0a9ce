"""SUMO as one of the simulators there are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.simulators.base import Simulator
from odscen.sumo.realize.run_map import RunMap
from odscen.sumo.runner.assignment import prepare_assigned
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import simulate
from odscen.sumo.worker.behaviour.behaviour_doors import open_behaviour

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.runs.new_run import SimulationOutcome
    from odscen.runs.reporter import Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.base import SimulatedMap


class SumoSimulator(Simulator[SumoPreparedRun]):
    """SUMO, in a process of its own."""

    label = "SUMO"

    def check_settings(self, settings: RunSettings) -> None:
        """Refuse a behaviour model that cannot be made."""
        if settings.behaviour is not None:
            open_behaviour(settings.behaviour, 0)

    def prepare(
        self, scenario: Scenario, on: SimulatedMap, settings: RunSettings, reporter: Reporter
    ) -> SumoPreparedRun:
        """Realize the scenario; where it wants routes by travel time, they are found first.

        Raises
        ------
        ScenarioError
            With every actor and flow whose spawn or goal is not usable.
        SimulationError
            If a run that routes are found by fails.
        TypeError
            If the map has no SUMO network.
        """
        if not isinstance(on, RunMap):
            raise TypeError("SUMO runs on maps of the catalogue, which have its network")
        return prepare_assigned(
            scenario,
            on.sumo,
            on.file("net"),
            on.assets,
            settings=settings,
            on_step=lambda step: reporter.said(step.words),
        )

    def run(self, prepared: SumoPreparedRun, folder: Path, reporter: Reporter) -> SimulationOutcome:
        """Simulate in one piece."""
        return simulate(prepared, folder, reporter=reporter)
