from __future__ import annotations

import gzip

import pytest

from odscen.base.errors import OpenDriveError
from odscen.maps.importers.file_kinds import file_kind, root_element
from odscen.maps.importers.opendrive import OpenDriveImporter


@pytest.mark.parametrize(
    ("content", "file", "what", "advice"),
    [
        (b"", "a.osm", "empty", "export it again"),
        (gzip.compress(b"<osm/>"), "a.osm.gz", "a gzip archive", "unpack it"),
        (b"PK\x03\x04...", "a.zip", "a zip archive", "unpack it"),
        (b"\x0a\x12binary\x00", "a.rrhd", "a RoadRunner file", "export OpenDRIVE from RoadRunner"),
        (b"\0\0\0\x0d\x0a\x09OSMHeader", "a.pbf", "OpenStreetMap (PBF)", "ending .osm.pbf"),
        (b'<?xml version="1.0"?>\n<osm version="0.6"/>', "a.osm", "OpenStreetMap", "ending .osm "),
        (
            b"<osm>" + b"<node/>" * 20_000 + b"<tag k='type' v='lanelet'/></osm>",
            "a.osm",
            "a Lanelet2 map",
            "odscen maps importers",
        ),
        (b"<!-- generated on ... -->\n<net/>", "a.net.xml", "a SUMO network", "--sumo-net-file"),
        (b'<commonRoad commonRoadVersion="2020a"/>', "a.xodr", "a CommonRoad scenario", ".xml"),
        (b"\xef\xbb\xbf<OpenSCENARIO/>", "a.xosc", "an OpenSCENARIO file", "odscen import"),
        (b"<kml:kml/>", "a.kml", "XML with the root element <kml>", "convert"),
        (b'{"type": "FeatureCollection"}', "a.json", "GeoJSON", "convert"),
        (b" [1]", "a.json", "JSON", "convert"),
        ("Straße\n".encode(), "a.txt", "text", "convert"),
        (b"\x00\x01\x02", "a.bin", "binary data", "convert"),
    ],
    ids=lambda value: value if isinstance(value, str) and "." in value[:6] else "",
)
def test_a_file_is_called_what_it_seems_to_be(
    content: bytes, file: str, what: str, advice: str
) -> None:
    kind = file_kind(content, file)
    assert kind.what == what
    assert advice in kind.advice


@pytest.mark.parametrize(
    "content",
    [
        b'<?xml version="1.0"?><!-- a > b --><!DOCTYPE a [<!ENTITY b "c">]> <OpenDRIVE>',
        "<?xml version='1.0' encoding='utf-16'?><OpenDRIVE/>".encode("utf-16"),
        b'<x:OpenDRIVE xmlns:x="http://x"/>',
    ],
)
def test_the_root_element_is_found_behind_what_may_come_before_it(content: bytes) -> None:
    assert root_element(content) == "OpenDRIVE"


def test_what_is_no_xml_has_no_root_element() -> None:
    assert root_element(b"1 < 2") is None
    assert root_element(b"") is None


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'<?xml version="1.0"?><osm version="0.6"/>', "OpenStreetMap, not OpenDRIVE: give it"),
        (b"<net/>", "a SUMO network, not OpenDRIVE: odscen import FILE.net.xml"),
        (b"<commonRoad/>", "a CommonRoad scenario, not OpenDRIVE: give it the ending .xml"),
        (b"\x0a\x12binary\x00\x01", "binary data, not OpenDRIVE: convert it"),
    ],
)
def test_a_file_of_another_format_named_xodr_is_refused_with_what_to_do(
    content: bytes, message: str
) -> None:
    with pytest.raises(OpenDriveError) as caught:
        OpenDriveImporter().to_opendrive(content, {})
    assert str(caught.value).startswith(f"this is {message}")


@pytest.mark.parametrize(
    "content", [b"<OpenDRIVE>", b"<x><OpenDRIVE/></x>", b"nothing", b"", b"<opendrive/>"]
)
def test_a_damaged_file_is_left_to_the_parser_which_names_the_place(content: bytes) -> None:
    assert OpenDriveImporter().to_opendrive(content, {}).xodr == content
