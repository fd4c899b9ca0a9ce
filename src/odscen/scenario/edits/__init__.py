"""Every change to a scenario, as pure functions from document to document; one file a subject.

Functions that are edits are entered by :func:`~odscen.scenario.edits.edit_registry.edit`; all have
been when this package is imported.
"""

from odscen.scenario.edits.actor_edits import (
    add_actor,
    change_actor,
    copy_actors,
    fill_roi,
    move_actor,
    remove_actors,
    set_ego,
    set_goal,
)
from odscen.scenario.edits.demand_edits import (
    remove_demand,
    set_background,
    set_clock,
    set_counts,
    set_input,
    set_matrix,
    set_parking,
    set_profile,
    set_routes,
    set_zone,
)
from odscen.scenario.edits.flow_edits import add_flow, change_flow, remove_flow
from odscen.scenario.edits.measure_edits import remove_measure, set_measure
from odscen.scenario.edits.parameter_edits import remove_parameter, set_formula, set_parameter
from odscen.scenario.edits.program_part_edits import (
    add_stage,
    remove_detector,
    remove_group,
    remove_plan,
    remove_stage,
    set_detector,
    set_group,
    set_intergreen,
    set_plan,
)
from odscen.scenario.edits.roi_edits import (
    eligible_segments,
    extend_roi,
    grow_roi,
    removable_segments,
    shrink_roi,
)
from odscen.scenario.edits.rule_edits import remove_rule, set_rule
from odscen.scenario.edits.settings_edits import (
    new_scenario,
    rename,
    set_criteria,
    set_drivers,
    set_environment,
    set_seed,
    set_simulation,
)
from odscen.scenario.edits.signal_edits import (
    clear_timing,
    set_green,
    set_offset,
    set_signal_control,
    set_stage,
    set_timing,
    set_turn,
)
from odscen.scenario.edits.study_edits import set_study
from odscen.scenario.edits.transit_edits import remove_transit, set_line, set_stop

__all__ = [
    "add_actor",
    "add_flow",
    "add_stage",
    "change_actor",
    "change_flow",
    "clear_timing",
    "copy_actors",
    "eligible_segments",
    "extend_roi",
    "fill_roi",
    "grow_roi",
    "move_actor",
    "new_scenario",
    "removable_segments",
    "remove_actors",
    "remove_demand",
    "remove_detector",
    "remove_flow",
    "remove_group",
    "remove_measure",
    "remove_parameter",
    "remove_plan",
    "remove_rule",
    "remove_stage",
    "remove_transit",
    "rename",
    "set_background",
    "set_clock",
    "set_counts",
    "set_criteria",
    "set_detector",
    "set_drivers",
    "set_ego",
    "set_environment",
    "set_formula",
    "set_goal",
    "set_green",
    "set_group",
    "set_input",
    "set_intergreen",
    "set_line",
    "set_matrix",
    "set_measure",
    "set_offset",
    "set_parameter",
    "set_parking",
    "set_plan",
    "set_profile",
    "set_routes",
    "set_rule",
    "set_seed",
    "set_signal_control",
    "set_simulation",
    "set_stage",
    "set_stop",
    "set_study",
    "set_timing",
    "set_turn",
    "set_zone",
    "shrink_roi",
]
