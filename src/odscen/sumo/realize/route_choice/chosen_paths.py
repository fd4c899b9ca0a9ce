"""The paths of all road users of a scenario, with the routes that its demand chooses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.categories import DEFAULT_BODY
from odscen.scenario.demand.zones import segments_of
from odscen.scenario.document.distributions import stream
from odscen.sumo.realize.route_choice.travel_times import free_flow_costs
from odscen.sumo.realize.route_paths import CostRouter, each_path

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.base.arrays import Int32Array
    from odscen.base.categories import Body
    from odscen.lanegraph.shortest_paths import Router
    from odscen.scenario.document.scenario_document import Scenario, SharedRoutes
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.road_user import RoadUser


class RoutesOfDemand:
    """Chooses paths for the road users of one scenario.

    Without assigned paths, trips that choose by travel time take the quickest route in free
    flow.

    Parameters
    ----------
    scenario
        Says how trips choose.
    region
        Of the scenario.
    drivable
        Paths over lanes that SUMO has.
    """

    def __init__(
        self,
        scenario: Scenario,
        region: Region,
        drivable: Router,
    ) -> None:
        self._scenario = scenario
        self._region = region
        self._drivable = drivable
        self._choice = scenario.demand.routes
        self._generated = frozenset(part.id for part in scenario.demand.counts)
        self._ways: CostRouter | None = None
        if self._choice.by == "travel_time":
            lanes = region.graph.lanes
            costs = free_flow_costs(lanes)
            self._ways = CostRouter(drivable.with_costs(costs), lanes, costs)

    def chooses(self, user: RoadUser) -> bool:
        """Whether a road user chooses among routes: trips by vehicle, except those from counts."""
        return user.trip and not user.person and user.flow not in self._generated

    def informed(self, user: RoadUser) -> bool:
        """Whether the driver of a trip looks for quicker routes on the way, by seed and id."""
        share = self._choice.informed
        if not share or not self.chooses(user):
            return False
        return float(stream(self._scenario.seed, "informed", user.id).random()) < share

    def shared(self, user: RoadUser) -> bool:
        """Whether the routes of a trip have fixed shares."""
        return self._shares_of(user) is not None

    def each_path(
        self,
        users: Sequence[RoadUser],
        bodies: Sequence[Body] | None = None,
        assigned: Mapping[str, Int32Array] | None = None,
    ) -> Iterator[tuple[int, Int32Array]]:
        """Yield the position of each user and the nodes of its route, in no particular order.

        Parameters
        ----------
        bodies
            Of the users; those of their categories if not given.
        assigned
            Paths found before, by the id of the trip.
        """
        if bodies is None:
            bodies = [DEFAULT_BODY[user.category] for user in users]
        rest: list[int] = []
        for index, user in enumerate(users):
            path = (assigned or {}).get(user.id)
            if path is None and self._choice.shares:
                path = self.shared_path(user, bodies[index])
            if path is None:
                rest.append(index)
            else:
                yield index, path
        quick = [index for index in rest if self._ways is not None and self.chooses(users[index])]
        chosen = set(quick)
        for group, ways in ((quick, self._ways), ([k for k in rest if k not in chosen], None)):
            found = each_path(
                [users[index] for index in group],
                self._region,
                self._drivable,
                [bodies[index] for index in group],
                quickest=ways,
            )
            for position, path in found:
                yield group[position], path

    def shared_path(self, user: RoadUser, body: Body) -> Int32Array | None:
        """Path of a trip whose routes have fixed shares; ``None`` if it has none, or no such path.

        Which one it takes depends on the scenario's seed and the trip's id alone.
        """
        shares = self._shares_of(user)
        if shares is None:
            return None
        drawn = float(stream(self._scenario.seed, "route share", user.id).random())
        bounds = np.cumsum([share for _, share in shares.routes])
        row = int(np.searchsorted(bounds, drawn * bounds[-1], side="right"))
        via = shares.routes[min(row, len(shares.routes) - 1)][0]
        if not via:
            return None
        graph = self._region.graph
        rows = {str(name): row for row, name in enumerate(graph.segments.ids)}
        places = [
            np.flatnonzero(graph.lanes.segment == rows[name]).astype(np.int32) for name in via
        ]
        ways = self._ways or CostRouter(self._drivable, graph.lanes)
        path = ways.path_over(user.spawn, body, places, user.goal)
        return path if len(path) else None

    def _shares_of(self, user: RoadUser) -> SharedRoutes | None:
        """Return the first of the shares that are for a trip between these segments."""
        graph, demand = self._region.graph, self._scenario.demand
        segment = graph.lanes.segment
        if not self._choice.shares or not self.chooses(user):
            return None
        here, there = (str(graph.segments.ids[segment[node]]) for node in (user.spawn, user.goal))
        for share in self._choice.shares:
            if here in segments_of(demand, share.origin) and there in segments_of(
                demand, share.destination
            ):
                return share
        return None
