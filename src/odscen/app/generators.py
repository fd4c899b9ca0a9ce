"""Generators of traffic from outside: by name, from an installed package, or another program.

An installed package offers one in its ``pyproject.toml``::

    [project.entry-points."odscen.generators"]
    mine = "my_package.traffic:MyGenerator"

The page chooses among these and the one that ships; it cannot name a module or a program.
"""

from __future__ import annotations

import shlex
import subprocess
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, NotFoundError, OdscenError
from odscen.learning.fill import (
    CheckedFill,
    Fill,
    FillRequest,
    checked_fill,
    fill_from_arrays,
    fill_from_bytes,
    request_bytes,
)
from odscen.learning.offered_models import installed_names, named_object, offered_models
from odscen.learning.offered_options import OptionValue, values_for
from odscen.scenario.document.distributions import stream

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    import numpy as np

    from odscen.app.maps import LoadedMap
    from odscen.base.categories import Body, Category
    from odscen.lanegraph.graphs import MapGraph
    from odscen.learning.fill import Generator
    from odscen.learning.offered_models import OfferedModel
    from odscen.learning.traffic_snapshots import LightView
    from odscen.scenario.document.scenario_document import Actor
    from odscen.scenario.document.signals_document import Signals
    from odscen.scenario.edits.actor_edits import NamedPlacer
    from odscen.scenario.placing.region import Region
    from odscen.scenario.sampling.sampler import WantedUsers

GROUP = "odscen.generators"
"""Of entry points."""
REFERENCE = "reference"
"""Name of the generator that ships with odscen."""
TIME_LIMIT = 600.0
"""Seconds that another program may take for one fill."""
LONGEST_WARM_UP = 3600.0
"""Seconds."""
_LAST_LINES = 5
MOST_BYTES = 1_000_000_000
"""Of the file that another program writes."""


class GeneratorDoor(NamedTuple):
    """Where traffic comes from: a class or an entry point by name, or the line of a command.

    ``options`` are those of a class, see :mod:`odscen.learning.offered_options`. What is placed is
    driven for ``warm_up`` seconds before a scenario begins.
    """

    name: str | None = None
    command: str | None = None
    time_limit: float = TIME_LIMIT
    options: Mapping[str, OptionValue] = MappingProxyType({})
    warm_up: float = 0.0


def open_generator(door: GeneratorDoor) -> Generator:
    """Find a generator; it is made once and asked for each scenario.

    Raises
    ------
    InputError
        If there is none, it cannot be imported or made, or an option is not possible.
    """
    if not 0.0 <= door.warm_up <= LONGEST_WARM_UP:
        raise InputError(
            f"a warm-up takes 0 to {LONGEST_WARM_UP:g} s, not {door.warm_up:g} s", element="warm_up"
        )
    if door.command is not None and door.name is not None:
        raise InputError("a generator is given by its name or as a command, not both")
    if door.command is not None:
        if door.options:
            raise InputError(
                "options are for classes; those of another program go into its command",
                element="generator",
            )
        return _Command(_split_command(door.command), door.time_limit)
    name = door.name or ""
    found = _find_generator(name)
    values = values_for(found, door.options, name=name)
    try:
        made = found(**values) if isinstance(found, type) else found
    except Exception as error:  # whatever code from outside may raise
        raise InputError(f"it cannot be made: {error!r}", element=name) from error
    if not callable(getattr(made, "fill", None)):
        raise InputError("it has no method `fill(graph, request, rng)`", element=name)
    return _GuardedGenerator(made, name)


def installed_generators() -> tuple[OfferedModel, ...]:
    """The generator that ships and those of installed packages, by name, with their options."""
    return offered_models(_list_installed(), _find_generator)


def placer_of(loaded: LoadedMap) -> NamedPlacer:
    """Place actors on a map by an installed generator: its name, options, and a seed.

    The function raises :class:`NotFoundError` for any other name, that of a module included.
    """

    def place_by(
        name: str, options: Mapping[str, OptionValue], seed: int, signals: Signals
    ) -> Callable[[Region, WantedUsers], tuple[Actor, ...]]:
        from odscen.sumo.realize.signals_ahead import lights_at_start

        known = _list_installed()
        if name not in known:
            raise NotFoundError("generator", name, known)
        placer = Placer(open_generator(GeneratorDoor(name, options=options)))
        lights = lights_at_start(loaded.sumo, signals)
        return placer.for_scenario(loaded.usable.bodies, seed, lights=lights)

    return place_by


def _list_installed() -> list[str]:
    return installed_names(GROUP, [REFERENCE])


class Placer:
    """Places actors by a generator, scenario after scenario.

    Attributes
    ----------
    checked
        What came of the last fill.
    """

    def __init__(self, generator: Generator) -> None:
        self._generator = generator
        self.checked: CheckedFill | None = None

    def for_scenario(
        self,
        bodies: Mapping[Category, Body],
        seed: int,
        *,
        lights: LightView | None = None,
        drive: Callable[[Region, FillRequest, Sequence[Actor]], Fill | None] | None = None,
    ) -> Callable[[Region, WantedUsers], tuple[Actor, ...]]:
        """Make the function that asks for a fill of a region, and makes actors of what is good.

        It raises :class:`InputError` if nothing of a fill is.

        Parameters
        ----------
        lights
            What the lights of the map show at the beginning, if it has any.
        drive
            Drives what is placed before the scenario begins, and says where all are then; ``None``
            for nobody that could be placed.
        """

        def place(region: Region, crew: WantedUsers) -> tuple[Actor, ...]:
            request = FillRequest(
                graph=region.graph,
                roads=region.lanes,
                walks=region.walks,
                allowed={**crew.road_places.allowed, **crew.walk_places.allowed},
                bodies=bodies,
                vehicles=crew.vehicles,
                walkers=crew.walkers,
                seed=seed,
                given_lights=lights,
            )
            given = self._generator.fill(region.graph, request, stream(seed, "generator"))
            fill = given if isinstance(given, Fill) else fill_from_arrays(given)
            self.checked = checked_fill(fill, request, region)
            if drive is not None and self.checked.actors:
                driven = drive(region, request, self.checked.actors)
                if driven is not None:
                    self.checked = checked_fill(driven, request, region)
            if self.checked.given and not self.checked.actors:
                why = self.checked.remarks[0].why
                raise InputError(
                    f"none of its {self.checked.given} road users can be placed; the first: {why}",
                    element="generator",
                )
            return self.checked.actors

        return place


@dataclass(frozen=True)
class _GuardedGenerator:
    """Code from outside whose errors end in a message that names it."""

    generator: Generator
    name: str

    def fill(self, graph: MapGraph, request: FillRequest, rng: np.random.Generator) -> Fill:
        try:
            given = self.generator.fill(graph, request, rng)
            arrays = (
                {name: getattr(given, name) for name in Fill.__slots__}
                if isinstance(given, Fill)
                else dict(given)
            )
        except OdscenError:
            raise
        except Exception as error:
            raise InputError(f"it failed: {error!r}", element=self.name) from error
        try:
            return fill_from_arrays(arrays)
        except InputError as error:
            error.file = f"fill of {self.name}"
            raise


@dataclass(frozen=True)
class _Command:
    """Another program, in any language: reads one .npz file and writes another."""

    words: tuple[str, ...]
    time_limit: float

    def fill(self, graph: MapGraph, request: FillRequest, rng: np.random.Generator) -> Fill:
        del graph, rng  # the request has both: the map, and the seed
        with scratch_folder() as folder:
            given, made = folder / "request", folder / "fill"
            given.with_suffix(".npz").write_bytes(request_bytes(request))
            self._run_command(
                [word.format_map(_file_arguments(given, made)) for word in self.words]
            )
            out = made.with_suffix(".npz")
            if not out.is_file():
                raise InputError(
                    "it has ended, but written no file where {out}.npz says", element=self.words[0]
                )
            if out.stat().st_size > MOST_BYTES:
                raise InputError(
                    f"its file has {out.stat().st_size:,} bytes; {MOST_BYTES:,} are the most",
                    element=self.words[0],
                )
            return fill_from_bytes(out.read_bytes(), file=f"fill of {self.words[0]}")

    def _run_command(self, words: list[str]) -> None:
        try:
            done = subprocess.run(
                words,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=self.time_limit,
                check=False,
            )
        except FileNotFoundError as error:
            raise InputError("there is no such program", element=words[0]) from error
        except OSError as error:
            raise InputError(f"it cannot be started: {error.strerror}", element=words[0]) from error
        except subprocess.TimeoutExpired as error:
            raise InputError(
                f"it took more than {self.time_limit:g} s", element=words[0]
            ) from error
        if done.returncode:
            lines = done.stderr.decode("utf-8", "replace").strip().splitlines()[-_LAST_LINES:]
            output = f": {' / '.join(lines)}" if lines else ""
            raise InputError(f"it ended with exit code {done.returncode}{output}", element=words[0])


def _file_arguments(given: Path, made: Path) -> dict[str, str]:
    return {"in": str(given), "out": str(made)}


def _split_command(command: str) -> tuple[str, ...]:
    try:
        words = tuple(shlex.split(command))
        filled = "".join(words).format_map({"in": "\0", "out": "\1"})
    except (ValueError, KeyError, IndexError, AttributeError) as error:
        raise InputError(
            f"{command!r} is no command with {{in}} and {{out}}: {error}", element="generator"
        ) from error
    for name, mark in (("{in}", "\0"), ("{out}", "\1")):
        if mark not in filled:
            raise InputError(f"{command!r} does not say where {name} goes", element="generator")
    return words


def _find_generator(name: str) -> Any:
    if name == REFERENCE:
        from odscen.learning.reference.reference_generator import ReferenceGenerator

        return ReferenceGenerator
    shipped = f"{REFERENCE!r} ships"
    return named_object(name, group=GROUP, what="generator", shipped=shipped)
