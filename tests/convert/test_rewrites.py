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
