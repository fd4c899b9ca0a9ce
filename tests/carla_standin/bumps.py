"""A crossing of two roads that are not of one height where they cross: one 0.4 m, one 0.1 m."""

from __future__ import annotations

HIGH, LOW = 0.4, 0.1
"""Metres of both roads above the level of their ends, in the middle of the crossing."""
HALF = 20.0
"""Metres from the middle to where the connecting roads end."""
LANE, WALK = 4.0, 2.0
"""Widths of the only lane, right of the reference line, and of the sidewalk beside it."""

_ROAD = """
<road name="" length="{length}" id="{id}" junction="{junction}">
  <link>{link}</link>
  <planView><geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{length}"><line/></geometry>
  </planView>
  <elevationProfile><elevation s="0" a="0" b="{b}" c="{c}" d="0"/></elevationProfile>
  <lanes><laneSection s="0">
    <center><lane id="0" type="none" level="false"/></center>
    <right>
      <lane id="-1" type="driving" level="false">
        <link>{lanes}</link><width sOffset="0" a="4" b="0" c="0" d="0"/></lane>
      <lane id="-2" type="sidewalk" level="false">
        <link>{walks}</link><width sOffset="0" a="2" b="0" c="0" d="0"/>
        <height sOffset="0" inner="0.12" outer="0.12"/></lane>
    </right>
  </laneSection></lanes>
</road>"""
_JUNCTION = """
<junction id="1" name="">
  <connection id="0" incomingRoad="1" connectingRoad="10" contactPoint="start">
    <laneLink from="-1" to="-1"/><laneLink from="-2" to="-2"/></connection>
  <connection id="1" incomingRoad="3" connectingRoad="11" contactPoint="start">
    <laneLink from="-1" to="-1"/><laneLink from="-2" to="-2"/></connection>
</junction>"""


def bumps() -> str:
    """OpenDRIVE text: roads to the east and to the north, the former over the higher bump."""
    east, north = 0.0, 1.5707963267948966
    roads = [
        _road(1, (-60.0, 0.0, east), 40.0, after=("junction", 1)),
        _road(2, (HALF, 0.0, east), 40.0, before=("road", 10)),
        _road(3, (0.0, -60.0, north), 40.0, after=("junction", 1)),
        _road(4, (0.0, HALF, north), 40.0, before=("road", 11)),
        _road(10, (-HALF, 0.0, east), 2 * HALF, HIGH, before=("road", 1), after=("road", 2)),
        _road(11, (0.0, -HALF, north), 2 * HALF, LOW, before=("road", 3), after=("road", 4)),
    ]
    head = '<header revMajor="1" revMinor="4" name="bumps" version="1"/>'
    return f'<?xml version="1.0"?>\n<OpenDRIVE>{head}{"".join(roads)}{_JUNCTION}\n</OpenDRIVE>\n'


def _road(
    number: int,
    start: tuple[float, float, float],
    length: float,
    bump: float = 0.0,
    *,
    before: tuple[str, int] | None = None,
    after: tuple[str, int] | None = None,
) -> str:
    x, y, hdg = start
    ends = (("predecessor", before, "end"), ("successor", after, "start"))
    link = lanes = walks = ""
    for name, end, point in ends:
        if end is None:
            continue
        kind, other = end
        contact = f' contactPoint="{point}"' if kind == "road" else ""
        link += f'<{name} elementType="{kind}" elementId="{other}"{contact}/>'
        if kind == "road":
            lanes += f'<{name} id="-1"/>'
            walks += f'<{name} id="-2"/>'
    # z = b s + c s^2 is 0 at both ends and the bump's height in the middle.
    b, c = 4.0 * bump / length, -4.0 * bump / length**2
    return _ROAD.format(
        id=number, junction=1 if bump else -1, x=x, y=y, hdg=hdg, length=length, b=b, c=c,
        link=link, lanes=lanes, walks=walks,
    )  # fmt: skip
