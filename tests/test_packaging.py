from __future__ import annotations

import json
from pathlib import Path

LOCK = Path(__file__).parents[1] / "frontend/package-lock.json"


def test_the_lock_file_names_versions_and_checksums_and_no_registry():
    packages = json.loads(LOCK.read_text(encoding="utf-8"))["packages"]
    packages.pop("")
    assert packages
    for name, package in packages.items():
        assert package.get("integrity", "").startswith("sha512-"), name
        assert "resolved" not in package, name
