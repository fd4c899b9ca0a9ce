"""Traffic lights: programs that run, timed by rule, coordinated, evaluated, read and written.

>>> from odscen import signals
>>> timed = signals.time_signals(workspace, scenario, begin=0, end=900)
>>> signals.evaluate_signals(workspace, timed.scenario, today=scenario).words
"""

from odscen.app.signals.controller_logs import controller_measures, play_controller_log
from odscen.app.signals.green_waves import Coordination, coordinate_signals
from odscen.app.signals.program_editing import stretch_cycle, take_over_program
from odscen.app.signals.signal_evaluation import SignalEvaluation, evaluate_signals
from odscen.app.signals.signal_optimisation import TimedSignals, time_signals
from odscen.app.signals.signal_plans import export_signals, import_signals, signal_programs
from odscen.app.signals.turn_arrows import with_turn_arrows

__all__ = [
    "Coordination",
    "SignalEvaluation",
    "TimedSignals",
    "controller_measures",
    "coordinate_signals",
    "evaluate_signals",
    "export_signals",
    "import_signals",
    "play_controller_log",
    "signal_programs",
    "stretch_cycle",
    "take_over_program",
    "time_signals",
    "with_turn_arrows",
]
