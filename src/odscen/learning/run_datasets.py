"""Runs of a dataset, read one at a time; and batches of them of one shape.

Everything here is NumPy: torch's ``DataLoader`` takes a :class:`RunDataset` as it is, JAX the
batches.
"""

from __future__ import annotations

import json
import tarfile
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypedDict

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.base.given_arrays import MOST_UNPACKED
from odscen.base.given_files import as_path, read_given
from odscen.learning.hetero_data import own_arrays
from odscen.learning.shared_maps import named_map, read_shared_map

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from odscen.base.given_arrays import Array
    from odscen.base.given_files import GivenPath

PYG: Final = "pyg"
WEBDATASET: Final = "webdataset"
HUGGINGFACE: Final = "huggingface"
TAR_SUFFIX: Final = ".tar"
FACTS_FILE: Final = "dataset.json"
_KEPT_MAPS: Final = 4


class BatchSizes(TypedDict, total=False):
    """What fits all runs of a split, as :func:`batches` takes it by ``**``."""

    agents: int
    lights: int
    steps: int
    lanes: int


class _Place(NamedTuple):
    """Where the arrays of a run lie; a size of -1 is a whole file."""

    file: Path
    offset: int = 0
    size: int = -1
    name: str = ""


@dataclass(eq=False)
class RunDataset:
    """Runs of a split of a dataset; a run is read when it is asked for.

    It has a length and can be indexed and iterated over, so that ``torch.utils.data.DataLoader``
    takes it, with processes of its own, too. Each item is a dict of arrays, see
    docs/learning-formats.md, or what ``transform`` makes of it.

    Attributes
    ----------
    folder
        Of the dataset.
    split
        Of its splits.
    form
        ``pyg`` or ``webdataset``: which of its formats is read.
    transform
        Called with the arrays of each run, such as :func:`~odscen.datasets.hetero_data`.
    with_map
        Whether items have the arrays of their map.
    sizes
        ``agents``, ``lights`` and ``steps`` of the run of the split with the most, and ``lanes`` of
        the largest map: what :func:`batches` needs for batches of one shape.
    """

    folder: Path
    split: str
    form: str
    transform: Callable[[dict[str, Array]], Any] | None = None
    with_map: bool = True
    sizes: BatchSizes = field(default_factory=BatchSizes)

    def __post_init__(self) -> None:
        self._places = list(_find_runs(self.folder / self.split / self.form, self.form))
        self._maps: OrderedDict[tuple[str, str, str], dict[str, Array]] = OrderedDict()

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, number: int) -> Any:
        arrays = self._read_run(self._places[number])
        return arrays if self.transform is None else self.transform(arrays)

    def __iter__(self) -> Iterator[Any]:
        for number in range(len(self)):
            yield self[number]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_maps": OrderedDict()}

    def __repr__(self) -> str:
        return f"<RunDataset {self.folder} {self.split} ({self.form}): {len(self)} runs>"

    def _read_run(self, place: _Place) -> dict[str, Array]:
        label = f"{place.file}: {place.name}" if place.name else str(place.file)
        arrays = own_arrays(_read_part(place, label), file=label)
        named = named_map(arrays, file=label)
        if named is None or not self.with_map:
            return arrays
        folder = place.file.parent
        key = (str(folder), *named)
        if key not in self._maps:
            self._maps[key] = read_shared_map(folder, named, run=label)
            if len(self._maps) > _KEPT_MAPS:
                self._maps.popitem(last=False)
        self._maps.move_to_end(key)
        return self._maps[key] | arrays


def open_dataset(
    folder: GivenPath,
    *,
    split: str = "train",
    form: str | None = None,
    transform: Callable[[dict[str, Array]], Any] | None = None,
    with_map: bool = True,
) -> RunDataset:
    """Open a split of a dataset that ``odscen dataset`` has made.

    Parameters
    ----------
    folder
        Of the dataset.
    split
        One of its splits.
    form
        ``pyg`` or ``webdataset``; the first of them that it has if not given.
    transform
        Called with the arrays of each run.
    with_map
        Whether items have the arrays of their map.

    Raises
    ------
    InputError
        If no dataset is there, it has no such split or format, or runs are missing.
    """
    folder = as_path(folder)
    formats, splits, sizes = _read_facts(folder, split)
    if split not in splits:
        raise InputError(f"it has no split {split!r}: {', '.join(splits)}", file=str(folder))
    able = [one for one in formats if one in (PYG, WEBDATASET)]
    chosen = form or (able[0] if able else PYG)
    if chosen not in able:
        raise InputError(
            f"it has {', '.join(formats)}; pyg and webdataset are read here"
            if form is None or form not in formats
            else f"{form} is not read here, but by its own readers; pyg and webdataset are",
            file=str(folder),
        )
    if not with_map:
        sizes.pop("lanes", None)
    found = RunDataset(folder, split, chosen, transform, with_map, sizes)
    if len(found) != splits[split]:
        raise InputError(
            f"split {split} has {splits[split]} runs by {FACTS_FILE}, its shards have {len(found)}",
            file=str(folder),
        )
    return found


def _read_facts(folder: Path, split: str) -> tuple[list[str], dict[str, int], BatchSizes]:
    """Formats of a dataset, runs of each of its splits, and sizes of one."""
    file = folder / FACTS_FILE
    if not file.is_file():
        raise InputError(f"no complete dataset is here: it has no {FACTS_FILE}", file=str(folder))
    try:
        said = json.loads(read_given(file))
        formats = [str(form) for form in said["plan"]["formats"]]
        runs = {str(row["split"]): int(row["runs"]) for row in said["splits"]}
        sizes = BatchSizes()
        own = [row["most"] for row in said["maps"] if row["split"] == split and row.get("most")]
        if own:
            sizes["agents"] = max(int(most["agents"]) for most in own)
            sizes["lights"] = max(int(most["lights"]) for most in own)
            sizes["steps"] = max(int(most["steps"]) for most in own)
            sizes["lanes"] = max(int(most["lanes"]) for most in own)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError("it does not say what the dataset has", file=str(file)) from error
    return formats, runs, sizes


def _find_runs(folder: Path, form: str) -> Iterator[_Place]:
    if form == WEBDATASET:
        for file in sorted(folder.glob(f"shard-*{TAR_SUFFIX}")):
            yield from _runs_of_tar(file)
    else:
        for path in sorted(folder.glob("shard-*/*.npz")):
            yield _Place(path)


def _runs_of_tar(file: Path) -> Iterator[_Place]:
    try:
        with tarfile.open(file) as archive:
            end = file.stat().st_size
            for found in archive:
                if found.isfile() and found.name.endswith(".npz"):
                    if found.offset_data + found.size > end:
                        raise InputError(f"it ends within {found.name}", file=str(file))
                    yield _Place(file, found.offset_data, found.size, found.name)
    except (tarfile.TarError, OSError, EOFError, ValueError) as error:
        raise InputError(f"it cannot be read as a tar file: {error}", file=str(file)) from error


def _read_part(place: _Place, label: str) -> bytes:
    if place.size < 0:
        return read_given(place.file, most=MOST_UNPACKED)
    try:
        with place.file.open("rb") as stream:
            stream.seek(place.offset)
            return stream.read(place.size)
    except OSError as error:
        raise InputError(str(error.strerror or error), file=label) from error


# ------------------------------------------------------------------------------------- batches
NO_CATEGORY: Final = 255


def padded_batch(
    runs: Sequence[Mapping[str, Array]],
    *,
    agents: int | None = None,
    lights: int | None = None,
    steps: int | None = None,
    lanes: int | None = None,
    lane_points: int = 20,
) -> dict[str, Array]:
    """Put runs together in arrays of one shape, filled up with zeros.

    It is a flat dict of arrays of numbers: a pytree for JAX, and what
    ``torch.utils.data.default_convert`` makes tensors of. It can be a ``collate_fn``.

    Parameters
    ----------
    runs
        Arrays of each; they need their map for ``lanes`` only.
    agents, lights, steps
        Road users A, lanes with a light K and instants T of the result; as many as the run with
        the most has if not given.
    lanes
        Lanes L of the map; without it there are none.
    lane_points
        Points P of each, at equal shares of its own.

    Returns
    -------
    dict of str to numpy.ndarray
        Of B runs: ``origin`` (B, 2), m, float64, that places are relative to; ``time`` and
        ``time_valid`` (B, T); ``agent_state`` (B, A, T, 5), ``agent_valid`` (B, A, T),
        ``agent_size`` (B, A, 3), ``agent_category`` (B, A) (0 to 6, 255 for none) and
        ``agent_is_ego`` (B, A); ``light_color`` (B, K, T), ``light_stop`` (B, K, 3) and
        ``light_valid`` (B, K); with ``lanes`` also ``lane_point`` (B, L, P, 9) and ``lane_valid``
        (B, L). Reals are float32 but for the origin.

    Raises
    ------
    InputError
        If a run has more than fits, or no map where lanes are asked for.
    """
    if not runs:
        raise InputError("a batch needs a run")
    sizes = {
        "agents": _batch_size("agents", agents, [len(run["agent_id"]) for run in runs]),
        "lights": _batch_size("lights", lights, [len(run["light_lane"]) for run in runs]),
        "steps": _batch_size("steps", steps, [len(run["time"]) for run in runs]),
        "lanes": 0,
    }
    if lanes is not None:
        if any("lane_point" not in run for run in runs):
            raise InputError("lanes: a run has no map; open the dataset with its maps")
        counts = [len(run["lane_point_start"]) - 1 for run in runs]
        sizes["lanes"] = _batch_size("lanes", lanes, counts)
    rows = [_padded_run(run, sizes, lane_points) for run in runs]
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def _batch_size(name: str, asked: int | None, found: Sequence[int]) -> int:
    most = max(found)
    if asked is None:
        return most
    if most > asked:
        raise InputError(f"{name} is {asked}, and run {found.index(most)} of the batch has {most}")
    return asked


def _padded_run(
    run: Mapping[str, Array], sizes: Mapping[str, int], lane_points: int
) -> dict[str, Array]:
    agents, lights, steps = sizes["agents"], sizes["lights"], sizes["steps"]
    valid, state = run["agent_valid"], run["agent_state"]
    origin = state[valid][:, :2].mean(axis=0) if valid.any() else np.zeros(2)
    there = np.where(valid[..., None], _move_points(state, origin), 0.0)
    count = len(run["time"])
    found = {
        "origin": origin,
        "time": _fill_array(run["time"], (steps,), np.float32),
        "time_valid": np.arange(steps) < count,
        "agent_state": _fill_array(there, (agents, steps, state.shape[2]), np.float32),
        "agent_valid": _fill_array(valid, (agents, steps), np.bool_),
        "agent_size": _fill_array(run["agent_size"], (agents, 3), np.float32),
        "agent_category": _category_numbers(run["agent_category"], agents),
        "agent_is_ego": _fill_array(run["agent_is_ego"], (agents,), np.bool_),
        "light_color": _fill_array(run["light_color"], (lights, steps), np.uint8),
        "light_stop": _fill_array(_move_points(run["light_stop"], origin), (lights, 3), np.float32),
        "light_valid": np.arange(lights) < len(run["light_lane"]),
    }
    if sizes["lanes"]:
        points = _lane_points(run, origin, lane_points)
        found["lane_point"] = _fill_array(points, (sizes["lanes"], lane_points, 9), np.float32)
        found["lane_valid"] = np.arange(sizes["lanes"]) < len(points)
    return found


def _move_points(points: Array, origin: Array) -> Array:
    """Points x, y, ... relative to an origin."""
    moved = points.astype(np.float64)
    moved[..., :2] -= origin
    return moved


def _fill_array(values: Array, shape: tuple[int, ...], kind: type[np.generic]) -> Array:
    """Values at the beginning of an array of a shape, which is zero elsewhere."""
    whole = np.zeros(shape, dtype=kind)
    whole[tuple(slice(0, count) for count in values.shape)] = values
    return whole


def _category_numbers(names: Array, count: int) -> Array:
    number = {str(name): row for row, name in enumerate(Category)}
    found = np.full(count, NO_CATEGORY, dtype=np.uint8)
    found[: len(names)] = [number.get(str(name), NO_CATEGORY) for name in names]
    return found


def _lane_points(run: Mapping[str, Array], origin: Array, count: int) -> Array:
    """Shape ``(L, count, 9)``: points of each lane at equal shares of those it has."""
    start, points = run["lane_point_start"], run["lane_point"]
    moved = points.copy()
    for column in (0, 3, 6):
        moved[:, column : column + 2] -= origin
    last = (start[1:] - 1)[:, None]
    at = start[:-1, None] + np.linspace(0.0, 1.0, count) * (last - start[:-1, None])
    low = np.floor(at).astype(np.int64)
    share = (at - low)[..., None]
    after = np.minimum(low + 1, last)
    between: Array = moved[low] * (1.0 - share) + moved[after] * share
    return between


def batches(
    runs: RunDataset,
    size: int,
    *,
    seed: int | None = None,
    drop_last: bool = False,
    agents: int | None = None,
    lights: int | None = None,
    steps: int | None = None,
    lanes: int | None = None,
    lane_points: int = 20,
) -> Iterator[dict[str, Array]]:
    """Batches of a dataset, one after the other; only one is in memory.

    Parameters
    ----------
    runs
        Of :func:`open_dataset`, without a transform.
    size
        Runs in a batch.
    seed
        Of the order; that of the dataset if not given.
    drop_last
        Leaves out a last batch that is smaller.
    agents, lights, steps, lanes, lane_points
        Of :func:`padded_batch`, whose errors it has: give them where all batches are to have one
        shape, as a function that JAX has compiled wants it; ``**runs.sizes`` fits all of a split.

    Yields
    ------
    dict of str to numpy.ndarray
        As of :func:`padded_batch`.

    Raises
    ------
    InputError
        If the size is below 1.
    """
    if size < 1:
        raise InputError(f"size is {size}, and a batch has a run at least")
    order = np.arange(len(runs))
    if seed is not None:
        np.random.default_rng(seed).shuffle(order)
    for first in range(0, len(order), size):
        rows = order[first : first + size].tolist()
        if drop_last and len(rows) < size:
            return
        yield padded_batch(
            [runs[row] for row in rows],
            agents=agents,
            lights=lights,
            steps=steps,
            lanes=lanes,
            lane_points=lane_points,
        )
