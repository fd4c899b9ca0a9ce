"""Run ASAM's checks on maps and OpenSCENARIO files; exit 1 and print what they find.

``python tools/check_maps.py FILE...``, with ``asam-qc-opendrive`` and ``asam-qc-openscenarioxml``
beside it: see ``make check-maps``.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from xml.sax.saxutils import quoteattr

_CHECKERS = {".xodr": ("xodrBundle", "qc_opendrive"), ".xosc": ("xoscBundle", "qc_openscenario")}
"""Bundle of checks and its program, by the ending of the file."""


def main() -> int:
    """Check every file named on the command line."""
    return max(_check(Path(name)) for name in sys.argv[1:])


def _check(path: Path) -> int:
    bundle, program = _CHECKERS[path.suffix]
    with tempfile.TemporaryDirectory() as folder:
        result, config = Path(folder) / "result.xqar", Path(folder) / "config.xml"
        config.write_text(
            f'<Config><Param name="InputFile" value={quoteattr(str(path.absolute()))}/>'
            f'<CheckerBundle application="{bundle}">'
            f'<Param name="resultFile" value={quoteattr(str(result))}/></CheckerBundle></Config>'
        )
        command = [str(Path(sys.executable).parent / program), "-c", str(config)]
        subprocess.run(command, check=True, capture_output=True)
        tree = ET.parse(result)
    checkers = [c for c in tree.iter("Checker") if c.get("status") == "completed"]
    issues = [issue.get("description") for issue in tree.iter("Issue")]
    print(f"{path.name}: {len(checkers)} checks completed, {len(issues)} issues")
    for issue in issues:
        print(f"  {issue}")
    return 1 if issues or not checkers else 0


if __name__ == "__main__":
    sys.exit(main())
