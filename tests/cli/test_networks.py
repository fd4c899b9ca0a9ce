from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import SHIPPED, odscen

CROSSING = SHIPPED / "signal_crossing.xodr"


@pytest.mark.slow
def test_a_map_is_added_by_the_converter_of_that_name_and_says_so(tmp_path: Path) -> None:
    done = odscen("maps", "add", CROSSING, "--converter", "netconvert", "--workspace", tmp_path)
    assert (done.code, done.out) == (0, "")
    (row,) = odscen("maps", "list", "--json", "--workspace", tmp_path).json["maps"]
    assert row["network"]["converter"] == "netconvert"
    assert "netconvert" in odscen("maps", "show", "signal_crossing", "--workspace", tmp_path).out


def test_a_map_that_netconvert_refuses_ends_with_code_3_and_its_words(tmp_path: Path) -> None:
    strange = tmp_path / "strange.xodr"
    strange.write_text(CROSSING.read_text().replace('type="1000001"', 'type=""'))
    done = odscen(
        "maps", "add", strange, "--converter", "netconvert", "--json", "--workspace", tmp_path
    )
    assert done.code == 3
    assert "Attribute 'type' in definition of signal" in done.json["maps"][0]["error"]["message"]


@pytest.mark.slow
def test_a_network_is_written_and_brought_back(tmp_path: Path) -> None:
    odscen("maps", "add", CROSSING, "--workspace", tmp_path)
    file = tmp_path / "out" / "mine.net.xml"
    done = odscen("maps", "network", "signal_crossing", "--out", file, "--workspace", tmp_path)
    assert done.code == 0
    back = odscen(
        "maps", "network", "signal_crossing", "--from", file, "--json", "--workspace", tmp_path
    )
    assert back.json["network"]["converter"] == "file"
    assert back.json["network"]["source"] == "mine.net.xml"
    assert back.json["changes"] == []
    shown = odscen("maps", "network", "signal_crossing", "--json", "--workspace", tmp_path).json
    assert Path(shown["file"]).read_bytes() == file.read_bytes()


@pytest.mark.slow
def test_what_cannot_be_brought_in_is_refused_with_the_reason(tmp_path: Path) -> None:
    odscen("maps", "add", CROSSING, "--workspace", tmp_path)
    call = ("maps", "network", "signal_crossing", "--workspace", tmp_path, "--from")
    done = odscen(*call, CROSSING)
    assert done.code == 2
    assert "first element is <OpenDRIVE>, not <net>" in done.err
    assert odscen(*call, CROSSING, "--out", tmp_path / "x").code == 2
    assert odscen(*call, tmp_path / "none.net.xml").code == 2


@pytest.mark.slow
def test_compare_prints_both_converters_beside_each_other(workspace: Path) -> None:
    done = odscen("maps", "compare", "t_junction_signs", "--levels", "", "--workspace", workspace)
    assert done.code == 0
    (row,) = [line for line in done.out.splitlines() if "crosswalks lost" in line]
    assert row.split()[2:] == ["0", "6", "!"]
    wrong = odscen("maps", "compare", "t_junction_signs", "--levels", "x", "--workspace", workspace)
    assert wrong.code == 2
    assert "--levels takes numbers" in wrong.err


@pytest.mark.slow
def test_a_device_is_no_network(tmp_path: Path) -> None:
    odscen("maps", "add", CROSSING, "--workspace", tmp_path)
    call = ("maps", "network", "signal_crossing", "--workspace", tmp_path, "--from", "/dev/zero")
    done = odscen(*call)
    assert done.code == 2
    assert "/dev/zero: this is a pipe, device or socket, not a regular file" in done.err
