"""Shards: folders of so many runs each, that readers of the format take as they are.

Of each split and format: ``train/pyg/shard-00000/``. A shard of ``scenarionet`` has the two indexes
of such a folder, one of ``waymo`` a single ``scenarios.tfrecord`` with an index beside it.
"""

from __future__ import annotations

import json
import pickle
from typing import TYPE_CHECKING, Final

from odscen.base.atomic_folders import new_folder
from odscen.formats.scenarionet_format import pickled

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    Writer = Callable[[Path, Mapping[str, Sequence[Path]]], None]

_INDEXES: Final = ("dataset_summary.pkl", "dataset_mapping.pkl")
_RECORDS, _INDEX = "scenarios.tfrecord", "index.json"


def write_shards(
    out: Path, staged: Path, runs: Sequence[str], *, form: str, size: int
) -> list[Path]:
    """Write the shards of a split in one format.

    Parameters
    ----------
    out
        Folder for the shards.
    staged
        Has a folder of files for each run.
    runs
        Names of those folders, in order.
    size
        Runs in a shard.

    Returns
    -------
    list of Path
        Folders, in order; the same files give the same bytes.
    """
    written = []
    for number, first in enumerate(range(0, len(runs), size)):
        part = runs[first : first + size]
        files = {run: sorted(one for one in (staged / run).iterdir()) for run in part}
        folder = out / f"shard-{number:05d}"
        with new_folder(folder) as making:
            _WRITERS.get(form, _copied)(making, files)
        written.append(folder)
    return written


def _copied(folder: Path, files: Mapping[str, Sequence[Path]]) -> None:
    for paths in files.values():
        for path in paths:
            (folder / path.name).write_bytes(path.read_bytes())


def _scenarionet(folder: Path, files: Mapping[str, Sequence[Path]]) -> None:
    """Copy the descriptions, and make one index of all."""
    for index in _INDEXES:
        whole: dict[str, object] = {}
        for paths in files.values():
            for path in paths:
                if path.name == index:
                    whole |= pickle.loads(path.read_bytes())  # noqa: S301 - our own, of this study
        (folder / index).write_bytes(pickled(whole))
    rest = {run: [one for one in paths if one.name not in _INDEXES] for run, paths in files.items()}
    _copied(folder, rest)


def _waymo(folder: Path, files: Mapping[str, Sequence[Path]]) -> None:
    """Write all records one after the other: a file of the format may have any number."""
    listed = []
    with (folder / _RECORDS).open("wb") as records:
        for paths in files.values():
            for path in paths:
                if path.suffix == ".tfrecord":
                    records.write(path.read_bytes())
                else:
                    listed.append(json.loads(path.read_bytes()))
    text = json.dumps({"runs": listed}, indent=1, ensure_ascii=False) + "\n"
    (folder / _INDEX).write_text(text, encoding="utf-8")


_WRITERS: Final[dict[str, Writer]] = {"scenarionet": _scenarionet, "waymo": _waymo}
