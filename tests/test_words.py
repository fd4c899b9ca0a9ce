"""One word for one thing: the words that the glossary replaces stay out of what users see.

Terms and their sources are in docs/glossary.md. Looked at are documents, texts of the page, help
texts, every string that the package may print, and the report and the comparison of real runs.
"""

from __future__ import annotations

import ast
import html
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from typer.main import get_command

from odscen.app.running import batches
from odscen.cli.commands import command_line
from odscen.experiments.comparison_page import comparison_page
from odscen.experiments.comparisons import compare_runs, read_runs
from odscen.maps.store import Workspace
from odscen.records.outcomes import StopReason
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    import click

ROOT = Path(__file__).parents[1]
SCENARIO = ROOT / "suites" / "scenarios" / "signal_crossing.scenario.json"

REPLACED = {
    r"some(body|one)|who(so)?ever|nobody|everybody": "vehicle, pedestrian, road user",
    r"(chance|crowd) number|by chance": "random seed, random",
    r"streams? of (traffic|people|vehicles|pedestrians)": "flow, pedestrian flow",
    r"by the (clock|traffic)": "fixed-time, actuated",
    r"(taken|lifted) off( the road)?|moved on": "teleported",
    r"kept out|never entered": "not inserted",
    r"stuck": "gridlocked, queued",
    r"sets? out": "depart",
    r"go(es|ing)? on|went on": "resume, running",
    r"troubles?": "incident",
    r"fates?": "outcome",
    r"told|tells": "reported, says",
    r"ruled by": "controlled by",
    r"manners?": "driver behaviour",
    r"crossings clear": "pedestrian clearance",
    r"times between stages": "intergreen",
    r"red light holds": "signal delay",
    r"places? of counting": "count station",
    r"time to allow": "planning time",
    r"middle one": "median",
    r"taken over": "import report",
    r"no map is like that": "no matching maps",
    r"stands|stood": "stopped, queued",
    r"hubs?": "walking area",
    r"courses?": "lane alignment, route",
    r"ways?": "route, connection, path",
}
"""What is replaced, and by what; whole words, in any case."""

ALLOWED = re.compile(
    r"right[- ]of[- ]way|(give|gives|giving|gave) way|(one|two|three|either|half)[- ]?way|all-way"
    r"|(both|either|other|same|this|that|no|only|easy|each|some|best|usual|long|under|two|three"
    r"|all the|out of the|on (the|its|their)|by the|in the|in a|in this) ways?"
    r"|OSM ways?|^way $"  # the word of OpenStreetMap
    r"|ways? (around|in|of|to)\b(?! (the|a) goal)|of course"
    r"|\"fate\"|entry\.fate",  # a field of map.json
    re.IGNORECASE,
)
"""English that means something else."""

RECORDED = frozenset(reason.value for reason in StopReason)
"""Written into the files of runs since before the glossary; people read their labels."""

_FOUND = re.compile(rf"\b({'|'.join(REPLACED)})\b", re.IGNORECASE)


def replaced_words(text: str) -> list[str]:
    """Words in ``text`` that have been replaced, each with what stands around it."""
    clean = ALLOWED.sub(lambda found: "~" * len(found[0]), text)
    return [
        f"...{text[max(0, found.start() - 30) : found.end() + 20]}...".replace("\n", " ")
        for found in _FOUND.finditer(clean)
    ]


def _strings(path: Path) -> Iterator[tuple[int, str]]:
    """Every string of a module but docstrings, with its line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield node.lineno, node.value


def _helps(command: click.Command, name: str) -> Iterator[tuple[str, str]]:
    yield name, command.help or ""
    for parameter in command.params:
        yield f"{name} {parameter.name}", getattr(parameter, "help", None) or ""
    for child, inner in getattr(command, "commands", {}).items():
        yield from _helps(inner, f"{name} {child}")


DOCUMENTS = sorted(
    {*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md"), ROOT / "maps" / "README.md"}
    - {ROOT / "docs" / "glossary.md"}  # explains the terms in plain words
    - {ROOT / "docs" / "api-reference.md"},  # is made of docstrings
)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_documents_use_the_terms_of_the_glossary(path: Path) -> None:
    assert replaced_words(path.read_text(encoding="utf-8")) == []


def test_texts_of_the_page_use_the_terms_of_the_glossary() -> None:
    sources = ROOT / "frontend" / "src"
    found = {
        path.relative_to(sources).as_posix(): words
        for path in sorted(sources.rglob("*.ts*"))
        if "glossary" not in path.name.lower()
        # Generated; messages of the server are looked at in its source, without its names.
        and path.name not in {"schema.ts", "serverSentences.ts"}
        and (words := replaced_words(path.read_text(encoding="utf-8")))
    }
    assert found == {}


def test_help_texts_use_the_terms_of_the_glossary() -> None:
    texts = dict(_helps(get_command(command_line()), "odscen"))
    assert len(texts) > 50
    assert {name: words for name, text in texts.items() if (words := replaced_words(text))} == {}


def test_messages_use_the_terms_of_the_glossary() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {word}"
        for path in sorted((ROOT / "src" / "odscen").rglob("*.py"))
        for line, text in _strings(path)
        if " " in text and text not in RECORDED
        for word in replaced_words(text)
    ]
    assert found == []


def _shown(page: str) -> str:
    """Text of an HTML page: without styles, scripts and tags."""
    inner = re.sub(r"<(style|script)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]*>", " | ", inner))


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Workspace, list[Path]]:
    """Two seeds of a signalised crossing with pedestrians, with all that a run can record."""
    root = tmp_path_factory.mktemp("runs")
    store = Workspace.open(root / "workspace")
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    folders = []
    for seed in (1, 2):
        settings = RunSettings(seed=seed, recording=Recording(criticality=True))
        batches.run_many(store, [SCENARIO], out=root / str(seed), settings=settings)
        folders.append(root / str(seed) / "signal_crossing")
    return store, folders


def test_the_report_uses_the_terms_of_the_glossary(two_runs: tuple[Workspace, list[Path]]) -> None:
    _, (first, _) = two_runs
    page = _shown((first / "report.html").read_text(encoding="utf-8"))
    for heading in (
        "Key figures", "Level of service", "Trajectories", "Flow, density and speed",
        "Insertions and arrivals", "Traffic conflicts", "Pedestrians", "Emissions and fuel",
    ):  # fmt: skip
        assert f"| {heading} |" in page
    assert replaced_words(page) == []


def test_a_comparison_uses_the_terms_of_the_glossary(
    two_runs: tuple[Workspace, list[Path]],
) -> None:
    store, (one, other) = two_runs
    page = comparison_page(compare_runs(read_runs(one, store), read_runs(other, store)))
    for heading in ("Summary", "Differences", "All figures", "Largest changes by place"):
        assert f"| {heading} |" in _shown(page)
    assert replaced_words(_shown(page)) == []
