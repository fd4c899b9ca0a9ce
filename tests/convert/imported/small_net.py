"""A network of two edges, an internal lane and a crossing, as text."""

NET = """<net version="1.20" lefthand="true">
  <location netOffset="100.00,-5.00" convBoundary="0.00,0.00,50.00,9.00"
            origBoundary="0,0,0,0" projParameter="!"/>
  <edge id=":j_0" function="internal">
    <lane id=":j_0_0" index="0" speed="8" length="3.0" shape="110,0 113,0" disallow="pedestrian"/>
  </edge>
  <edge id=":j_c0" function="crossing" crossingEdges="a b">
    <lane id=":j_c0_0" index="0" allow="pedestrian" speed="1" length="6" shape="110,0 110,6"/>
  </edge>
  <edge id="a" from="i" to="j">
    <lane id="a_0" index="0" allow="pedestrian" speed="2" length="10" shape="100,0 110,0"/>
    <lane id="a_1" index="1" speed="13.9" length="11" shape="100,3 105,3,0.5 110,3" width="3.5"/>
    <lane id="a_2" index="2" disallow="all" speed="1" length="11" shape="100,6,1 110,6,2"/>
  </edge>
  <edge id="b" from="j" to="k">
    <lane id="b_0" index="0" allow="bus taxi" speed="13.9" length="10" shape="113,3 123,3"/>
  </edge>
  <tlLogic id="t" type="static" programID="0" offset="7">
    <phase duration="30" state="Gr"/>
    <phase duration="3" state="yr"/>
    <phase duration="20" state="rG" minDur="5" maxDur="40"/>
    <phase duration="4" state="rr"/>
    <param key="linkSignalID:1" value="12 13"/>
  </tlLogic>
  <junction id="i" type="priority" x="100" y="1" incLanes="" intLanes=""/>
  <junction id="j" type="traffic_light" x="111" y="1" incLanes="a_0 a_1" intLanes=":j_0_0"/>
  <junction id="k" type="priority" x="123" y="1" incLanes="b_0" intLanes=""/>
  <junction id=":j_0_0" type="internal" x="111" y="1" incLanes="" intLanes=""/>
  <connection from="a" to="b" fromLane="1" toLane="0" via=":j_0_0" tl="t" linkIndex="0" dir="s"
              state="o"/>
  <connection from=":j_0" to="b" fromLane="0" toLane="0" dir="s" state="M"/>
</net>"""
