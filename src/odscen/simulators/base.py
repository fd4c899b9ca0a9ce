"""The seam of simulators: what plays a scenario, and what it is given for that.

An installed package offers one in its ``pyproject.toml``::

    [project.entry-points."odscen.simulators"]
    mine = "my_package.simulator:MySimulator"

``docs/simulators.md`` has a whole one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeVar

from odscen.base.errors import InputError
from odscen.runs.new_run import PreparedRun

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import MapGraph
    from odscen.runs.new_run import SimulationOutcome
    from odscen.runs.reporter import Reporter
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.assets import Assets


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """Where a road user is to go: K nodes of the lane graph, or of the pedestrian graph.

    Attributes
    ----------
    nodes
        Their ids, ``road.section.lane.index``.
    points
        Shape ``(K, 3)``, metres, OpenDRIVE frame: the middle of lanes, without the lateral offset
        of the road user.
    hdg
        Shape ``(K,)``, rad: direction of travel.
    speed
        Shape ``(K - 1,)``, m/s: wanted between a node and the next, alone on the road.
    """

    nodes: tuple[str, ...]
    points: FloatArray
    hdg: FloatArray
    speed: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class RoutedRun(PreparedRun):
    """A prepared run with the route of each road user.

    Attributes
    ----------
    routes
        By the id of the road user in ``plan.actors``; whoever has no route is not there, and its
        ``problem`` in the plan says why.
    """

    routes: Mapping[str, Route] = field(default_factory=dict)


class SimulatedMap(Protocol):
    """A map of the catalogue, as simulators are given it."""

    @property
    def name(self) -> str:
        """Name in the catalogue."""

    @property
    def sha256(self) -> str:
        """SHA-256 of its OpenDRIVE file, hexadecimal."""

    @property
    def assets(self) -> Assets:
        """Models of road users and weather presets that scenarios on it may name."""

    @property
    def graph(self) -> MapGraph:
        """Lane graph, segments and pedestrian graph."""

    def file(self, key: str) -> Path:
        """Path of one of its files, of those that ``map.json`` names: ``"xodr"``, for example."""

    def routed_run(self, scenario: Scenario, settings: RunSettings) -> RoutedRun:
        """Plan a run: who departs when and where, and each one's route.

        Raises
        ------
        ScenarioError
            With every actor and flow whose spawn or goal is not usable.
        """


Prepared = TypeVar("Prepared", bound=PreparedRun)


class Simulator(ABC, Generic[Prepared]):
    """Plays scenarios: it prepares a run, and leaves its records in the run's folder.

    A class is made with its options as keyword arguments, see
    :mod:`odscen.learning.offered_options`. :class:`odscen.simulators.positions.PositionRecord`
    makes all records of plain positions; figures and report follow from those.

    >>> class Teleporter(Simulator[RoutedRun]):
    ...     '''All are at their goals one second after departing.'''
    ...
    ...     label = "Teleporter"
    ...
    ...     def prepare(self, scenario, on, settings, reporter):
    ...         return on.routed_run(scenario, settings)
    ...
    ...     def run(self, prepared, folder, reporter):
    ...         record = PositionRecord(prepared)
    ...         for time in record.times(reporter):
    ...             there = []
    ...             for actor in prepared.plan.actors:
    ...                 if 0.0 <= time - actor.depart < 1.0 and actor.id in prepared.routes:
    ...                     x, y, z = prepared.routes[actor.id].points[-1]
    ...                     there.append(Position(actor.id, x, y, actor.hdg, z=z))
    ...             record.add(time, there)
    ...         return record.write(folder)
    >>> run = odscen.run(workspace, scenario, simulator=Teleporter())
    >>> run.status
    <RunStatus.COMPLETED: 'completed'>
    >>> run.counts["arrived"] == run.counts["planned"]
    True
    """

    label: ClassVar[str]
    """What people call it."""
    versions: Mapping[str, str] = {}
    """What ``summary.json`` says of it under ``versions``."""

    def unsupported(self, scenario: Scenario, on: SimulatedMap) -> Iterable[Problem]:
        """List what it does not do of a scenario; with an error among it, none is run."""
        del scenario, on
        return ()

    def check_settings(self, settings: RunSettings) -> None:
        """Refuse settings that it cannot follow.

        Raises
        ------
        InputError
            If one is asked for; unless a simulator says otherwise, those that only SUMO has.
        """
        only_sumo = {
            "meso": settings.meso,
            "a behaviour model": settings.behaviour is not None,
            "criticality": settings.recorded.criticality,
        }
        for name, wanted in only_sumo.items():
            if wanted:
                raise InputError(f"{name} is SUMO's: {self.label} cannot do it; leave it out")

    @abstractmethod
    def prepare(
        self, scenario: Scenario, on: SimulatedMap, settings: RunSettings, reporter: Reporter
    ) -> Prepared:
        """Make everything that a run is made of; nothing is written yet."""

    @abstractmethod
    def run(self, prepared: Prepared, folder: Path, reporter: Reporter) -> SimulationOutcome:
        """Simulate, and leave ``events.json``, ``actors.json`` and what else is recorded.

        Scenario and plan are in the folder. It says how far it is, and ends early when the reporter
        is cancelled.
        """


AnySimulator = Simulator[Any]
