"""Nothing but ``app`` puts a run together: found in the sources."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest

import odscen
from odscen.runs.run_settings import RunSettings

ROOT = Path(odscen.__file__).parent
STEPS = {
    # Whatever makes or starts a run, and the rooms that may import it.
    "prepare": set[str](),
    "prepare_assigned": set[str](),
    "assign_routes": {"app"},
    "run_prepared": {"app"},
    "simulate": {"carla"},  # mirrored
    "run_worker": set[str](),
    "realize": {"app", "formats"},  # the SUMO files alone, of which nothing is run
}


def sources() -> Iterator[tuple[Path, ast.Module]]:
    for path in sorted(ROOT.rglob("*.py")):
        yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_step_of_a_run_is_taken_by_app_and_within_sumo_only(step: str) -> None:
    rooms = {
        path.parts[0]
        for path, tree in sources()
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").startswith("odscen.sumo")
        and any(name.name == step for name in node.names)
    }
    assert rooms - {"sumo"} == STEPS[step]


@pytest.mark.slow
def test_settings_of_a_run_are_handed_on_together() -> None:
    names = {one.name for one in fields(RunSettings)}
    singly = [
        f"{path}: {node.name}"
        for path, tree in sources()
        if path.parts[0] != "cli"  # where each is an option
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and len(names & {arg.arg for arg in (*node.args.args, *node.args.kwonlyargs)}) > 2
    ]
    assert singly == []
