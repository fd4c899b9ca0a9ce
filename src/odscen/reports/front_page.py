"""The first page of the report: three sentences, and a row for each of the worst junctions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import number
from odscen.figures.by_place.level_of_service import PRIORITY_DELAY, SIGNAL_DELAY
from odscen.figures.by_place.traffic import over_run
from odscen.figures.measures.usability import UsabilityLevel
from odscen.reports.report_sections import FEW, worst_places
from odscen.reports.report_words import duration, moment

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.figures.measures.usability import Usability
    from odscen.reports.place_names import PlaceNames

MOST_ACTORS = 20
"""Road users of a scene at most; more are traffic. As on the page."""

MOST_JUNCTIONS = 6
"""Rows of the table of junctions: with the map they fit on a page of A4."""

LEVEL_WORDS = {
    UsabilityLevel.USABLE: "results valid",
    UsabilityLevel.RESERVATIONS: "results valid with reservations",
    UsabilityLevel.NOT_USABLE: "results not valid",
}
"""The verdict on a run in the words of its report."""

_CONGESTED = ("E", "F")
_SPILLING = 0.05
"""Share of the time from which a queue that reaches the junction behind is named."""


def junction_rows(figures: TrafficFigures, names: PlaceNames) -> list[dict[str, Any]]:
    """Return the worst junctions, each with its worst movement and what to do next.

    Every row has ``name``, ``control``, ``level``, ``shown`` (delay, s per vehicle), ``vehicles``,
    ``queue_max``, ``movement`` (words, with level and delay) and ``advice``.
    """
    movements = worst_movements(figures)
    rows = worst_places(over_run(figures.junctions))[:MOST_JUNCTIONS]
    for row in rows:
        worst = movements.get(row["junction"])
        row["name"] = names.name_junction(row["junction"])
        row["counted"] = row["vehicles"] if row.get("passages") is None else row["passages"]
        row["movement"] = "-"
        if worst is not None:
            words = names.name_movement(worst["movement"], junction=row["junction"])
            level = f", level {worst['level']}" if worst["level"] else ""
            row["movement"] = f"{words}: {number(worst['shown'], 0)} s{level}"
        row["advice"] = advise(row, worst)
    return rows


def worst_movements(figures: TrafficFigures) -> dict[str, dict[str, Any]]:
    """By junction, the movement with the longest delay of those with FEW vehicles and more."""
    import polars as pl

    table = over_run(figures.movements).with_columns(shown=pl.coalesce("control_delay", "delay"))
    counted = pl.coalesce("passages", "vehicles")
    busy = table.filter((counted >= FEW) & pl.col("shown").is_not_null())
    ordered = busy.sort(["shown", "movement"], descending=[True, False])
    worst_rows = ordered.unique("junction", keep="first", maintain_order=True)
    return {row["junction"]: row for row in worst_rows.iter_rows(named=True)}


def advise(junction: Mapping[str, Any], worst: Mapping[str, Any] | None) -> str:
    """What to look at next at a junction, from the figures of its worst movement.

    Parameters
    ----------
    junction
        With ``level`` and ``control``.
    worst
        The movement with the longest delay: ``level``, and ``vc`` and ``spillback`` if measured.
    """
    levels = {junction["level"], None if worst is None else worst["level"]}
    if not levels & set(_CONGESTED):
        return "Nothing: below capacity."
    ratio = None if worst is None else worst.get("vc")
    spilling = None if worst is None else worst.get("spillback")
    signalised = junction["control"] == "signal"
    roundabout = "roundabout" in str(junction.get("facility") or "")
    parts = []
    if ratio is not None and ratio > 1.0:
        share = f"demand is {number(100.0 * ratio, 0)} % of its capacity"
        cure = "try a signal or another lane"
        if signalised:
            cure = "give it more green or a lane"
        elif roundabout:
            cure = "try another lane at the entry, or less traffic in the circle"
        parts.append(f"{cure} ({share})")
    elif signalised:
        parts.append("try another split, cycle or offset")
    elif roundabout:
        parts.append("try another lane at the entry, or less traffic in the circle")
    else:
        parts.append("try a signal, a roundabout or priority for this approach")
    if spilling is not None and spilling >= _SPILLING:
        parts.append(f"queue up to the next junction {number(100 * spilling, 0)} % of the time")
    words = "; ".join(parts)
    return f"{words[:1].upper()}{words[1:]}."


def traffic_sentences(
    values: Mapping[str, Any], usability: Usability, rows: Sequence[Mapping[str, Any]]
) -> list[str]:
    """Whether the results hold, where most time is lost, and what comes next.

    Parameters
    ----------
    values
        Figures and counts of the run.
    rows
        Of :func:`junction_rows`; empty if traffic was not measured by place.
    """
    sentences = [_validity_sentence(values, usability)]
    delay = values.get("mean_delay")
    if delay is not None:
        lost = f"A vehicle lost {duration(float(delay))} on average"
        if rows:
            worst = rows[0]
            level = f", level {worst['level']}" if worst["level"] else ""
            lost += (
                f"; the longest delay is at {worst['name']}: "
                f"{duration(worst['shown'])} per vehicle{level}"
            )
        sentences.append(f"{lost}.")
    over = [row for row in rows if not str(row["advice"]).startswith("Nothing")]
    if usability.level is UsabilityLevel.NOT_USABLE:
        where = f", first at {over[0]['name']}" if over else ""
        sentences.append(
            f"Next: find out why traffic breaks down{where} (too much demand, a signal plan, a "
            "fault of the map), before any figure is quoted."
        )
    elif over:
        others = f" {len(over) - 1} more are in the table." if len(over) > 1 else ""
        advice = str(over[0]["advice"])
        sentences.append(f"Next, at {over[0]['name']}: {advice[:1].lower()}{advice[1:]}{others}")
    elif rows:
        sentences.append("Next: nothing has to change for this traffic; no junction is congested.")
    return sentences


def _validity_sentence(values: Mapping[str, Any], usability: Usability) -> str:
    words = LEVEL_WORDS[usability.level]
    verdict = f"The {words.replace('results ', 'results are ', 1)}"
    if usability.reasons:
        return f"{verdict}: {usability.reasons[0].words}."
    return f"{verdict}: {values['arrived']:,} of {values['planned']:,} road users arrived."


def scene_sentences(
    values: Mapping[str, Any],
    usability: Usability,
    criteria: Sequence[Mapping[str, Any]],
    conflicts: pl.DataFrame | None,
) -> list[str]:
    """Whether the criteria are met, the closest moment, and what comes next."""
    missed = [row for row in criteria if not row.get("passed")]
    if missed:
        value = missed[0].get("value")
        shown = "not measured" if value is None else f"{number(value, 2)} {missed[0]['unit']}"
        count = f"{len(missed)} of {len(criteria)} criteria"
        verb = "is" if len(missed) == 1 else "are"
        first = f"{missed[0]['words']}; it is {shown.strip()}"
        sentences = [f"{count} {verb} not met: {first}."]
    elif criteria:
        number_met = (
            "The criterion is" if len(criteria) == 1 else f"All {len(criteria)} criteria are"
        )
        sentences = [f"{number_met} met."]
    else:
        sentences = [_validity_sentence(values, usability)]
    closest = _closest_moment(conflicts)
    if values.get("collided"):
        sentences.append(f"{values['collided']:,} road users collided.")
    elif closest is not None:
        sentences.append(closest[1])
    elif conflicts is not None:
        sentences.append("No two road users came close to a conflict.")
    if closest is not None:
        ask = "" if criteria else " and set a criterion for it"
        sentences.append(f"Next: watch the replay at {moment(max(closest[0] - 2.0, 0.0))}{ask}.")
    elif not criteria:
        sentences.append("Next: set criteria, so that every run says whether it passed.")
    else:
        sentences.append("Next: vary what leads to the scene, and find where it is no longer safe.")
    return sentences


def _closest_moment(conflicts: pl.DataFrame | None) -> tuple[float, str] | None:
    """Instant and sentence of the shortest time to collision, else of the shortest PET."""
    import polars as pl

    if conflicts is None or conflicts.is_empty():
        return None
    for name, words in (("ttc", "time to collision"), ("pet", "post-encroachment time")):
        known = conflicts.filter(pl.col(name).is_not_null())
        if not known.is_empty():
            row = known.sort([name, "begin"]).row(0, named=True)
            begin = float(row["begin"])
            return begin, (
                f"The closest moment is that of {row['one']} and {row['other']}, from "
                f"{moment(begin)} on: {words} {number(row[name], 1)} s."
            )
    return None


def level_notes(figures: TrafficFigures, rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences where levels of service seem to contradict each other, as two definitions meet."""
    notes = []
    crossed = next(
        (
            (signal, other)
            for signal in rows
            for other in rows
            if signal["control"] == "signal" != other["control"]
            and signal["level"] and other["level"]
            and signal["shown"] > other["shown"] and signal["level"] < other["level"]
        ),
        None,
    )  # fmt: skip
    if crossed is not None:
        signal, other = crossed
        notes.append(
            f"{number(signal['shown'], 1)} s is level {signal['level']} at a signal, but "
            f"{number(other['shown'], 1)} s is level {other['level']} without one: drivers accept "
            f"longer waits at signals, so F begins at {SIGNAL_DELAY[-1]:.0f} s there, and at "
            f"{PRIORITY_DELAY[-1]:.0f} s elsewhere."
        )
    streets = over_run(figures.segments)
    slow = int(streets["level"].is_in(_CONGESTED).sum())
    calm = {row["level"] for row in over_run(figures.junctions).iter_rows(named=True)}
    if slow and calm & {"A", "B"}:
        notes.append(
            "Streets are graded by speed, as a share of that of a free road; junctions by the mean "
            "delay of all who pass. So a side street can be F before a junction that is A: its "
            "vehicles wait, the many on the main road do not."
        )
    return notes
