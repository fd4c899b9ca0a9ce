"""Find a Chromium, or install Debian's where that is allowed: ``python tools/chromium.py``.

Needs nothing but Python, for it runs before anything is set up. ``ODSCEN_CHROMIUM`` names a browser
of one's own; with ``ODSCEN_REQUIRE_BROWSER=1`` or ``CI`` it is an error if there is none.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

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


def _may_install() -> list[str] | None:
    """What comes before ``apt-get``, or None if this machine or this user has none."""
    if not shutil.which("apt-get"):
        return None
    if os.geteuid() == 0:
        return []
    sudo = shutil.which("sudo")
    if (
        sudo
        and subprocess.run([sudo, "-n", "true"], check=False, capture_output=True).returncode == 0
    ):
        return [sudo, "-n"]
    return None


def _install(prefix: list[str]) -> None:
    apt = [*prefix, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]
    for arguments in (["update"], ["install", "-y", "--no-install-recommends", "chromium"]):
        if subprocess.run([*apt, *arguments], check=False, stdout=subprocess.DEVNULL).returncode:
            return


def main() -> int:
    """Make sure that there is one; 1 if there must be and is not."""
    prefix = None if os.environ.get("ODSCEN_CHROMIUM") else _may_install()
    if not find() and prefix is not None:
        print("Installing Debian's Chromium for the tests in a browser ...", flush=True)
        _install(prefix)
    found = find()
    if found:
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
