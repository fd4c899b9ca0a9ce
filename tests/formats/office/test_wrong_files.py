"""Ten wrong files of each kind of an office: what is said of them, and of what in them."""

from __future__ import annotations

import re

import pytest

from odscen.base.errors import InputError
from odscen.formats.office.read_traffic import read_traffic
from tests.formats.office.test_traffic_files import sheet

TRIP = "from='a' to='b'"


def square(*, times: str = "7.00 8.00", factor: str = "1", size: str = "2", rest: str) -> bytes:
    """A matrix in format V with something wrong in it."""
    return f"$V;D2\n{times}\n{factor}\n{size}\n{rest}\n".encode()


def pairs(*, times: str = "7.00 8.00", factor: str = "1", rest: str) -> bytes:
    return f"$O;D2\n{times}\n{factor}\n{rest}\n".encode()


def within(body: str, times: str = "begin='0' end='900'") -> bytes:
    return f"<data><interval {times}>{body}</interval></data>".encode()


def loop(row: str) -> bytes:
    return f"<detector><interval {row}/></detector>".encode()


def parts(body: str) -> bytes:
    return f"<additional>{body}</additional>".encode()


NUMBERS = "1 2\n0 3\n4 0"
NOTHING = "its intervals have nothing that counts"
WRONG: dict[str, list[tuple[bytes, str]]] = {
    "VISUM, format V": [
        (square(rest="1 2\n0 x\n4 0"), "line 6: 'x' is no number"),
        (square(rest="1 2\n0 nan\n4 0"), "line 6: 'nan' is no number"),
        (square(rest="1 2\n0 -3\n4 0"), "1 to 2: -3 trips"),
        (square(rest="1 2\n0 0\n0 0"), "format V with 2 zones, .* missing or 0"),
        (square(rest="1 1\n0 3\n4 0"), "zone '1' is there twice"),
        (square(rest="1\n0 3\n4 0"), "3 numbers of zones are given, 2 were announced"),
        (square(size="-2", rest=NUMBERS), "'-2' is no number of zones from 1 to"),
        (square(size="99999999", rest=NUMBERS), "no number of zones from 1 to 5000"),
        (square(factor="zwei", rest=NUMBERS), "line 3: 'zwei' is no number"),
        (square(factor="0", rest=NUMBERS), "line 3: the factor is 0"),
        (square(times="7.00", rest=NUMBERS), "are not the times from and to, such as 7.00 8.00"),
        (b"$V;D2\n", "ends where the times from and to should be"),
    ],
    "VISUM, format O": [
        (pairs(rest="1 2"), "line 4: '1 2' is no row of origin, destination and trips"),
        (pairs(rest="1 2 3 4"), "line 4: '1 2 3 4' is no row of origin"),
        (pairs(rest="1 2 -3"), "format O with 2 zones, .* 1 to 2: -3 trips"),
        (pairs(rest="1 2 1e99"), r"row 4 of the file: 1 to 2: 1e\+99 trips"),
        (pairs(rest="1 2 x"), "line 4: 'x' is no number"),
        (pairs(rest=""), "has no rows of origin, destination and trips"),
        (pairs(factor="-1", rest="1 2 3"), "line 3: the factor is -1"),
        (pairs(times="seven eight", rest="1 2 3"), "'seven' is no time, which VISUM writes as"),
        (pairs(times="8.00 7.00", rest="1 2 3"), "it ends before it begins"),
        (b"$O;D2\n7.00 8.00\n", "ends where the factor should be"),
        (b"$X;D2\n7.00 8.00\n1\n1 2 3\n", "but no matrix in format V or O"),
    ],
    "SUMO tazRelation": [
        (within(""), NOTHING),
        (within(f"<tazRelation {TRIP}/>"), "a to b: no count"),
        (within(f"<tazRelation {TRIP} trips='3'/>"), "a to b: no count; it has trips"),
        (within(f"<tazRelation {TRIP} count='x'/>"), "count of <tazRelation> is no number: 'x'"),
        (within(f"<tazRelation {TRIP} count='nan'/>"), "is no number: 'nan'"),
        (within(f"<tazRelation {TRIP} count='-4'/>"), "row 1 of the file: a to b: -4"),
        (within("<tazRelation from='a' count='4'/>"), "from or to is missing"),
        (within("<tazRelation to='b' count='4'/>"), "from or to is missing"),
        (within(f"<tazRelation {TRIP} count='3'/>", "begin='9' end='0'"), "from 9 to 0 is none"),
        (within(f"<tazRelation {TRIP} count='3'/>", "end='9'"), "begin of <interval> is no number"),
        (f"<data><tazRelation {TRIP} count='3'/></data>".encode(), "root element <data>"),
    ],
    "SUMO taz": [
        (parts("<taz/>"), "a district without id"),
        (parts("<taz edges='x'/>"), "a district without id"),
        (parts("<taz id='a'/>"), "'a': a district without edges"),
        (parts("<taz id='a' edges=''/>"), "'a': a district without edges"),
        (parts("<taz id='a' edges=' '/>"), "'a': a district without edges"),
        (parts("<taz id='a'><tazSource/></taz>"), "'a': a district without edges"),
        (parts("<taz id='a' shape='0,0 1,1'/>"), "'a': a district without edges"),
        (parts("<taz id='a' edges='x'/><taz id='a' edges='y'/>"), "'a' is there twice"),
        (b"<tazs/>", "root element <tazs>; trips or counts are"),
        (b"<additional><taz id='a' edges='x'>", "not well-formed"),
    ],
    "SUMO edgeData": [
        (within("<edge id='a'/>"), "edge a: no count; it has nothing"),
        (within("<edge id='a' speed='3'/>"), "edge a: no count; it has speed"),
        (within("<edge id='a' entered='x'/>"), "entered of <edge> is no number: 'x'"),
        (within("<edge id='a' entered='nan'/>"), "entered of <edge> is no number: 'nan'"),
        (within("<edge id='a' entered='-3'/>"), "edge a: -3 vehicles"),
        (within("<edge entered='3'/>"), "the edge has no id"),
        (within("<lane id='a_0' entered='3'/>"), NOTHING),
        (within("<edge id='a'><lane id='a_0' entered='3'/></edge>"), "edge a: no count"),
        (within("<edge id='a' entered='3'/>", "begin='9' end='9'"), "from 9 to 9 is none"),
        (within("<edge id='a' entered='3'/>", "begin='x' end='9'"), "is no number: 'x'"),
        (parts("<edgeData id='a' file='b'/>"), "has no values: run SUMO with it"),
    ],
    "SUMO edgeRelation and turn ratios": [
        (within(f"<edgeRelation {TRIP}/>"), "a to b: no count"),
        (within(f"<edgeRelation {TRIP} count='x'/>"), "is no number: 'x'"),
        (within(f"<edgeRelation {TRIP} count='-3'/>"), "a to b: -3"),
        (within(f"<edgeRelation {TRIP} probability='2'/>"), "a to b: 2"),
        (within("<edgeRelation from='a' count='3'/>"), "from or to is missing"),
        (f"<data><edgeRelation {TRIP} count='3'/></data>".encode(), "root element <data>"),
        (within("<fromEdge id='a'/>"), NOTHING),
        (within("<fromEdge><toEdge id='b' probability='1'/></fromEdge>"), "<fromEdge> .* no id"),
        (within("<fromEdge id='a'><toEdge probability='1'/></fromEdge>"), "<toEdge> has no id"),
        (within("<fromEdge id='a'><toEdge id='b'/></fromEdge>"), "probability of <toEdge> is no"),
        (within("<fromEdge id='a'><toEdge id='b' probability='-1'/></fromEdge>"), "a to b: -1"),
    ],
    "SUMO output of E1": [
        (b"<detector/>", "root element <detector>; trips or counts are"),
        (loop("begin='0' end='9' id='d'"), NOTHING),
        (loop("begin='0' end='9' id='d' speed='1'"), NOTHING),
        (loop("begin='0' end='9' nVehContrib='3'"), "the detector has no id"),
        (loop("begin='0' end='9' id='d' nVehContrib='x'"), "nVehContrib of <interval> is no"),
        (loop("begin='0' end='9' id='d' nVehContrib=''"), "nVehContrib of <interval> is no"),
        (loop("begin='0' end='9' id='d' nVehContrib='-1'"), "d: nVehContrib is -1"),
        (loop("begin='9' end='9' id='d' nVehContrib='1'"), "the interval from 9 to 9 is none"),
        (loop("begin='-9' end='9' id='d' nVehContrib='1'"), "the interval from -9 to 9 is none"),
        (loop("id='d' nVehContrib='1'"), "begin of <interval> is no number: nothing"),
        (b"<detector><interval begin='0'", "not well-formed"),
    ],
    "SUMO detectors": [
        (parts(""), "root element <additional>; trips or counts are"),
        (parts("<inductionLoop/>"), "id or lane is missing"),
        (parts("<inductionLoop id='a'/>"), "id or lane is missing"),
        (parts("<inductionLoop lane='x_0' pos='3'/>"), "id or lane is missing"),
        (parts("<inductionLoop id='a' lane=''/>"), "id or lane is missing"),
        (parts("<inductionLoop id='a' lane='x_0' pos='q'/>"), "a: pos is 'q'"),
        (parts("<inductionLoop id='a' lane='x_0' pos='nan'/>"), "a: pos is 'nan'"),
        (parts("<e1Detector id='a' lane='x_0' pos='inf'/>"), "a: pos is 'inf'"),
        (parts("<laneAreaDetector id='a'/>"), "id or lane is missing"),
        (parts("<e3Detector id='a'/>"), "root element <additional>"),
    ],
    "counts in CSV": [
        (b"station;time;count\nA;;3\n", "row 2 of the file: the time is missing"),
        (b"station;time;count\nA;07:00;-3\n", "A: -3 vehicles"),
        (b"station;time;count\nA;07:00;\n", "A: no value"),
        (b"station;time;count\nA;07:00;1e12\n", r"A: 1e\+12 vehicles"),
        (b"station;time;count\nA;07:61;3\n", "'07:61' is no time of day"),
        (b"station;time;count\nA;32.13.2026 07:00;3\n", "'32.13.2026 07:00' is no day"),
        (b"station;time;count\n;07:00;3\n", "no station"),
        (b"station;time;count\n", "no lines below the titles"),
        (b"station;time\nA;07:00\n", "recognised as count; its titles are 'station', 'time'"),
        (b"station;count\nA;3\n", "recognised as time; .* --columns time=TITLE"),
    ],
    "counts in Excel": [
        (sheet([["Station", "Time", "Count"], ["A", "", 3]]), "the time is missing"),
        (sheet([["Station", "Time", "Count"], ["A", "07:00", -3]]), "A: -3 vehicles"),
        (sheet([["Station", "Time", "Count"], ["A", "07:00", ""]]), "A: no value"),
        (sheet([["Station", "Time", "Count"], ["A", "07:61", 3]]), "'07:61' is no time of day"),
        (sheet([["Station", "Time", "Count"], ["", "07:00", 3]]), "no station"),
        (sheet([["Station", "Time", "Count"]]), "no sheet .* has a row below its titles"),
        (sheet([["Station", "Time"], ["A", "07:00"]]), "recognised as count"),
        (sheet([["Station", "Count"], ["A", 3]]), "recognised as time"),
        (sheet([["hello", "world"], ["a", "b"]]), "no column was recognised"),
        (b"PK\x03\x04 broken", "no Excel file that can be read"),
    ],
    "matrices in CSV": [
        (b"from;to;trips\nA;B;x\n", "a matrix in rows .*: A to B: no value"),
        (b"from;to;trips\nA;B;-2\n", "A to B: -2 vehicles"),
        (b"from;to;trips\nA;B;0\n", "its values are missing or 0"),
        (b"from;to;trips\nA;B;\n", "A to B: no value"),
        (b"from;to;trips\nA;;2\n", "no origin or destination"),
        (b"from;to;trips\n;B;2\n", "no origin or destination"),
        (b"from;to;trips\n", "no lines below the titles"),
        (b"from;to\nA;B\n", "no column of the table has counts; its titles are 'from', 'to'"),
        (b"O/D;1;2\n1;x;0\n2;0;0\n", "a square matrix .* 1 to 1: no value"),
        (b"O/D;1;2\n", "no lines below the titles"),
    ],
    "places of stations": [
        (b"station;lon;lat\nA;x;50\n", "A: no place"),
        (b"station;lon;lat\nA;200;50\n", "longitude 200.0, latitude 50.0: no such place"),
        (b"station;lon;lat\nA;9;95\n", "longitude 9.0, latitude 95.0: no such place"),
        (b"station;lon;lat\n;9;50\n", "no station"),
        (b"station;lon;lat\nA;;\n", "A: no place"),
        (b"station;lon;lat\n", "no lines below the titles"),
        (b"station;lon\nA;9\n", "no column was recognised as time and count"),
        (b"station;x;y\nA;;3\n", "a table of 0 places of stations .* A: no place"),
        (b"station;x;y\nA;nan;4\n", "A: no place"),
        (b"station;edge\nA;\n", "A: no place"),
    ],
}  # fmt: skip


def words_on(content: bytes) -> str:
    """What is said of a file: why it is refused, or what was left out."""
    try:
        read = read_traffic(content)
    except InputError as error:
        return str(error)
    return "; ".join(f"{left.source}: {left.reason}" for left in read.left_out)


@pytest.mark.parametrize("kind", WRONG)
def test_ten_wrong_files_are_answered_in_clear_words(kind: str) -> None:
    assert len(WRONG[kind]) >= 10
    for content, words in WRONG[kind]:
        said = words_on(content)
        assert re.search(words, said), (content, said)
