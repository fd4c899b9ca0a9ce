"""The one place where the tools that come with SUMO are called, each in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import MissingDependencyError, ToolError

if TYPE_CHECKING:
    from collections.abc import Sequence

PATIENCE = 900.0
"""Seconds after which a tool is taken to be stuck."""


def run_tool(name: str, arguments: Sequence[str], *, folder: Path) -> str:
    """Run a Python tool of SUMO's ``tools`` folder and return what it printed.

    Parameters
    ----------
    name
        For example ``routeSampler.py``.
    folder
        Where it runs; file names among the arguments count from there.

    Raises
    ------
    MissingDependencyError
        If SUMO or the tool is not installed.
    ToolError
        If the tool fails, with its own words, or does not end.
    """
    try:
        import sumo
    except ImportError as error:
        raise MissingDependencyError(
            "SUMO's tools are not installed: pip install 'eclipse-sumo>=1.28,<1.29'"
        ) from error
    script = Path(sumo.SUMO_HOME) / "tools" / name
    if not script.is_file():
        raise MissingDependencyError(
            f"SUMO's tool {name} is not in {script.parent}; install eclipse-sumo again"
        )
    try:
        done = subprocess.run(
            [sys.executable, str(script), *arguments],
            cwd=folder,
            env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME, "PYTHONHASHSEED": "0"},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise ToolError(f"{name} was stopped after {PATIENCE:g} s") from error
    if done.returncode:
        raise ToolError(
            f"{name} failed with exit code {done.returncode}", output=done.stderr[-2000:]
        )
    return done.stdout
