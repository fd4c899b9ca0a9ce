"""What of the public API of an earlier version would break: ``python -m tools.api_changes [REF]``.

Compares the public modules at REF, the last tag ``v*`` if not given, with those of now, by their
sources alone (griffe). Exit code 1 if a public name or parameter is gone, moved or newly required;
what is to go warns for one minor version first, see ``docs/api.md``.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1]
PACKAGE = "odscen"


def breaking_changes(old: Any, new: Any, modules: list[str]) -> Iterator[str]:
    """Changes of public names, a line each.

    Parameters
    ----------
    old, new
        Packages, as griffe has loaded them.
    modules
        Public modules; public is what they import or define without an underscore.
    """
    import griffe

    public: set[str] = set()
    for name in modules:
        before, now = (_find_module(package, name) for package in (old, new))
        if before is None:
            continue
        names = {own for own in before.members if not own.startswith("_") and own.isidentifier()}
        names = {own for own in names if own in (before.exports or names)}
        for own in sorted(names):
            member = before.members[own]
            if member.is_module:
                continue
            if now is None or own not in now.members:
                yield f"{name}.{own}: it is gone"
            else:
                public.add(_home_of(member))
    for change in griffe.find_breaking_changes(old, new):
        path = change.obj.path
        if any(path == home or path.startswith(f"{home}.") for home in public):
            words = change.explain(griffe.ExplanationStyle.ONE_LINE)
            what = _plain(words).rpartition(": ")[0].rpartition(": ")[2]
            yield f"{path}: {what}: {change.kind.value}"


def _find_module(package: Any, name: str) -> Any | None:
    rest = name.split(".")[1:]
    found = package
    for part in rest:
        if part not in found.members:
            return None
        found = found.members[part]
    return found


def _home_of(member: Any) -> str:
    """Where a name is defined."""
    return str(member.target_path if member.is_alias else member.path)


def _plain(text: str) -> str:
    return re.sub(r"\x1b\[\d*m", "", text)


def last_release() -> str | None:
    """The last tag of a version before this commit; ``None`` if there is none."""
    command = ["git", "-C", str(ROOT), "describe", "--tags", "--abbrev=0", "--match", "v*", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip() or None


def main() -> None:
    import griffe

    import odscen

    ref = sys.argv[1] if sys.argv[1:] else last_release()
    if ref is None:
        print("there is no tag v* before this commit: nothing has been released to compare with")
        return
    old = griffe.load_git(PACKAGE, ref=ref, repo=str(ROOT), search_paths=["src"])
    new = griffe.load(PACKAGE, search_paths=[str(ROOT / "src")])
    modules = [PACKAGE, *(f"{PACKAGE}.{name}" for name in odscen.MODULES)]
    found = list(breaking_changes(old, new, modules))
    print("\n".join(found) or f"nothing public has gone since {ref}")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
