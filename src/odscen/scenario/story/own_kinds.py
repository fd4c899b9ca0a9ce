"""Conditions and actions of one's own: entry points of installed packages, loaded when named.

A package names an object of ours under the name that documents use::

    [project.entry-points."odscen.conditions"]
    crowded = "my_package.kinds:CROWDED"

A kind must not remember anything between steps: a long run begins anew with each slice.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, wraps
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, TypeVar

from odscen.base.errors import InputError, OdscenError
from odscen.scenario.story.action_kinds import ACTIONS, ActionKind
from odscen.scenario.story.channels import CannotAct
from odscen.scenario.story.condition_kinds import CONDITIONS, ConditionKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.scenario.document.rules_document import Action, Condition

_Kind = TypeVar("_Kind", ConditionKind, ActionKind)
CONDITION_GROUP, ACTION_GROUP = "odscen.conditions", "odscen.actions"
"""Groups of entry points."""


def own_conditions() -> list[str]:
    """Names of the conditions that installed packages give."""
    return sorted(entry_points(group=CONDITION_GROUP).names)


def own_actions() -> list[str]:
    """Names of the actions that installed packages give."""
    return sorted(entry_points(group=ACTION_GROUP).names)


@cache
def own_condition(name: str) -> ConditionKind | None:
    """Find a condition of an installed package, ``None`` if there is none of that name.

    Raises
    ------
    InputError
        If it cannot be imported, or is something else.
    """
    kind = _load_object(CONDITION_GROUP, name, ConditionKind)
    if not isinstance(kind, ConditionKind):
        return None
    return replace(
        kind, read=_guard_function(kind.read, name), check=_guard_function(kind.check, name)
    )


@cache
def own_action(name: str) -> ActionKind | None:
    """Find an action of an installed package, ``None`` if there is none of that name.

    Raises
    ------
    InputError
        If it cannot be imported, or is something else.
    """
    kind = _load_object(ACTION_GROUP, name, ActionKind)
    if not isinstance(kind, ActionKind):
        return None
    return replace(
        kind,
        begin=_guard_function(kind.begin, name),
        update=_guard_function(kind.update, name),
        finish=_guard_function(kind.finish, name),
        ask=_guard_function(kind.ask, name),
        says=_guard_function(kind.says, name),
        check=_guard_function(kind.check, name),
    )


def condition_kind(condition: Condition) -> ConditionKind:
    """Find the kind of a condition that is no combination.

    Raises
    ------
    InputError
        If no installed package gives it.
    """
    if condition.own is None:
        return CONDITIONS[condition.kind]
    return _find_kind(own_condition(condition.own.kind), condition.own.kind)


def action_kind(action: Action) -> ActionKind:
    """Find the kind of a single action.

    Raises
    ------
    InputError
        If no installed package gives it.
    """
    if action.own is None:
        return ACTIONS[action.kind]
    return _find_kind(own_action(action.own.kind), action.own.kind)


def _find_kind(kind: _Kind | None, name: str) -> _Kind:
    if kind is None:
        raise InputError(f"no installed package gives {name!r}")
    return kind


def _load_object(group: str, name: str, expected: type) -> object:
    points = [*entry_points(group=group, name=name)]
    if not points:
        return None
    try:
        found = points[0].load()
    except Exception as error:  # whatever an import may raise
        raise InputError(
            f"{name!r} of {group} cannot be imported from {points[0].value}: {error!r}"
        ) from error
    if not isinstance(found, expected):
        raise InputError(
            f"{points[0].value} is not the {expected.__name__} that {group} {name!r} has to be"
        )
    return found


def _guard_function(function: Callable[..., Any] | None, name: str) -> Callable[..., Any] | None:
    """Let an error of code from outside end a run with a message that names it."""
    if function is None:
        return None
    own = function

    @wraps(own)
    def guarded(*given: Any) -> Any:
        try:
            return own(*given)
        except (OdscenError, CannotAct):
            raise
        except Exception as error:
            raise InputError(f"own kind {name!r} failed: {error!r}") from error

    return guarded
