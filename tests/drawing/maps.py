"""Small OpenDRIVE maps as text, for the tests of this room."""

from __future__ import annotations


def lane(id_, type_="driving", width=3.5, more=""):
    width = f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
    return f'<lane id="{id_}" type="{type_}">{width}{more}</lane>'


DRIVING = lane(-1)


def mark(type_="broken", color="white", s=0, width=0.12):
    return (
        f'<roadMark sOffset="{s}" type="{type_}" weight="standard" color="{color}" '
        f'width="{width}" laneChange="both"/>'
    )


def road(
    id_="1",
    *,
    x=0.0,
    y=0.0,
    hdg=0.0,
    length=100.0,
    shape="<line/>",
    left="",
    right=DRIVING,
    centre="",
    elevation="",
    more="",
    rule="RHT",
    kind="town",
):
    left = f"<left>{left}</left>" if left else ""
    right = f"<right>{right}</right>" if right else ""
    return f"""<road name="" length="{length}" id="{id_}" junction="-1" rule="{rule}">
<type s="0" type="{kind}"><speed max="50" unit="km/h"/></type>
<planView>
<geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{length}">{shape}</geometry>
</planView>
<elevationProfile>{elevation}</elevationProfile>
<lanes><laneSection s="0">{left}<center><lane id="0" type="none">{centre}</lane></center>{right}
</laneSection></lanes>{more}</road>"""


def document(*roads):
    return (
        '<OpenDRIVE><header revMajor="1" revMinor="6" name="test"/>'
        + "".join(roads)
        + "</OpenDRIVE>"
    )


CROSSWALK = """<objects><object id="7" type="crosswalk" name="" s="50" t="0" zOffset="0" hdg="0"
pitch="0" roll="0" orientation="none" length="4" width="7"><outline>
<cornerLocal u="-2" v="-3.5" z="0" height="0"/><cornerLocal u="2" v="-3.5" z="0" height="0"/>
<cornerLocal u="2" v="3.5" z="0" height="0"/><cornerLocal u="-2" v="3.5" z="0" height="0"/>
</outline></object></objects>"""


def signal(id_, type_, s=10, t=-5, *, value="", dynamic="no", orientation="+"):
    return (
        f'<signal id="{id_}" name="" s="{s}" t="{t}" zOffset="2" hOffset="0" dynamic="{dynamic}" '
        f'orientation="{orientation}" country="OpenDRIVE" type="{type_}" subtype="-1" '
        f'{value} height="1" width="1"/>'
    )


def signals(*parts):
    return "<signals>" + "".join(parts) + "</signals>"


STREET = document(
    road(
        left=lane(1, more=mark("solid")) + lane(2, "sidewalk", 2.0),
        right=lane(-1, more=mark("solid")) + lane(-2, "sidewalk", 2.0),
        centre=mark("broken"),
        more=CROSSWALK
        + signals(
            signal("1", "1000001", dynamic="yes"),
            signal("2", "206", 20),
            signal("3", "205", 30),
            signal("4", "274", 40, value='value="30" unit="km/h"'),
        ),
    )
)
