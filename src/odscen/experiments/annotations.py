"""Findings of a suite where reviewers see them: GitHub, GitLab, and what reads SARIF.

Each finding has the file and the line that it is about: of a changed map the road in its .xodr, of
a changed scenario the part that has the changed field.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import quote

from odscen.base.version import __version__
from odscen.experiments.suite import CaseStatus
from odscen.experiments.suite_words import MOST_PROBLEMS, details, headline
from odscen.maps.folder_names import name_from_file

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.experiments.suite import CaseResult, SuiteResult

CODE_QUALITY_FILE = "gl-code-quality-report.json"
"""Where GitLab's own recipes look for it."""


class Finding(NamedTuple):
    """One thing to look at.

    Attributes
    ----------
    failed
        Whether the gate fails for it; else it warns.
    file, line
        Where it is, counted from 1; the file is there.
    title
        The scenario, and its verdict.
    words
        What has changed, and by how much; the first line says most.
    """

    failed: bool
    file: Path
    line: int
    title: str
    words: str


def findings(result: SuiteResult) -> Iterator[Finding]:
    """What is to be looked at, the worst first, and what the checks of scenarios warn of."""
    for case in result.worst_first:
        if case.status is not CaseStatus.PASSED:
            file, line = _find_place(result, case)
            lines = [headline(case), *details(case)[:MOST_PROBLEMS]]
            title = f"{case.name}: {case.label}"
            yield Finding(not case.status.passes, file, line, title, "\n".join(lines))
        for words in case.warnings:
            file = _existing_file(result, case.case.file)
            yield Finding(False, file, 1, f"{case.name}: warning", words)


def _find_place(result: SuiteResult, case: CaseResult) -> tuple[Path, int]:
    """File and line of what has changed first; the scenario where nothing says more."""
    maps = {name_from_file(path): path for path in result.suite.maps}
    on_map = [change for change in case.map_changes if change.place is not None]
    if on_map and case.causes and case.causes[0].name == "map" and case.map_name in maps:
        file = _existing_file(result, maps[case.map_name])
        place = on_map[0].place
        road = "" if place is None else re.escape(str(place.road))
        return file, _line_of(file, rf'<road\b[^>]*\bid="{road}"')
    file = _existing_file(result, case.case.file)
    parts = {cause.part for cause in case.causes[:1]}
    changed = [change for change in case.scenario_changes if change.place[0] in parts]
    if not changed:
        return file, 1
    for name in reversed(changed[0].place[:3]):
        line = _line_of(file, rf'"{re.escape(name)}"')
        if line > 1:
            return file, line
    return file, 1


def _existing_file(result: SuiteResult, file: Path) -> Path:
    return file if file.is_file() else result.suite.file


def _line_of(file: Path, pattern: str) -> int:
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 1
    match = re.search(pattern, text)
    return 1 if match is None else text.count("\n", 0, match.start()) + 1


def github_annotations(result: SuiteResult) -> str:
    """Workflow commands, a line each: GitHub shows them at the files of a pull request."""
    lines = []
    for finding in findings(result):
        where = ",".join(
            f"{key}={_escape_property(str(value))}"
            for key, value in (
                ("file", _make_relative(finding.file)),
                ("line", finding.line),
                ("title", finding.title),
            )
        )
        level = "error" if finding.failed else "warning"
        lines.append(f"::{level} {where}::{_escape_command(finding.words)}\n")
    return "".join(lines)


def code_quality(result: SuiteResult) -> str:
    """A code-quality report for GitLab, JSON; the same findings have the same fingerprints."""
    rows = []
    for finding in findings(result):
        path = _make_relative(finding.file)
        known = f"{result.suite.name}\n{path}\n{finding.title}\n{finding.words}"
        rows.append(
            {
                "description": f"{finding.title}: {finding.words.splitlines()[0]}",
                "check_name": "odscen-test",
                "fingerprint": hashlib.sha256(known.encode()).hexdigest(),
                "severity": "major" if finding.failed else "minor",
                "location": {"path": path, "lines": {"begin": finding.line}},
            }
        )
    return json.dumps(rows, indent=1, ensure_ascii=False) + "\n"


_SARIF = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif(result: SuiteResult) -> str:
    """A SARIF 2.1.0 log, JSON; the same findings have the same fingerprints."""
    rows = []
    for finding in findings(result):
        path = _make_relative(finding.file)
        known = f"{result.suite.name}\n{path}\n{finding.title}\n{finding.words}"
        digest = hashlib.sha256(known.encode()).hexdigest()
        place = {
            "artifactLocation": {"uri": _quote_path(path)},
            "region": {"startLine": finding.line},
        }
        rows.append(
            {
                "ruleId": "odscen-test",
                "level": "error" if finding.failed else "warning",
                "message": {"text": f"{finding.title}: {finding.words}"},
                "locations": [{"physicalLocation": place}],
                "partialFingerprints": {"odscen/v1": digest},
            }
        )
    about = "A scenario of a suite is not as its baseline, or falls short of what is expected."
    driver = {
        "name": "odscen",
        "version": __version__,
        "rules": [{"id": "odscen-test", "shortDescription": {"text": about}}],
    }
    log = {
        "$schema": _SARIF,
        "version": "2.1.0",
        "runs": [{"tool": {"driver": driver}, "results": rows}],
    }
    return json.dumps(log, indent=1, ensure_ascii=False) + "\n"


def _quote_path(path: str) -> str:
    """Reference to a file: relative to the repository, or absolute outside it."""
    return Path(path).as_uri() if path.startswith("/") else quote(path)


def _make_relative(file: Path) -> str:
    """Path from the working directory, which in CI is that of the repository."""
    full = file.resolve()
    here = Path.cwd().resolve()
    return (full.relative_to(here) if full.is_relative_to(here) else full).as_posix()


def _escape_command(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape_command(text).replace(":", "%3A").replace(",", "%2C")
