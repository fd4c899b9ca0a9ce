"""The command line. Thin: every command parses its options, calls one function, and prints.

Heavy imports stay inside the commands, so that ``odscen --help`` starts fast.
"""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from odscen import __version__
from odscen.cli import assets, demo, doctor, maps, runs, scenarios
from odscen.cli.output import report_error
from odscen.errors import OdscenError

app = typer.Typer(
    name="odscen",
    help="Traffic scenarios on OpenDRIVE maps, run headlessly in SUMO.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(maps.app, name="maps")
app.add_typer(assets.app, name="assets")
app.command()(scenarios.generate)
app.command()(scenarios.check)
app.command()(scenarios.export)
app.command()(runs.run)
app.command()(doctor.doctor)
app.command()(demo.demo)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"odscen {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: runs the command and turns odscen's own errors into messages and exit codes."""
    try:
        app()
    except OdscenError as error:
        report_error(error)
        sys.exit(error.exit_code)
