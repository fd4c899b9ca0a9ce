"""What the import report says of parts of a map that have no lane in SUMO, or another one."""

from __future__ import annotations

import pytest

from odscen.opendrive.parse import parse
from tests.convert.legs import crossing, entry, way
from tests.convert.maps import FOLDER, Converted, converted, of_model
from tests.opendrive.snippets import document, lane, road, section

ON = '<link><predecessor id="-1"/><successor id="-1"/></link>'


def made(*lanes: str, inside: str = "") -> Converted:
    return of_model(parse(document(road(lanes="".join(lanes), inside=inside))))


def walk(number: int) -> str:
    return lane(number, kind="sidewalk", width=2.0)


def item(text: str) -> str:
    return f"<objects>{text}</objects>"


CORNERS = "".join(
    f'<cornerLocal u="{u}" v="{v}"/>' for u, v in ((-2, -4), (2, -4), (2, 4), (-2, 4))
)
TAPER = lane(-2).replace('a="3.5" b="0"', 'a="3.5" b="-0.035"')
DENIED = '<access sOffset="0" rule="allow" restriction="delivery"/>' + "".join(
    f'<access sOffset="0" rule="deny" restriction="{who}"/>' for who in ("delivery", "emergency")
)
SAID = {
    "a lane without width": (
        (section(lane(-1), lane(-2, width=0.1)),),
        "",
        "lost: 100.00 of 100.00 m have no SUMO lane: it is 0.10 m wide at most",
    ),
    "a lane that comes to an end": (
        (section(lane(-1), TAPER),),
        "",
        "m have no SUMO lane: its width falls to zero",
    ),
    "a lane that is closed": (
        (section(lane(-1), lane(-2, inside=DENIED)),),
        "",
        "lost: 100.00 of 100.00 m have no SUMO lane: by its access no vehicle may use it",
    ),
    "a lane of another width": (
        (section(lane(-1, inside=ON, width=5.0)), section(lane(-1, inside=ON, width=4.2), s=70)),
        "",
        "it is 4.20 m wide here, and the SUMO lane 5.00 m all along",
    ),
    "a lane whose width varies": (
        (section(lane(-1).replace('b="0"', 'b="0.01"')),),
        "",
        "its width varies from 3.50 to 4.50 m, SUMO's is 4.00 m",
    ),
    "a lane for turning both ways": (
        (section(lane(1), lane(-1, kind="bidirectional"), lane(-2)),),
        "",
        "lost: lanes of type bidirectional are open both ways, as no lane of SUMO: left out",
    ),
    "a lane of no known use": (
        (section(lane(-1), lane(-2, kind="special1")),),
        "",
        "lost: lanes of type special1 are open to no road user and left out",
    ),
    "a restricted lane": (
        (section(lane(-1), lane(-2, kind="restricted")),),
        "",
        "lost: lanes of type restricted, on which no access allows vehicles: left out",
    ),
    "a crosswalk without a size": (
        (section(walk(2), lane(1), lane(-1), walk(-2)),),
        item('<object id="1" type="crosswalk" s="50" t="0"/>'),
        "lost: crosswalk without any size",
    ),
    "a crosswalk without heights": (
        (section(walk(2), lane(1), lane(-1), walk(-2)),),
        item(f'<object id="1" type="crosswalk" s="50" t="0"><outline>{CORNERS}</outline></object>'),
        "kept: crosswalk, as a crossing of its place and width",
    ),
}


@pytest.mark.parametrize("what", SAID)
def test_the_report_says_why(what: str) -> None:
    lanes, inside, words = SAID[what]
    rows = [
        f"{row.outcome.value}: {row.reason}"
        for row in made(*lanes, inside=inside).network.report.entries
    ]
    assert [row for row in rows if words in row], rows
    assert not [row for row in rows if "nothing leads there" in row]


def test_the_longer_of_two_ways_is_said_to_be_that() -> None:
    twin = way("1", inside="<!-- another -->").replace('road id="10"', 'road id="77"')
    text = crossing({}).replace("<junction id", f"{twin}<junction id", 1)
    other = entry("1").replace('connectingRoad="10"', 'connectingRoad="77"')
    text = text.replace("</junction>", f"{other}</junction>")
    rows = [row.reason for row in of_model(parse(text)).network.report.entries]
    assert [row for row in rows if "only the shortest is in the network" in row], rows


def test_walking_areas_at_the_ends_of_a_walk_are_no_loss() -> None:
    rows = converted(FOLDER / "bus_street.xodr").network.report.entries
    walks = [row for row in rows if "they are walking areas" in row.reason]
    assert walks
    assert {row.outcome.value for row in walks} == {"kept"}
