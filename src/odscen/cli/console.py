"""What commands share: options, JSON on stdout, everything else on stderr."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.durations import parse_duration
from odscen.base.errors import InputError, NoMapError, OdscenError
from odscen.base.shown import visible

if TYPE_CHECKING:
    from odscen.base.errors import ReportedRow
    from odscen.learning.behaviour.behaviour_model import BehaviourDoor
    from odscen.learning.offered_options import OptionValue

WorkspaceOption = Annotated[
    Path | None,
    typer.Option(
        "--workspace",
        help="Folder with maps, scenarios and runs. (default: $ODSCEN_WORKSPACE, "
        "else the user's data folder)",
        file_okay=False,
        show_default=False,
    ),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print exactly one JSON object on stdout.")
]

BuildMemoryOption = Annotated[
    float | None,
    typer.Option(
        "--build-memory",
        help="GB of memory that building a map may use. "
        "[default: $ODSCEN_BUILD_MEMORY, else by the size of the map]",
        show_default=False,
    ),
]
BuildMinutesOption = Annotated[
    float | None,
    typer.Option(
        "--build-minutes",
        help="Minutes of computing time that building a map may use. "
        "[default: $ODSCEN_BUILD_MINUTES, else by the size of the map]",
        show_default=False,
    ),
]

BehaviourOption = Annotated[
    str | None,
    typer.Option(
        help="What drives vehicles instead of SUMO (idm, imitation) or switches lights "
        "(max-pressure, signal-agent): one of these, an entry point, package.module:Class or "
        "FILE.py:Class.",
        metavar="NAME",
    ),
]
BehaviourSettingOption = Annotated[
    list[str] | None,
    typer.Option(
        "--behaviour-set", help="A setting of it: headway=0.8; repeatable.", metavar="NAME=VALUE"
    ),
]
BehaviourCommandOption = Annotated[
    str | None,
    typer.Option("--behaviour-cmd", help="A program that drives, over a pipe.", metavar="COMMAND"),
]
OverwriteOption = Annotated[
    bool,
    typer.Option(
        "--overwrite",
        help="Replace runs that have ended in the folder of --out; those of the workspace are.",
    ),
]
BehaviourTimeoutOption = Annotated[
    float,
    typer.Option(
        "--behaviour-timeout", min=0.001, help="Wall seconds that it may take for one step."
    ),
]

SimulatorOption = Annotated[
    str,
    typer.Option(
        help="What plays the scenario: sumo, carla-mirror, carla-native, metadrive, esmini, an "
        "entry point, package.module:Class or FILE.py:Class.",
        metavar="NAME",
    ),
]
SimulatorSettingOption = Annotated[
    list[str] | None,
    typer.Option(
        "--simulator-set",
        help="A setting of it: address=127.0.0.1:2000; repeatable.",
        metavar="NAME=VALUE",
    ),
]

_MOST_SEEDS = 1000


def _parse_seeds(text: str) -> tuple[int, ...]:
    """Read ``10`` (1 to 10), ``1,2,7`` or ``101-150``."""
    seeds: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,10})(?:-(\d{1,10}))?\s*", part)
        if match is None:
            raise typer.BadParameter(
                f"{text!r} are no seeds; write for example 10 (for 1 to 10), 1,2,7 or 101-150"
            )
        first = int(match[1])
        seeds += range(first, min(int(match[2] or first), first + _MOST_SEEDS) + 1)
    if len(seeds) == 1 and text.strip().isdecimal():
        seeds = list(range(1, min(seeds[0], _MOST_SEEDS + 1) + 1))
    if not 0 < len(seeds) <= _MOST_SEEDS or max(seeds) >= 2**31:
        raise typer.BadParameter(
            f"{text!r}: at least 1 and at most {_MOST_SEEDS} seeds, below 2^31"
        )
    return tuple(dict.fromkeys(seeds))


def duration(text: str) -> float:
    """Read a length of time from the command line.

    Raises
    ------
    typer.BadParameter
        If it is none.
    """
    try:
        return parse_duration(text)
    except InputError as error:
        raise typer.BadParameter(str(error)) from error


def _parse_warm_up(text: str) -> float:
    return 0.0 if text.strip() in ("0", "none") else duration(text)


WarmUpOption = Annotated[
    float | None,
    typer.Option(
        parser=_parse_warm_up,
        metavar="TIME",
        help="Leave this much from the start out of all figures: 10min. (default: the scenario's)",
    ),
]
IntervalOption = Annotated[
    float | None,
    typer.Option(
        parser=duration,
        metavar="TIME",
        help="Give figures over time for intervals of this length: 5min, 15min, 1h. "
        "(default: the scenario's)",
    ),
]
JobsOption = Annotated[int, typer.Option(min=1, help="How many run at a time.")]
SeedsOption = Annotated[
    Any,
    typer.Option(
        "--seeds",
        parser=_parse_seeds,
        metavar="SEEDS",
        help="Seeds: 10 for 1 to 10, or a list such as 1,2,7 or 101-150.",
    ),
]


def print_json(value: Mapping[str, Any]) -> None:
    """Write one JSON object to stdout; NaN and infinity are refused rather than written.

    Bytes of file names that are no text stand in it as JSON escapes them.
    """
    ascii_only = not sys.stdout.encoding.lower().startswith("utf")
    text = json.dumps(value, indent=2, ensure_ascii=ascii_only, allow_nan=False)
    sys.stdout.write(text.encode("utf-8", "backslashreplace").decode() + "\n")


def log(message: str) -> None:
    """Write a line for people to stderr; a command does not end because it cannot be written."""
    with suppress(OSError):
        typer.echo(visible(message), err=True)


def report_error(error: OdscenError) -> None:
    """Write an error to stderr, and as JSON to stdout if the command line asked for JSON."""
    with suppress(OSError):
        typer.secho(f"error: {visible(str(error))}", err=True, fg=typer.colors.RED)
    if "--json" in sys.argv[1:]:
        report = as_rows(error.lists) if isinstance(error, NoMapError) else {}
        with suppress(OSError):  # which may be the error that is reported
            print_json({"error": error_fields(error), **report})


def as_rows(lists: Mapping[str, Sequence[ReportedRow]]) -> dict[str, list[dict[str, Any]]]:
    """Lists of a report as data."""
    return {name: [row._asdict() for row in rows] for name, rows in lists.items()}


def report_usage(message: str) -> None:
    """Write what is wrong with the command line as JSON to stdout, if it asked for JSON."""
    if "--json" in sys.argv[1:]:
        print_json({"error": {"type": "UsageError", "message": message}})


def error_fields(error: OdscenError) -> dict[str, Any]:
    """An error as data: its type, its message, and the file and element if it has them."""
    places = {key: getattr(error, key, None) for key in ("file", "element")}
    return {
        "type": type(error).__name__,
        "message": str(error),
        **{key: value for key, value in places.items() if value is not None},
    }


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write a table to stdout; numbers are right-aligned. Without ``columns`` it has no head."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    table = Table(
        title=title or None,
        title_justify="left",
        box=SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
        show_header=bool(columns),
    )
    for index in range(len(rows[0]) if rows else len(columns)):
        numeric = bool(rows) and all(isinstance(row[index], int | float) for row in rows)
        name = columns[index] if columns else ""
        table.add_column(
            name,
            justify="right" if numeric else "left",
            no_wrap=index == 0 or numeric,
            overflow="fold",
        )
    for row in rows:
        table.add_row(*(_format_cell(value) for value in row))
    Console(markup=False, emoji=False).print(table)  # brackets are part of what is written


def _format_cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:,.2f}"
    if isinstance(value, int) and not isinstance(value, bool):
        return f"{value:,}"
    return "-" if value is None else str(value)


@contextmanager
def progress(title: str) -> Iterator[Callable[[str, float], None]]:
    """Yield a function that shows what is being done and the share done, 0 to 1, on stderr.

    A bar on a terminal; nothing elsewhere, where a log of steps would only be noise.
    """
    if not sys.stderr.isatty():
        yield lambda _what, _share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[what]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=1.0, what="")
        yield lambda what, share: bar.update(task, completed=share, what=what)


def option_settings(settings: Iterable[str], *, element: str) -> dict[str, OptionValue]:
    """Read ``NAME=VALUE``: numbers and true or false as JSON, all else as text.

    Raises
    ------
    InputError
        If one has no name or no value; ``element`` is the option of the command.
    """
    found: dict[str, OptionValue] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not (name.strip().isidentifier() and equals):
            raise InputError(f"{setting!r} sets nothing; write NAME=VALUE", element=element)
        try:
            value = json.loads(text)
        except ValueError:
            value = text
        found[name.strip()] = value if isinstance(value, bool | int | float | str) else text
    return found


def behaviour_door(
    name: str | None, given: list[str] | None, command: str | None, time_limit: float
) -> BehaviourDoor | None:
    """Where the model comes from; ``None`` if SUMO drives.

    Raises
    ------
    InputError
        If a setting has no name, or belongs to nothing.
    """
    if name is None and command is None:
        if given:
            raise InputError("--behaviour-set needs --behaviour")
        return None
    from odscen.learning.behaviour.behaviour_model import BehaviourDoor

    options = option_settings(given or (), element="--behaviour-set")
    if name is not None and name.partition(":")[0].endswith(".py"):
        file, _, attribute = name.rpartition(":")
        name = f"{Path(file).resolve()}:{attribute}"  # runs may go on in another folder
    return BehaviourDoor(name=name, command=command, time_limit=time_limit, options=options)
