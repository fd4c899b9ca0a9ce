"""The command line. Thin: every command parses its options, calls one function, and prints.

Heavy imports stay inside the commands, and a command is imported when it is asked for (see
:mod:`odscen.cli.commands`), so that ``odscen`` starts fast.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from _thread import interrupt_main
from typing import TYPE_CHECKING

from odscen.base.errors import OdscenError, ResourceError
from odscen.base.system_errors import NO_MEMORY, disk_errors

if TYPE_CHECKING:
    from collections.abc import Sequence

_AGAIN = 0.05
"""Wall seconds after which an interruption that Python has only shown comes again."""
_ADDRESSES = 2_000_000_000
"""Bytes of address space for commands that use tables.

Measured as VmPeak of the largest process, shipped crossing, two cores: `run` 1.86e9, `report`
1.51e9, `export` 1.46e9; `check`, which uses none, 0.37e9. More cores reserve more for threads:
below this it is certain to fail, and Polars aborts without words.
"""
_INTERRUPTED = 130
"""Exit code of a command that was interrupted, as shells know it."""


def _interrupt_again(what: sys.UnraisableHookArgs) -> None:
    """Interrupt again what was interrupted where Python only shows exceptions and goes on."""
    if what.exc_type is KeyboardInterrupt:
        # Not here: it would be shown again. SIGTERM, as SIGINT may be ignored, as by who is started
        # in the background of a script.
        again = threading.Timer(_AGAIN, interrupt_main, (signal.SIGTERM,))
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


def _worker_ahead(given: Sequence[str]) -> None:
    """Have the process that forks those of simulations do its imports beside all of ours."""
    if given[:1] == ["run"] and not {"-h", "--help"} & set(given):
        from odscen.sumo.runner.forked_worker import get_ready

        get_ready()


def _open_closed_streams() -> None:
    """Let nothing that is opened later take the place of a stream that the caller has closed.

    What is written there would end in that file. Texts that a terminal or locale cannot show are
    escaped.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
        stream = getattr(sys, name)
        if stream is None:
            mode = "w" if number else "r"
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))
        elif number and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


class _AddressSpaceCheck:
    """Refuses tables where too little address space is allowed: Polars would abort the process.

    It reserves addresses for its threads and its allocator, far more than the memory it uses.
    """

    def find_spec(self, fullname: str, path: object, target: object = None) -> None:  # noqa: ARG002
        if fullname != "polars":
            return
        from resource import RLIM_INFINITY, RLIMIT_AS, getrlimit

        allowed, _ = getrlimit(RLIMIT_AS)
        if allowed != RLIM_INFINITY and allowed < _ADDRESSES:
            raise ResourceError(
                f"this needs {_ADDRESSES / 1e9:g} GB of address space, and {allowed / 1e9:.1f} GB "
                "are allowed here; allow more (ulimit -v)"
            )


def main() -> None:
    """Entry point: carries the command out, here or by a process that has done the imports."""
    if os.environ.get("ODSCEN_RESIDENT"):
        _open_closed_streams()  # what is handed over must be streams
        from odscen.cli.resident.client import carry_out_there

        try:
            carry_out_there(sys.argv[1:])
        except OdscenError as error:
            _report_to_console(error)
            sys.exit(error.exit_code)
    carry_out()


def carry_out() -> None:
    """Carry the command out here, and turn errors into messages and exit codes.

    Errors are odscen's own, and those of the system that nobody has given a place.
    """
    _open_closed_streams()
    sys.meta_path.insert(0, _AddressSpaceCheck())
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as Ctrl-C does
    sys.unraisablehook = _interrupt_again
    given = sys.argv[1:]
    try:
        try:
            with disk_errors("odscen"):
                _worker_ahead(given)
                from odscen.cli.commands import command_line

                command_line(given)()
        finally:
            _end_at_once_if_asked()
    except KeyboardInterrupt:  # it came when the command had just ended
        _end_at_once_if_asked()
        sys.exit(_INTERRUPTED)
    except OdscenError as error:
        _report_to_console(error)
        sys.exit(error.exit_code)
    except RuntimeError as error:
        if "can't start new thread" not in str(error):
            raise
        _report_to_console(ResourceError(NO_MEMORY))
        sys.exit(ResourceError.exit_code)
    except SystemExit as stop:
        # Typer has told people what is wrong with the call; scripts want it as JSON too.
        format_message = getattr(stop.__context__, "format_message", None)
        if format_message is not None:
            from odscen.cli.console import report_usage

            report_usage(format_message())
        raise


def _report_to_console(error: OdscenError) -> None:
    from odscen.cli.console import report_error

    report_error(error)
