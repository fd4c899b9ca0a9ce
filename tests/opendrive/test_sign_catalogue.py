"""Signs by country: what they mean, that they act, and that the others are counted."""

from __future__ import annotations

import pytest

from odscen.base.ids import RoadId
from odscen.convert.building.network import build_network
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import Signal
from odscen.opendrive.sign_catalogue import sign_meaning
from tests.opendrive.snippets import document, road


def sign(country: str, code: str, subtype: str = "-1", number: str = "1") -> str:
    return (
        f'<signal id="{number}" s="90" t="-4" dynamic="no" orientation="+" country="{country}" '
        f'type="{code}" subtype="{subtype}"/>'
    )


def read(text: str) -> Signal:
    odr = parse(document(road(inside=f"<signals>{text}</signals>")))
    return odr.roads[RoadId("1")].signals[0]


def built(*signs: str) -> SumoNetwork:
    odr = parse(document(road(inside=f"<signals>{''.join(signs)}</signals>")))
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    return build_network(odr, table, graph.walks)


@pytest.mark.parametrize(
    ("country", "code", "subtype", "meaning"),
    [
        ("SE", "B1", "-1", "yield"),
        ("se", "b", "2", "stop"),
        ("SWE", "B4", "", "priority"),
        ("GB", "601.1", "-1", "stop"),
        ("GB", "602", "", "yield"),
        ("GB", "601", "1", "stop"),
        ("FR", "AB4", "-1", "stop"),
        ("FR", "AB3a", "-1", "yield"),
        ("FR", "B1", "", "no_entry"),
        ("JP", "330-A", "-1", "stop"),
        ("JP", "329", "2", "yield"),
        ("JP", "330-2", "", "stop"),
        ("RU", "2.4", "-1", "yield"),
        ("RU", "2.5", "-1", "stop"),
        ("RU", "2", "5", "stop"),
        ("CN", "101", "1", "stop"),
        ("CN", "101", "2", "yield"),
        ("US", "R1", "1", "stop"),
        ("usa", "R1", "2", "yield"),
        ("US", "R2-1", "-1", "speed_limit"),
        ("DE", "301", "-1", "priority"),
        ("DE", "306", "-1", "priority"),
        ("DE", "274-50", "", "speed_limit"),
        ("DE", "278", "-1", "end_of_speed_limit"),
        ("Germany", "267", "", "no_entry"),
        ("DE", "245", "", "bus_lane"),
        ("DE", "350", "", "crosswalk"),
        ("OpenDRIVE", "206", "-1", "stop"),
        ("", "r1-1", "", "stop"),
        ("NL", "B6", "", "yield"),
        ("NLD", "A1", "50", "speed_limit"),
        ("BE", "B5", "-1", "stop"),
        ("PL", "A-7", "", "yield"),
        ("PL", "B", "20", "stop"),
        ("PL", "D-12", "", "bus_lane"),
        ("POL", "D1", "", "priority"),
        ("CZ", "P6", "", "stop"),
        ("CH", "3.02", "", "yield"),
        ("CHE", "3", "01", "stop"),
        ("ES", "R-2", "", "stop"),
        ("ESP", "R301", "50", "speed_limit"),
        ("NO", "202", "", "yield"),
        ("KR", "227", "", "stop"),
        ("AU", "R1-2", "", "yield"),
        ("CA", "RA-1", "", "stop"),
        ("NO", "205", "", None),
        ("KR", "206", "", None),
        ("DE", "2-74", "", None),
        ("DE", "101", "1", None),
        ("JP", "B1", "", None),
        ("XX", "B1", "", None),
    ],
)
def test_a_code_means_what_its_country_says(
    country: str, code: str, subtype: str, meaning: str | None
) -> None:
    found = read(sign(country, code, subtype))
    assert sign_meaning(found) == meaning
    expected = meaning if meaning in ("stop", "yield", "speed_limit") else "other"
    assert signal_kind(found) == expected


def test_signs_without_effect_are_counted_by_country_and_type() -> None:
    network = built(
        sign("DE", "306", number="1"),
        sign("DE", "306", number="2"),
        sign("DE", "999", number="3"),
        sign("SE", "A20", number="4"),
        sign("SE", "A20", number="5"),
        sign("OpenDRIVE", "274", "60", number="6"),
    )
    told = {entry.element: (entry.outcome.value, entry.reason) for entry in network.report.entries}
    assert told["signals of type DE 306"] == (
        "guessed",
        "2 priority signs: right of way follows the signs to give way, or the larger road",
    )
    assert told["signals of type DE 999"] == (
        "lost",
        "1 signs that are not understood have no effect",
    )
    assert told["signals of type SE A20"][1].startswith("2 signs that are not understood")
    assert told["signals of type OPENDRIVE 274 60"][1].startswith("1 speed limit signs")
