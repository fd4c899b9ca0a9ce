"""One file with every element and attribute that the reader reads; see test_coverage."""

from __future__ import annotations

FULL = """<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="7" name="full" north="90" south="-10" east="210" west="-20">
    <geoReference>+proj=tmerc +lat_0=0 +lon_0=0</geoReference>
    <offset x="1" y="2" z="3" hdg="0.1"/>
  </header>
  <road name="main" length="100" id="1" junction="-1" rule="RHT">
    <link>
      <successor elementType="junction" elementId="9"/>
    </link>
    <type s="0" type="town" country="de"><speed max="50" unit="km/h"/></type>
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry>
      <geometry s="50" x="50" y="0" hdg="0" length="30"><arc curvature="0.01"/></geometry>
      <geometry s="80" x="79.5506" y="4.4660" hdg="0.3" length="20">
        <spiral curvStart="0.01" curvEnd="0.02"/>
      </geometry>
    </planView>
    <elevationProfile><elevation s="0" a="1" b="0.01" c="0.0001" d="0.000001"/></elevationProfile>
    <lateralProfile>
      <superelevation s="0" a="0.01" b="0.0001" c="0.000001" d="0.00000001"/>
    </lateralProfile>
    <lanes>
      <laneOffset s="0" a="0.1" b="0.001" c="0.00001" d="0.0000001"/>
      <laneSection s="0" singleSide="false">
        <left>
          <lane id="2" type="sidewalk" level="false" direction="both">
            <border sOffset="0" a="6" b="0.01" c="0.001" d="0.0001"/>
          </lane>
          <lane id="1" type="driving" level="false" direction="standard">
            <link><successor id="1"/></link>
            <width sOffset="0" a="3.5" b="0.001" c="0.0001" d="0.00001"/>
            <roadMark sOffset="0" type="solid" weight="standard" color="white" width="0.12"
              laneChange="none" material="paint" height="0.01"/>
          </lane>
        </left>
        <center><lane id="0" type="none" level="false">
          <roadMark sOffset="0" type="broken" weight="standard" color="white" width="0.12"
            laneChange="both"/>
        </lane></center>
        <right>
          <lane id="-1" type="driving" level="false" direction="standard">
            <link><successor id="-1"/></link>
            <width sOffset="0" a="3.5" b="0.001" c="0.0001" d="0.00001"/>
            <roadMark sOffset="0" type="solid" weight="standard" color="white" width="0.12"
              laneChange="none"/>
            <speed sOffset="0" max="40" unit="km/h"/>
            <height sOffset="0" inner="0.1" outer="0.2"/>
            <access sOffset="0" rule="deny" restriction="bus"/>
            <access sOffset="10" rule="deny"><restriction type="taxi"/></access>
          </lane>
        </right>
      </laneSection>
      <laneSection s="40" singleSide="false">
        <left>
          <lane id="1" type="driving" level="false" direction="standard">
            <link><predecessor id="1"/></link>
            <width sOffset="0" a="3.54" b="0" c="0" d="0"/>
          </lane>
        </left>
        <center><lane id="0" type="none" level="false"/></center>
        <right>
          <lane id="-1" type="driving" level="false" direction="standard">
            <link><predecessor id="-1"/></link>
            <width sOffset="0" a="3.54" b="0" c="0" d="0"/>
          </lane>
        </right>
      </laneSection>
    </lanes>
    <objects>
      <object id="1" name="cross" type="crosswalk" subtype="zebra" s="50" t="0" zOffset="0.01"
        hdg="1.57" pitch="0.01" roll="0.02" orientation="none" length="8" width="3" height="0.1"
        radius="4" validLength="5">
        <repeat s="50" length="10" distance="5" tStart="1" tEnd="2"/>
        <outline outer="true" closed="true">
          <cornerLocal u="4" v="1.5" z="0.1" height="0.2"/>
          <cornerLocal u="-4" v="1.5" z="0.1" height="0.2"/>
          <cornerLocal u="-4" v="-1.5" z="0.1" height="0.2"/>
        </outline>
        <validity fromLane="-1" toLane="1"/>
      </object>
      <object id="2" type="parkingSpace" s="20" t="-6">
        <outlines>
          <outline outer="true" closed="true">
            <cornerRoad s="20" t="-5" dz="0.1" height="0.2"/>
            <cornerRoad s="25" t="-5" dz="0.1" height="0.2"/>
            <cornerRoad s="25" t="-7" dz="0.1" height="0.2"/>
          </outline>
        </outlines>
      </object>
    </objects>
    <signals>
      <signal id="5" name="light" s="90" t="-5" zOffset="4" hOffset="0.1" orientation="+"
        dynamic="yes" country="de" type="1000001" subtype="-1" value="30" unit="km/h" text="abc"
        width="0.5" height="1.2">
        <validity fromLane="-1" toLane="-1"/>
        <dependency id="6" type="limitline"/>
      </signal>
      <signal id="6" s="80" t="-5" dynamic="no" type="206" subtype="-1"/>
      <signalReference id="6" s="70" t="-4" orientation="+">
        <validity fromLane="-1" toLane="-1"/>
      </signalReference>
    </signals>
  </road>
  <road name="inner" length="20" id="2" junction="9" rule="RHT">
    <link>
      <predecessor elementType="road" elementId="1" contactPoint="end"/>
      <successor elementType="road" elementId="3" contactPoint="start"/>
    </link>
    <planView>
      <geometry s="0" x="100" y="20" hdg="0" length="20">
        <paramPoly3 pRange="arcLength" aU="0.01" bU="1" cU="0.00001" dU="0.000001"
          aV="0.01" bV="0.01" cV="0.001" dV="0.0001"/>
      </geometry>
    </planView>
    <lanes>
      <laneSection s="0">
        <center><lane id="0" type="none"/></center>
        <right>
          <lane id="-1" type="driving">
            <link><predecessor id="-1"/><successor id="-1"/></link>
            <width sOffset="0" a="3.5" b="0" c="0" d="0"/>
          </lane>
        </right>
      </laneSection>
    </lanes>
  </road>
  <road name="out" length="20" id="3" junction="-1" rule="RHT">
    <link>
      <predecessor elementType="junction" elementId="9"/>
      <successor elementType="road" elementId="4" elementS="5" elementDir="+"/>
    </link>
    <planView>
      <geometry s="0" x="120" y="20" hdg="0" length="20">
        <poly3 a="0.1" b="0.01" c="0.001" d="0.0001"/>
      </geometry>
    </planView>
    <lanes>
      <laneSection s="0">
        <center><lane id="0" type="none"/></center>
        <right>
          <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
        </right>
      </laneSection>
    </lanes>
  </road>
  <road name="far" length="20" id="4" junction="-1" rule="RHT">
    <link><predecessor elementType="road" elementId="3" elementS="6" elementDir="-"/></link>
    <planView>
      <geometry s="0" x="140" y="20" hdg="0" length="20"><line/></geometry>
    </planView>
    <lanes>
      <laneSection s="0">
        <center><lane id="0" type="none"/></center>
        <right>
          <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
        </right>
      </laneSection>
    </lanes>
  </road>
  <controller id="7" name="program" sequence="0"><control signalId="5" type="0"/></controller>
  <controller id="8" name="other" sequence="1"><control signalId="6" type="1"/></controller>
  <junction id="9" name="crossing" type="default" mainRoad="1">
    <connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">
      <laneLink from="-1" to="-1"/>
    </connection>
    <priority high="1" low="2"/>
    <controller id="7"/>
  </junction>
  <junction id="10" name="split" type="direct">
    <connection id="0" incomingRoad="3" linkedRoad="4" contactPoint="start">
      <laneLink from="-1" to="-1"/>
    </connection>
  </junction>
</OpenDRIVE>
"""
