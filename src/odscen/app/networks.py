"""The SUMO networks of a map: brought in from outside, and side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.convert.imported.network_changes import NetworkState, network_changes
from odscen.maps.allowances import BY_SIZE

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from odscen.convert.imported.network_changes import NetworkChange
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace


class BroughtIn(NamedTuple):
    """A map with a network from outside, and what is different from the one that it had."""

    entry: MapEntry
    changes: tuple[NetworkChange, ...]


def bring_in(
    workspace: Workspace,
    name: str,
    source: Path,
    *,
    limits: BuildLimits = BY_SIZE,
    progress: Callable[[str, float], None] | None = None,
) -> BroughtIn:
    """Make a SUMO network that was changed elsewhere that of a map.

    Parameters
    ----------
    name
        Of the map.
    source
        The ``.net.xml``.
    limits
        What building the map may use.

    Raises
    ------
    NotFoundError
        If there is no such map.
    InputError
        If the file cannot be read, is no network, or none of this map; the map stays as it is.
    """
    before = _read_network_state(workspace.map(name))
    entry = workspace.set_network(name, source, limits=limits, progress=progress)
    return BroughtIn(entry, network_changes(before, _read_network_state(entry)))


def _read_network_state(entry: MapEntry) -> NetworkState:
    return NetworkState(entry.lane_table(), entry.fidelity())
