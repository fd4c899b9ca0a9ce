"""The command line. Thin: every command parses its options, calls one function, and prints.

Heavy imports stay inside the commands, so that ``odscen --help`` starts fast.
"""

from __future__ import annotations

import signal
import sys
import threading
from _thread import interrupt_main
from typing import Annotated

import typer

from odscen.base.errors import OdscenError, ResourceError
from odscen.base.system_errors import NO_MEMORY, disk_errors
from odscen.base.version import __version__
from odscen.cli.asset_commands import app as assets
from odscen.cli.console import report_error, report_usage
from odscen.cli.cosim_commands import cosim
from odscen.cli.count_commands import correct, fit, parking, routes
from odscen.cli.demand_commands import app as demand
from odscen.cli.demo_command import demo
from odscen.cli.difference_commands import diff_maps, diff_scenarios
from odscen.cli.doctor_command import doctor
from odscen.cli.import_command import import_
from odscen.cli.learn_command import app as learn
from odscen.cli.map_commands import app as maps
from odscen.cli.network_commands import compare_networks, network
from odscen.cli.pull_command import pull
from odscen.cli.regression_commands import compare, gate
from odscen.cli.removal_commands import remove, remove_map, trash
from odscen.cli.report_command import report
from odscen.cli.run_commands import resume, run
from odscen.cli.scenario_commands import check, export, generate, replay, variant
from odscen.cli.serve_command import serve
from odscen.cli.signal_commands import app as signals
from odscen.cli.study_commands import app as study
from odscen.cli.study_commands import dataset
from odscen.cli.sweep_command import search, sweep
from odscen.cli.template_command import NewCommand, new
from odscen.cli.transit_commands import app as transit

_AGAIN = 0.05
"""Wall seconds after which an interruption that Python has only shown comes again."""
_INTERRUPTED = 130
"""Exit code of a command that was interrupted, as shells know it."""

app = typer.Typer(
    name="odscen",
    help="Traffic scenarios on OpenDRIVE maps, run headlessly in SUMO.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
maps.command()(pull)
maps.command()(network)
maps.command("compare")(compare_networks)
maps.command("diff")(diff_maps)
maps.command("remove")(remove_map)
app.add_typer(maps, name="maps")
app.add_typer(assets, name="assets")
demand.command()(routes)
demand.command()(parking)
demand.command()(fit)
demand.command()(correct)
app.add_typer(demand, name="demand")
app.add_typer(signals, name="signals")
app.add_typer(transit, name="transit")
app.add_typer(trash, name="trash")
app.add_typer(learn, name="learn")
app.add_typer(study, name="study")
app.command()(generate)
app.command()(variant)
app.command(cls=NewCommand)(new)
app.command()(check)
app.command()(export)
app.command("import")(import_)
app.command()(replay)
app.command()(run)
app.command()(resume)
app.command()(report)
app.command()(sweep)
app.command()(dataset)
app.command()(search)
app.command("test")(gate)
app.command()(compare)
app.command("diff")(diff_scenarios)
app.command()(cosim)
app.command()(serve)
app.command()(remove)
app.command()(doctor)
app.command()(demo)


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


def _interrupt_again(what: sys.UnraisableHookArgs) -> None:
    """Interrupt again what was interrupted where Python only shows exceptions and goes on."""
    if what.exc_type is KeyboardInterrupt:
        again = threading.Timer(_AGAIN, interrupt_main)  # not here: it would be shown again
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(what)


def _end_at_once_if_asked() -> None:
    """Leave signals to the system: what the command has to clean up is done.

    Python would show where in its own end it was interrupted.
    """
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)


def main() -> None:
    """Entry point: runs the command and turns errors into messages and exit codes.

    Errors are odscen's own, and those of the system that nobody has given a place.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as Ctrl-C does
    sys.unraisablehook = _interrupt_again
    try:
        try:
            with disk_errors("odscen"):
                app()
        finally:
            _end_at_once_if_asked()
    except KeyboardInterrupt:  # it came when the command had just ended
        _end_at_once_if_asked()
        sys.exit(_INTERRUPTED)
    except OdscenError as error:
        report_error(error)
        sys.exit(error.exit_code)
    except RuntimeError as error:
        if "can't start new thread" not in str(error):
            raise
        report_error(ResourceError(NO_MEMORY))
        sys.exit(ResourceError.exit_code)
    except SystemExit as stop:
        # Typer has told people what is wrong with the call; scripts want it as JSON too.
        told = getattr(stop.__context__, "format_message", None)
        if told is not None:
            report_usage(told())
        raise
