"""pytest plugin: the fixture ``odscen_run``, and scenario files as tests.

Loaded by every pytest that finds odscen installed, so it imports nothing at the top but pytest and
collects scenario files only where it is asked to: named on the command line, or with
``odscen_collect = true`` in the configuration.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from odscen.runs.finished_run import Run
    from odscen.runs.run_settings import RunSettings

_SUFFIX = ".scenario.json"
_WORKSPACE = "--odscen-workspace"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the options of the plugin."""
    group = parser.getgroup("odscen", "traffic scenarios")
    group.addoption(
        _WORKSPACE,
        metavar="DIR",
        help="workspace with the maps of the scenarios, written with = before DIR "
        "(default: odscen_workspace of the configuration, else as for the odscen command)",
    )
    parser.addini("odscen_workspace", "workspace with the maps, relative to this file")
    parser.addini("odscen_collect", "collect *.scenario.json files as tests", type="bool")
    parser.addini("odscen_expect", "expectations of every collected scenario", type="linelist")
    parser.addini("odscen_seeds", "seeds of every collected scenario", type="args")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse the form of the option that makes pytest take the workspace for a folder of tests.

    pytest looks for its configuration before it knows the options of plugins: what follows one
    after a space is a path to it, and moves its root.
    """
    if _WORKSPACE in config.invocation_params.args:
        raise pytest.UsageError(
            f"write {_WORKSPACE}=DIR: after a space, pytest takes DIR for a folder of tests"
        )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect a scenario file, if that is wanted."""
    if not file_path.name.endswith(_SUFFIX):
        return None
    if parent.config.getini("odscen_collect") or parent.session.isinitpath(file_path):
        file: pytest.Collector = _ScenarioFile.from_parent(parent, path=file_path)
        return file
    return None


class _ScenarioFile(pytest.File):
    """A scenario: one test per seed."""

    def collect(self) -> Iterator[pytest.Item]:
        seeds = self.config.getini("odscen_seeds")
        for seed in seeds or [None]:
            name = "run" if seed is None else f"seed-{seed}"
            yield _ScenarioTest.from_parent(self, name=name, seed=seed)


class _ScenarioTest(pytest.Item):
    """A run of the scenario: passes if it completes and meets the expectations."""

    def __init__(self, *, seed: str | None, **arguments: object) -> None:
        super().__init__(**arguments)  # type: ignore[arg-type]  # pytest's own
        self.seed = seed

    def runtest(self) -> None:
        factory: pytest.TempPathFactory = self.config._tmp_path_factory  # type: ignore[attr-defined]
        try:
            seed = None if self.seed is None else int(self.seed)
        except ValueError:
            raise pytest.UsageError(f"odscen_seeds: {self.seed!r} is not a whole number") from None
        expect = self.config.getini("odscen_expect")
        settings = _make_settings(seed=seed, expect=expect)
        result = _run_scenario(self.config, factory.mktemp("odscen"), self.path, settings)
        found = _list_shortcomings(result)
        if found:
            pytest.fail("\n".join(found), pytrace=False)

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """Errors of odscen in their own words, without Python's traceback."""
        from odscen.base.errors import OdscenError

        if isinstance(excinfo.value, OdscenError):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo, style))  # type: ignore[arg-type]

    def reportinfo(self) -> tuple[Path, None, str]:
        return self.path, None, f"{self.path.name}: {self.name}"


@pytest.fixture(scope="session")
def odscen_run(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., Run]:
    """Return a function that runs a scenario and gives the finished :class:`Run`.

    ``odscen_run(path, seed=None, until=None, expect=(), workspace=None)``; the path is relative to
    the file of the test, or to the working directory. A run that fails or falls short of ``expect``
    fails the test. Fixtures of any scope can use it.
    """

    def run(
        scenario: str | Path,
        *,
        seed: int | None = None,
        until: float | None = None,
        expect: Sequence[str] = (),
        workspace: Path | None = None,
    ) -> Run:
        __tracebackhide__ = True  # a failure shows the test's own line
        from odscen.base.errors import OdscenError

        folder = tmp_path_factory.mktemp("odscen")
        try:
            settings = _make_settings(seed=seed, until=until, expect=expect)
            result = _run_scenario(request.config, folder, scenario, settings, workspace=workspace)
        except OdscenError as error:
            problem = str(error)
        else:
            problem = "\n".join(_list_shortcomings(result))
            if not problem:
                return result
        pytest.fail(problem)

    return run


def _make_settings(
    *, seed: int | None, until: float | None = None, expect: Sequence[str]
) -> RunSettings:
    from odscen.figures.judging.expectations import parse_expectation
    from odscen.runs.run_settings import RunSettings

    expectations = tuple(parse_expectation(text) for text in expect)
    return RunSettings(seed=seed, until=until, expectations=expectations)


def _run_scenario(
    config: pytest.Config,
    out: Path,
    scenario: str | Path,
    settings: RunSettings,
    *,
    workspace: Path | None = None,
) -> Run:
    from pathlib import Path

    from odscen.app.running import runs
    from odscen.maps.store import Workspace

    named = workspace or config.getoption(_WORKSPACE)
    configured = config.getini("odscen_workspace")
    if not named and configured:
        named = (config.inipath or config.rootpath / "-").parent / configured
    store = Workspace.open(Path(named) if named else None)
    return runs.run(store, _resolve_beside_test(config, Path(scenario)), settings=settings, out=out)


def _resolve_beside_test(config: pytest.Config, scenario: Path) -> Path:
    """A relative path is one from the folder of the test file; from where pytest runs if not."""
    test, _, _ = os.environ.get("PYTEST_CURRENT_TEST", "").partition("::")
    near = (config.rootpath / test).parent / scenario
    return near if test and near.is_file() else scenario


def _list_shortcomings(result: Run) -> list[str]:
    from odscen.figures.judging.criteria import missed_rows, missed_words
    from odscen.records.outcomes import RunStatus

    if result.status is RunStatus.FAILED:
        return [f"the run failed: {result.summary['error']}"]
    return [
        f"expected {verdict['expectation']}, but it is {_format_value(verdict['value'])}"
        for verdict in result.summary["expectations"]
        if not verdict["passed"] and verdict["expectation"] != "criteria"
    ] + [
        missed_words(row)
        for row in missed_rows(result.summary)
        if any(verdict["expectation"] == "criteria" for verdict in result.summary["expectations"])
    ]


def _format_value(value: float | None) -> str:
    return "nothing" if value is None else f"{value:g}"
