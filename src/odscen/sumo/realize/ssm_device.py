"""What SUMO's SSM device is asked to measure, see :mod:`odscen.sumo.outputs.ssm_log`.

Every vehicle has one, by a parameter of its vType: devices given by probability are gone from
vehicles that come in with a saved state.
"""

from __future__ import annotations

from odscen.results.measures.conflicts import SEEN_DRAC, SEEN_PET, SEEN_TTC, WATCHED_ON

VEHICLE_PARAMETER = ("has.ssm.device", "true")

OPTIONS = {
    "device.ssm.measures": "TTC DRAC PET",
    "device.ssm.thresholds": f"{SEEN_TTC:g} {SEEN_DRAC:g} {SEEN_PET:g}",
    "device.ssm.range": "50",
    "device.ssm.extratime": f"{WATCHED_ON:g}",
}
"""Of the sumocfg; range in metres."""
