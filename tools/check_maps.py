"""Run ASAM's checks (``asam-qc-opendrive``) on maps; exit 1 and print what they find.

``python tools/check_maps.py MAP.xodr...``, see ``make check-maps``.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from xml.sax.saxutils import quoteattr


def main() -> int:
    """Check every map named on the command line."""
    return max(_check(Path(name)) for name in sys.argv[1:])


def _check(path: Path) -> int:
    with tempfile.TemporaryDirectory() as folder:
        result, config = Path(folder) / "result.xqar", Path(folder) / "config.xml"
        config.write_text(
            f'<Config><Param name="InputFile" value={quoteattr(str(path.absolute()))}/>'
            '<CheckerBundle application="xodrBundle">'
            f'<Param name="resultFile" value={quoteattr(str(result))}/></CheckerBundle></Config>'
        )
        command = [str(Path(sys.executable).parent / "qc_opendrive"), "-c", str(config)]
        subprocess.run(command, check=True, capture_output=True)
        tree = ET.parse(result)
    checkers = [c for c in tree.iter("Checker") if c.get("status") == "completed"]
    issues = [place.get("description") for place in tree.iter("Locations")]
    print(f"{path.name}: {len(checkers)} checks completed, {len(issues)} issues")
    for issue in issues:
        print(f"  {issue}")
    return 1 if issues or not checkers else 0


if __name__ == "__main__":
    sys.exit(main())
