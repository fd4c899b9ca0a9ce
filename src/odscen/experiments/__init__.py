"""Many runs: sweeps, searches, experiments, regression suites and comparisons.

>>> from odscen import experiments
>>> plan = experiments.SweepPlan((experiments.Range("gap", 1.0, 4.0, steps=7),))
>>> experiments.sweep(workspace, scenario, plan, "sweep", processes=2).table
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from odscen.experiments.annotations import sarif as sarif
    from odscen.experiments.badge import suite_badge as suite_badge
    from odscen.experiments.comparisons import RunComparison as RunComparison
    from odscen.experiments.comparisons import compare as compare
    from odscen.experiments.gates import Update as Update
    from odscen.experiments.gates import run_suite as run_suite
    from odscen.experiments.history import HistoryLine as HistoryLine
    from odscen.experiments.history import append_history as append_history
    from odscen.experiments.history import find_trends as find_trends
    from odscen.experiments.history import history_line as history_line
    from odscen.experiments.history import history_page as history_page
    from odscen.experiments.history import read_history as read_history
    from odscen.experiments.plan import StudyPlan as ExperimentPlan
    from odscen.experiments.plan import read_study_plan as read_study_plan
    from odscen.experiments.searches import SearchResult as SearchResult
    from odscen.experiments.searches import SearchSettings as SearchSettings
    from odscen.experiments.searches import search as search
    from odscen.experiments.studies import EndedStudy as ExperimentResults
    from odscen.experiments.studies import resume_experiment as resume_experiment
    from odscen.experiments.studies import run_experiment as run_experiment
    from odscen.experiments.studies import study_results as experiment_results
    from odscen.experiments.suite import CaseResult as CaseResult
    from odscen.experiments.suite import CaseStatus as CaseStatus
    from odscen.experiments.suite import Suite as Suite
    from odscen.experiments.suite import SuiteResult as SuiteResult
    from odscen.experiments.suite import read_suite as read_suite
    from odscen.experiments.suite_words import junit_xml as junit_xml
    from odscen.experiments.suite_words import suite_summary as suite_summary
    from odscen.experiments.sweeps import Sweep as Sweep
    from odscen.experiments.sweeps import SweepEstimate as SweepEstimate
    from odscen.experiments.sweeps import SweepSettings as SweepSettings
    from odscen.experiments.sweeps import estimate as estimate
    from odscen.experiments.sweeps import sweep as sweep
    from odscen.scenario.sweeps.sweep_plan import Range as Range
    from odscen.scenario.sweeps.sweep_plan import SweepPlan as SweepPlan
    from odscen.scenario.sweeps.sweep_plan import Table as Table
    from odscen.scenario.sweeps.sweep_plan import axis_from_text as axis_from_text

_HOMES = {
    "RunComparison": "odscen.experiments.comparisons",
    "compare": "odscen.experiments.comparisons",
    "Update": "odscen.experiments.gates",
    "run_suite": "odscen.experiments.gates",
    "ExperimentPlan": "odscen.experiments.plan:StudyPlan",
    "read_study_plan": "odscen.experiments.plan",
    "SearchResult": "odscen.experiments.searches",
    "SearchSettings": "odscen.experiments.searches",
    "search": "odscen.experiments.searches",
    "ExperimentResults": "odscen.experiments.studies:EndedStudy",
    "resume_experiment": "odscen.experiments.studies",
    "run_experiment": "odscen.experiments.studies",
    "experiment_results": "odscen.experiments.studies:study_results",
    "CaseResult": "odscen.experiments.suite",
    "CaseStatus": "odscen.experiments.suite",
    "Suite": "odscen.experiments.suite",
    "SuiteResult": "odscen.experiments.suite",
    "read_suite": "odscen.experiments.suite",
    "junit_xml": "odscen.experiments.suite_words",
    "suite_summary": "odscen.experiments.suite_words",
    "HistoryLine": "odscen.experiments.history",
    "append_history": "odscen.experiments.history",
    "find_trends": "odscen.experiments.history",
    "history_line": "odscen.experiments.history",
    "history_page": "odscen.experiments.history",
    "read_history": "odscen.experiments.history",
    "sarif": "odscen.experiments.annotations",
    "suite_badge": "odscen.experiments.badge",
    "Sweep": "odscen.experiments.sweeps",
    "SweepEstimate": "odscen.experiments.sweeps",
    "SweepSettings": "odscen.experiments.sweeps",
    "estimate": "odscen.experiments.sweeps",
    "sweep": "odscen.experiments.sweeps",
    "Range": "odscen.scenario.sweeps.sweep_plan",
    "SweepPlan": "odscen.scenario.sweeps.sweep_plan",
    "Table": "odscen.scenario.sweeps.sweep_plan",
    "axis_from_text": "odscen.scenario.sweeps.sweep_plan",
}
"""Where each public name is at home: the pytest plugin is in here too, and loads none of them."""

__all__ = [
    "CaseResult",
    "CaseStatus",
    "ExperimentPlan",
    "ExperimentResults",
    "HistoryLine",
    "Range",
    "RunComparison",
    "SearchResult",
    "SearchSettings",
    "Suite",
    "SuiteResult",
    "Sweep",
    "SweepEstimate",
    "SweepPlan",
    "SweepSettings",
    "Table",
    "Update",
    "append_history",
    "axis_from_text",
    "compare",
    "estimate",
    "experiment_results",
    "find_trends",
    "history_line",
    "history_page",
    "junit_xml",
    "read_history",
    "read_study_plan",
    "read_suite",
    "resume_experiment",
    "run_experiment",
    "run_suite",
    "sarif",
    "search",
    "suite_badge",
    "suite_summary",
    "sweep",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module, _, own = _HOMES[name].partition(":")
        return getattr(import_module(module), own or name)

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
