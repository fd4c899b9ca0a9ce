import json
from pathlib import Path

import pytest

from odscen.app.removal import remove
from odscen.base.checksums import sums_of, write_sums
from odscen.base.errors import (
    DamagedError,
    InputError,
    NotFoundError,
    OpenDriveError,
    WorkspaceError,
)
from odscen.maps import guarded_build
from odscen.maps.folder_names import check_name, name_from_file
from odscen.maps.store import Workspace, is_outdated

SHIPPED = Path(__file__).parents[2] / "maps"
SMALL = SHIPPED / "t_junction_signs.xodr"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(SMALL)
    return store


@pytest.mark.slow
def test_a_map_is_built_once(tmp_path):
    store = Workspace.open(tmp_path)
    written = (store.add_map(SMALL).folder / "map.json").stat()
    again = store.add_map(SMALL)
    assert again.info == store.map("t_junction_signs").info
    kept = (again.folder / "map.json").stat()
    assert (kept.st_ino, kept.st_mtime_ns) == (written.st_ino, written.st_mtime_ns)
    about = again.folder / "map.json"
    about.write_text(about.read_text().replace('"builder": ', '"builder": "1", "_": '))
    (again.folder / "SHA256SUMS").unlink()
    store.add_map(SMALL)
    assert about.stat().st_ino != written.st_ino, "an outdated one is built anew"


def test_what_is_loaded_is_what_was_built(workspace):
    entry = workspace.map("t_junction_signs")
    graph = entry.graph()
    assert graph.map_sha256 == entry.sha256
    assert len(graph.lanes.s) == entry.info["graph"]["nodes"]
    assert entry.lane_table().counts["lanes"] == entry.info["sumo"]["lanes"]
    assert entry.drawing().name == "t_junction_signs"
    assert entry.statistics().stop_signs == 1


def test_progress_goes_from_nothing_to_all(tmp_path):
    shares = []
    Workspace.open(tmp_path).add_map(SMALL, progress=lambda _what, share: shares.append(share))
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    assert shares == sorted(shares)


def test_a_failed_build_leaves_the_old_map_and_no_trace(tmp_path):
    store = Workspace.open(tmp_path)
    before = store.add_map(SMALL).sha256
    broken = tmp_path / "t_junction_signs.xodr"
    broken.write_bytes(SMALL.read_bytes()[:5000])
    with pytest.raises(OpenDriveError, match=r"^t_junction_signs\.xodr: "):
        store.add_map(broken)
    assert store.map("t_junction_signs").sha256 == before
    assert [path.name for path in (tmp_path / "maps").iterdir()] == ["t_junction_signs"]


@pytest.mark.slow
def test_other_content_of_the_same_name_replaces_the_map(tmp_path):
    store = Workspace.open(tmp_path)
    old = store.add_map(SMALL, name="m")
    new = store.add_map(SHIPPED / "roundabout.xodr", name="m")
    assert new.sha256 != old.sha256
    assert store.map_names() == ["m"]
    with pytest.raises(InputError, match="other content"):
        store.map_for("m", old.sha256)


def test_a_map_is_found_by_its_content_under_another_name(workspace):
    entry = workspace.map("t_junction_signs")
    assert workspace.map_for("renamed", entry.sha256) == entry


def outdate(entry):
    """Let a map be that of an older odscen."""
    old = {**entry.info, "builder": "0"}
    (entry.folder / "map.json").write_text(json.dumps(old), encoding="utf-8")
    write_sums(entry.folder, sums_of(entry.folder))


@pytest.mark.slow
def test_a_map_of_an_older_builder_is_built_again_when_opened_not_when_listed(
    tmp_path, monkeypatch
):
    store = Workspace.open(tmp_path)
    small = store.add_map(SMALL)
    other = store.add_map(SHIPPED / "roundabout.xodr")
    outdate(small)
    with monkeypatch.context() as patch:
        patch.setattr(guarded_build, "build_in_child", lambda *_args, **_more: pytest.fail("built"))
        assert [(one.name, is_outdated(one)) for one in store.maps()] == [
            ("roundabout", False),
            ("t_junction_signs", True),
        ]
        assert store.map_for("renamed", other.sha256) == other
        assert is_outdated(store.stored("t_junction_signs"))
    opened = store.map("t_junction_signs")
    assert not is_outdated(opened)
    assert not is_outdated(store.stored("t_junction_signs"))
    assert {**opened.info, "build_seconds": 0} == {**small.info, "build_seconds": 0}


@pytest.mark.slow
def test_an_outdated_map_that_is_found_by_its_content_is_built_again(tmp_path):
    store = Workspace.open(tmp_path)
    entry = store.add_map(SMALL)
    outdate(entry)
    assert store.map_for("renamed", entry.sha256) == entry
    outdate(entry)
    assert store.first_map(lambda one: one.sha256 == entry.sha256) == entry
    assert store.first_map(lambda one: one.sha256 == "") is None


@pytest.mark.slow
def test_an_outdated_map_that_is_damaged_is_listed_but_not_found(tmp_path):
    store = Workspace.open(tmp_path)
    entry = store.add_map(SMALL, name="a")
    same = store.add_map(SMALL, name="b")
    outdate(entry)
    flip(entry.path("xodr"))
    assert [one.name for one in store.maps()] == ["a", "b"]
    assert store.first_map(lambda one: one.sha256 == same.sha256) == same
    with pytest.raises(DamagedError, match="odscen doctor --repair builds map 'a' anew"):
        store.map("a")


def test_folders_in_the_making_are_not_maps(tmp_path):
    store = Workspace.open(tmp_path)
    (tmp_path / "maps" / ".building-x").mkdir()
    (tmp_path / "maps" / "half").mkdir()
    assert store.map_names() == []
    with pytest.raises(NotFoundError, match="there is no map yet"):
        store.map("half")


@pytest.mark.parametrize("name", ["..", "a/b", "a\\b", "", ".hidden", "a" * 65, "a\n"])
def test_names_that_could_be_paths_are_refused(name):
    with pytest.raises(InputError, match="cannot be used"):
        check_name(name)


def test_odd_file_names_become_plain_map_names():
    assert name_from_file(Path("/x/My town (new).xodr")) == "My_town_new"
    assert name_from_file(Path("---.xodr")) == "map"
    assert name_from_file(Path("Town.osm.bz2")) == name_from_file(Path("Town.osm.pbf")) == "Town"
    assert name_from_file(Path("Town.v2.gz")) == "Town.v2"


def test_a_file_that_is_not_there_says_so(workspace):
    with pytest.raises(InputError, match=r"nowhere\.xodr: No such file"):
        workspace.add_map(Path("nowhere.xodr"))


def test_a_workspace_that_is_a_file_says_so(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(WorkspaceError, match="file"):
        Workspace.open(tmp_path / "file")


def test_the_environment_names_the_workspace(tmp_path, monkeypatch):
    monkeypatch.setenv("ODSCEN_WORKSPACE", str(tmp_path / "w"))
    assert Workspace.open().root == tmp_path / "w"


@pytest.mark.slow
def test_every_real_map_is_added(shared_maps, tmp_path):
    store = Workspace.open(tmp_path)
    for path in sorted(shared_maps.glob("esmini/*.xodr")):
        entry = store.add_map(path)
        assert entry.info["graph"]["nodes"] > 0, path.name
        assert entry.info["sumo"]["lanes"] > 0, path.name


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.slow
def test_one_broken_map_hides_no_other_and_can_be_added_again_or_removed(tmp_path):
    store = Workspace.open(tmp_path)
    good, bad = store.add_map(SMALL, name="good"), store.add_map(SMALL, name="bad")
    (bad.folder / "map.json").write_text("{", encoding="utf-8")
    entries, broken = store.catalogue()
    assert entries == [good]
    assert [one.name for one in broken] == ["bad"]
    assert "map.json: expected sha256" in broken[0].problem
    assert store.map_for("bad", good.sha256) == good
    with pytest.raises(DamagedError, match="odscen doctor --repair builds map 'bad' anew"):
        store.map("bad")
    assert store.add_map(SMALL, name="bad").sha256 == good.sha256
    (bad.folder / "map.json").unlink()
    assert [one.name for one in store.catalogue()[1]] == ["bad"]
    remove(store, "map", "bad")
    assert store.map_names() == ["good"]


@pytest.mark.slow
@pytest.mark.parametrize("key", ["graph_npz", "net", "lane_table", "drawing", "xodr"])
def test_a_byte_that_has_changed_in_a_map_is_named_before_it_is_read(tmp_path, key):
    store = Workspace.open(tmp_path)
    entry = store.add_map(SMALL)
    flip(entry.path(key))
    with pytest.raises(DamagedError, match=rf"{entry.path(key).name}: expected sha256"):
        store.map(entry.name).read(key)
    with pytest.raises(DamagedError):
        entry.checked(key)
    assert [one.file for one in entry.damaged()] == [entry.path(key).name]
    assert store.add_map(SMALL).damaged() == []


def test_a_map_without_checksums_opens_and_says_so_once(tmp_path, caplog):
    store = Workspace.open(tmp_path)
    entry = store.add_map(SMALL)
    (entry.folder / "SHA256SUMS").unlink()
    assert store.map(entry.name).graph().map_sha256 == entry.sha256
    assert store.map(entry.name).drawing().name == entry.name
    assert [one.message for one in caplog.records] == [
        f"{entry.folder} has no SHA256SUMS, as of earlier versions: its files are not checked"
    ]


def test_what_killed_processes_left_is_gone_when_a_workspace_is_opened(tmp_path):
    store = Workspace.open(tmp_path)
    entry = store.add_map(SMALL)
    for name in (".building-x", ".removed-y", ".replaced-z"):
        (tmp_path / "maps" / name / "m").mkdir(parents=True)
    (tmp_path / "maps" / ".m.lock").write_text("{}", encoding="utf-8")
    Workspace.open(tmp_path)
    assert sorted(path.name for path in (tmp_path / "maps").iterdir()) == ["m", entry.name]
