from __future__ import annotations

import json
import tomllib
from itertools import chain
from pathlib import Path

from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).parents[1]
LOCK = ROOT / "frontend/package-lock.json"
SAFE = {
    "cairosvg": "2.9",
    "dask": "2026.1",
    "distributed": "2026.1",
    "jinja2": "3.1.6",
    "lxml": "6.1.3",
    "msgpack": "1.2.1",
    "orjson": "3.11.6",
    "python-multipart": "0.0.31",
    "starlette": "1.5",
    "torch": "2.12.1",
}
"""Releases below have a published vulnerability."""
WORKING = {
    "fastapi": "0.133", "numpy": "2.2", "polars": "1.37", "shapely": "2.0.6", "typer": "0.16"
}  # fmt: skip
"""Releases below lack what odscen calls; all of them together are tried by `make test-lowest`."""


def test_the_lock_file_names_versions_and_checksums_and_no_registry():
    packages = json.loads(LOCK.read_text(encoding="utf-8"))["packages"]
    packages.pop("")
    assert packages
    for name, package in packages.items():
        assert package.get("integrity", "").startswith("sha512-"), name
        assert "resolved" not in package, name


def test_no_bound_admits_a_release_that_is_vulnerable_or_does_not_work():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = [*chain(project["dependencies"], *project["optional-dependencies"].values())]
    lowest = {
        requirement.name: bound.version
        for requirement in map(Requirement, asked)
        for bound in requirement.specifier
        if bound.operator in (">=", "==")
    }
    assert set(lowest) == {Requirement(text).name for text in asked}
    too_low = {
        name: lowest.get(name)
        for name, version in {**SAFE, **WORKING}.items()
        if name not in lowest or Version(lowest[name]) < Version(version)
    }
    assert too_low == {}
