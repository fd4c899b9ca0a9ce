"""That a place, or a whole map, has no room for a scene."""

from __future__ import annotations

from odscen.base.errors import ScenarioError


class NoPlaceError(ScenarioError):
    """No place of a map has room for a template; the message says where was looked and why not."""


class Unfit(Exception):  # noqa: N818 (no error: the next place is tried)
    """A place does not fit; the reason reads on from "of so many places"."""
