"""Figures of a road, a junction and a road behind it, made from lane data written by hand."""

import polars as pl

from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.traffic import traffic_figures

INTERVAL = 900.0
PLACES = LanePlaces.of(
    lanes=[
        ("a_0", 100.0, True, "r1", 1.0, True),
        (":j_0_0", 10.0, True, "j10", 1.0, True),
        ("b_0", 200.0, True, "r2", 1.0, True),
    ],
    ways=[
        ("a_0", "j10", "a", None, None, None),
        (":j_0_0", "j10", "a", "a_0", ":j_0_0", "r1>j10>r2"),
    ],
    segments=[("r1", 100.0), ("r2", 200.0)],
    junctions=[("j10", "signal", 10.0)],
    movements=[("r1>j10>r2", "j10", "signal", 10.0)],
)
NOBODY = (0, 0.0)


def lane_rows(index, lane, vehicles, *, length, lost, co2, source, sink):
    """What ``vehicles`` do on a lane at 10 m/s, each of them losing ``lost`` seconds."""
    return {
        "begin": index * INTERVAL,
        "end": (index + 1) * INTERVAL,
        "edge": lane.rpartition("_")[0],
        "lane": lane,
        "seconds": vehicles * (length / 10.0 + lost),
        "distance": vehicles * length,
        "entered": 0 if source else vehicles,
        "left": 0 if sink else vehicles,
        "departed": vehicles if source else 0,
        "arrived": vehicles if sink else 0,
        "waiting": vehicles * lost / 2.0,
        "time_loss": vehicles * lost,
        **({} if co2 is None else dict.fromkeys(("co", "hc", "nox", "pmx"), 1.0)),
        **({} if co2 is None else {"co2": vehicles * co2, "fuel": vehicles * co2 / 3.0}),
    }


def made_figures(course=((50, 5.0), (100, 30.0), (150, 90.0), (60, 5.0)), *, co2=20.0):
    """Figures; ``course`` has vehicles and seconds lost before the junction for each interval."""
    rows = []
    for index, (vehicles, lost) in enumerate(course):
        if vehicles:
            rows += [
                lane_rows(index, "a_0", vehicles, length=100.0, lost=lost, co2=co2, source=True,
                          sink=False),
                lane_rows(index, ":j_0_0", vehicles, length=10.0, lost=0.0, co2=co2, source=False,
                          sink=False),
                lane_rows(index, "b_0", vehicles, length=200.0, lost=0.0, co2=2.0 * co2 if co2
                          else None, source=False, sink=True),
            ]  # fmt: skip
    return traffic_figures(pl.DataFrame(rows), PLACES, end=len(course) * INTERVAL)
