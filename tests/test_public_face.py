"""What ``import odscen`` gives: there, documented, cheap, and used as the first steps show it."""

from __future__ import annotations

import ast
import inspect
import json
import re
import subprocess
import sys
from dataclasses import is_dataclass
from enum import Enum
from pathlib import Path

import pytest

import odscen

ROOT = Path(__file__).parents[1]
ERRORS = [name for name in odscen.__all__ if name.endswith("Error")]
CLASSES = [name for name in odscen.__all__ if name[0].isupper() and name not in ERRORS]
FUNCTIONS = [name for name in odscen.__all__ if name[0].islower()]


def sections(name: str) -> set[str]:
    text = inspect.getdoc(getattr(odscen, name)) or ""
    return set(re.findall(r"^([A-Z]\w+)\n-{3,}$", text, re.MULTILINE))


def imported_for_types() -> set[str]:
    """Names that a type checker and the site find in ``odscen/__init__.py``."""
    tree = ast.parse(Path(odscen.__file__).read_text(encoding="utf-8"))
    return {
        f"{node.module}:{alias.name} as {alias.asname or alias.name}"
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def test_the_names_at_run_time_are_those_for_types() -> None:
    homes = {name: home.partition(":") for name, home in odscen._HOMES.items()}
    assert {
        f"{module}:{own or name} as {name}" for name, (module, _, own) in homes.items()
    } == imported_for_types()
    assert sorted(homes) == sorted(odscen.__all__)
    assert set(odscen.__all__) <= set(dir(odscen))


@pytest.mark.parametrize("name", odscen.__all__)
def test_every_name_is_there_and_says_what_it_is(name: str) -> None:
    found = getattr(odscen, name)
    assert found.__module__.startswith("odscen.")
    assert len(inspect.getdoc(found) or "") > 20


MEMBERS = [
    f"{module}.{name}"
    for module in odscen.MODULES
    for name in __import__(f"odscen.{module}", fromlist=["__all__"]).__all__
]


@pytest.mark.parametrize("path", MEMBERS)
def test_every_name_of_a_public_module_is_there_and_says_what_it_is(path: str) -> None:
    module, _, name = path.partition(".")
    found = getattr(getattr(odscen, module), name)
    assert found.__module__.startswith("odscen.")
    assert len(inspect.getdoc(found) or "") > 10


def test_public_modules_have_what_the_page_does() -> None:
    """Sweep, search, dataset, test, study, template, demand, lights, learning, environments."""
    wanted = {
        "experiments.sweep", "experiments.search", "experiments.run_suite", "edit.Editing",
        "experiments.run_experiment", "datasets.make_dataset", "templates.place_template",
        "demand.import_traffic", "demand.sized", "signals.time_signals", "edit.add_actor",
        "signals.evaluate_signals", "learn.GeneratorDoor", "learn.DrivingAction",
        "rl.EgoEnvironment",
    }  # fmt: skip
    assert wanted <= set(MEMBERS)
    assert set(odscen.MODULES) <= set(dir(odscen))


def test_the_reference_is_that_of_the_sources() -> None:
    """``python -m tools.api_reference`` writes it, in a process that has imported nothing else."""
    checked = subprocess.run(
        [sys.executable, "-m", "tools.api_reference", "--check"],
        cwd=ROOT,
        check=False,
        capture_output=True,
        text=True,
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.mark.slow
def test_examples_of_the_documents_pass_a_strict_type_checker(tmp_path: Path) -> None:
    """Those of the scenario format, and all scripts in ``examples/``."""
    text = (ROOT / "docs/scenario-format.md").read_text(encoding="utf-8")
    snippet = tmp_path / "scenario_format.py"
    snippet.write_text(re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)[-1])
    scripts = [str(file) for file in sorted((ROOT / "examples").rglob("*.py"))]
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--config-file=",
        "--follow-imports=silent",
    ]
    options = ["--disable-error-code=import-untyped", "--cache-dir", str(tmp_path)]
    done = subprocess.run(
        [*command, *options, str(snippet), *scripts],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_examples_pass_pyright(tmp_path: Path) -> None:
    """By basedpyright, which has Node with it, with the strict rules of Pyright."""
    pytest.importorskip("basedpyright")
    settings = {
        "include": [str(ROOT / "examples")],
        "typeCheckingMode": "standard",
        "reportMissingTypeArgument": True,
        "reportPrivateUsage": True,
        "reportUnnecessaryTypeIgnoreComment": True,
    }
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    command = [sys.executable, "-m", "basedpyright", "--project", str(tmp_path)]
    done = subprocess.run(
        [*command, "--pythonpath", sys.executable, "--level", "error"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_examples_import_public_modules_only() -> None:
    """``odscen`` and what it names: none that may change without notice."""
    public = {"odscen", *(f"odscen.{module}" for module in odscen.MODULES)}
    scripts = sorted((ROOT / "examples").glob("*.py"))
    assert len(scripts) >= 10
    for script in scripts:
        tree = ast.parse(script.read_text(encoding="utf-8"))
        modules = {
            name
            for node in ast.walk(tree)
            for name in (
                [node.module or ""]
                if isinstance(node, ast.ImportFrom)
                else [alias.name for alias in node.names]
                if isinstance(node, ast.Import)
                else []
            )
            if name.partition(".")[0] == "odscen"
        }
        assert modules, script.name
        assert modules <= public, script.name


def test_an_unknown_name_is_an_attribute_error_as_of_any_module() -> None:
    with pytest.raises(AttributeError, match="module 'odscen' has no attribute 'runn'"):
        odscen.runn  # noqa: B018


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_tells_parameters_result_and_errors(name: str) -> None:
    function = getattr(odscen, name)
    wanted = {"Raises"}
    wanted |= {"Parameters"} if inspect.signature(function).parameters else set()
    wanted |= {"Yields"} if name == "watch" else {"Returns"}
    assert wanted <= sections(name)
    told = inspect.getdoc(function) or ""
    head = told.partition("Returns\n---")[0].partition("Yields\n---")[0]
    for parameter in inspect.signature(function).parameters:
        assert re.search(rf"^(\w+, )*{parameter}(, \w+)*$", head, re.MULTILINE), parameter


@pytest.mark.parametrize("name", FUNCTIONS)
def test_whatever_is_not_a_main_noun_is_keyword_only(name: str) -> None:
    parameters = inspect.signature(getattr(odscen, name)).parameters.values()
    free = [one.name for one in parameters if one.kind is one.POSITIONAL_OR_KEYWORD]
    nouns = {"workspace", "scenario", "scenarios", "run", "arrays", "path", "out", "a", "b", "text"}
    nouns |= {"template", "map_name", "file", "suite"}
    assert set(free) <= nouns
    assert all(one.default is one.empty for one in parameters if one.name in free)


@pytest.mark.parametrize("name", CLASSES)
def test_every_class_tells_its_fields(name: str) -> None:
    found = getattr(odscen, name)
    fields = is_dataclass(found) or hasattr(found, "model_fields") or hasattr(found, "_fields")
    fields = fields or inspect.isabstract(found) or issubclass(found, Enum)
    if fields or inspect.signature(found).parameters:
        assert ("Attributes" if fields else "Parameters") in sections(name)
    told = inspect.getdoc(found) or ""
    names = found.model_fields if hasattr(found, "model_fields") else getattr(found, "_fields", ())
    names = found.__dataclass_fields__ if is_dataclass(found) else names
    for field in names:
        assert re.search(rf"^(\w+, )*{field}(, \w+)*( :.*)?$", told, re.MULTILINE), field


@pytest.mark.parametrize("name", [*CLASSES, *ERRORS])
def test_every_public_member_says_what_it_is(name: str) -> None:
    own = {one for base in getattr(odscen, name).__mro__ if base.__module__.startswith("odscen.")
           for one, value in vars(base).items()
           if isinstance(value, property | classmethod) or inspect.isfunction(value)}  # fmt: skip
    silent = [
        one
        for one in sorted(own)
        if not one.startswith("_") and not inspect.getdoc(getattr(getattr(odscen, name), one))
    ]
    assert silent == []


@pytest.mark.parametrize("name", ["actors", "events", "trajectories", "lane_places", "figures_by"])
def test_every_table_of_a_run_tells_its_errors_and_units(name: str) -> None:
    told = inspect.getdoc(getattr(odscen.Run, name)) or ""
    assert "Raises\n---" in told
    assert name == "lane_places" or {"(s)", "(s"} & set(re.findall(r"\(s\)?", told))


def test_importing_it_loads_nothing_heavy() -> None:
    code = (
        "import sys; before = set(sys.modules); import odscen; dir(odscen)\n"
        "print(*sorted(name for name in set(sys.modules) - before if name.startswith('odscen')))\n"
        "print(*({'numpy', 'polars', 'pydantic', 'scipy', 'lxml', 'libsumo'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    assert done == ["odscen odscen.base odscen.base.version", ""]


def test_the_example_of_the_first_steps_runs(tmp_path: Path) -> None:
    text = (ROOT / "docs/first-steps.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    source = next(path for path in odscen.shipped_maps() if path.stem == "roundabout")
    (tmp_path / "Town01.xodr").write_bytes(source.read_bytes())
    code = block.replace("until=300", "until=30")
    assert code != block
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for seed in (7, 8, 9):
        assert f"my-workspace/runs/Town01-{seed:04d}" in done.stdout
