"""How a trial ended, in one word; words in capitals are failures."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from bench.fuzz.limits import WRONG_RESULT, Ended

FINE_CODES = (0, 1)
REFUSED_CODES = (2, 3)
_HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f\u202a-\u202e\u2066-\u2069]")
_RAW = re.compile(r"<string>|\b[A-Z][A-Za-z]*Error\(")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
LONGEST = 20_000
"""Characters of a message that somebody still reads; a list of many problems is long."""
_TEMPORARY = (".building-", ".removed-", ".part")
_HOUSEKEEPING = re.compile(r"(^|/)\.[^/]*lock[^/]*$|\.lock$")
"""Locks stay, empty: a lock that is deleted is not one."""


class Verdict(StrEnum):
    """``fine``: done; ``refused``: with a message and an exit code that say so."""

    FINE = "fine"
    REFUSED = "refused"
    SKIPPED = "skipped"
    TRACEBACK = "TRACEBACK"
    CRASH = "CRASH"
    HANG = "HANG"
    MEMORY = "MEMORY"
    SERVER_ERROR = "5XX"
    LEFTOVER = "LEFTOVER"
    UNCLEAR = "UNCLEAR"
    WARNING = "WARNING"
    WRONG = "WRONG"

    @property
    def failed(self) -> bool:
        """Whether it counts as a find."""
        return self.value.isupper()


@dataclass(frozen=True, slots=True)
class Finding:
    """What became of a trial: ``words`` are for people, one line."""

    verdict: Verdict
    words: str = ""


@dataclass(frozen=True, slots=True)
class Tried:
    """A trial that has been made."""

    target: str
    seed: int
    kind: str
    finding: Finding
    seconds: float
    peak: int = 0
    counts: dict[str, int] = field(default_factory=dict)


def judge(ended: Ended) -> Finding:
    """What one command came to, leftovers aside."""
    err = _COLOUR.sub("", ended.err)
    last = err.strip().splitlines()[-1] if err.strip() else ""
    named = f"odscen {' '.join(ended.argv)[:160]}: {last[:300]}"
    if ended.hung:
        return Finding(Verdict.HANG, f"{named} (after {ended.seconds:.1f} s)")
    if ended.large:
        return Finding(Verdict.MEMORY, f"{named} ({ended.peak / 1e9:.2f} GB)")
    if "Traceback (most recent call last)" in err:
        return Finding(Verdict.TRACEBACK, named)
    if ended.code == WRONG_RESULT:
        return Finding(Verdict.WRONG, f"{named[:100]}: {err[:400]}")
    if ended.code not in (*FINE_CODES, *REFUSED_CODES):
        return Finding(Verdict.CRASH, f"{named} (exit code {ended.code})")
    if ended.orphans:
        return Finding(Verdict.LEFTOVER, f"{named} (still runs: {ended.orphans[0]})")
    if re.search(r"\w+Warning: ", err):
        return Finding(Verdict.WARNING, named)
    if _HIDDEN.search(err) or _RAW.search(err) or len(err) > LONGEST:
        return Finding(Verdict.UNCLEAR, named)
    if ended.code in REFUSED_CODES:
        # Usage is told by the library of the command line, in a frame.
        said = err.strip() and not err.strip().endswith("error:")
        return Finding(Verdict.REFUSED if said else Verdict.UNCLEAR, named)
    return Finding(Verdict.FINE, named)


def worst(findings: Iterable[Finding]) -> Finding:
    """The first failure, else the first refusal, else the first of all; fine without any."""
    known = list(findings)
    for wanted in (lambda one: one.verdict.failed, lambda one: one.verdict is Verdict.REFUSED):
        for one in known:
            if wanted(one):
                return one
    return known[0] if known else Finding(Verdict.FINE)


Listing = dict[str, tuple[int, int]]


def listing(roots: Sequence[Path]) -> Listing:
    """Size and time of change of every file below some folders."""
    found: Listing = {}
    for root in roots:
        for path in root.rglob("*"):
            try:
                stat = path.lstat()
            except OSError:
                continue
            size = (0, 0) if path.is_dir() else (stat.st_size, stat.st_mtime_ns)
            found[str(path)] = size
    return found


def left_over(before: Listing, after: Listing, *, refused: bool) -> str:
    """What a command should not have left; of a refused one anything that is new or different."""
    for name in after.keys() - before.keys():
        if any(part in Path(name).name for part in _TEMPORARY):
            return f"left {name}"
    if not refused:
        return ""
    for name, stat in sorted(after.items()):
        if before.get(name) != stat and not _HOUSEKEEPING.search(name):
            return f"{'changed' if name in before else 'left'} {name}"
    gone = sorted(before.keys() - after.keys())
    return f"removed {gone[0]}" if gone else ""
