"""``odscen maps remove``, ``odscen remove`` and ``odscen trash``: nothing is lost at once."""

from __future__ import annotations

import sys
from dataclasses import asdict
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.errors import ConflictError, InputError
from odscen.cli.console import JsonOption, WorkspaceOption, log, print_json, print_table

if TYPE_CHECKING:
    from odscen.app.removal import RemovalFacts
    from odscen.maps.store import Workspace
    from odscen.maps.wastebasket import RemovedItem, RemovedKind

YesOption = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask; for scripts.")]
ItemsArgument = Annotated[
    list[str], typer.Argument(help="Ids, or names where they are clear.", metavar="ITEM...")
]


class RemovableKind(StrEnum):
    """What ``odscen remove`` removes; maps have ``odscen maps remove``."""

    SCENARIO = "scenario"
    RUN = "run"


trash = typer.Typer(
    help="What was removed: look at it, restore it, delete it.", no_args_is_help=True
)


def remove(
    kind: Annotated[RemovableKind, typer.Argument(help="What it is.")],
    names: Annotated[list[str], typer.Argument(metavar="NAME...")],
    yes: YesOption = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Remove scenarios or runs: says what depends on them, asks, and keeps them for 30 days.

    ``odscen trash restore`` brings them back.
    """
    from odscen.maps.store import Workspace

    remove_all(Workspace.open(workspace), kind.value, names, yes=yes, as_json=as_json)


def remove_map(
    names: Annotated[list[str], typer.Argument(metavar="NAME...")],
    yes: YesOption = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Remove maps: says what depends on them, asks, and keeps them for 30 days.

    ``odscen trash restore`` brings them back.
    """
    from odscen.maps.store import Workspace

    remove_all(Workspace.open(workspace), "map", names, yes=yes, as_json=as_json)


def remove_all(
    store: Workspace, kind: RemovedKind, names: list[str], *, yes: bool, as_json: bool
) -> None:
    """Say what depends on all of them, ask once, and remove them."""
    from odscen.app.removal import known_runs, removal_facts
    from odscen.app.removal import remove as remove_one

    runs = known_runs(store)
    facts = [removal_facts(store, kind, name, runs=runs) for name in dict.fromkeys(names)]
    for fact in facts:
        log(_describe_dependents(fact))
    _ask_before_removal(f"Remove {', '.join(names)}?", yes=yes)
    rows: list[dict[str, Any]] = []
    for fact in facts:
        item = remove_one(store, kind, fact.name)
        rows.append({**_wastebasket_row(item), **asdict(fact)})
        log(f"Removed {fact.name}; to bring it back: odscen trash restore {item.id}")
    if as_json:
        print_json({"removed": rows})


@trash.command("list")
def list_(workspace: WorkspaceOption = None, as_json: JsonOption = False) -> None:
    """List what was removed, the newest first, and until when it is kept."""
    from odscen.maps.store import Workspace
    from odscen.maps.wastebasket import Wastebasket

    items = Wastebasket(Workspace.open(workspace)).items()
    rows = [{**_wastebasket_row(item), "size": item.size()} for item in items]
    if as_json:
        print_json({"items": rows})
    elif not rows:
        log("The wastebasket is empty.")
    else:
        columns = ("id", "kind", "name", "removed", "kept until", "MB")
        keys = ("id", "kind", "name", "removed", "until")
        cells = [(*(row[key] for key in keys), row["size"] / 1e6) for row in rows]
        print_table("", columns, cells)


@trash.command()
def restore(
    items: ItemsArgument, workspace: WorkspaceOption = None, as_json: JsonOption = False
) -> None:
    """Put maps, scenarios and runs back where they were."""
    from odscen.maps.store import Workspace
    from odscen.maps.wastebasket import Wastebasket

    basket = Wastebasket(Workspace.open(workspace))
    rows = []
    for item_id in [basket.item(item).id for item in items]:
        item = basket.restore(item_id)
        rows.append(_wastebasket_row(item))
        log(f"Restored {item.kind} {item.name}")
    if as_json:
        print_json({"restored": rows})


@trash.command()
def empty(
    items: Annotated[
        list[str] | None,
        typer.Argument(help="Only these: ids, or names.", metavar="[ITEM...]", show_default=False),
    ] = None,
    yes: YesOption = False,
    workspace: WorkspaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Delete for good what is in the wastebasket."""
    from odscen.maps.store import Workspace
    from odscen.maps.wastebasket import Wastebasket

    basket = Wastebasket(Workspace.open(workspace))
    chosen = [basket.item(item) for item in items] if items else basket.items()
    if chosen:
        _ask_before_removal(
            f"Delete {', '.join(removed.name for removed in chosen)} for good?", yes=yes
        )
    for removed in chosen:
        basket.delete(removed.id)
        log(f"Deleted {removed.kind} {removed.name}")
    if as_json:
        print_json({"deleted": [_wastebasket_row(removed) for removed in chosen]})


def _ask_before_removal(question: str, *, yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError("this is no terminal, so there is no answer; --yes says that it is meant")
    if not typer.confirm(question, err=True):
        raise ConflictError("nothing was removed")


def _describe_dependents(facts: RemovalFacts) -> str:
    """What depends on it, in a sentence."""
    if facts.kind == "run":
        return f"Run {facts.name}" + (" is live." if facts.live else " has ended.")
    runs = f"{_count_of(facts.runs, 'run')}, {facts.live} live"
    if facts.kind == "scenario":
        return f"Scenario {facts.name} has {runs}; they stay."
    return (
        f"Map {facts.name} has {_count_of(facts.scenarios, 'scenario')}, {runs}. They stay; "
        "scenarios need the map to run again."
    )


def _count_of(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def _wastebasket_row(item: RemovedItem) -> dict[str, Any]:
    return {
        "id": item.id,
        "kind": item.kind,
        "name": item.name,
        "removed": f"{item.removed:%Y-%m-%d %H:%M} UTC",
        "until": f"{item.until:%Y-%m-%d %H:%M} UTC",
    }
