"""Writes docs/images/sweep-cut-in-*.png: the plane of the example of docs/sweeps.md.

``python -m tools.sweep_pictures``. They are cut out of the page of the sweep, light and dark; its
200 cases run one after the other, which takes minutes.
"""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

from PIL import Image

from odscen.experiments.sweeps import sweep
from odscen.maps.store import Workspace
from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text
from tools import page as tool
from tools.screenshots.camera import in_few_colours
from tools.screenshots.scenarios import WEAVE, cut_in

PICTURES = tool.ROOT / "docs" / "images"
VARIED = ("ttc=0.6..3.45:20", "challenger_speed=5..14:10")
"""As the document has it."""
WINDOW = {"width": 900, "height": 700}
"""Pixels."""


def main() -> None:
    """Run the sweep, and take both pictures."""
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name, "workspace"))
        workspace.add_map(tool.ROOT / "maps" / f"{WEAVE}.xodr")
        plan = SweepPlan(axes=tuple(axis_from_text(one) for one in VARIED))
        found = sweep(workspace, cut_in(workspace), plan, Path(name, "cut-in"), tell=print)
        safe = found.table["safe"].to_list()
        print(f"{len(safe)} cases, {safe.count(True)} of them safe")
        take((found.folder / "sweep.html").as_uri())


def take(address: str) -> None:
    """Cut the plane out of the page of a sweep, in both colour schemes."""
    with tool.launched() as browser:
        for scheme in ("light", "dark"):
            page = browser.new_page(viewport=WINDOW, color_scheme=scheme)  # type: ignore[arg-type]
            page.goto(address)
            taken = page.locator("section#boundary").screenshot()
            picture = in_few_colours(Image.open(io.BytesIO(taken)).convert("RGB"))
            picture.save(PICTURES / f"sweep-cut-in-{scheme}.png", optimize=True)


if __name__ == "__main__":
    main()
