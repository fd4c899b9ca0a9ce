"""A self-check as one page and as JSON, for sending to those who build the mirror."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import Markup, element, join
from odscen.carla.selfcheck.body_checks import BODY_NAMES
from odscen.carla.selfcheck.check_line import CheckState
from odscen.reports.page_templates import html_page, html_table, page_head, report_section

if TYPE_CHECKING:
    from odscen.carla.selfcheck.check_line import CheckLine, SelfcheckReport

PAGE, DATA = "carla-selfcheck.html", "carla-selfcheck.json"
"""Names of the two files."""

_STYLES = {CheckState.OK: "good", CheckState.DIFFERS: "bad", CheckState.NOT_CHECKED: None}
_HEADS = ("Check", "Expected", "Seen", "Result", "Note")
_VERSIONS = {
    "server": "CARLA server",
    "carla": "package carla",
    "odscen": "odscen",
    "python": "Python",
    "system": "system",
}


def selfcheck_data(report: SelfcheckReport) -> dict[str, Any]:
    """The report as plain values; ``ok`` is false if a line differs."""
    return {
        "server": report.server,
        "map": report.map,
        "versions": report.versions,
        "ok": not report.differing,
        "checks": [
            {
                "name": line.name,
                "expected": line.expected,
                "seen": line.seen,
                "state": str(line.state),
                "note": line.note,
            }
            for line in report.lines
        ],
    }


def selfcheck_page(report: SelfcheckReport) -> str:
    """The report as a page that needs nothing else."""
    differing, unchecked = len(report.differing), len(report.unchecked)
    if differing:
        style, words = "bad", f"{differing} of {len(report.lines)} checks differ"
    elif unchecked:
        style, words = "fair", f"As expected; {unchecked} not checked"
    else:
        style, words = "good", "As expected"
    title = f"CARLA at {report.server}"
    sentence = (
        "What the mirror relies on, measured on this server. No map was loaded; what was made for "
        "the checks has been taken away."
    )
    versions = [
        element("tr", element("th", label, scope="row"), element("td", report.versions[key]))
        for key, label in _VERSIONS.items()
        if key in report.versions
    ]
    versions.append(element("tr", element("th", "map", scope="row"), element("td", report.map)))
    body = join(
        [
            page_head("Self-check", title, element("p", sentence), verdict=words, style=style),
            _render_checks("The server and its world", report, bodies=False),
            _render_checks("A car and a walker", report, bodies=True),
            report_section(
                "Versions",
                html_table(("Of", "Version"), versions),
                explained="of the server, of what has asked it, and of where that runs.",
                ident="versions",
            ),
        ]
    )
    return html_page(f"{title} - self-check", body)


def _render_checks(heading: str, report: SelfcheckReport, *, bodies: bool) -> Markup:
    lines = [line for line in report.lines if (line.name in BODY_NAMES) == bodies]
    return report_section(
        heading,
        html_table(_HEADS, [_render_row(line) for line in lines]),
        explained="metres, degrees, m/s, and milliseconds of wall time.",
        ident="bodies" if bodies else "world",
    )


def _render_row(line: CheckLine) -> Markup:
    return element(
        "tr",
        element("th", line.name, scope="row"),
        *(element("td", words, class_="wrap") for words in (line.expected, line.seen)),
        element("td", str(line.state), class_=_STYLES[line.state]),
        element("td", line.note, class_="wrap"),
    )
