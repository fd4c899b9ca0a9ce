from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from odscen.base.errors import ConflictError, InputError, NotFoundError
from odscen.maps.store import Workspace
from odscen.maps.wastebasket import KEPT, RemovedKind, Wastebasket


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    """One of each, made by hand: the wastebasket looks into none of them."""
    store = Workspace.open(tmp_path)
    for folder in ("maps/town", "runs/night-1", "scenarios/.history/morning"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "content").write_text(folder)
    (store.scenarios / "morning.scenario.json").write_text("{}")
    return store


def files(workspace: Workspace) -> dict[str, str]:
    return {
        str(path.relative_to(workspace.root)): path.read_text()
        for path in workspace.root.rglob("*")
        if path.is_file()
    }


@pytest.mark.parametrize(
    ("kind", "name"), [("map", "town"), ("scenario", "morning"), ("run", "night-1")]
)
def test_what_is_removed_is_out_of_sight_and_comes_back_byte_for_byte(
    workspace: Workspace, kind: RemovedKind, name: str
) -> None:
    before, basket = files(workspace), Wastebasket(workspace)
    item = basket.put(kind, name)
    gone = set(before) - set(files(workspace))
    assert gone == {file for file in before if name in file}
    assert basket.items() == [item]
    assert (item.kind, item.name, item.until - item.removed) == (kind, name, timedelta(days=30))
    assert item.size() >= sum(len(before[file]) for file in gone)
    assert basket.restore(item.id) == item
    assert files(workspace) == before
    assert basket.items() == []
    with pytest.raises(NotFoundError):
        basket.restore(item.id)


def test_nothing_comes_back_over_what_has_taken_its_place(workspace: Workspace) -> None:
    basket = Wastebasket(workspace)
    old = basket.put("scenario", "morning")
    (workspace.scenarios / "morning.scenario.json").write_text("new")
    with pytest.raises(ConflictError, match="another scenario named 'morning'"):
        basket.restore(old.id)
    newer = basket.put("scenario", "morning")
    assert {one.id for one in basket.items()} == {old.id, newer.id}
    with pytest.raises(ConflictError, match="say which"):
        basket.restore("morning")
    basket.restore(old.id)
    assert (workspace.scenarios / "morning.scenario.json").read_text() == "{}"
    assert (workspace.scenarios / ".history" / "morning" / "content").is_file()


def test_an_item_is_deleted_after_thirty_days_and_not_before(workspace: Workspace) -> None:
    basket = Wastebasket(workspace)
    item = basket.put("run", "night-1")
    basket.sweep(item.removed + KEPT)
    assert basket.items() == [item]
    basket.sweep(item.removed + KEPT + timedelta(seconds=1))
    assert basket.items() == []
    assert not item.folder.exists()


def test_an_item_that_a_killed_process_never_filled_is_not_shown_and_swept(
    workspace: Workspace,
) -> None:
    now = datetime.now(UTC)
    empty = workspace.runs / ".trash" / f"run-{now:%Y%m%d-%H%M%S}-00000000"
    other = workspace.runs / ".trash" / "not of ours"
    for folder in (empty, other):
        folder.mkdir(parents=True)
    basket = Wastebasket(workspace)
    assert basket.items() == []
    basket.sweep(now)
    assert empty.is_dir()  # its content may be on the way
    basket.sweep(now + timedelta(hours=2))
    assert not empty.exists()
    assert other.is_dir()


@pytest.mark.parametrize("name", ["..", "../runs", "a/b", "/etc", ".history", "a\0b", ""])
def test_names_and_ids_never_become_paths(workspace: Workspace, name: str) -> None:
    before, basket = files(workspace), Wastebasket(workspace)
    with pytest.raises(InputError):
        basket.put("map", name)
    for act in (basket.restore, basket.delete):
        with pytest.raises(NotFoundError):
            act(name)
    assert files(workspace) == before


def test_a_folder_that_is_a_link_to_another_place_has_its_wastebasket_there(
    workspace: Workspace, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("big_disk") / "runs"
    workspace.runs.rename(elsewhere)
    workspace.runs.symlink_to(elsewhere)
    item = Wastebasket(workspace).put("run", "night-1")
    assert (elsewhere / ".trash" / item.id / "night-1" / "content").is_file()
