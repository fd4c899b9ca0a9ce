from __future__ import annotations

import json

from odscen.convert.model.conversion_report import ConversionReport, ElementOutcome, ReportEntry

REPORT = ConversionReport.of(
    [
        ReportEntry(ElementOutcome.LOST, "road 1", "gone"),
        ReportEntry(ElementOutcome.GUESSED, "map", "made up"),
        ReportEntry(ElementOutcome.LOST, "road 1", "gone"),
    ],
    {"crossings": 3.0},
)


def test_an_entry_is_listed_once() -> None:
    assert [entry.element for entry in REPORT.entries] == ["road 1", "map"]


def test_counts_name_every_outcome() -> None:
    assert REPORT.counts() == {"kept": 0, "repaired": 0, "guessed": 1, "lost": 1}


def test_the_json_form_gives_the_report_back() -> None:
    assert ConversionReport.from_dict(json.loads(json.dumps(REPORT.to_dict()))) == REPORT
