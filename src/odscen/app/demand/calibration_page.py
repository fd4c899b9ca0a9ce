"""The page of a calibration: how well targets are met before and after, and each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from odscen.base.markup import Markup, element, join
from odscen.base.text_files import write_text
from odscen.reports.page_templates import html_page, html_table, page_head, report_section
from odscen.scenario.demand.targets import UNITS

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from odscen.app.demand.calibration import Calibration, FitShare

WORDS: Final = {
    "flow": "flows",
    "travel_time": "travel times",
    "queue": "mean queues",
    "queue_max": "longest queues",
}
SHARE_HEADS: Final = ("targets", "number", "met before", "met after", "off before", "off after")
TARGET_HEADS: Final = (
    "use",
    "kind",
    "place",
    "from, s",
    "to, s",
    "measured",
    "before",
    "after",
    "met",
)
MOST_ROWS: Final = 1000
"""Targets on the page; ``--json`` has all."""


def share_cells(share: FitShare) -> tuple[str, ...]:
    """Cells of a row of how many targets are met, see :data:`SHARE_HEADS`."""
    held = ", held back" if share.held else ", fitted"
    return (
        WORDS[share.kind] + held, str(share.targets),
        *(f"{met} ({100 * met / share.targets:.0f} %)"
          for met in (share.met_before, share.met_after)),
        f"{share.off_before:.2f}", f"{share.off_after:.2f}",
    )  # fmt: skip


def target_cells(done: Calibration) -> Iterable[tuple[str, ...]]:
    """Cells of a row for each target, see :data:`TARGET_HEADS`."""
    for fit in done.fits:
        target = fit.target
        before, after = (
            "-" if value is None else f"{value:.1f}" for value in (fit.before, fit.after)
        )
        yield (
            "validate" if target.held else "calibrate", target.kind, target.place,
            f"{target.begin:g}", f"{target.end:g}", f"{target.value:g} {UNITS[target.kind]}",
            before, after, "yes" if fit.met(after=True) else "no",
        )  # fmt: skip


def write_calibration_page(done: Calibration, out: Path, *, title: str) -> Path:
    """Write the page; ``title`` is the scenario's name."""
    shares = [_make_row(share_cells(share)) for share in done.shares]
    sections = [
        report_section(
            "Targets met", html_table(SHARE_HEADS, shares),
            explained="Flows within GEH 5, travel times within 15 % or a minute, queues within "
            "20 % or 15 m. Off is the root mean square distance in multiples of that. Nothing was "
            "fitted to targets that were held back.",
            ident="shares",
        ),
        report_section(
            "What is not plausible", _make_list(done.doubts or ("Nothing.",)),
            explained="Nothing is changed for that.", ident="doubts",
        ),
        report_section(
            "What was tried",
            _make_list([*(step.words for step in done.steps), *done.skipped]),
            explained=f"Each with the same seeds, {done.runs} runs in all; the distance is the "
            "mean over the kinds of targets that were fitted.",
            ident="steps",
        ),
        report_section(
            "Each target",
            html_table(TARGET_HEADS, [_make_row(c) for c in list(target_cells(done))[:MOST_ROWS]]),
            explained="Means over the seeds.", ident="targets",
        ),
    ]  # fmt: skip
    head = page_head("Calibration", title)
    return write_text(out, html_page(f"{title} - calibration", join([head, *sections])))


def _make_row(cells: Iterable[str]) -> Markup:
    return element("tr", *(element("td", cell) for cell in cells))


def _make_list(lines: Iterable[str]) -> Markup:
    return element("ul", *(element("li", line) for line in lines))
