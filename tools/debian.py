"""Debian packages, installed where that is allowed: ``python -m tools.debian PACKAGE REASON``.

Needs nothing but Python, for it runs before anything is set up. Whatever happens it is no error:
who needs the package will say so.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys


def install(package: str, reason: str) -> None:
    """Install a package, if this machine has ``apt-get`` and this user may use it."""
    prefix = _may_install()
    if prefix is None:
        return
    print(f"Installing Debian's {package} {reason} ...", flush=True)
    apt = [*prefix, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]
    for arguments in (["update"], ["install", "-y", "--no-install-recommends", package]):
        if subprocess.run([*apt, *arguments], check=False, stdout=subprocess.DEVNULL).returncode:
            return


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


if __name__ == "__main__":
    install(*sys.argv[1:])
