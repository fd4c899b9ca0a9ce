"""The registries of rules as the tables of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import markdown_table
from odscen.scenario.story.action_kinds import ACTIONS, ActionKind
from odscen.scenario.story.condition_kinds import CONDITIONS, ConditionKind

if TYPE_CHECKING:
    from collections.abc import Iterable

_HEADS = ("name", "meaning", "unit", "in SUMO", "OpenSCENARIO", "CARLA")


def condition_table() -> str:
    """Kinds of conditions: meaning, unit, and what they are elsewhere."""
    return _kinds_table(CONDITIONS.values())


def action_table() -> str:
    """Kinds of actions: meaning, unit, and what they are elsewhere."""
    return _kinds_table(ACTIONS.values())


def _kinds_table(kinds: Iterable[ConditionKind | ActionKind]) -> str:
    rows = (
        (f"`{kind.name}`", kind.meaning, kind.unit, kind.sumo, kind.openscenario, kind.carla)
        for kind in kinds
    )
    return markdown_table(_HEADS, rows)
