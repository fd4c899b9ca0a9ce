"""Traffic demand: read from files, made up, sized to the network, held against counts.

Each function takes a scenario and gives one with the demand.

>>> from odscen import demand
>>> scenario = demand.import_demand(workspace, scenario, "matrix.csv", kind="od")
>>> scenario, load = demand.sized(workspace, scenario)
"""

from odscen.app.demand.demand_correction import correct_matrix
from odscen.app.demand.demands import (
    add_background,
    add_input,
    choose_parking,
    choose_routes,
    fit_counts,
    import_demand,
    whole_day,
)
from odscen.app.demand.sized_demand import DemandSizing, proposed_background, sized
from odscen.app.demand.traffic_files import TrafficReport, import_traffic
from odscen.app.demand.transit_feeds import import_transit

__all__ = [
    "DemandSizing",
    "TrafficReport",
    "add_background",
    "add_input",
    "choose_parking",
    "choose_routes",
    "correct_matrix",
    "fit_counts",
    "import_demand",
    "import_traffic",
    "import_transit",
    "proposed_background",
    "sized",
    "whole_day",
]
