from __future__ import annotations

import contextlib
import dataclasses
import io
import re
from typing import TYPE_CHECKING

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.errors import GraphFormatError
from odscen.base.ids import LaneKey, RoadId
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graph_files import (
    from_graphml,
    from_npz_bytes,
    to_graphml,
    to_networkx,
    to_npz_bytes,
)
from odscen.lanegraph.map_graphml import EDGE_KEYS, GRAPH_KEYS, NODE_KEYS
from odscen.opendrive.parse import parse
from tests.graphs import ToyLane, ToyWalk, fork, line_of_segments, map_graph, ring, two_lane_road
from tests.opendrive.snippets import document, road

if TYPE_CHECKING:
    from odscen.lanegraph.graphs import MapGraph

GRAPHS = {
    "two lanes": two_lane_road(),
    "fork": fork(),
    "ring": ring(),
    "row": line_of_segments(),
}


def differences(one: object, other: object, place: str = "graph") -> list[str]:
    """Every place where two graphs differ, types and shapes included."""
    if dataclasses.is_dataclass(one):
        return [
            found
            for field in dataclasses.fields(one)
            for found in differences(
                getattr(one, field.name), getattr(other, field.name), f"{place}.{field.name}"
            )
        ]
    if isinstance(one, np.ndarray):
        same = one.dtype == other.dtype and one.shape == other.shape
        equal = same and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
        return [] if equal else [place]
    return [] if one == other and type(one) is type(other) else [place]


def with_numbers(values: list[float]) -> MapGraph:
    """A graph whose float attributes hold any numbers there are."""
    graph = two_lane_road(4.0)
    count = len(graph.lanes.x)
    numbers = np.resize(np.array(values), count)
    lanes = dataclasses.replace(
        graph.lanes, x=numbers, z=numbers[::-1].copy(), speed_limit=numbers, width=np.abs(numbers)
    )
    return dataclasses.replace(graph, lanes=lanes)


@pytest.mark.parametrize("name", GRAPHS)
def test_npz_gives_the_same_graph_back(name: str) -> None:
    graph = GRAPHS[name]
    assert differences(graph, from_npz_bytes(to_npz_bytes(graph))) == []


@pytest.mark.parametrize("name", GRAPHS)
def test_graphml_gives_the_same_graph_back(name: str) -> None:
    graph = GRAPHS[name]
    assert differences(graph, from_graphml(to_graphml(graph))) == []


@pytest.mark.parametrize("name", GRAPHS)
def test_graphml_survives_being_rewritten_by_networkx(name: str) -> None:
    graph = GRAPHS[name]
    rewritten = io.BytesIO()
    nx.write_graphml(nx.read_graphml(io.BytesIO(to_graphml(graph))), rewritten)
    assert differences(graph, from_graphml(rewritten.getvalue())) == []


@pytest.mark.slow
@settings(max_examples=50)
@given(st.lists(st.floats(), min_size=1, max_size=4))
def test_every_number_survives(values: list[float]) -> None:
    graph = with_numbers(values)
    assert differences(graph, from_graphml(to_graphml(graph))) == []
    assert differences(graph, from_npz_bytes(to_npz_bytes(graph))) == []


@pytest.mark.slow
@settings(max_examples=50)
@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), min_size=1))
def test_every_road_id_survives(road: str) -> None:
    if {"\ufffe", "\uffff"} & set(road):
        return
    key = LaneKey(RoadId(road), 0, -1)
    lane = ToyLane(key, 0.0, 0.0, 0.0, 6.0, "r<&\"'>\n\t")
    walk = ToyWalk(LaneKey(RoadId(road), 0, -2), 0.0, -3.0, 0.0, 6.0, "r<&\"'>\n\t")
    graph = map_graph([lane], walks=[walk], name=f"map {road}")
    assert differences(graph, from_graphml(to_graphml(graph))) == []
    assert differences(graph, from_npz_bytes(to_npz_bytes(graph))) == []


def test_equal_graphs_give_equal_bytes() -> None:
    assert to_npz_bytes(fork()) == to_npz_bytes(fork())
    assert to_graphml(fork()) == to_graphml(fork())


def test_networkx_reads_types_and_relations() -> None:
    graph = nx.read_graphml(io.BytesIO(to_graphml(two_lane_road())))
    node = graph.nodes["1.0.-2.0"]
    assert node["kind"] == "vehicle"
    assert node["x"] == 1.0
    assert node["lane_change"] == 1
    assert node["forward"] is True
    assert graph.nodes["ped.1.0.-3.0"]["kind"] == "pedestrian"
    assert graph.nodes["segment.r1"]["segment_kind"] == "road"
    assert graph.edges["1.0.-2.0", "1.0.-1.1"]["relation"] == "left"
    assert graph.edges["1.0.-2.0", "1.0.-2.1"] == {"relation": "successor", "length": 2.0}


def test_networkx_graphs_have_the_edges_of_the_arrays() -> None:
    graph = fork()
    lanes, walks = to_networkx(graph)
    assert lanes.number_of_nodes() == len(graph.lanes.x)
    assert lanes.number_of_edges() == len(graph.lanes.source)
    assert walks.number_of_edges() == len(graph.walks.source)
    assert set(lanes.graph["segments"].edges) == {("r1", "j9"), ("j9", "r2"), ("j9", "r3")}


@pytest.mark.parametrize("data", [b"", b"no", b"PK\x03\x04", to_npz_bytes(fork())[:-200]])
def test_what_is_no_npz_is_refused(data: bytes) -> None:
    with pytest.raises(GraphFormatError, match=r"^graph\.npz: "):
        from_npz_bytes(data, file="graph.npz")


def test_pickles_are_not_loaded() -> None:
    buffer = io.BytesIO()
    np.savez(buffer, format=np.array([{"a": 1}], dtype=object))
    with pytest.raises(GraphFormatError):
        from_npz_bytes(buffer.getvalue())


def test_an_archive_without_our_arrays_is_refused() -> None:
    buffer = io.BytesIO()
    np.savez(buffer, format=np.array(["odscen-map-graph"]), version=np.array([1], dtype=np.int32))
    with pytest.raises(GraphFormatError, match="missing: map"):
        from_npz_bytes(buffer.getvalue())


@pytest.mark.parametrize(
    ("pattern", "replacement", "problem"),
    [
        (r'target="1\.0\.-2\.1"', 'target="7.0.0.0"', "node 7.0.0.0: an edge needs it as vehicle"),
        (r'"e_relation">left<', '"e_relation">up<', "its relation is 'up'"),
        (r'"n_x">1\.0<', '"n_x">one<', "'x' has a value of the wrong type"),
        (r'<data key="n_x">1\.0</data>', "", "'x' is missing"),
        (r'"1\.0\.-2\.1"', '"1.0.-2.9"', "node 1.0.-2.9: it does not follow"),
        (r'"n_kind">vehicle', '"n_kind">tram', "its kind is 'tram'"),
        (r'"n_segment">r1<', '"n_segment">r2<', "'segment' names 'r2'"),
        (r'"g_version">1<', '"g_version">2<', "version is 2"),
        (r'"g_format">[^<]*<', '"g_format">other<', "not an odscen map graph"),
        (r"</graphml>", "", "it is not XML"),
        (r'"n_lane_change">1<', '"n_lane_change">4<', "lane_change"),
    ],
)
def test_damaged_graphml_is_refused_with_place_and_value(
    pattern: str, replacement: str, problem: str
) -> None:
    text = to_graphml(two_lane_road()).decode()
    for kind, names in (("g", GRAPH_KEYS), ("n", NODE_KEYS), ("e", EDGE_KEYS)):
        for index, name in enumerate(names):  # keys of any name are read
            text = text.replace(f'"{kind}{index}"', f'"{kind}_{name}"')
    damaged, count = re.subn(pattern, replacement, text)
    assert count
    with pytest.raises(GraphFormatError) as caught:
        from_graphml(damaged.encode(), file="graph.graphml")
    assert str(caught.value).startswith("graph.graphml: ")
    assert problem in str(caught.value)


def test_entities_are_not_expanded() -> None:
    bomb = (
        b'<!DOCTYPE graphml [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
        b'<graphml xmlns="http://graphml.graphdrawing.org/xmlns">'
        b'<key id="g" for="graph" attr.name="format"/><graph><data key="g">&b;</data></graph>'
        b"</graphml>"
    )
    with pytest.raises(GraphFormatError):
        from_graphml(bomb)


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.data())
def test_damaged_npz_is_read_or_refused_but_never_crashes(data: st.DataObject) -> None:
    good = bytearray(to_npz_bytes(two_lane_road(6.0)))
    for _ in range(data.draw(st.integers(1, 4))):
        good[data.draw(st.integers(0, len(good) - 1))] = data.draw(st.integers(0, 255))
    with contextlib.suppress(GraphFormatError):
        from_npz_bytes(bytes(good))


def test_ids_of_any_characters_come_back_from_both_files() -> None:
    odd = "a>b \u202e'1\"&<: \u200b é]]>"
    text = document(road("".join(f"&#{ord(letter)};" for letter in odd)))
    graph = build_map_graph(parse(text), name="m", sha256="0" * 64)
    assert {key.road for key in graph.lanes.lanes.keys} == {odd}
    assert differences(from_npz_bytes(to_npz_bytes(graph)), graph) == []
    assert differences(from_graphml(to_graphml(graph)), graph) == []
