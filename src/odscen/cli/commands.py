"""Which commands there are, and the command line made of all of them, or of the one that is asked.

Typer looks at every parameter of every command, which takes as long as the imports of a command:
so what is given decides what is imported and looked at.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Annotated, Any

import typer

from odscen.base.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_GROUPS: dict[str, tuple[str, dict[str, str]]] = {
    "maps": (
        "map_commands:app",
        {
            "network": "network_commands:network",
            "compare": "network_commands:compare_networks",
            "diff": "difference_commands:diff_maps",
            "remove": "removal_commands:remove_map",
        },
    ),
    "assets": ("asset_commands:app", {}),
    "demand": (
        "demand_commands:app",
        {
            "routes": "count_commands:routes",
            "parking": "count_commands:parking",
            "fit": "count_commands:fit",
            "correct": "count_commands:correct",
        },
    ),
    "signals": ("signal_commands:app", {}),
    "transit": ("transit_commands:app", {}),
    "trash": ("removal_commands:trash", {}),
    "recording": ("recording_commands:app", {}),
    "learn": ("learn_command:app", {}),
    "study": ("study_commands:app", {}),
}
"""Place of each group, and of commands in it that other modules have."""
_COMMANDS = {
    "generate": "scenario_commands:generate",
    "variant": "scenario_commands:variant",
    "new": "template_command:new",
    "check": "scenario_commands:check",
    "export": "exchange_commands:export",
    "import": "exchange_commands:import_",
    "replay": "scenario_commands:replay",
    "run": "run_commands:run",
    "resume": "run_commands:resume",
    "report": "report_command:report",
    "calibrate": "calibrate_command:calibrate",
    "sweep": "sweep_command:sweep",
    "dataset": "study_commands:dataset",
    "search": "sweep_command:search",
    "test": "regression_commands:gate",
    "compare": "regression_commands:compare",
    "history": "regression_commands:show_history",
    "diff": "difference_commands:diff_scenarios",
    "cosim": "cosim_commands:cosim",
    "serve": "serve_command:serve",
    "assist": "assist_command:assist",
    "remove": "removal_commands:remove",
    "doctor": "doctor_command:doctor",
    "demo": "demo_command:demo",
}
_CLASSES = {"new": "template_command:NewCommand"}
_HELP = ("-h", "--help")


def command_line(given: Sequence[str] | None = None) -> typer.Typer:
    """Make the command line.

    Parameters
    ----------
    given
        What is to be parsed. Only what that needs is in it; all commands if not given.
    """
    app = typer.Typer(
        name="odscen",
        help="Traffic scenarios on OpenDRIVE maps, run headlessly in SUMO.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": list(_HELP)},
    )
    app.callback()(_common_options)
    asked = None if given is None else given[0] if given else _HELP[0]
    listed = asked in _HELP  # each command in a line, without its parameters
    known = asked in _COMMANDS or asked in _GROUPS
    for name in _GROUPS:
        if not known or name == asked:
            app.add_typer(
                _keep_help_only(_build_group(name)) if listed else _build_group(name), name=name
            )
    for name, place in _COMMANDS.items():
        if not known or name == asked:
            function = _import_command(place)
            kind = _import_command(_CLASSES[name]) if name in _CLASSES else None
            app.command(name, cls=kind)(_drop_parameters(function) if listed else function)
    return app


def _build_group(name: str) -> typer.Typer:
    place, more = _GROUPS[name]
    group: typer.Typer = _import_command(place)
    there = {info.name for info in group.registered_commands}
    for own, other in more.items():
        if own not in there:
            group.command(own)(_import_command(other))
    return group


def _keep_help_only(group: typer.Typer) -> typer.Typer:
    return typer.Typer(help=group.info.help)


def _drop_parameters(function: Callable[..., Any]) -> Callable[[], None]:
    def listed() -> None:
        pass

    listed.__doc__ = function.__doc__
    return listed


def _import_command(place: str) -> Any:
    module, name = place.split(":")
    return getattr(importlib.import_module(f"odscen.cli.{module}"), name)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"odscen {__version__}")
        raise typer.Exit


def _common_options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass
