"""Shards of a dataset: what runs were exported to, as the readers of each format take it.

Arrays of a run name the file of their map, which a shard has once: that is written here, from the
map of the workspace, and compared with what each run says of it.
"""

from __future__ import annotations

import gzip
import io
import json
import math
import pickle
import shutil
import tarfile
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

from odscen.app.exchange.dataset_exports import ARRAYS, dataset_map
from odscen.base.atomic_folders import new_folder
from odscen.base.checksums import SUMS_FILE, check_files
from odscen.base.errors import ConflictError, InputError
from odscen.base.given_arrays import arrays_from_npz
from odscen.base.text_files import write_file
from odscen.base.to_disk import to_disk
from odscen.experiments.work import member
from odscen.formats.scenarionet_format import pickled
from odscen.learning.run_datasets import HUGGINGFACE, PYG, TAR_SUFFIX, WEBDATASET
from odscen.learning.shared_maps import about_of, named_map

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import BinaryIO

    import polars as pl

    from odscen.base.given_arrays import Array
    from odscen.formats.pyg_format import SharedMap
    from odscen.maps.store import Workspace

DatasetFormat = Literal["pyg", "webdataset", "huggingface", "scenarionet", "waymo", "commonroad"]
Compressible = Literal["waymo"]
_ARRAY_FORMATS: Final = (PYG, WEBDATASET, HUGGINGFACE)
ROWS_IN_GROUP: Final = 8
"""Runs that a reader of Parquet has to read at a time."""
MOST_ROWS: Final = 1000
"""Runs in a Parquet file, which is in memory while it is written."""


def exported_formats(formats: Sequence[DatasetFormat]) -> tuple[str, ...]:
    """What runs are exported to for formats of a dataset, each once."""
    return tuple(dict.fromkeys(_export_of(form) for form in formats))


def _export_of(form: str) -> str:
    return ARRAYS if form in _ARRAY_FORMATS else form


@dataclass(frozen=True)
class ShardSource:
    """What the shards of a dataset are written from.

    Attributes
    ----------
    workspace
        Has the maps.
    staged
        Has a folder for each format with one for each run.
    rows
        Of the table, by the folder of the run.
    compressed
        Formats whose files are compressed.
    """

    workspace: Workspace
    staged: Path
    rows: Mapping[str, Mapping[str, Any]]
    compressed: Sequence[str] = ()
    _maps: dict[tuple[str, str], SharedMap] = field(default_factory=dict)

    def files(self, form: str, run: str) -> list[Path]:
        """Files that a run was exported to, as they were written.

        Hidden ones are none of them: what a process that was killed had begun to write.

        Raises
        ------
        DamagedError
            If they are not as they were written.
        InputError
            If there are none.
        """
        folder = self.staged / _export_of(form) / run
        if not folder.is_dir():
            raise InputError(
                f"what run {run} was exported to is not there; make the dataset in another folder",
                file=str(folder),
            )
        check_files(folder)
        return sorted(
            path for path in folder.iterdir() if path.name != SUMS_FILE and path.name[0] != "."
        )

    def map_of(self, about: Mapping[str, Any], arrays: Mapping[str, Array], file: str) -> SharedMap:
        """The file of the map that arrays of a run name.

        Raises
        ------
        ConflictError
            If the map of the workspace is another one by now.
        """
        key = str(about["map"]), str(about["map_sha256"])
        if key not in self._maps:
            self._maps.clear()  # runs are in the order of their maps
            self._maps[key] = dataset_map(self.workspace, *key)
        shared, named = self._maps[key], named_map(arrays, file=file)
        if named is None or (shared.file, shared.sha256) != named:
            raise ConflictError(
                f"{file}: the arrays of map {key[0]!r} are others now than when this run was "
                "exported; make the dataset in another folder"
            )
        return shared


def write_shards(
    out: Path, source: ShardSource, runs: Sequence[str], *, form: str, size: int
) -> None:
    """Write the shards of a split in one format; the same files give the same bytes.

    Parameters
    ----------
    out
        Folder for the shards; whatever it has is removed.
    runs
        Folders of runs, in order.
    size
        Runs in a shard.
    """
    shutil.rmtree(out, ignore_errors=True)
    for number, first in enumerate(range(0, len(runs), size)):
        _WRITERS[form](out / f"shard-{number:05d}", source, runs[first : first + size])


@contextmanager
def _new_file(final: Path) -> Iterator[Path]:
    """Yield the path of a file that appears under its name when it is whole."""
    final.parent.mkdir(parents=True, exist_ok=True)
    part = final.with_name(f".{final.name}.part")
    yield part
    to_disk(part)
    part.replace(final)


# ------------------------------------------------------------------------------- arrays of runs
def _write_arrays(shard: Path, source: ShardSource, runs: Sequence[str]) -> None:
    """A folder of .npz files, with those of their maps in ``maps``."""
    with new_folder(shard) as folder:
        for run in runs:
            for path in source.files(PYG, run):
                content = path.read_bytes()
                (folder / path.name).write_bytes(content)
                _write_map_beside(folder, source, content, str(path))


def _write_map_beside(
    folder: Path, source: ShardSource, content: bytes, file: str
) -> dict[str, Any]:
    """Write the map that a run names, if it is not there; what the run says of itself."""
    arrays = arrays_from_npz(content, file=file, only=("about",))
    about = about_of(arrays) or {}
    shared = source.map_of(about, arrays, file)
    if not (folder / shared.file).is_file():
        write_file(folder / shared.file, shared.content)
    return about


def _write_tar(shard: Path, source: ShardSource, runs: Sequence[str]) -> None:
    """A tar file with KEY.json and KEY.npz of each run; maps are beside all tar files."""
    keys = _sample_keys(runs)
    with (
        _new_file(shard.with_name(shard.name + TAR_SUFFIX)) as part,
        tarfile.open(part, "w", format=tarfile.PAX_FORMAT) as archive,
    ):
        for run in runs:
            for path in source.files(WEBDATASET, run):
                content = path.read_bytes()
                about = _write_map_beside(shard.parent, source, content, str(path))
                row = {**about, "run": run, "figures": _keep_finite(source.rows.get(run, {}))}
                text = json.dumps(row, ensure_ascii=False, allow_nan=False).encode()
                for ending, data in (("json", text), ("npz", content)):
                    name = f"{keys[run]}.{ending}"
                    archive.addfile(member(name, len(data)), io.BytesIO(data))


def _sample_keys(runs: Sequence[str]) -> dict[str, str]:
    """Keys of samples: WebDataset takes what is before the first dot of a name, so none has one."""
    keys: dict[str, str] = {}
    for run in runs:
        key, number = run.replace(".", "_"), 1
        while key in keys.values():
            number += 1
            key = f"{run.replace('.', '_')}-{number}"
        keys[run] = key
    return keys


def _keep_finite(row: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a row that JSON can carry."""
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in row.items()
    }


def _write_parquet(shard: Path, source: ShardSource, runs: Sequence[str]) -> None:
    """A Parquet file with a row for each run; maps are rows of files in ``maps``."""
    import polars as pl

    rows = []
    for run in runs:
        for path in source.files(HUGGINGFACE, run):
            arrays = arrays_from_npz(path.read_bytes(), file=str(path))
            about = about_of(arrays) or {}
            shared = source.map_of(about, arrays, str(path))
            _write_map_row(shard.parent, shared)
            row = {**about, "run": run}
            rows.append(_make_row({name: row[name] for name in _RUN_COLUMNS}, arrays))
    with _new_file(shard.with_name(f"{shard.name}.parquet")) as part:
        pl.concat(rows).write_parquet(part, row_group_size=ROWS_IN_GROUP)


_RUN_COLUMNS: Final = (
    "run", "scenario", "map", "map_sha256", "seed", "recorded_step", "interpolated",
)  # fmt: skip


def _write_map_row(folder: Path, shared: SharedMap) -> None:
    file = (folder / shared.file).with_suffix(".parquet")
    if file.is_file():
        return
    arrays = arrays_from_npz(shared.content, file=shared.file)
    about = about_of(arrays, "map_about") or {}
    row = _make_row({name: about[name] for name in ("map", "map_sha256")}, arrays)
    with _new_file(file) as part:
        row.write_parquet(part)


def _make_row(row_values: Mapping[str, Any], arrays: Mapping[str, Array]) -> pl.DataFrame:
    """One row: what is said, and each array as nested lists."""
    import polars as pl

    own = {name: values for name, values in arrays.items() if not name.endswith("about")}
    columns = [pl.Series(name, [value]) for name, value in row_values.items()]
    return pl.DataFrame([*columns, *(_nest_values(name, values) for name, values in own.items())])


def _nest_values(name: str, values: Array) -> pl.Series:
    """An array as one value of a column."""
    import polars as pl

    flat = pl.Series(name, values.ravel())
    kind: pl.DataType = flat.dtype
    for _ in range(values.ndim - 1):
        kind = pl.List(kind)
    shaped = flat.reshape(values.shape).cast(kind) if values.ndim > 1 else flat
    return shaped.implode()


# ------------------------------------------------------------------------------- whole files
def _copy_files(shard: Path, source: ShardSource, runs: Sequence[str], form: str) -> None:
    with new_folder(shard) as folder:
        for run in runs:
            for path in source.files(form, run):
                (folder / path.name).write_bytes(path.read_bytes())


def _copy_commonroad(shard: Path, source: ShardSource, runs: Sequence[str]) -> None:
    _copy_files(shard, source, runs, "commonroad")


_INDEXES: Final = ("dataset_summary.pkl", "dataset_mapping.pkl")


def _merge_scenarionet(shard: Path, source: ShardSource, runs: Sequence[str]) -> None:
    """Copy the descriptions, and make one index of all."""
    indexes: dict[str, dict[str, object]] = {name: {} for name in _INDEXES}
    with new_folder(shard) as folder:
        for run in runs:
            for path in source.files("scenarionet", run):
                if path.name in indexes:
                    indexes[path.name] |= _plain_values(path)
                else:
                    (folder / path.name).write_bytes(path.read_bytes())
        for name, whole in indexes.items():
            (folder / name).write_bytes(pickled(whole))


def _plain_array(shape: tuple[int, ...], kind: str, content: bytearray) -> Any:
    """Array of numbers or texts as :func:`odscen.formats.scenarionet_format.pickled` has them."""
    import numpy as np

    if np.dtype(kind).hasobject:
        raise pickle.UnpicklingError("it holds an array of objects")
    return np.ndarray(shape, kind, content)


_PLAIN: Final[dict[tuple[str, str], Callable[..., Any]]] = {
    ("numpy", "ndarray"): _plain_array,
    ("builtins", "bytearray"): bytearray,
}


class _PlainUnpickler(pickle.Unpickler):
    """Reads texts, numbers, lists and arrays of them; all else would be code, and is refused."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _PLAIN:
            return _PLAIN[module, name]
        raise pickle.UnpicklingError(f"it holds {module}.{name}, which is no plain value")


def _plain_values(path: Path) -> dict[str, object]:
    """Index of a run in ScenarioNet's form."""
    try:
        found = _PlainUnpickler(io.BytesIO(path.read_bytes())).load()
        return dict(found)
    except Exception as error:  # whatever a file that is none leads to
        raise InputError(f"not an index of scenarios: {error}", file=str(path)) from error


_RECORDS, _INDEX = "scenarios.tfrecord", "index.json"


def _merge_waymo(shard: Path, source: ShardSource, runs: Sequence[str]) -> None:
    """Write all records one after the other: a file of the format may have any number."""
    listed = []
    with new_folder(shard) as folder:
        with _open_records(folder, compressed="waymo" in source.compressed) as records:
            for run in runs:
                for path in source.files("waymo", run):
                    if path.suffix == ".tfrecord":
                        records.write(path.read_bytes())
                    else:
                        listed.append(json.loads(path.read_bytes()))
        text = json.dumps({"runs": listed}, indent=1, ensure_ascii=False) + "\n"
        (folder / _INDEX).write_text(text, encoding="utf-8")


@contextmanager
def _open_records(folder: Path, *, compressed: bool) -> Iterator[BinaryIO]:
    if not compressed:
        with (folder / _RECORDS).open("wb") as plain:
            yield plain
        return
    with (
        (folder / f"{_RECORDS}.gz").open("wb") as raw,
        gzip.GzipFile("", "wb", 1, raw, mtime=0) as packed,
    ):
        yield packed  # type: ignore[misc]


_WRITERS: Final[dict[str, Callable[[Path, ShardSource, Sequence[str]], None]]] = {
    PYG: _write_arrays,
    WEBDATASET: _write_tar,
    HUGGINGFACE: _write_parquet,
    "scenarionet": _merge_scenarionet,
    "waymo": _merge_waymo,
    "commonroad": _copy_commonroad,
}
