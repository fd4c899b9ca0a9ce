"""Find a Chromium, or install Debian's where that is allowed: ``python -m tools.chromium``.

Needs nothing but Python, for it runs before anything is set up. ``ODSCEN_CHROMIUM`` names a browser
of one's own; with ``ODSCEN_REQUIRE_BROWSER=1`` or ``CI`` it is an error if there is none.
"""

from __future__ import annotations

import os
import shutil
import sys

from tools.debian import install

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
"""Nothing leaves the machine, drawing is in software; root in a container has no sandbox."""


def find() -> str | None:
    """Path of a Chromium or Chrome, or None."""
    named = os.environ.get("ODSCEN_CHROMIUM")
    candidates = (named,) if named else NAMES
    return next((path for name in candidates if (path := shutil.which(name))), None)


def required() -> bool:
    """Whether its absence is an error: in CI, or if asked for."""
    return any(
        os.environ.get(name, "") not in ("", "0") for name in ("CI", "ODSCEN_REQUIRE_BROWSER")
    )


def main() -> int:
    """Make sure that there is one; 1 if there must be and is not."""
    if not find() and not os.environ.get("ODSCEN_CHROMIUM"):
        install("chromium", "for the tests in a browser")
    if find():
        return 0
    print(
        "No Chromium here and none can be installed; name one in ODSCEN_CHROMIUM.", file=sys.stderr
    )
    if required():
        return 1
    print("The tests in a browser will be skipped.", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
