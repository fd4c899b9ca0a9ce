"""A van cuts in, then a pedestrian crosses: ten variations, with the criterion that decides.

The ego approaches; a van cuts in at a time to collision of 3 s; a pedestrian crosses mid-block when
the ego is D m away. It passes if there is no collision and the ego stops before the pedestrian.
The pedestrian is 4.62 m from the middle of the ego's lane and walks at 1 m/s: it is there after
4.62 s, and within half the ego's width and its own (0.9 m + 0.1 m) from 3.6 s to 5.6 s.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from odscen.figures.judging.criteria import criteria_rows
from odscen.lanegraph.query import walk_node_index
from odscen.runs.judged import read_judged
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.templates.template_registry import TEMPLATES, place_template
from tests.sumo.story_case import loaded, run

if TYPE_CHECKING:
    from pathlib import Path

    from tests.sumo.story_case import Told

MAP = "signal_crossing"
HIT, STANDS, NEAR = (
    "collided(ego) == 0",
    "stopped(ego) == 1",
    "min_distance(ego,walker) >= 0.5 m",
)


class Variation(NamedTuple):
    """Numbers of the template, who drives the ego, what it does by a rule, and what fails."""

    values: dict[str, float]
    driver: str
    missed: tuple[str, ...]
    brakes: dict[str, Any] | None = None


def braking(by: float, away: float) -> dict[str, Any]:
    """A rule that brakes when the ego's front is so far from where the pedestrian crosses."""
    return {"by": by, "away": away}


VARIATIONS = {
    # SUMO's driver sees the pedestrian in its lane and stops.
    "SUMO, 30 m": Variation({}, "sumo", ()),
    "SUMO, 24 m": Variation({"distance": 24.0}, "sumo", ()),
    "SUMO, van at 4 m/s": Variation({"van_speed": 4.0}, "sumo", ()),
    # It needs 6²/(2 x 4.5) = 4 m, and stops for who begins to cross 9 m ahead, too.
    "SUMO, 9 m": Variation({"distance": 9.0}, "sumo", ()),
    # The story alone: 30 m in 5 s, within the time in which the pedestrian is there.
    "story, 30 m": Variation({}, "story", (HIT, STANDS, NEAR)),
    # 9 m in 1.5 s, its rear 0.83 s later: the pedestrian has walked 2.3 m of the 3.6 m.
    "story, 9 m": Variation({"distance": 9.0}, "story", (STANDS,)),
    # 6²/(2 x 6) = 3 m: from 20 m before the line it stops 17 m before it.
    "story, brakes with 6 from 20 m": Variation({}, "story", (), braking(6.0, 20.0)),
    # 6²/(2 x 4) = 4.5 m: from 4.8 m before the line it stops 0.3 m before it, less than 0.5 m.
    "story, brakes with 4 from 4.8 m": Variation({}, "story", (NEAR,), braking(4.0, 4.8)),
    # From 3 m: sqrt(36 - 2 x 4 x 2.76) = 3.73 m/s at the pedestrian's side.
    "story, brakes with 4 from 3 m": Variation({}, "story", (HIT, NEAR), braking(4.0, 3.0)),
    # The van keeps 3 m/s: 9 m at 3 m/s are closed 3 s after its change began.
    "story, van does not accelerate": Variation(
        {"acceleration": 0.0}, "story", (HIT, STANDS, NEAR)
    ),
}


def play(name: str, folder: Path) -> tuple[Any, Told, list[dict[str, Any]]]:
    values, driver, _, brakes = VARIATIONS[name]
    made_on = loaded(MAP)
    given = {key: value for key, value in values.items() if (key, value) != ("acceleration", 0.0)}
    made = place_template(
        TEMPLATES["van-and-walker"], made_on.sumo.graph, made_on.usable, made_on.lights,
        values=given, name="story",
    )  # fmt: skip
    data = json.loads(dumps(made))
    ego = next(actor for actor in data["actors"] if actor.get("ego"))
    ego["driver"] = driver
    if "acceleration" in values:
        cut_in = next(rule for rule in data["rules"] if rule["id"] == "cut-in")
        cut_in["then"] = [cut_in["then"][0]["together"][0]]
    if brakes is not None:
        cross = next(rule for rule in data["rules"] if rule["id"] == "cross")
        when = {"distance": cross["when"]["distance"] | {"below": brakes["away"]}}
        data["rules"].append(
            {"id": "brake", "actor": "ego", "when": when, "then": [{"brake": {"by": brakes["by"]}}]}
        )
    scenario = loads(json.dumps(data))
    found = run(scenario, folder)
    return scenario, found, criteria_rows(scenario.criteria, {}, read_judged(folder))


@pytest.mark.parametrize(
    "name",
    [name if name == "story, 30 m" else pytest.param(name, marks=pytest.mark.slow)
     for name in VARIATIONS],
)  # fmt: skip
def test_a_variation_passes_or_fails_by_the_criterion_that_its_numbers_say(
    tmp_path: Path, name: str
) -> None:
    variation = VARIATIONS[name]
    scenario, found, rows = play(name, tmp_path / "run")
    missed = tuple(row["criterion"] for row in rows if not row["passed"])
    assert missed == variation.missed, [(row["criterion"], row["value"]) for row in rows]
    assert found.instant("cut-in") == pytest.approx(2.0, abs=0.02)
    summary = json.loads((found.folder / "summary.json").read_text())
    assert (summary["scene"], summary["usable"]["level"]) == (True, "usable")
    if name == "story, 30 m":
        hit = next(one for one in found.events if one.kind == "collision")
        walks, actor = loaded(MAP).sumo.graph.walks, scenario.actors[2]
        row = walk_node_index(loaded(MAP).sumo.graph, actor.spawn)
        meets = scenario.rules[2].when.distance.place
        metres = math.hypot(float(walks.x[row]) - meets[0], float(walks.y[row]) - meets[1])
        assert metres == pytest.approx(4.62, abs=0.01)
        assert hit.time - found.instant("cross") == pytest.approx(30.0 / 6.0, abs=0.1)
    if missed == (NEAR,):
        [near] = [row["value"] for row in rows if row["criterion"] == NEAR]
        assert near == pytest.approx(4.8 - 4.5 - 0.478 / 2.0, abs=0.08)
    if name == "story, van does not accelerate":
        hit = next(one for one in found.events if one.kind == "collision")
        assert {hit.actor, hit.partner} == {"ego", "van"}
        assert hit.time - found.instant("cut-in") == pytest.approx(3.0, abs=0.05)
    if name == "story, brakes with 4 from 3 m":
        hit = next(one for one in found.events if one.kind == "collision")
        assert (hit.values or {})["impact_speed"] == pytest.approx(math.hypot(3.73, 1.0), abs=0.2)
