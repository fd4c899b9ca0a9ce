"""Routes of the demand in the scenario document: how trips choose among the ways there are.

Placed actors and flows take the shortest route whatever is said here; so does traffic that is
generated from counts, for its routes are chosen to pass the count stations.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from odscen.scenario.document.document_parts import Label, Part

RouteShare = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
"""Relative to the other routes of the same trips."""
Via = Annotated[tuple[Label, ...], Field(max_length=50)]
"""Segments that a route leads over, in this order; without any it is the usual route."""


class SharedRoutes(Part):
    """Trips from ``origin`` to ``destination`` are dealt out to routes by fixed shares.

    Both are zones or segments. Each of ``routes`` is the segments it leads over and its share.
    """

    origin: Label
    destination: Label
    routes: Annotated[tuple[tuple[Via, RouteShare], ...], Field(min_length=1, max_length=50)]


class RouteChoice(Part):
    """How trips of inputs, matrices and background traffic choose their routes.

    By ``length`` each takes the shortest. By ``travel_time`` the run is repeated, at most
    ``iterations`` times, and each time some trips change to the route that was quickest, until
    ``gap``, the share of travel time that could be saved, is small enough. Travel times are means
    of ``interval`` seconds. With a ``spread`` drivers tell routes apart only roughly: of two routes
    one of which takes longer by that share of the time, it is taken ``e`` times as rarely.

    ``informed`` is the share of drivers who look for a quicker route on the way, every ``period``
    seconds, whichever route they began with. ``shares`` deal out trips to routes beforehand.
    """

    by: Literal["length", "travel_time"] = "length"
    iterations: Annotated[int, Field(ge=1, le=100)] = 20
    gap: Annotated[float, Field(ge=0, lt=1)] = 0.01
    interval: Annotated[float, Field(ge=60, le=3600)] = 900.0
    spread: Annotated[float, Field(ge=0, le=1)] = 0.03
    informed: Annotated[float, Field(ge=0, le=1)] = 0.0
    period: Annotated[float, Field(ge=1, le=3600)] = 60.0
    shares: Annotated[tuple[SharedRoutes, ...], Field(max_length=1000)] = ()
