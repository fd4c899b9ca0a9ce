"""odscen: traffic scenarios on OpenDRIVE maps, run headlessly in SUMO.

``import odscen`` gives the public face and costs nothing: each name is imported when it is first
used, and so are the public modules, ``odscen.experiments``, ``.edit``, ``.templates``, ``.demand``,
``.signals``, ``.datasets``, ``.learn`` and ``.rl``. Whatever is not in an ``__all__`` may change.

>>> workspace = odscen.Workspace.open()
>>> workspace.add_map(Path("Town01.xodr"))
>>> settings = odscen.GenerationSettings(map_name="Town01", seed=7, fill=0.3)
>>> (path,) = odscen.generate(workspace, settings=settings)
>>> run = odscen.run(workspace, path, settings=odscen.RunSettings(until=300.0))
>>> run.figures["mean_delay"]
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from odscen.base.version import __version__ as __version__

if TYPE_CHECKING:
    from odscen.app.demand.demand_correction import correct_matrix
    from odscen.app.demand.demands import add_background, fit_counts, import_demand, whole_day
    from odscen.app.demand.transit_feeds import import_transit
    from odscen.app.editing import Editing
    from odscen.app.exchange.exports import export
    from odscen.app.exchange.imports import ImportedFile, import_file
    from odscen.app.exchange.recorded_traffic import read_recorded_traffic
    from odscen.app.generation import generate
    from odscen.app.learner_arrays import scenario_arrays, scenario_from_arrays
    from odscen.app.running.batches import run_many
    from odscen.app.running.reports import renew_report
    from odscen.app.running.resumed_runs import resume
    from odscen.app.running.runs import run
    from odscen.app.running.watched_runs import WatchedRun, watch
    from odscen.app.scenarios import check_scenario as check
    from odscen.app.scenarios import read_scenario, write_scenario
    from odscen.app.signals.green_waves import coordinate_signals
    from odscen.app.signals.signal_evaluation import evaluate_signals
    from odscen.app.signals.signal_optimisation import time_signals
    from odscen.app.signals.signal_plans import export_signals, import_signals, signal_programs
    from odscen.app.template_scenarios import template_scenario as place_template
    from odscen.base.errors import (
        ConflictError,
        InputError,
        LimitError,
        NotFoundError,
        OdscenError,
        ScenarioError,
        ToolError,
        WorkspaceError,
    )
    from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
    from odscen.convert.model.conversion_settings import ConversionSettings
    from odscen.drawing.map_sheet import Picture
    from odscen.experiments.comparisons import RunComparison, compare
    from odscen.experiments.gates import run_suite
    from odscen.experiments.plan import StudyPlan as ExperimentPlan
    from odscen.experiments.studies import EndedStudy as ExperimentResults
    from odscen.experiments.studies import resume_experiment, run_experiment
    from odscen.experiments.studies import study_results as experiment_results
    from odscen.experiments.suite import read_suite
    from odscen.figures.judging.expectations import Expectation, parse_expectation
    from odscen.formats.base import Format
    from odscen.formats.tracks.recorded_traffic import RecordedTraffic
    from odscen.lanegraph.query import NearestNode
    from odscen.learning.behaviour.behaviour_model import BehaviourDoor
    from odscen.learning.hetero_data import read_arrays
    from odscen.maps.importers.base import ImportedMap, ImportSettings, MapImporter
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.shipped import shipped_maps
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.recording import Recording
    from odscen.runs.reporter import Progress, ProgressBar, Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sampling.generation_settings import GenerationSettings
    from odscen.scenario.story.action_kinds import ActionKind
    from odscen.scenario.story.condition_kinds import ConditionKind, Reading
    from odscen.scenario.story.motion_laws import SpeedLaw
    from odscen.scenario.templates.scene_template import SceneTemplate
    from odscen.sumo.runner.in_step import Step

_HOMES = {
    "Workspace": "odscen.maps.store",
    "MapEntry": "odscen.maps.map_entry",
    "shipped_maps": "odscen.maps.shipped",
    "MapImporter": "odscen.maps.importers.base",
    "ImportedMap": "odscen.maps.importers.base",
    "ImportSettings": "odscen.maps.importers.base",
    "ReportEntry": "odscen.convert.model.conversion_report",
    "ElementOutcome": "odscen.convert.model.conversion_report",
    "ConversionSettings": "odscen.convert.model.conversion_settings",
    "Scenario": "odscen.scenario.document.scenario_document",
    "GenerationSettings": "odscen.scenario.sampling.generation_settings",
    "Problem": "odscen.scenario.document.problems",
    "generate": "odscen.app.generation",
    "read_scenario": "odscen.app.scenarios",
    "write_scenario": "odscen.app.scenarios",
    "check": "odscen.app.scenarios:check_scenario",
    "export": "odscen.app.exchange.exports",
    "import_file": "odscen.app.exchange.imports",
    "ImportedFile": "odscen.app.exchange.imports",
    "read_recorded_traffic": "odscen.app.exchange.recorded_traffic",
    "RecordedTraffic": "odscen.formats.tracks.recorded_traffic",
    "Format": "odscen.formats.base",
    "Editing": "odscen.app.editing",
    "SceneTemplate": "odscen.scenario.templates.scene_template",
    "place_template": "odscen.app.template_scenarios:template_scenario",
    "import_demand": "odscen.app.demand.demands",
    "add_background": "odscen.app.demand.demands",
    "whole_day": "odscen.app.demand.demands",
    "fit_counts": "odscen.app.demand.demands",
    "correct_matrix": "odscen.app.demand.demand_correction",
    "import_transit": "odscen.app.demand.transit_feeds",
    "signal_programs": "odscen.app.signals.signal_plans",
    "import_signals": "odscen.app.signals.signal_plans",
    "export_signals": "odscen.app.signals.signal_plans",
    "evaluate_signals": "odscen.app.signals.signal_evaluation",
    "time_signals": "odscen.app.signals.signal_optimisation",
    "coordinate_signals": "odscen.app.signals.green_waves",
    "scenario_arrays": "odscen.app.learner_arrays",
    "scenario_from_arrays": "odscen.app.learner_arrays",
    "read_arrays": "odscen.learning.hetero_data",
    "ConditionKind": "odscen.scenario.story.condition_kinds",
    "Reading": "odscen.scenario.story.condition_kinds",
    "ActionKind": "odscen.scenario.story.action_kinds",
    "SpeedLaw": "odscen.scenario.story.motion_laws",
    "RunSettings": "odscen.runs.run_settings",
    "Recording": "odscen.runs.recording",
    "BehaviourDoor": "odscen.learning.behaviour.behaviour_model",
    "Expectation": "odscen.figures.judging.expectations",
    "NearestNode": "odscen.lanegraph.query",
    "parse_expectation": "odscen.figures.judging.expectations",
    "run": "odscen.app.running.runs",
    "run_many": "odscen.app.running.batches",
    "resume": "odscen.app.running.resumed_runs",
    "watch": "odscen.app.running.watched_runs",
    "WatchedRun": "odscen.app.running.watched_runs",
    "Step": "odscen.sumo.runner.in_step",
    "Reporter": "odscen.runs.reporter",
    "Progress": "odscen.runs.reporter",
    "ProgressBar": "odscen.runs.reporter",
    "Run": "odscen.runs.finished_run",
    "Picture": "odscen.drawing.map_sheet",
    "renew_report": "odscen.app.running.reports",
    "compare": "odscen.experiments.comparisons",
    "RunComparison": "odscen.experiments.comparisons",
    "ExperimentPlan": "odscen.experiments.plan:StudyPlan",
    "ExperimentResults": "odscen.experiments.studies:EndedStudy",
    "run_experiment": "odscen.experiments.studies",
    "resume_experiment": "odscen.experiments.studies",
    "experiment_results": "odscen.experiments.studies:study_results",
    "read_suite": "odscen.experiments.suite",
    "run_suite": "odscen.experiments.gates",
    "OdscenError": "odscen.base.errors",
    "InputError": "odscen.base.errors",
    "ScenarioError": "odscen.base.errors",
    "NotFoundError": "odscen.base.errors",
    "ConflictError": "odscen.base.errors",
    "LimitError": "odscen.base.errors",
    "WorkspaceError": "odscen.base.errors",
    "ToolError": "odscen.base.errors",
}
"""Where each public name is at home, and by what name if it is another one there.

``tests/test_public_face.py`` holds it against the imports above.
"""

MODULES = (
    "datasets",
    "demand",
    "edit",
    "experiments",
    "learn",
    "rl",
    "signals",
    "templates",
)
"""Public modules."""

__all__ = [
    "ActionKind",
    "BehaviourDoor",
    "ConditionKind",
    "ConflictError",
    "ConversionSettings",
    "Editing",
    "ElementOutcome",
    "Expectation",
    "ExperimentPlan",
    "ExperimentResults",
    "Format",
    "GenerationSettings",
    "ImportSettings",
    "ImportedFile",
    "ImportedMap",
    "InputError",
    "LimitError",
    "MapEntry",
    "MapImporter",
    "NearestNode",
    "NotFoundError",
    "OdscenError",
    "Picture",
    "Problem",
    "Progress",
    "ProgressBar",
    "Reading",
    "RecordedTraffic",
    "Recording",
    "ReportEntry",
    "Reporter",
    "Run",
    "RunComparison",
    "RunSettings",
    "Scenario",
    "ScenarioError",
    "SceneTemplate",
    "SpeedLaw",
    "Step",
    "ToolError",
    "WatchedRun",
    "Workspace",
    "WorkspaceError",
    "add_background",
    "check",
    "compare",
    "coordinate_signals",
    "correct_matrix",
    "evaluate_signals",
    "experiment_results",
    "export",
    "export_signals",
    "fit_counts",
    "generate",
    "import_demand",
    "import_file",
    "import_signals",
    "import_transit",
    "parse_expectation",
    "place_template",
    "read_arrays",
    "read_recorded_traffic",
    "read_scenario",
    "read_suite",
    "renew_report",
    "resume",
    "resume_experiment",
    "run",
    "run_experiment",
    "run_many",
    "run_suite",
    "scenario_arrays",
    "scenario_from_arrays",
    "shipped_maps",
    "signal_programs",
    "time_signals",
    "watch",
    "whole_day",
    "write_scenario",
]

if not TYPE_CHECKING:  # a type checker knows the names from the imports above, and no others

    def __getattr__(name: str) -> object:
        if name in MODULES:
            return import_module(f"odscen.{name}")
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module, _, own = _HOMES[name].partition(":")
        value = getattr(import_module(module), own or name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__, *MODULES})
