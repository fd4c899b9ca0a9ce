"""What converting a map gives, whoever wrote the network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from odscen.convert.lane_table.table import LaneTable
    from odscen.convert.model.conversion_report import ConversionReport


@dataclass(frozen=True, slots=True)
class SumoNetwork:
    """A network: its file, how to cross over to it, and how it came about."""

    net_xml: bytes
    table: LaneTable
    report: ConversionReport
