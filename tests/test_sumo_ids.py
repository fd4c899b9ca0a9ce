"""A SUMO id is looked up, never taken apart or put together, but where the network is written."""

import ast
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[1] / "src/odscen"
WRITER = "net_ids.py"
OTHER_NAMES = {
    "f'{plain}_{number}'": "names of junctions, given when the network is written",
    "f'{key.road}_{key.lane}'": "road and lane of OpenDRIVE, in SUMO's parameter origId",
    "name.removesuffix('_length').split('_')": "names of deviations",
    "f'{domain}_{name}'": "names of functions of libsumo",
    "name.split('_')": "names of figures",
}
"""Expressions that join or split other names at an underscore."""
STAGES = ("convert", "sumo", "runs", "records", "figures", "reports", "experiments", "carla")
_PARSERS = {"split", "rsplit", "partition", "rpartition", "endswith", "removesuffix"}


def handled(source: str) -> list[str]:
    """Expressions that take a name apart at ``_`` or ``:`` or put one together with them."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            texts = [a.value for a in node.args if isinstance(a, ast.Constant)]
            starts = node.func.attr == "startswith" and ":" in texts
            if starts or (node.func.attr in _PARSERS and {"_", "_0"} & {*map(str, texts)}):
                found.append(ast.unparse(node))
        elif isinstance(node, ast.JoinedStr):
            shape = "".join(p.value if isinstance(p, ast.Constant) else "{}" for p in node.values)
            if shape.startswith(":{}") or shape in ("{}_{}", "{}_0"):
                found.append(ast.unparse(node))
    return found


def modules() -> list[Path]:
    return [
        path
        for path in sorted(SOURCES.rglob("*.py"))
        if path.relative_to(SOURCES).parts[0] in STAGES and path.name != WRITER
    ]


@pytest.mark.parametrize(
    "code",
    [
        'lane.rpartition("_")[0]',
        'edge.startswith(":")',
        'name.split("_")',
        'start.removesuffix("_0")',
        'f"{edge}_{index}"',
        'f":{junction}_{number}"',
    ],
)
def test_the_search_finds_ids_that_are_parsed_or_built(code: str) -> None:
    assert len(handled(code)) == 1


def test_the_search_leaves_other_text_alone() -> None:
    assert handled('f"{name}: {value}"; text.split(":"); f"p{share}_s"; key.rstrip("_")') == []


def test_ids_are_built_where_the_network_is_written_and_parsed_nowhere() -> None:
    paths = modules()
    assert len(paths) > 100
    found = {(path.name, code) for path in paths for code in handled(path.read_text("utf-8"))}
    assert {(name, code) for name, code in found if code not in OTHER_NAMES} == set()
