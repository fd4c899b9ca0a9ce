"""Notes of a release from the changelog: ``python -m tools.release_notes 0.2.0``.

Also refuses a version that is not the package's own, or that the changelog calls unreleased.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


class ReleaseError(Exception):
    """What stands in the way of a release."""


def release_notes(changelog: str, version: str, *, own: str) -> str:
    """What the changelog says of a version, without its heading.

    Parameters
    ----------
    own
        Version of the package.
    """
    if version != own:
        raise ReleaseError(f"the tag is {version}, but the package is {own}")
    parts = re.split(r"^## ", changelog, flags=re.MULTILINE)[1:]
    for part in parts:
        heading, _, notes = part.partition("\n")
        if heading.split(" ")[0] == version:
            if "unreleased" in heading:
                raise ReleaseError(f"the changelog calls {version} unreleased: give it its date")
            return notes.strip() + "\n"
    raise ReleaseError(f"the changelog says nothing of {version}")


def own_version() -> str:
    text = (ROOT / "src/odscen/base/version.py").read_text(encoding="utf-8")
    return re.findall(r'^__version__ = "(.+)"$', text, re.MULTILINE)[0]


def main() -> None:
    try:
        changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
        print(release_notes(changelog, sys.argv[1].removeprefix("v"), own=own_version()), end="")
    except ReleaseError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
