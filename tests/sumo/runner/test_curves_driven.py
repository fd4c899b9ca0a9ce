"""Curves as they are driven in runs: a right angle, an S of spirals, a mountain road."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl
import pytest

from odscen.app.generation import generate
from odscen.app.running.runs import run
from odscen.app.scenarios import read_scenario
from odscen.figures.measures.motion import implausible
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.scenario_document import Flow
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.opendrive.snippets import document, lane, road, section

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.runs.finished_run import Run


class Piece(NamedTuple):
    """A part of a road: metres, and curvature at its begin and end, 1/m."""

    length: float
    begin: float = 0.0
    end: float = 0.0


def arc(radius: float, degrees: float) -> Piece:
    """To the left, if ``radius`` is above 0."""
    return Piece(abs(radius) * math.radians(degrees), 1.0 / radius, 1.0 / radius)


CURVE10 = (Piece(200.0), arc(10.0, 90.0), Piece(200.0))
S_CURVE = (
    Piece(150.0), Piece(40.0, 0.0, 1 / 60), arc(60.0, 35.0), Piece(60.0, 1 / 60, -1 / 60),
    arc(-60.0, 35.0), Piece(40.0, -1 / 60, 0.0), Piece(150.0),
)  # fmt: skip
MOUNTAIN = (
    Piece(120.0), Piece(20.0, 0.0, 1 / 14), arc(14.0, 95.0), Piece(20.0, 1 / 14, 0.0), Piece(90.0),
    Piece(20.0, 0.0, -1 / 14), arc(-14.0, 95.0), Piece(20.0, -1 / 14, 0.0), Piece(30.0),
    arc(40.0, 50.0), Piece(25.0, 1 / 40, -1 / 40), arc(-40.0, 50.0), Piece(60.0), arc(90.0, 40.0),
    Piece(120.0),
)  # fmt: skip
"""Two hairpins and bends of 40 and 90 m, climbing by 8 %."""


def course(pieces: tuple[Piece, ...], limit: int, grade: float = 0.0) -> tuple[str, list[float]]:
    """A road of these pieces, and x and y of the middle of its lane to the right at its end."""
    x = y = hdg = s = 0.0
    plan = ""
    for length, begin, end in pieces:
        shape = "<line/>" if begin == end == 0.0 else f'<arc curvature="{begin!r}"/>'
        if begin != end:
            shape = f'<spiral curvStart="{begin!r}" curvEnd="{end!r}"/>'
        plan += (
            f'<geometry s="{s!r}" x="{x!r}" y="{y!r}" hdg="{hdg!r}" length="{length!r}">{shape}'
            "</geometry>"
        )
        along = np.linspace(0.0, length, 4001)
        headings = hdg + begin * along + 0.5 * (end - begin) / length * along**2
        x += float(np.trapezoid(np.cos(headings), along))
        y += float(np.trapezoid(np.sin(headings), along))
        hdg, s = float(headings[-1]), s + length
    inside = f'<type s="0" type="rural"><speed max="{limit}" unit="km/h"/></type>'
    height = f'<elevation s="0" a="0" b="{grade}" c="0" d="0"/>'
    lanes = section(lane(-1), lane(1))
    text = road("1", length=s, plan=plan, lanes=lanes, inside=inside)
    return document(
        text.replace("</planView>", f"</planView><elevationProfile>{height}</elevationProfile>")
    ), [x, y, hdg]


def driven(
    pieces: tuple[Piece, ...], limit: int, folder: Path, *, grade: float = 0.0, trucks: float = 0.1
) -> Run:
    """A run of ten minutes with a car or truck every eight seconds over the road."""
    text, (x, y, hdg) = course(pieces, limit, grade)
    file = folder / "course.xodr"
    file.write_text(text)
    store = Workspace.open(folder / "workspace")
    entry = store.add_map(file)
    settings = GenerationSettings(map_name="course", fill=0.0, roi_segments=100)
    scenario = read_scenario(generate(store, settings=settings)[0])
    right = hdg - math.pi / 2.0
    goal = entry.nearest(
        x + 1.75 * math.cos(right) - 10.0 * math.cos(hdg),
        y + 1.75 * math.sin(right) - 10.0 * math.sin(hdg),
        hdg,
    )
    flow = Flow(
        id="stream", spawn=entry.nearest(6.0, -1.75, 0.0).id, goal=goal.id,
        per_hour=400.0, end=600.0, mix={"car": 1.0 - trucks, "truck": trucks},
    )  # fmt: skip
    scenario = scenario.model_copy(update={"actors": (), "flows": (flow,)})
    return run(store, scenario, settings=RunSettings(until=700.0), out=folder / "run")


def speeds_at(done: Run, x: float, y: float, category: str) -> np.ndarray:
    """Speed of each as it passes a place, km/h."""
    rows = done.trajectories().filter(pl.col("category") == category)
    far = (pl.col("x") - x) ** 2 + (pl.col("y") - y) ** 2
    near = rows.with_columns(far=far).sort("far").unique("id", keep="first")
    return 3.6 * near.filter(pl.col("far") < 36.0)["speed"].to_numpy()


def test_a_right_angle_of_10_m_is_driven_as_people_do(tmp_path):
    done = driven(CURVE10, 50, tmp_path)
    middle = 200.0 + 11.75 * math.sin(math.pi / 4), 10.0 - 11.75 * math.cos(math.pi / 4)
    cars = speeds_at(done, *middle, "car")
    assert len(cars) > 40
    assert 22.0 < np.percentile(cars, 85) < 28.0
    assert np.percentile(speeds_at(done, *middle, "truck"), 85) < np.median(cars)
    assert np.median(speeds_at(done, 60.0, -1.75, "car")) > 40.0  # and only there
    assert done.motion().is_empty()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pieces", "grade", "slowest"), [(S_CURVE, 0.0, (38.0, 46.0)), (MOUNTAIN, 0.08, (19.0, 26.0))]
)
def test_who_drives_spirals_and_hairpins_feels_no_more_than_is_comfortable(
    pieces, grade, slowest, tmp_path
):
    done = driven(pieces, 80, tmp_path, grade=grade)
    users = done.trajectories().filter(pl.col("category") == "car").group_by("id")
    low = 3.6 * users.agg(pl.col("speed").filter(pl.col("speed") > 0.0).slice(20).min())["speed"]
    assert len(low) > 40
    assert slowest[0] < low.median() < slowest[1]
    assert done.summary["actors"]["arrived"] == len(done.actors())
    found = done.motion()
    assert implausible(found).is_empty()
    assert len(found) <= 0.02 * len(done.actors())  # hard braking, of emergencies
