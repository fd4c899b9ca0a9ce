"""Files from outside, worked on in a child process with what their size allows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import in_file
from odscen.maps.allowances import for_document, unpacked_size
from odscen.maps.child_process import work_in_child

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from odscen.convert.model.conversion_settings import ConversionSettings
    from odscen.maps.allowances import BuildLimits
    from odscen.maps.converters import GivenNetwork
    from odscen.maps.importers.base import ImportSettings
    from odscen.scenario.document.scenario_document import Scenario

_XODR = "map.xodr"


def build_in_child(
    content: bytes,
    folder: Path,
    *,
    name: str,
    file: str,
    settings: ConversionSettings,
    builder: str,
    given: GivenNetwork | None,
    importing: ImportSettings,
    limits: BuildLimits,
    progress: Callable[[str, float], None] | None,
) -> str:
    """Fill ``folder`` with the files of a map, see :func:`odscen.maps.map_build.build_map`.

    Returns
    -------
    Name of the file in the folder that has ``content``.

    Raises
    ------
    LimitError
        If the map needs more than its limits.
    OdscenError
        As :func:`~odscen.maps.map_build.build_map` does.
    """
    allowance = limits.for_map(
        unpacked_size(content),
        spacing=settings.spacing,
        network=len(given.net_xml) if given else 0,
    )
    with scratch_folder() as scratch:
        (folder / _XODR).write_bytes(content)
        network = None
        if given is not None:
            network = scratch / "given.net.xml"
            network.write_bytes(given.net_xml)
        done = work_in_child(
            "map",
            what="building the map",
            arguments={
                "folder": str(folder),
                "name": name,
                "file": file,
                "builder": builder,
                "spacing": settings.spacing,
                "converter": settings.converter,
                "given": None if network is None else str(network),
                "source": given.source if given else "",
                "importer": importing.importer,
                "options": dict(importing.options),
                "edits": importing.edits,
                "times_usual": allowance.times_usual,
            },
            folders=(scratch, folder),
            allowance=allowance,
            progress=progress,
        )
        return str(done["content"])


def read_scenario_in_child(content: bytes, *, file: str | None = None) -> Scenario:
    """Read a scenario from outside, see :func:`odscen.scenario.forms.any_form.read_any`.

    What a child has read within its limits is then read here from the document that it has written.

    Raises
    ------
    ScenarioError
        If it is no scenario, or has problems.
    LimitError
        If reading it needs more than a file of its size may.
    """
    from odscen.scenario.document.json_form import loads

    with scratch_folder() as scratch:
        path = scratch / "scenario"
        path.write_bytes(content)
        with in_file(file or "the scenario"):
            work_in_child(
                "scenario",
                what="reading the scenario",
                arguments={"path": str(path), "file": file},
                folders=(scratch,),
                allowance=for_document(len(content)),
            )
        return loads(path.read_text(encoding="utf-8"), file=file)
