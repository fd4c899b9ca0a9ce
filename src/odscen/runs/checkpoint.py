"""What a long run keeps at each boundary, so that it can go on from there whatever happens.

A slice is complete when its folder ``slices/NNNN`` is there: everything in it was written, checked
and brought to the disk under another name before, and renaming is one step. What is recorded lies
under checksums in ``checkpoint.json``, which has its own, as disks and people damage files.
"""

from __future__ import annotations

import gzip
import shutil
import zlib
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from odscen.base.checksums import MISSING, file_digest, seal, unsealed
from odscen.base.errors import DamagedError, DamagedFile, SimulationError
from odscen.base.to_disk import to_disk
from odscen.runs.layout import RECORDED, SLICES_FOLDER

if TYPE_CHECKING:
    from pathlib import Path

CHECKPOINT_FILE = "checkpoint.json"
STATE_FILE = "state.xml.gz"
EVENTS_LINES = "events.jsonl"
FORMAT = "odscen-slice"
VERSION = 2
"""1 had no checksums that are checked today."""

_BLOCK = 1 << 20
_PART = ".part-"


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """A complete slice.

    Attributes
    ----------
    number
        From 1.
    time
        Simulated seconds at its end.
    last
        Whether the run ended with it.
    stopped
        Whether a user who watched the run ended it.
    routes
        Where in the routes file the next slice begins, bytes.
    steps, wall_seconds
        Of the run so far; wall seconds of simulating, in all processes that took part.
    memory
        Bytes that the process held at the end of the slice.
    running
        How many vehicles and persons were on the road.
    present
        Ids of all vehicles and persons that the state holds, as far as SUMO says.
    lanes
        How many vehicles the state holds on each lane.
    recorder
        What it remembers, see :meth:`odscen.sumo.worker.recorder.Recorder.state`.
    files
        SHA-256 by name.
    story
        What rules remember, see :meth:`odscen.sumo.worker.story.story_run.StoryRun.state`; nothing
        if there are none.
    driven
        Ids of vehicles that a behaviour model has driven.
    lights
        What lights show that a model switches, by their ids.
    """

    number: int
    time: float
    last: bool
    stopped: bool
    routes: int
    steps: int
    wall_seconds: float
    memory: int
    running: int
    present: list[str]
    recorder: dict[str, Any]
    files: dict[str, str]
    lanes: dict[str, int] = field(default_factory=dict)
    story: dict[str, Any] = field(default_factory=dict)
    driven: list[str] = field(default_factory=list)
    lights: dict[str, Any] = field(default_factory=dict)


def slice_folder(run: Path, number: int) -> Path:
    """Folder of a complete slice."""
    return run / SLICES_FOLDER / f"{number:04d}"


def part_folder(run: Path, number: int) -> Path:
    """Folder that a slice is written in; empty, whatever an earlier process left there."""
    folder = run / SLICES_FOLDER / f"{_PART}{number:04d}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def slice_size(run: Path, number: int) -> int:
    """Bytes that a slice takes, what it has recorded included."""
    files = [*slice_folder(run, number).iterdir()]
    files += [recorded_part(run, file, number) for file in RECORDED]
    return sum(file.stat().st_size for file in files if file.is_file())


def clear_parts(run: Path) -> None:
    """Remove what is left of slices, and of small files, that were not completed."""
    for folder in (run / SLICES_FOLDER).glob(f"{_PART}*"):
        shutil.rmtree(folder, ignore_errors=True)
    for file in run.glob(".*.part"):
        file.unlink(missing_ok=True)


def recorded_part(run: Path, file: str, number: int) -> Path:
    """Where a complete slice's part is, of one of :data:`odscen.runs.layout.RECORDED`."""
    return run / RECORDED[file] / f"part-{number:04d}.parquet"


def complete(run: Path, part: Path, checkpoint: Checkpoint) -> None:
    """Make a slice complete: all of it is on the disk, then it appears.

    Raises
    ------
    OSError
        If the disk is full, for example.
    """
    path = part / CHECKPOINT_FILE
    head = {"format": FORMAT, "version": VERSION}
    path.write_text(seal({**head, **asdict(checkpoint)}), encoding="utf-8")
    for name in (*checkpoint.files, CHECKPOINT_FILE):
        to_disk(part / name)
    to_disk(part)
    final = slice_folder(run, checkpoint.number)
    shutil.rmtree(final, ignore_errors=True)
    part.rename(final)
    to_disk(final.parent)
    settle(run, checkpoint.number)


def settle(run: Path, number: int) -> None:
    """Show what a complete slice has recorded, if that has not been done."""
    for file in RECORDED:
        inside = slice_folder(run, number) / file
        if inside.is_file():
            target = recorded_part(run, file, number)
            target.parent.mkdir(exist_ok=True)
            inside.replace(target)
            to_disk(target.parent)


def read_checkpoint(run: Path, number: int) -> Checkpoint:
    """Read what a slice has left.

    Raises
    ------
    SimulationError
        If it is damaged; says what.
    """
    path = slice_folder(run, number) / CHECKPOINT_FILE
    try:
        data = unsealed(path)
        head = data.pop("format"), data.pop("version")
        if head not in ((FORMAT, 1), (FORMAT, VERSION)):
            raise SimulationError(f"{path.name} is of another version")
        if head[1] == 1:
            data["files"] = {}
        return Checkpoint(**data)
    except DamagedError as error:
        wrong = error.files[0]._replace(file=path.relative_to(run).as_posix())
        raise SimulationError(str(wrong)) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise SimulationError(
            f"{path.relative_to(run).as_posix()} cannot be read ({error})"
        ) from error


def last_number(run: Path) -> int:
    """Number of the last of the complete slices that begin with the first; 0 for none."""
    number = 0
    while slice_folder(run, number + 1).is_dir():
        number += 1
    return number


def survey(run: Path) -> tuple[int, list[str]]:
    """Find the last slice up to which nothing is damaged, and put away what comes after it.

    Returns
    -------
    Its number (0: the run has to begin anew), and what was found wrong, in words.
    """
    whole, problems = 0, []
    last = last_number(run)
    for number in range(1, last + 1):
        settle(run, number)
        try:
            check(run, read_checkpoint(run, number))
        except SimulationError as error:
            problems.append(f"slice {number} is damaged: {error}")
            break
        whole = number
    for number in range(whole + 1, last + 1):
        shutil.rmtree(slice_folder(run, number))
        for file in RECORDED:
            recorded_part(run, file, number).unlink(missing_ok=True)
    return whole, problems


def check(run: Path, checkpoint: Checkpoint) -> None:
    """Compare the files of a slice with their checksums.

    Raises
    ------
    SimulationError
        If one is not as it was written.
    """
    number = checkpoint.number
    for name, expected in checkpoint.files.items():
        inside = slice_folder(run, number) / name
        path = recorded_part(run, name, number) if name in RECORDED else inside
        actual = file_digest(path) if path.is_file() else MISSING
        if actual != expected:
            wrong = DamagedFile(path.relative_to(run).as_posix(), expected, actual)
            raise SimulationError(str(wrong))


def part_sums(run: Path) -> dict[str, str]:
    """SHA-256 of what complete slices have recorded, as it was written, by path in the run."""
    sums = {}
    for number in range(1, last_number(run) + 1):
        for name, known in read_checkpoint(run, number).files.items():
            if name in RECORDED:
                sums[recorded_part(run, name, number).relative_to(run).as_posix()] = known
    return sums


def fingerprints(part: Path, names: tuple[str, ...]) -> dict[str, str]:
    """SHA-256 of files in a folder, of those that are there."""
    return {name: file_digest(part / name) for name in names if (part / name).is_file()}


def check_state(path: Path) -> None:
    """Make sure that SUMO has written a state to its end; it says nothing when a disk is full.

    Raises
    ------
    SimulationError
        If not.
    """
    tail = b""
    try:
        with gzip.open(path) as state:
            while block := state.read(_BLOCK):
                tail = (tail + block)[-64:]
    except (OSError, EOFError, zlib.error) as error:
        raise SimulationError(f"SUMO could not save its state: {error}") from error
    if b"</snapshot>" not in tail:
        raise SimulationError("SUMO has not saved its state to the end; the disk may be full")
