"""The verdict on a run: whether its figures can be used, and if not, why and where.

A simulation that ran to its end has not shown anything if a part of the demand never got onto the
road, was removed from it, or is stopped behind each other: the vehicles that did arrive then have
short delays. FHWA, Traffic Analysis Toolbox Volume III (FHWA-HOP-18-036, 2019), asks for unserved
demand and blocked vehicles to be looked at before any result; the bounds are ours, in
:data:`BOUNDS`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from odscen.figures.measures.figure import mean
from odscen.figures.measures.latent_delay import due, latent_delay, served
from odscen.records.outcomes import ActorStatus, IncidentKind, StopReason, reason_label
from odscen.records.row_text import rounded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.figures.measures.gridlock import Incident
    from odscen.figures.measures.summary import ActorOutcome


class UsabilityLevel(StrEnum):
    """Whether the figures of a run can be used."""

    USABLE = "usable"
    RESERVATIONS = "usable with reservations"
    NOT_USABLE = "not usable"

    @property
    def score(self) -> int:
        """2, 1 and 0: what an expectation compares."""
        return {UsabilityLevel.USABLE: 2, UsabilityLevel.RESERVATIONS: 1}.get(self, 0)


class UsabilityKind(StrEnum):
    """What can be wrong with a run as a whole."""

    FAILED = "failed"
    GRIDLOCK = "gridlock"
    NOT_INSERTED = "not inserted"
    TELEPORTED = "teleported"
    NOT_SERVED = "demand not served"
    LATENT_DELAY = "latent delay"
    STOPPED_EARLY = "stopped early"


@dataclass(frozen=True, slots=True)
class Bound:
    """Above ``reservations`` a value is named, above ``not_usable`` the run is not usable."""

    reservations: float
    not_usable: float

    def level(self, value: float) -> UsabilityLevel:
        """What a value comes to."""
        if value > self.not_usable:
            return UsabilityLevel.NOT_USABLE
        return UsabilityLevel.RESERVATIONS if value > self.reservations else UsabilityLevel.USABLE


BOUNDS: Mapping[UsabilityKind, Bound] = {
    UsabilityKind.NOT_INSERTED: Bound(0.0, 0.05),
    UsabilityKind.TELEPORTED: Bound(0.001, 0.005),
    UsabilityKind.NOT_SERVED: Bound(0.02, 0.10),
    UsabilityKind.LATENT_DELAY: Bound(5.0, 60.0),
    UsabilityKind.GRIDLOCK: Bound(0.0, 600.0),
}
"""Shares of the road users that were due (not inserted), inserted (teleported) or due to arrive
(not served); seconds per vehicle (latent delay); seconds for which the first vehicle of a jam has
been stopped when the run ends (gridlock: the circle of vehicles that wait for each other is none of
degree, a run with one that did not dissolve is not usable)."""

SLOW = 3.0
"""A road user is due to arrive this many times its free-flow time, and :data:`LATE` seconds, after
its planned departure: slower than level of service F on an urban street."""
LATE = 120.0

PATIENCE = 10.0
"""Seconds that one has to have waited for to count as not inserted; who was due in the last step of
a run is not missed."""

_PLACES = 5
"""Places that are named with a reason, at most."""


def _format_seconds(seconds: float) -> str:
    """``"4397 s"``."""
    return f"{seconds:.0f} s"


def _describe_spot(incident: Incident) -> str:
    """``"r1-0 (x 12 m, y 40 m)"``."""
    name = incident.place or incident.lane or incident.actor
    if incident.x is None or incident.y is None:
        return name
    return f"{name} (x {incident.x:.0f} m, y {incident.y:.0f} m)"


@dataclass(frozen=True, slots=True)
class IncidentWords:
    """How places and instants are written in the reasons of a verdict.

    Attributes
    ----------
    spot
        Where an incident was: its lane and coordinates, unless a reader has names of streets.
    moment
        An instant, given in seconds of the run.
    """

    spot: Callable[[Incident], str] = _describe_spot
    moment: Callable[[float], str] = _format_seconds


PLAIN = IncidentWords()
"""Words without names of streets, and seconds of the run."""


@dataclass(frozen=True, slots=True)
class UsabilityReason:
    """One thing that is wrong.

    Attributes
    ----------
    level
        What it alone makes of the run.
    value
        What was measured, in the unit of :data:`BOUNDS`; ``None`` where there is no number.
    count
        Road users, or jams, that are concerned.
    words
        A whole phrase, with number, share and first place.
    places
        The worst places, with where they are.
    """

    kind: UsabilityKind
    level: UsabilityLevel
    value: float | None
    count: int
    words: str
    places: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Usability:
    """The verdict, with all its reasons, the worst first."""

    level: UsabilityLevel
    reasons: tuple[UsabilityReason, ...] = ()

    @property
    def headline(self) -> str:
        """``"not usable: 12 of 100 road users were not inserted (12 %), most at n7"``."""
        return ": ".join([str(self.level), *filter(None, [self.because])])

    @property
    def because(self) -> str:
        """The reasons that make it no better than it is, in one line; empty if usable."""
        return "; ".join(reason.words for reason in self.reasons if reason.level is self.level)

    def to_dict(self) -> dict[str, Any]:
        """For ``summary.json``."""
        reasons = [
            {**rounded(asdict(reason)), "places": list(reason.places)} for reason in self.reasons
        ]
        return {"level": self.level, "headline": self.headline, "reasons": reasons}


def run_usability(
    outcomes: Sequence[ActorOutcome],
    incidents: Sequence[Incident],
    *,
    end: float,
    until: float | None = None,
    scene: bool = False,
    words: IncidentWords = PLAIN,
) -> Usability:
    """Judge a run that has ended.

    Parameters
    ----------
    outcomes
        Of all planned road users.
    incidents
        From :func:`odscen.figures.measures.gridlock.find_incidents`.
    end
        When the run ended, simulated seconds. Who was to depart later is not missed.
    until
        When it was to end, if it was stopped by hand.
    scene
        Whether it is judged by its criteria: who stands before a pedestrian is no jam, and who has
        not arrived when the story ends is not late. Who was not inserted, or was teleported, has
        not done what the scene says.
    words
        How places and instants are written.
    """
    found = [
        None if scene else _judge_gridlock(incidents, end, words),
        _judge_not_inserted(outcomes, incidents, end, words),
        _judge_teleports(outcomes, incidents, words),
        None if scene else _judge_not_served(outcomes, end),
        None if scene else _judge_latent_delay(outcomes, end),
        None if until is None else _stopped_early(end, until, words),
    ]
    reasons = [
        reason
        for reason in found
        if reason is not None and reason.level is not UsabilityLevel.USABLE
    ]
    return judged(reasons)


def judged(reasons: Iterable[UsabilityReason]) -> Usability:
    """Verdict from its reasons: as bad as the worst of them."""
    ordered = tuple(sorted(reasons, key=lambda reason: reason.level.score))
    return Usability(ordered[0].level if ordered else UsabilityLevel.USABLE, ordered)


def failed_run(error: str | None) -> Usability:
    """Verdict on a run that has failed."""
    first = (error or "the run failed").strip().splitlines()[0]
    kind, level = UsabilityKind.FAILED, UsabilityLevel.NOT_USABLE
    return judged([UsabilityReason(kind, level, None, 0, f"the run failed: {first}")])


def usability_score(summary: Mapping[str, Any]) -> float | None:
    """Score of the verdict in ``summary.json``; ``None`` in that of an earlier version."""
    verdict = summary.get("usable")
    return None if not verdict else float(UsabilityLevel(verdict["level"]).score)


def _judge_gridlock(
    incidents: Sequence[Incident], end: float, words: IncidentWords
) -> UsabilityReason | None:
    jams = [incident for incident in incidents if incident.kind is IncidentKind.JAM]
    lasting = [jam for jam in jams if jam.until is None]
    circles = [jam for jam in jams if jam.reason is StopReason.CIRCLE]
    closed = [circle for circle in circles if circle.until is None]
    named = closed or lasting or circles
    if not named:
        return None
    longest = max(
        (end if incident.until is None else incident.until) - incident.time for incident in named
    )
    level = BOUNDS[UsabilityKind.GRIDLOCK].level(longest if lasting else 1.0)
    if closed:
        level = UsabilityLevel.NOT_USABLE
    what = "unresolved gridlock" if closed else "unresolved queue"
    if not lasting:
        what = "gridlock that dissolved"
    number = f"{len(named)} times {what}" if len(named) > 1 else what
    first = named[0]
    since = f"since {words.moment(first.time)} ({reason_label(first.reason)})"
    text = f"{number}, first at {words.spot(first)} {since}"
    places = tuple(words.spot(incident) for incident in named[:_PLACES])
    return UsabilityReason(UsabilityKind.GRIDLOCK, level, longest, len(named), text, places)


def _judge_not_inserted(
    outcomes: Sequence[ActorOutcome],
    incidents: Sequence[Incident],
    end: float,
    words: IncidentWords,
) -> UsabilityReason | None:
    expected = due(outcomes, end - PATIENCE)
    missing = [outcome for outcome in expected if outcome.status is ActorStatus.WAITING]
    kept = [incident for incident in incidents if incident.kind is IncidentKind.NOT_INSERTED]
    kept.sort(key=lambda incident: (-incident.count, incident.time))
    places = tuple(f"{words.spot(incident)}: {incident.count}" for incident in kept[:_PLACES])
    most = f", most at {words.spot(kept[0])} ({reason_label(kept[0].reason)})" if kept else ""
    return _judge_share(
        UsabilityKind.NOT_INSERTED,
        len(missing),
        len(expected),
        f"road users {_was_or_were(missing)} not inserted",
        most,
        places,
    )


def _judge_teleports(
    outcomes: Sequence[ActorOutcome], incidents: Sequence[Incident], words: IncidentWords
) -> UsabilityReason | None:
    inserted = [outcome for outcome in outcomes if outcome.inserted is not None]
    gone = [outcome for outcome in inserted if outcome.teleports]
    where = [incident for incident in incidents if incident.kind is IncidentKind.TELEPORTED]
    places = tuple(dict.fromkeys(words.spot(incident) for incident in where))[:_PLACES]
    first = f", first at {places[0]} ({reason_label(where[0].reason)})" if places else ""
    text = f"inserted road users {_was_or_were(gone)} teleported"
    return _judge_share(UsabilityKind.TELEPORTED, len(gone), len(inserted), text, first, places)


def _judge_not_served(outcomes: Sequence[ActorOutcome], end: float) -> UsabilityReason | None:
    arriving = [
        outcome
        for outcome in outcomes
        if outcome.goal is not None
        and outcome.free_flow_time is not None
        and outcome.depart + SLOW * outcome.free_flow_time + LATE < end
    ]
    late = [outcome for outcome in arriving if outcome.status is not ActorStatus.ARRIVED]
    words = "road users due had not arrived (demand not served)"
    return _judge_share(UsabilityKind.NOT_SERVED, len(late), len(arriving), words, "", ())


def _judge_share(
    kind: UsabilityKind,
    count: int,
    number: int,
    words: str,
    where: str,
    places: tuple[str, ...],
) -> UsabilityReason | None:
    if not count:
        return None
    share = count / number
    text = f"{count:,} of {number:,} {words} ({_format_percent(share)}){where}"
    return UsabilityReason(kind, BOUNDS[kind].level(share), share, count, text, places)


def _judge_latent_delay(outcomes: Sequence[ActorOutcome], end: float) -> UsabilityReason | None:
    expected = [
        outcome for outcome in served(due(outcomes, end)) if outcome.category != "pedestrian"
    ]
    waits = [latent_delay(outcome, end) or 0.0 for outcome in expected]
    value = mean(waits)
    if value is None:
        return None
    late = sum(wait > 0.0 for wait in waits)
    words = f"vehicles waited {value:.1f} s on average to enter (latent delay)"
    level = BOUNDS[UsabilityKind.LATENT_DELAY].level(value)
    return UsabilityReason(UsabilityKind.LATENT_DELAY, level, value, late, words)


def _stopped_early(end: float, until: float, words: IncidentWords) -> UsabilityReason:
    text = f"the run was stopped by hand at {words.moment(end)} of {words.moment(until)}"
    level = UsabilityLevel.RESERVATIONS
    return UsabilityReason(UsabilityKind.STOPPED_EARLY, level, end, 0, text)


def _was_or_were(some: Sequence[object]) -> str:
    return "was" if len(some) == 1 else "were"


def _format_percent(share: float) -> str:
    """Two digits at least, so that a few of many are never 0 %."""
    percent = 100.0 * share
    return f"{percent:.1f} %" if percent >= 0.1 else f"{percent:.2g} %"
