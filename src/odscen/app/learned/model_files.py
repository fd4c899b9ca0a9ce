"""Models of traffic, trained on shards of snapshots, as files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.learned.learned_maps import examples_of
from odscen.app.learned.snapshot_data import read_shards
from odscen.base.errors import InputError
from odscen.base.given_files import as_path, read_given
from odscen.base.text_files import write_file
from odscen.learning.reference.model_training import TrainingSettings, train_model
from odscen.learning.reference.traffic_model import model_bytes, model_from_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.base.given_files import GivenPath
    from odscen.learning.reference.traffic_model import TrafficModel
    from odscen.learning.traffic_snapshots import Shard
    from odscen.maps.store import Workspace


def train(
    workspace: Workspace,
    data: GivenPath,
    out: GivenPath,
    *,
    hold_out: Sequence[str] = (),
    settings: TrainingSettings | None = None,
    told: Callable[[str], None] | None = None,
) -> TrafficModel:
    """Train a model on the shards of a folder, and write it.

    Parameters
    ----------
    data
        Folder of :func:`~odscen.app.learned.snapshot_data.make_shards`.
    out
        File to write.
    hold_out
        Towns that are left out, to be evaluated on.

    Raises
    ------
    InputError
        If there are no shards, a town is not among them, or nothing is left to learn from.
    NotFoundError
        If the workspace lacks one of the maps.
    """
    shards = read_shards(data)
    model = train_on(workspace, kept(shards, hold_out), settings=settings, told=told)
    write_file(as_path(out), model_bytes(model))
    return model


def train_on(
    workspace: Workspace,
    shards: Sequence[Shard],
    *,
    settings: TrainingSettings | None = None,
    told: Callable[[str], None] | None = None,
) -> TrafficModel:
    """Train a model on shards; errors of :func:`train`."""
    about = {
        "maps": sorted({shard.map_name for shard in shards}),
        "runs": len(shards),
        "snapshots": sum(len(shard.snapshots) for shard in shards),
    }
    settings = settings or TrainingSettings()
    return train_model(examples_of(workspace, shards), settings=settings, about=about, told=told)


def kept(shards: Sequence[Shard], hold_out: Sequence[str]) -> list[Shard]:
    """Shards of all towns but some.

    Raises
    ------
    InputError
        If there is no such town.
    """
    towns = sorted({shard.town for shard in shards})
    for town in hold_out:
        if town not in towns:
            raise InputError(
                f"there is no town {town!r} in the data; there are {', '.join(towns)}",
                element="hold-out",
            )
    return [shard for shard in shards if shard.town not in hold_out]


def read_model(file: GivenPath) -> TrafficModel:
    """Read a model.

    Raises
    ------
    InputError
        If it cannot be read, or is none.
    """
    return model_from_bytes(read_given(as_path(file)), file=str(file))
