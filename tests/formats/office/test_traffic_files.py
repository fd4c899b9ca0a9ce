"""Each kind of file of trips and counts, true to its schema, and wrong ones with clear words."""

from __future__ import annotations

import gzip
import io
import os
import zipfile
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.formats.office.read_traffic import read_traffic
from odscen.formats.office.time_stamps import StampReader
from odscen.formats.office.traffic_file import ReadingOptions, parse_number

PROJECTS = Path(
    os.environ.get("ODSCEN_TEST_PROJECTS", Path(__file__).parents[4] / "shared" / "projects")
)

V = """$VMR;D2
* Transport system
  1
* Time from, time to
 7.00 8.30
* Factor
 2.00
* Number of zones
 3
* Zones
         1          2
        30
* cells
 0.00 1.50 2
 3.00 0.00 4.00
 5.00 -1.00 0.00
$NAMES
1 "Centre"
2 "Nord"
"""

PAIRS = """$OR;D2
* From-Time  To-Time
7.00 8.00
* Factor
1.00
*
* some comment
         1          2       10.00
         2          1        5.50
         2          2        0.00
"""


def test_format_v_has_its_factor_its_times_and_cells_row_by_row() -> None:
    read = read_traffic(V.encode())
    assert read.what == "a VISUM matrix in format VMR with 3 zones"
    assert [row[:5] for row in read.trips] == [
        ("1", "2", 3.0, 25200.0, 30600.0),
        ("1", "30", 4.0, 25200.0, 30600.0),
        ("2", "1", 6.0, 25200.0, 30600.0),
        ("2", "30", 8.0, 25200.0, 30600.0),
        ("30", "1", 10.0, 25200.0, 30600.0),
    ]
    assert [left.reason for left in read.left_out] == ["30 to 2: -1 trips"]
    assert read.names == {"1": "Centre", "2": "Nord"}
    assert read.of_day


def test_format_o_is_that_of_sumos_od_files() -> None:
    read = read_traffic(PAIRS.encode("cp1252"))
    assert read.what == "a VISUM matrix in format OR with 2 zones"
    assert [row[:3] for row in read.trips] == [("1", "2", 10.0), ("2", "1", 5.5)]
    assert read.rows == 3


def test_od2trips_agrees_on_the_number_of_trips(tmp_path: Path) -> None:
    import subprocess

    import sumo

    (tmp_path / "m.txt").write_text(V.replace("-1.00", "1.00"), encoding="utf-8")
    (tmp_path / "taz.xml").write_text(
        "<tazs>"
        + "".join(
            f'<taz id="{zone}"><tazSource id="e" weight="1"/><tazSink id="e" weight="1"/></taz>'
            for zone in (1, 2, 30)
        )
        + "</tazs>",
        encoding="utf-8",
    )
    program = Path(sumo.SUMO_HOME) / "bin" / "od2trips"
    subprocess.run(
        [
            program,
            "-d",
            "m.txt",
            "-n",
            "taz.xml",
            "-o",
            "t.xml",
            "--different-source-sink",
            "false",
        ],
        cwd=tmp_path,
        check=True,
        capture_output=True,
    )
    trips = (tmp_path / "t.xml").read_text(encoding="utf-8")
    read = read_traffic(V.replace("-1.00", "1.00").encode())
    assert trips.count("<trip ") == sum(row.trips for row in read.trips) == 33


def test_sumo_relations_of_districts() -> None:
    text = """<data><interval id="car" begin="0" end="1:0:0">
        <tazRelation from="a" to="b" count="2000"/><tazRelation from="b" to="a" count="500"/>
        <tazRelation from="b" to="b"/></interval></data>"""
    read = read_traffic(text.encode())
    assert read.what == "a SUMO matrix (tazRelation) with 2 zones in 1 interval"
    assert [row[:5] for row in read.trips] == [
        ("a", "b", 2000.0, 0.0, 3600.0),
        ("b", "a", 500.0, 0.0, 3600.0),
    ]
    assert [left.reason for left in read.left_out] == ["b to b: no count"]
    assert not read.of_day


def test_turn_ratios_and_turning_counts() -> None:
    text = """<data><interval begin="0" end="900"><edgeRelation from="a" to="b" probability="0.3"/>
        <edgeRelation from="a" to="c" count="14"/></interval></data>"""
    read = read_traffic(text.encode())
    assert [(row.origin, row.destination, row.value, row.share) for row in read.turns] == [
        ("a", "b", 0.3, True),
        ("a", "c", 14.0, False),
    ]
    old = """<turns><interval begin="0" end="900"><fromEdge id="a"><toEdge id="b"
        probability="0.2"/></fromEdge></interval></turns>"""
    assert read_traffic(old.encode()).turns[0].value == 0.2


def test_edge_data_counts_those_who_entered_or_departed() -> None:
    text = """<meandata><interval begin="0.00" end="900.00" id="x">
        <edge id="1" sampledSeconds="9.0" departed="3" arrived="0" entered="10" left="12"/>
        <edge id="2" sampledSeconds="9.0" speed="3"/></interval></meandata>"""
    read = read_traffic(text.encode())
    assert read.what == "SUMO edgeData of 1 edges in 1 interval, counted by departed + entered"
    assert read.volumes[0][:4] == ("1", 0.0, 900.0, 13.0)
    assert read.left_out[0].reason == "edge 2: no count; it has sampledSeconds, speed"
    chosen = read_traffic(text.encode(), options=ReadingOptions(columns={"count": "left"}))
    assert chosen.volumes[0].vehicles == 12.0


def test_outputs_and_definitions_of_detectors() -> None:
    output = """<detector><interval begin="0.00" end="1800.00" id="d1" nVehContrib="45" flow="90"
        occupancy="1.2" speed="9.1" length="4.9" nVehEntered="45"/></detector>"""
    read = read_traffic(gzip.compress(output.encode()))
    assert read.what == "SUMO output of 1 E1 detectors in 1 interval"
    assert read.volumes[0][:4] == ("d1", 0.0, 1800.0, 45.0)
    defined = """<additional><inductionLoop id="d1" lane="104_0" pos="-23" period="60" file="o"/>
        <e1Detector id="d2" lane="104_1" pos="abc" freq="60" file="o"/></additional>"""
    read = read_traffic(defined.encode())
    assert read.what == "definitions of 1 SUMO detectors"
    assert (read.stations["d1"].lane, read.stations["d1"].pos) == ("104_0", -23.0)
    assert read.left_out[0].reason == "d2: pos is 'abc'"


def test_districts() -> None:
    text = """<additional><tazs><taz id="a" edges="e1 e2"/></tazs>
        <taz id="b"><tazSource id="e3" weight="1"/><tazSink id="e4" weight="1"/></taz>
        </additional>"""
    assert read_traffic(text.encode()).zones == {"a": ("e1", "e2"), "b": ("e3", "e4")}


def test_a_german_export_with_semicolons_decimal_commas_and_two_kinds_of_vehicles() -> None:
    text = (
        "Zählstellenexport 2026;;;\nZählstelle;Datum;Uhrzeit;Pkw;Lkw;v [km/h]\n"
        "Süd;02.03.2026;07:00;1.203,0;12,5;48,2\nSüd;02.03.2026;07:15;980,0;-;47,0\n"
        "Süd;03.03.2026;07:00;1,0;1,0;47,0\nNord;02.03.2026;07:00;;;\n"
    )
    read = read_traffic(text.encode("cp1252"))
    assert [row[:4] for row in read.volumes] == [
        ("Süd", 25200.0, 26100.0, 1215.5),
        ("Süd", 26100.0, 27000.0, 980.0),
    ]
    assert read.columns == {
        "station": "Zählstelle",
        "time": "Uhrzeit",
        "date": "Datum",
        "count": "Pkw + Lkw",
    }
    assert "decimal commas" in read.what
    assert any("2 days" in note for note in read.notes)
    other = read_traffic(text.encode("cp1252"), options=ReadingOptions(date="2026-03-03"))
    assert [row.vehicles for row in other.volumes] == [2.0]


def test_rows_with_begin_and_end_and_hourly_rates() -> None:
    text = (
        "detector_id,begin,end,flow (veh/h)\nd1,07:00,07:15,400\nd1,07:15,07:30,800\n"
        "d2,07:00,07:15,nan\n"
    )
    read = read_traffic(text.encode())
    assert [row[:4] for row in read.volumes] == [
        ("d1", 25200.0, 26100.0, 100.0),
        ("d1", 26100.0, 27000.0, 200.0),
    ]
    assert read.left_out[0].reason == "d2: no value"


def test_wide_tables_both_ways() -> None:
    slices = "Station,07:00,07:15,07:30\nA,1,2,3\nB,4,,6\n"
    read = read_traffic(slices.encode())
    assert [row.vehicles for row in read.volumes] == [1.0, 2.0, 3.0, 4.0, 6.0]
    assert read.volumes[-1][:3] == ("B", 27000.0, 27900.0)
    stations = "Time\tA1\tA2\n2026-03-02 07:00\t1\t2\n2026-03-02 07:05\t3\t4\n"
    read = read_traffic(stations.encode("utf-16"))
    assert read.volumes[3][:4] == ("A2", 25500.0, 25800.0, 4.0)


def test_detector_files_of_sumos_tools_count_minutes() -> None:
    text = "Detector;Time;qPKW;qLKW;vPKW;vLKW\ndet1;0;431;9;0;0\ndet1;60;301;0;0;0\n"
    read = read_traffic(text.encode())
    assert [row[:4] for row in read.volumes] == [
        ("det1", 0.0, 3600.0, 440.0),
        ("det1", 3600.0, 7200.0, 301.0),
    ]


def test_a_table_of_places_has_coordinates_and_directions() -> None:
    text = "Station;Longitude;Latitude;Richtung\nA;11,25;44,5;Nord\nB;11,26;44,5;270\n"
    read = read_traffic(text.encode())
    assert read.stations["A"].point == (11.25, 44.5)
    assert read.stations["A"].degrees
    assert [place.bearing for place in read.stations.values()] == [0.0, 270.0]


def test_matrices_in_tables() -> None:
    square = read_traffic(b"O/D;1;2;Sum\n1;0;5,5;5,5\n2;7;0;7\nSum;7;5,5;12,5\n")
    assert [row[:3] for row in square.trips] == [("1", "2", 5.5), ("2", "1", 7.0)]
    rows = read_traffic(b"Von;Nach;Fahrten\nA;B;3\nB;A;4\n")
    assert [row[:3] for row in rows.trips] == [("A", "B", 3.0), ("B", "A", 4.0)]


def sheet(rows: list[list[str | float]]) -> bytes:
    """The smallest Excel file: text inline, one sheet."""
    cells = "".join(
        "<row>"
        + "".join(
            f"<c><v>{value}</v></c>"
            if isinstance(value, float | int)
            else f'<c t="inlineStr"><is><t>{value}</t></is></c>'
            for value in row
        )
        + "</row>"
        for row in rows
    )
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(
            "[Content_Types].xml",
            f'<Types xmlns="{package}/content-types"><Default Extension="xml" '
            'ContentType="application/xml"/></Types>',
        )
        archive.writestr(
            "_rels/.rels",
            f'<Relationships xmlns="{package}/relationships"><Relationship Id="r1" '
            f'Type="{office}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        )
        archive.writestr(
            "xl/workbook.xml",
            f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets><sheet name="Zählung" '
            'sheetId="1" r:id="r1"/></sheets></workbook>',
        )
        archive.writestr(
            "xl/_rels/workbook.xml.rels",
            f'<Relationships xmlns="{package}/relationships"><Relationship Id="r1" '
            f'Type="{office}/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
        )
        archive.writestr(
            "xl/worksheets/sheet1.xml",
            f'<worksheet xmlns="{main}"><sheetData>{cells}</sheetData></worksheet>',
        )
    return out.getvalue()


def test_a_sheet_of_excel() -> None:
    content = sheet([["Station", "Time", "Count"], ["A", "07:00", 12], ["A", "07:30", 14.0]])
    read = read_traffic(content)
    assert read.what == "counts of 1 stations in rows (Excel, sheet 'Zählung')"
    assert [row[:4] for row in read.volumes] == [
        ("A", 25200.0, 27000.0, 12.0),
        ("A", 27000.0, 28800.0, 14.0),
    ]


def test_columns_can_be_said() -> None:
    text = b"a;b;c\nX;07:00;3\nX;08:00;4\n"
    with pytest.raises(InputError, match="no column was recognised as station and time and count"):
        read_traffic(text)
    columns = {"station": "a", "time": "b", "count": "c"}
    read = read_traffic(text, options=ReadingOptions(columns=columns))
    assert [row.vehicles for row in read.volumes] == [3.0, 4.0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (b"$V;D2\n7.00 8.00\n1\n3\n1 2 3\n1 2 3\n4 5 6\n7 8\n", "has 8 cells; 3 zones need 9"),
        (b"$V;D2\n7.00 8.00\n1\n2\n1 2\n1 2 3 4 5\n", "more than the 4 cells of 2 zones"),
        (b"$V;D2\n8.00 7.00\n1\n1\n1\n1\n", "it ends before it begins"),
        (b"$O;D2\n7.00 8.00\n1\n1 2 zwei\n", "'zwei' is no number"),
        (b"$O;D2\n7.75 8.00\n1\n1 2 3\n", "'7.75' is no time"),
        (b"$BI\n", "binary format"),
        (b"$VISION\n* a net\n", r"7\.00|times|no time|ends where"),
        (b"<data><interval begin='0' end='x'/></data>", "end of <interval> is no number: 'x'"),
        (b"<data><interval begin='0' end='9'><edge id='a'/>", "not well-formed XML"),
        (b"<net><edge id='a'/></net>", "a SUMO network; maps are added with"),
        (b"<routes><vehicle id='a'/></routes>", "opened with its configuration"),
        (b"<additional><edgeData id='a' file='b'/></additional>", "import the file that it names"),
        (b'{"type": "FeatureCollection"}', "this is JSON"),
        (b"PK\x03\x04 broken", "no Excel file that can be read"),
        (b"\x1f\x8b broken", "the packed file is damaged"),
        (b"abc\x00\x01\x02", "this is no text"),
        (b"hello\nworld\n", "this is no table"),
        (
            b"TimeStamp,DeviceId,EventId,Parameter\n2024-04-15 12:00:00,7,1,2\n",
            "an event log of a signal controller; `odscen signals play-log`",
        ),
        (b"station;time;count\n", "no lines below the titles"),
        (b"station;time;count\nA;25:10;3\n", "'25:10' is no time of day"),
        (b"station;time;count\nA;07:00;viele\n", "'viele' is no number|no row"),
    ],
)
def test_wrong_files_are_refused_in_clear_words(content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_traffic(content)


@pytest.mark.parametrize(
    ("text", "second"),
    [
        ("07:15", 26100.0), ("7.15", 26100.0), ("7:15 PM", 69300.0), ("12:00 am", 0.0),
        ("2026-03-02T07:15:00", 26100.0), ("2026-03-02 07:15", 26100.0),
        ("02.03.2026 07:15", 26100.0), ("2.3.26 7:15", 26100.0), ("03/02/2026 07:15", 26100.0),
        ("2026-03-02T07:15:00Z", 26100.0), ("2026-03-02T07:15:00.000+01:00", 26100.0),
        ("24:00", 86400.0), ("07:15 Uhr", 26100.0), ("07:15-07:30", 26100.0), ("900", 900.0),
    ],
)  # fmt: skip
def test_stamps_of_usual_forms(text: str, second: float) -> None:
    assert StampReader([text]).read(text).second == second


def test_stamps_in_utc_are_those_of_the_place_in_summer_too() -> None:
    reader = StampReader([], time_zone="Europe/Berlin")
    assert reader.read("2026-03-02T06:15:00Z").second == 26100.0
    assert reader.read("2026-07-02T05:15:00Z").second == 26100.0
    assert reader.read("1782969300").second == 26100.0
    with pytest.raises(InputError, match="no time zone 'Europe/Atlantis'"):
        StampReader([], time_zone="Europe/Atlantis")


@given(st.integers(0, 10**7), st.booleans())
def test_numbers_with_separators_come_back(number: int, comma: bool) -> None:
    text = f"{number / 4:,.2f}"
    if comma:
        text = text.translate(str.maketrans(",.", ".,"))
    assert parse_number(text, decimal_comma=comma) == number / 4


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(content: bytes) -> None:
    try:
        read_traffic(content)
    except InputError:
        return


@given(
    st.lists(
        st.lists(st.floats(0, 1e5).map(lambda x: round(x, 2)), min_size=3, max_size=3),
        min_size=3,
        max_size=3,
    )
)
def test_cells_of_a_square_come_back(cells: list[list[float]]) -> None:
    assume(any(map(any, cells)))  # a matrix without trips is refused
    body = "\n".join(" ".join(f"{cell:.2f}" for cell in row) for row in cells)
    read = read_traffic(f"$V;D2\n0.00 24.00\n1.00\n3\n7 8 9\n{body}\n".encode())
    found = {(row.origin, row.destination): row.trips for row in read.trips}
    for i, origin in enumerate("789"):
        for j, destination in enumerate("789"):
            assert found.get((origin, destination), 0.0) == pytest.approx(cells[i][j])


@pytest.mark.skipif(not PROJECTS.is_dir(), reason="projects of others are not here")
def test_detector_counts_of_wildau() -> None:
    read = read_traffic((PROJECTS / "wildau" / "fahrzeuganzahl2.csv").read_bytes())
    assert read.what == "counts of 18 stations in rows (CSV (semicolon))"
    assert sum(row.vehicles for row in read.volumes) == 5406


@pytest.mark.skipif(not PROJECTS.is_dir(), reason="projects of others are not here")
def test_detectors_of_acosta() -> None:
    read = read_traffic((PROJECTS / "acosta" / "acosta_detectors.add.xml").read_bytes())
    assert read.what == "definitions of 58 SUMO detectors"


@pytest.mark.parametrize(
    ("text", "first"),
    [
        (
            "ts,site_id,lane_no,speed_kmh,vol_5min\n2024-05-06 00:00:00,S1,1,55,12\n"
            "2024-05-06 00:00:00,S1,2,50,3\n2024-05-06 00:05:00,S1,1,55,10\n",
            ("S1", 0.0, 300.0, 15.0),
        ),
        (
            "Timestamp,Station,District,Freeway,Direction,Total Flow,Avg Speed\n"
            "01/02/2023 00:05:00,400001,4,101,N,120,60\n01/02/2023 00:10:00,400001,4,101,N,9,60\n",
            ("400001", 300.0, 600.0, 120.0),
        ),
        (
            "TKZST;Datum;Stunde;KFZ_R1;Lkw_R1\n9001;230501;01;120;4\n9001;230501;24;90;3\n"
            "9001;230501;02;70;3\n",
            ("9001", 0.0, 3600.0, 120.0),
        ),
        (
            "detid_15;tag;stunde;q_kfz_det_hr;v_kfz_det_hr\n1001;01.03.2022;0;53;60\n"
            "1001;01.03.2022;1;41;60\n",
            ("1001", 0.0, 3600.0, 53.0),
        ),
        (
            "Segment ID,Roadway,Direction,Date,12:00-1:00 AM,11:00-12:00 PM\n"
            "2153,HUGUENOT AVE,NB,02/02/2013,106,74\n",
            ("2153", 0.0, 3600.0, 106.0),
        ),
        ("Site: 12\n\nTime;Volume\n07:00;12\n07:15;13\n", ("station", 25200.0, 26100.0, 12.0)),
    ],
)
def test_tables_of_agencies_are_read_without_a_word(
    text: str, first: tuple[str, float, float, float]
) -> None:
    assert read_traffic(text.encode()).volumes[0][:4] == first


def test_a_matrix_with_titles_of_several_words() -> None:
    read = read_traffic(b"orig_taz,dest_taz,demand\n1,2,30.5\n2,1,12\n")
    assert [row[:3] for row in read.trips] == [("1", "2", 30.5), ("2", "1", 12.0)]
