"""Figures of a run in plain words."""

from __future__ import annotations

_WORDS = {
    "sim_seconds": "simulated time",
    "planned": "road users planned",
    "inserted": "entered the road",
    "arrived": "reached their goal",
    "running": "still on their way at the end",
    "waiting": "never entered the road",
    "teleported": "stuck and moved on by the simulator",
    "collided": "in a collision",
    "emergency_stopped": "stopped harder than their brakes can",
    "insertion_error_max": "largest start error",
    "insertion_error_mean": "mean start error",
    "depart_delay_max": "longest wait to enter the road",
    "mean_travel_time": "mean travel time",
    "median_travel_time": "travel time of the middle one of all",
    "p95_travel_time": "travel time that 19 of 20 stay below",
    "mean_speed": "mean speed",
    "mean_delay": "time lost per trip",
    "mean_waiting_time": "time stood per trip",
    "mean_stops": "stops per trip",
    "co2_total": "CO2 in all",
    "fuel_total": "fuel in all",
    "nox_total": "nitrogen oxides in all",
    "pmx_total": "fine dust in all",
    "co2_per_km": "CO2 per kilometre",
    "travel_time_index": "travel time over that on a free road",
    "planning_time_index": "time to allow for, over that on a free road",
    "buffer_index": "time to add to the mean, to be in time",
    "vehicle_km": "driven by all vehicles",
    "throughput": "arrived per hour",
    "worst_junction_delay": "time lost at the worst junction",
}

_ON_FOOT = "pedestrian_"


def in_words(figure: str) -> str:
    """``mean_delay`` as "time lost per trip"; a figure without words of its own by its name."""
    if figure.startswith(_ON_FOOT):
        return f"{in_words(figure.removeprefix(_ON_FOOT))}, on foot"
    return _WORDS.get(figure, figure.replace("_", " "))
