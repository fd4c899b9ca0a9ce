import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from odscen.base.checksums import sums_of, write_sums
from tests.cli.conftest import SHIPPED, odscen
from tests.opendrive.snippets import document, lane, road, section

STATISTICS = {
    "bounds",
    "road_length",
    "driving_lane_length",
    "junctions",
    "crosswalks",
    "traffic_lights",
    "stop_signs",
    "yield_signs",
    "speed_limit_min",
    "speed_limit_max",
}


@pytest.mark.slow
def test_show_gives_what_scripts_rely_on(workspace):
    done = odscen("maps", "show", "signal_crossing", "--json", "--workspace", workspace)
    info = done.json
    assert done.code == 0
    assert info["name"] == "signal_crossing"
    assert len(info["sha256"]) == 64
    assert info["opendrive"] == {"version": "1.7", "rule": "RHT"}
    assert set(info["statistics"]) >= STATISTICS
    assert info["statistics"]["crosswalks"] == 4
    assert info["statistics"]["traffic_lights"] == 8
    assert info["statistics"]["speed_limit_max"] == pytest.approx(50 / 3.6, abs=1e-3)
    assert info["graph"]["spacing"] == 2.0
    assert info["graph"]["nodes"] > 700
    assert info["graph"]["left_edges"] == 209
    assert info["graph"]["right_edges"] == 208
    assert set(info["sumo"]) >= {
        "net_file",
        "edges",
        "lanes",
        "junctions",
        "tl_logics",
        "crossings",
    }
    assert info["sumo"]["tl_logics"] == 1
    assert info["build_seconds"] > 0


@pytest.mark.slow
def test_all_files_of_a_map_are_there(workspace):
    files = odscen("maps", "show", "signal_crossing", "--json", "--workspace", workspace).json[
        "files"
    ]
    assert set(files) >= {"xodr", "graph", "graph_npz", "net", "lane_table", "preview"}
    for path in files.values():
        assert Path(path).stat().st_size > 0


@pytest.mark.slow
def test_add_reports_refusals_by_element_and_adds_the_others(tmp_path):
    bad = tmp_path / "bad.xodr"
    text = (SHIPPED / "t_junction_signs.xodr").read_text(encoding="utf-8")
    bad.write_text(text.replace('length="', 'length="-', 1), encoding="utf-8")
    good = SHIPPED / "roundabout.xodr"
    done = odscen("maps", "add", bad, good, "--json", "--workspace", tmp_path / "w")
    assert done.code == 2
    refused, added = done.json["maps"]
    assert refused["error"]["file"] == "bad.xodr"
    assert "road 1" in refused["error"]["message"]
    assert "length" in refused["error"]["message"]
    assert added["name"] == "roundabout"
    listed = odscen("maps", "list", "--json", "--workspace", tmp_path / "w").json["maps"]
    assert [row["name"] for row in listed] == ["roundabout"]
    left = {path.name for path in (tmp_path / "w" / "maps").iterdir()}
    assert left == {"roundabout"}, "nothing half-written is left"


@pytest.mark.slow
def test_a_map_of_an_earlier_odscen_is_listed_as_outdated_until_it_is_used(tmp_path):
    good = SHIPPED / "t_junction_signs.xodr"
    odscen("maps", "add", good, "--workspace", tmp_path)
    about = tmp_path / "maps" / "t_junction_signs" / "map.json"
    (about.parent / "SHA256SUMS").unlink()
    older = json.loads(about.read_text()) | {"builder": "1"}
    del older["network"]
    about.write_text(json.dumps(older))
    done = odscen("maps", "list", "--workspace", tmp_path)
    assert "outdated: t_junction_signs: an earlier odscen has built it" in done.err
    assert json.loads(about.read_text()) == older
    (row,) = odscen("maps", "list", "--json", "--workspace", tmp_path).json["maps"]
    assert row["outdated"] is True
    assert odscen("maps", "show", "t_junction_signs", "--workspace", tmp_path).code == 0
    (row,) = odscen("maps", "list", "--json", "--workspace", tmp_path).json["maps"]
    assert row["outdated"] is False


@pytest.mark.slow
def test_files_of_the_same_name_also_get_their_folders(tmp_path):
    text = (SHIPPED / "t_junction_signs.xodr").read_text(encoding="utf-8")
    files = []
    for year in ("2019", "2020"):
        (tmp_path / year).mkdir()
        files.append(tmp_path / year / "Town.xodr")
        files[-1].write_text(text, encoding="utf-8")
    done = odscen("maps", "add", *files, "--json", "--workspace", tmp_path / "w")
    assert [row["name"] for row in done.json["maps"]] == ["2019-Town", "2020-Town"]


def test_names_never_become_paths(tmp_path):
    done = odscen(
        "maps", "add", SHIPPED / "roundabout.xodr", "--name", "../x", "--workspace", tmp_path / "w"
    )
    assert done.code == 2
    assert "'../x'" in done.err
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_an_unknown_map_is_answered_with_close_names(workspace):
    done = odscen("maps", "show", "signal_crosing", "--json", "--workspace", workspace)
    assert done.code == 2
    assert done.json["error"]["type"] == "NotFoundError"
    assert "did you mean signal_crossing" in done.err


@pytest.mark.slow
def test_render_writes_svg_and_png_and_refuses_the_rest(workspace, tmp_path):
    w = ("--workspace", workspace)
    assert odscen("maps", "render", "signal_crossing", "-o", tmp_path / "a.svg", *w).code == 0
    assert (tmp_path / "a.svg").read_text(encoding="utf-8").endswith("</svg>\n")
    done = odscen("maps", "render", "signal_crossing", "-o", tmp_path / "a.gif", *w)
    assert done.code == 2
    assert "not .gif" in done.err
    pytest.importorskip("cairosvg", reason="needs the png extra")
    assert odscen("maps", "render", "signal_crossing", "-o", tmp_path / "a.png", *w).code == 0
    assert (tmp_path / "a.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.slow
def test_another_spacing_builds_the_map_again(tmp_path):
    add = ("maps", "add", SHIPPED / "roundabout.xodr", "--json", "--workspace", tmp_path)
    two = odscen(*add).json["maps"][0]["graph"]["nodes"]
    four = odscen(*add, "--spacing", 4).json["maps"][0]["graph"]["nodes"]
    assert four == pytest.approx(two / 2, rel=0.1)


@pytest.mark.slow
def test_verify_gives_every_limit_and_fails_if_one_is_not_held(workspace, tmp_path):
    sheet = tmp_path / "found" / "sheet.svg"
    arguments = ("maps", "verify", "signal_crossing", "--workspace", workspace)
    done = odscen(*arguments, "--json", "--drawing", sheet)
    assert done.code == (0 if done.json["passed"] else 1), done.err
    assert done.json["name"] == "signal_crossing"
    assert done.json["passed"] == all(verdict["ok"] for verdict in done.json["verdicts"])
    assert done.json["crosswalks"] == 4
    assert done.json["coverage"]["share"] > 0.99
    assert sheet.read_text(encoding="utf-8").startswith("<?xml")
    table = odscen(*arguments)
    assert table.code == done.code
    for verdict in done.json["verdicts"]:
        assert verdict["name"] in table.out


@pytest.mark.slow
def test_verify_names_what_a_tampered_network_lost(workspace, tmp_path):
    shutil.copytree(workspace / "maps" / "t_junction_signs", tmp_path / "maps" / "t_junction_signs")
    net = tmp_path / "maps" / "t_junction_signs" / "net.net.xml"
    text = net.read_text(encoding="utf-8")
    west = r'netOffset="(-?[\d.]+)'
    moved = re.sub(west, lambda found: f'netOffset="{float(found[1]) + 0.3}', text, count=1)
    net.write_text(moved, encoding="utf-8")
    write_sums(net.parent, sums_of(net.parent))
    sheet = tmp_path / "sheet.svg"
    done = odscen("maps", "verify", "t_junction_signs", "--drawing", sheet, "--workspace", tmp_path)
    assert done.code == 1
    assert "NOT HELD" in done.out
    assert "lane not covered" in done.out
    assert "Lane not covered" in sheet.read_text(encoding="utf-8")


@pytest.mark.slow
def test_verify_refuses_a_network_that_is_none(workspace, tmp_path):
    shutil.copytree(workspace / "maps" / "t_junction_signs", tmp_path / "maps" / "t_junction_signs")
    net = tmp_path / "maps" / "t_junction_signs" / "net.net.xml"
    net.write_text("<net", encoding="utf-8")
    done = odscen("maps", "verify", "t_junction_signs", "--workspace", tmp_path)
    assert done.code == 2
    assert "net.net.xml: expected sha256" in done.err
    write_sums(net.parent, sums_of(net.parent))
    done = odscen("maps", "verify", "t_junction_signs", "--json", "--workspace", tmp_path)
    assert done.code == 2
    assert done.json["error"]["file"] == "net.net.xml"


@pytest.mark.slow
def test_add_warns_of_a_network_that_does_not_follow_its_map_and_sampling_says_what_is_wrong(
    tmp_path,
):
    file = tmp_path / "inside.xodr"
    links = '<connection id="0" incomingRoad="1" connectingRoad="1" contactPoint="start"/>'
    file.write_text(document(road("1", junction="9"), f'<junction id="9">{links}</junction>'))
    done = odscen("maps", "add", file, "--workspace", tmp_path, "--json")
    assert done.code == 0
    warning, added = done.err.splitlines()
    assert warning == (
        "inside: warning: its SUMO network does not follow the map within the limits (drivable "
        "lanes covered, share 0, limit 0.998); odscen maps verify inside says where"
    )
    assert added.startswith("inside: 100 nodes")
    missed = [{"name": "drivable lanes covered, share", "value": 0.0, "limit": 0.998}]
    expected = {"passed": False, "not_held": missed}
    assert done.json["maps"][0]["fidelity"] == expected
    listed = odscen("maps", "list", "--workspace", tmp_path, "--json")
    assert listed.json["maps"][0]["fidelity"] == expected
    assert odscen("maps", "verify", "inside", "--workspace", tmp_path).code == 1
    sampled = odscen("generate", "--map", "inside", "--workspace", tmp_path)
    assert sampled.code == 2
    assert sampled.err.startswith("error: no actor fits on map 'inside'")


def test_a_map_that_follows_says_so_without_a_word(workspace):
    listed = odscen("maps", "list", "--workspace", workspace, "--json").json
    assert all(one["fidelity"] == {"passed": True, "not_held": []} for one in listed["maps"])


@pytest.mark.slow
def test_a_road_whose_nodes_would_be_those_of_walks_is_refused(tmp_path):
    file = tmp_path / "ped.xodr"
    file.write_text(document(road("ped.1")))
    done = odscen("maps", "add", file, "--workspace", tmp_path)
    assert done.code == 2
    assert "ped.xodr: road ped.1: nodes of walks begin with 'ped.'" in done.err


def test_help_needs_none_of_the_heavy_packages():
    code = (
        "import sys, odscen.cli;"
        "print([m for m in ('numpy', 'scipy', 'lxml', 'polars', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.slow
def test_doctor_says_what_is_there(workspace):
    done = odscen("doctor", "--json", "--workspace", workspace)
    assert done.code == 0
    checks = {check["name"]: check["found"] for check in done.json["checks"]}
    assert done.json["healthy"] is True
    assert checks["sumo"].endswith("sumo")
    assert checks["workspace"] == str(workspace)


@pytest.mark.slow
def test_assets_are_listed():
    done = odscen("assets", "list", "--json")
    assert len(done.json["blueprints"]) == 93
    assert {"ClearNoon", "FogNight"} <= {preset["name"] for preset in done.json["weather"]}


@pytest.mark.slow
def test_a_missing_command_explains_itself():
    done = odscen("mpas")
    assert done.code == 2
    assert "maps" in done.err


def test_map_json_is_valid_json_without_nan(workspace):
    text = (workspace / "maps" / "signal_crossing" / "map.json").read_text(encoding="utf-8")
    json.loads(text, parse_constant=pytest.fail)


@pytest.mark.parametrize("option", ["--build-memory", "--build-minutes"])
def test_a_limit_of_zero_is_refused(tmp_path, option):
    small = SHIPPED / "t_junction_signs.xodr"
    done = odscen("maps", "add", small, option, "0", "--workspace", tmp_path)
    assert done.code == 2
    assert f"{option} must be above 0" in done.err


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits memory")
def test_a_map_beyond_its_memory_ends_with_code_3_and_what_to_do(tmp_path):
    lines = "".join(
        f'<road name="" id="{k}" length="10000" junction="-1"><planView><geometry s="0" '
        f'x="{10_000 * k}" y="0" hdg="0" length="10000"><line/></geometry></planView><lanes>'
        '<laneSection s="0"><center><lane id="0" type="none"/></center><right>'
        '<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'
        "</right></laneSection></lanes></road>"
        for k in range(40)
    )
    file = tmp_path / "long.xodr"
    file.write_text(f'<OpenDRIVE><header revMajor="1" revMinor="6"/>{lines}</OpenDRIVE>')
    done = odscen("maps", "add", file, "--build-memory", "0.25", "--workspace", tmp_path)
    assert done.code == 3
    assert "long.xodr: building the map needs more than 0.25 GB of memory" in done.err
    assert "--build-memory 0.50" in done.err
    assert odscen("maps", "list", "--json", "--workspace", tmp_path).json["maps"] == []


@pytest.mark.slow
def test_the_first_line_of_a_map_says_what_is_lost_for_traffic(tmp_path):
    sign = '<signal id="{}" s="90" t="-4" dynamic="no" country="DE" type="999" subtype="-1"/>'
    access = '<access sOffset="0" rule="deny" restriction="throughTraffic"/>'
    text = document(
        road(
            lanes=section(lane(-1, inside=access)),
            inside=f"<signals>{sign.format(1)}{sign.format(2)}</signals>",
        ),
        road("2", length=0.0),
    )
    file = tmp_path / "stranger.xodr"
    file.write_text(text)
    done = odscen("maps", "add", file, "--workspace", tmp_path / "w")
    assert done.code == 0
    assert "; lost for traffic: 1 access rule, 1 road, 2 signs not understood" in done.err
