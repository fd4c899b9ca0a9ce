"""Checksums of a run folder: nothing is computed from a file that is not as it was written."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.checksums import (
    MISSING,
    SUMS_FILE,
    damaged_files,
    file_digest,
    read_sums,
    say_unchecked,
    sums_of,
    write_sums,
)
from odscen.base.errors import DamagedError, DamagedFile
from odscen.runs import layout
from odscen.runs.checkpoint import part_sums

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from pathlib import Path

CHANGING = frozenset({layout.STATUS_FILE, layout.LOG_FILE, layout.SUMMARY_FILE})
"""Not of what a run starts from: the first has its own checksum, the log is only added to."""
_START = (
    layout.SCENARIO_FILE,
    layout.PLAN_FILE,
    layout.SETTINGS_FILE,
    layout.LANE_PLACES_FILE,
    layout.LIGHTS_FILE,
    layout.ASSIGNMENT_FILE,
)
"""What a run in slices starts from, beside all that is in its SUMO folder."""
_INNER = frozenset({layout.STATUS_FILE, layout.SETTINGS_FILE})
"""Removed when a run in slices has ended."""
REPAIR = "odscen doctor --repair rebuilds what can be rebuilt"


def seal_start(run: Path) -> None:
    """Write down the checksums of what a run in slices starts from."""
    start = [name for name in _START if (run / name).is_file()] + _sumo_files(run)
    write_sums(run, {name: file_digest(run / name) for name in start})


def refuse_additions(run: Path) -> None:
    """Refuse a run to which files were added that SUMO or the worker would read.

    Raises
    ------
    DamagedError
        With each file of its SUMO folder that has no checksum.
    """
    sums = read_sums(run)
    if sums is None:  # the whole list is gone, which :func:`damaged_in` says
        return
    added = [name for name in _sumo_files(run) if name not in sums]
    if added:
        wrong = [DamagedFile(name, MISSING, file_digest(run / name)) for name in added]
        raise DamagedError(str(run), wrong)


def _sumo_files(run: Path) -> list[str]:
    folder = run / layout.SUMO_FOLDER
    return sorted(path.relative_to(run).as_posix() for path in folder.rglob("*") if path.is_file())


def seal_run(run: Path, *, hidden: bool = False) -> None:
    """Write down the checksums of a run that has ended, perhaps in a folder that is still hidden.

    What has been written down before is not computed again: what was damaged meanwhile shows.
    """
    known = {**(read_sums(run) or {}), **part_sums(run)}
    for name in CHANGING:
        known.pop(name, None)
    sums = sums_of(run, leave=_INNER, known=known)
    slices = f"{layout.SLICES_FOLDER}/"
    kept = {name: digest for name, digest in sums.items() if not name.startswith(slices)}
    write_sums(run, kept, hidden=hidden)


def seal_interrupted(run: Path) -> None:
    """Add what is said of a run in slices when it is interrupted."""
    names = (layout.SUMMARY_FILE, layout.LOG_FILE)
    seal_again(run, *(name for name in names if (run / name).is_file()))


def unseal_interrupted(run: Path) -> None:
    """Forget the checksums of what changes when a run goes on: undo :func:`seal_interrupted`."""
    sums = read_sums(run)
    if sums is not None:
        write_sums(run, {name: digest for name, digest in sums.items() if name not in CHANGING})


def seal_again(run: Path, *names: str) -> None:
    """Write down the checksums of files of a run that have been written anew."""
    sums = read_sums(run)
    if sums is not None:
        write_sums(run, {**sums, **{name: file_digest(run / name) for name in names}})


def check_run_files(run: Path, *, leave: Collection[str] = ()) -> None:
    """Compare every file of a run with its checksum; those recorded may have been deleted.

    Raises
    ------
    DamagedError
        With each file that is not as it was written.
    """
    wrong = damaged_in(run, leave=leave)
    if wrong:
        raise DamagedError(str(run), wrong, advice=REPAIR)


def damaged_in(
    run: Path, *, leave: Collection[str] = (), only: str | None = None
) -> list[DamagedFile]:
    """Files of a run that are not as they were written; says once where it cannot know."""
    try:
        sums = read_sums(run)
    except DamagedError as error:
        return list(error.files)
    if sums is None:
        say_unchecked(run)
        return []
    asked = {name: digest for name, digest in sums.items() if name not in leave}
    if only is not None:
        asked = {only: sums[only]} if only in sums else {}
    wrong = damaged_files(run, asked, may_miss=[name for name in asked if _may_miss(name)])
    return wrong if only is not None else [*wrong, *_added_records(run, sums)]


def _added_records(run: Path, sums: Mapping[str, str]) -> list[DamagedFile]:
    """Records that a run which has ended did not write itself, and readers would take for its own.

    Those of a run that has not ended are in the checkpoints of its slices.
    """
    if (run / layout.STATUS_FILE).is_file():
        return []
    there = [name for name in layout.RECORDED if (run / name).is_file()]
    for folder in layout.RECORDED.values():
        there += [f"{folder}/{path.name}" for path in (run / folder).glob("part-*.parquet")]
    return [
        DamagedFile(name, MISSING, file_digest(run / name))
        for name in sorted(there)
        if name not in sums
    ]


def without_sums(run: Path) -> bool:
    """Whether a run was written by a version that kept no checksums."""
    return not (run / SUMS_FILE).is_file()


def _may_miss(name: str) -> bool:
    recorded = {*layout.RECORDED, *layout.RECORDED.values()}
    return name.split("/", maxsplit=1)[0] in {*recorded, layout.REPORT_FILE, layout.LOG_FILE}
