"""Parameters of drivers by their names in SUMO: what may be set, between which values, what for.

Meanings and SUMO's own defaults: SUMO 1.28, "Definition of Vehicles, Vehicle Types, and Routes".
"""

from __future__ import annotations

from typing import NamedTuple


class DriverParameter(NamedTuple):
    """One attribute of a ``<vType>``; ``unit`` is empty for shares and factors."""

    low: float
    high: float
    unit: str
    meaning: str


DRIVER_PARAMETERS: dict[str, DriverParameter] = {
    "speedFactor": DriverParameter(0.2, 2.0, "", "desired speed over the speed limit"),
    "tau": DriverParameter(0.1, 10.0, "s", "desired time headway from the rear in front"),
    "minGap": DriverParameter(0.0, 10.0, "m", "gap to the rear in front when stopped"),
    "accel": DriverParameter(0.1, 15.0, "m/s2", "highest acceleration"),
    "decel": DriverParameter(0.5, 15.0, "m/s2", "deceleration that the driver plans with"),
    "emergencyDecel": DriverParameter(1.0, 20.0, "m/s2", "highest deceleration possible"),
    "apparentDecel": DriverParameter(0.5, 20.0, "m/s2", "deceleration that others expect"),
    "sigma": DriverParameter(0.0, 1.0, "", "imperfection of speed keeping (Krauss' model)"),
    "startupDelay": DriverParameter(0.0, 10.0, "s", "time lost before starting from a stop"),
    "impatience": DriverParameter(0.0, 1.0, "", "readiness to take gaps that make others brake"),
    "jmTimegapMinor": DriverParameter(0.0, 10.0, "s", "least time gap when giving way"),
    "jmSigmaMinor": DriverParameter(0.0, 1.0, "", "imperfection while passing a minor link"),
    "jmStoplineGap": DriverParameter(0.0, 10.0, "m", "distance kept from the stop line"),
    "jmCrossingGap": DriverParameter(0.0, 50.0, "m", "least distance to people who cross"),
    "jmDriveAfterYellowTime": DriverParameter(
        -1.0, 10.0, "s", "drives on this long after yellow began; -1 brakes where it can"
    ),
    "jmDriveAfterRedTime": DriverParameter(
        -1.0, 60.0, "s", "drives on this long after red began; -1 never"
    ),
    "jmIgnoreKeepClearTime": DriverParameter(
        -1.0, 3600.0, "s", "blocks a junction after waiting this long before it; -1 never"
    ),
    "jmIgnoreFoeProb": DriverParameter(0.0, 1.0, "", "probability of not giving way"),
    "jmIgnoreFoeSpeed": DriverParameter(0.0, 60.0, "m/s", "only to those slower than this"),
    "lcStrategic": DriverParameter(-1.0, 100.0, "", "eagerness to change lanes for the route"),
    "lcCooperative": DriverParameter(-1.0, 1.0, "", "readiness to change lanes for others"),
    "lcSpeedGain": DriverParameter(0.0, 100.0, "", "eagerness to change lanes to be faster"),
    "lcKeepRight": DriverParameter(0.0, 100.0, "", "eagerness to keep to the slower lane"),
    "lcAssertive": DriverParameter(0.1, 10.0, "", "readiness to accept smaller gaps beside"),
    "lcLookaheadLeft": DriverParameter(0.1, 10.0, "", "look-ahead for changes to the left"),
    "lcOvertakeRight": DriverParameter(0.0, 1.0, "", "probability of overtaking on the right"),
}
"""By name, in the order in which they are documented and written."""
