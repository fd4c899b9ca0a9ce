from lxml import etree

from odscen.convert.prepare import prepare_for_netconvert

MAP = b"""<OpenDRIVE><header revMajor="1" revMinor="8"/>
<road id="A 1" length="10" junction="-1"><link><successor elementType="junction" elementId="J,1"/>
</link><lanes><laneSection s="0"><right><lane id="-1" type="driving">
<width sOffset="0" a="3" b="0" c="0" d="0"/>
<access sOffset="0" rule="deny"><restriction type="truck"/><restriction type="bus"/></access>
<access sOffset="5" rule="allow" restriction="bus"/>
</lane></right></laneSection></lanes></road>
<junction id="J,1"><connection id="0" incomingRoad="A 1" connectingRoad="2"/></junction>
</OpenDRIVE>"""


def test_ids_that_sumo_refuses_are_renamed_wherever_they_are_used():
    text, notes = prepare_for_netconvert(MAP)
    root = etree.fromstring(text)
    road, junction = root.find("road"), root.find("junction")
    assert road.get("id") == junction.find("connection").get("incomingRoad") == "odscen0"
    assert junction.get("id") == road.find("link/successor").get("elementId") == "odscen1"
    assert junction.find("connection").get("connectingRoad") == "2"
    assert {"id 'A 1'", "id 'J,1'"} <= {note.element for note in notes}


def test_restrictions_of_1_8_become_one_access_each():
    text, _ = prepare_for_netconvert(MAP)
    found = [
        (access.get("sOffset"), access.get("rule"), access.get("restriction"), len(access))
        for access in etree.fromstring(text).iter("access")
    ]
    assert found == [("0", "deny", "truck", 0), ("0", "deny", "bus", 0), ("5", "allow", "bus", 0)]


BORDERS = b"""<OpenDRIVE><header revMajor="1" revMinor="7"/><include file="other.xodr"/>
<road id="1" length="10"><lanes><laneSection s="0"><right>
<lane id="-1" type="driving"><width sOffset="0" a="3" b="0.1" c="0" d="0"/></lane>
<lane id="-2" type="driving"><border sOffset="0" a="-6" b="0" c="0" d="0"/>
<border sOffset="4" a="-6" b="-0.5" c="0.25" d="-0.125"/></lane>
<lane id="-3" type="driving"><border sOffset="0" a="-9" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


def test_borders_become_the_widths_that_they_make():
    text, notes = prepare_for_netconvert(BORDERS)
    root = etree.fromstring(text)
    assert root.find(".//border") is None
    found = {
        lane.get("id"): [
            tuple(round(float(width.get(name)), 9) for name in ("sOffset", "a", "b", "c", "d"))
            for width in lane.iter("width")
        ]
        for lane in root.iter("lane")
    }
    assert found["-1"] == [(0, 3, 0.1, 0, 0)]
    # 6 - (3 + 0.1 s), and from 4 on 6 + 0.5 h - 0.25 h^2 + 0.125 h^3 - (3.4 + 0.1 h)
    assert found["-2"] == [(0, 3, -0.1, 0, 0), (4, 2.6, 0.4, -0.25, 0.125)]
    assert found["-3"] == [(0, 3, 0, 0, 0), (4, 3, -0.5, 0.25, -0.125)]
    assert [note.reason for note in notes].count("given to netconvert as width") == 2


def test_includes_are_dropped_and_told():
    text, notes = prepare_for_netconvert(BORDERS)
    assert b"include" not in text
    assert any(note.element == "include other.xodr" for note in notes)
