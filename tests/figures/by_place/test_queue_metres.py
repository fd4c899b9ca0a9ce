from __future__ import annotations

from collections import defaultdict

import numpy as np
import polars as pl
from hypothesis import given
from hypothesis import strategies as st

from odscen.figures.by_place.queue_metres import GAP, _join_queue, _SlowRows

PERIOD = 0.5
PASSES = 3


def in_queue(rows: list[dict]) -> set[tuple[str, float]]:
    """Who is in a queue when: the rule, vehicle by vehicle and moment by moment."""
    moments = defaultdict(list)
    for row in sorted(rows, key=lambda row: (row["front"], row["id"])):
        moments[row["lane_group"], row["time"]].append(row)
    clusters = []
    for moment in moments.values():
        back = -np.inf
        for row in moment:
            if row["front"] - back > GAP:
                clusters.append([])
            clusters[-1].append((row["id"], row["time"]))
            back = max(back, row["rear"])
    front = {(row["id"], row["time"]): row["front"] for row in rows}
    queued = {one for group in clusters if front[group[0]] <= GAP for one in group}
    spells = []
    for row, before in zip(rows, [None, *rows], strict=False):
        same = before and (before["id"], before["lane_group"]) == (row["id"], row["lane_group"])
        if not same or row["time"] - before["time"] > 1.5 * PERIOD:
            spells.append([])
        spells[-1].append((row["id"], row["time"]))
    for _ in range(PASSES):
        for spell in spells:
            joined = next((k for k, one in enumerate(spell) if one in queued), len(spell))
            queued |= set(spell[joined:])
        queued |= {one for group in clusters if queued & set(group) for one in group}
    return queued


@st.composite
def slow_vehicles(draw: st.DrawFn) -> list[dict]:
    rows = []
    for name in "abcde"[: draw(st.integers(1, 5))]:
        for step in sorted(draw(st.sets(st.integers(0, 8)))):
            front = draw(st.floats(0.0, 60.0))
            group = draw(st.sampled_from(["left", "left", "left", "through"]))
            rows.append({"id": name, "time": step * PERIOD, "lane_group": group, "front": front})
            rows[-1]["rear"] = front + draw(st.sampled_from([2.0, 5.0, 18.0]))
    return rows


@given(slow_vehicles())
def test_who_is_reached_by_a_queue_is_in_it_until_it_drives_on(rows: list[dict]) -> None:
    placed = [(row["id"], row["lane_group"], row["time"]) for row in rows]
    spells = [
        k == 0 or placed[k][:2] != placed[k - 1][:2] or one[2] - placed[k - 1][2] > 1.5 * PERIOD
        for k, one in enumerate(placed)
    ]
    table = _SlowRows(
        names=pl.Series(["left", "through"]),
        moments=np.arange(9) * PERIOD,
        group=np.array([group == "through" for _, group, _ in placed], dtype=np.int64),
        moment=np.array([round(time / PERIOD) for *_, time in placed], dtype=np.int64),
        spell=np.cumsum(spells),
        front=np.array([row["front"] for row in rows]),
        rear=np.array([row["rear"] for row in rows]),
    )
    found = _join_queue(table) if rows else []
    assert {(rows[k]["id"], rows[k]["time"]) for k in found} == in_queue(rows)
