"""The maps that ship with odscen."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from odscen.base.errors import WorkspaceError


def shipped_maps() -> list[Path]:
    """Paths of the .xodr files that ship, sorted by name.

    An installed package holds them inside; a checkout has them in ``maps/``.

    Returns
    -------
    list of Path
        For :meth:`~odscen.maps.store.Workspace.add_map`.

    Raises
    ------
    WorkspaceError
        If they are in neither place.
    """
    inside = Path(str(files("odscen"))) / "shipped_maps"
    folder = inside if inside.is_dir() else Path(__file__).parents[3] / "maps"
    found = sorted(folder.glob("*.xodr"))
    if not found:
        raise WorkspaceError(
            f"the maps that ship are not where they should be ({folder}); install odscen again"
        )
    return found
