"""``odscen --help`` against an interpreter that does nothing. Aim: at most 0.3 s."""

from __future__ import annotations

import subprocess
import sys

from bench.common import paired


def main() -> None:
    ours, peer, ratio = paired(
        lambda: _run("-m", "odscen", "--help"), lambda: _run("-c", "pass"), repeats=15
    )
    print(f"odscen --help {ours:.3f} s, python -c pass {peer:.3f} s, ratio {ratio:.1f}")


def _run(*arguments: str) -> None:
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
