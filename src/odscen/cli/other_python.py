"""A command carried out by another Python, which has a package that this one cannot have."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import MissingDependencyError
from odscen.base.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence

_ASK = "import importlib.metadata as m;print(m.version('odscen'), m.version('{package}'))"


def without_option(given: Sequence[str], option: str) -> list[str]:
    """Arguments of a command line without an option and its value."""
    kept, skip = [], False
    for word in given:
        if skip or word.startswith(f"{option}="):
            skip = False
        elif word == option:
            skip = True
        else:
            kept.append(word)
    return kept


def carry_out_in(python: Path, given: Sequence[str], *, package: str) -> int:
    """Carry out a command of odscen in another Python; its exit code.

    Parameters
    ----------
    given
        Words behind ``odscen``.
    package
        That it is to have.

    Raises
    ------
    MissingDependencyError
        If it cannot be started, or has not this release of odscen, or not the package.
    """
    try:
        asked = subprocess.run(
            [python, "-c", _ASK.format(package=package)],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise MissingDependencyError(f"the Python {python} cannot be started: {error}") from error
    release = asked.stdout.split()[:1]
    if asked.returncode or release != [__version__]:
        there = f"odscen {release[0]}" if release else f"not both odscen and {package}"
        raise MissingDependencyError(
            f"the Python {python} has {there}: install odscen[{package}] {__version__} there"
        )
    with subprocess.Popen([python, "-m", "odscen", *given]) as process:
        # Ctrl-C reaches both: the command ends itself, and its end is waited for.
        kept = signal.signal(signal.SIGINT, lambda *_: None)
        ended = signal.signal(signal.SIGTERM, lambda number, _: process.send_signal(number))
        try:
            return process.wait()
        finally:
            signal.signal(signal.SIGINT, kept)
            signal.signal(signal.SIGTERM, ended)


def carry_out_elsewhere(python: Path, option: str, *, package: str) -> int:
    """Carry out the command that is running in another Python, which an option has named."""
    return carry_out_in(python, without_option(sys.argv[1:], option), package=package)
