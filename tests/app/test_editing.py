from __future__ import annotations

import zlib
from pathlib import Path

import pytest

from odscen.app.editing import Editing, HistoryFolder
from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, read_scenario, write_scenario
from odscen.app.variants import edited
from odscen.base.errors import ConflictError, InputError, NotFoundError, ScenarioError
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.edits import new_scenario
from odscen.scenario.edits.edit_history import MOST_UNDONE, NO_HISTORY, open_history
from odscen.scenario.edits.edit_messages import read_edit
from odscen.web.drafts import Drafts

MAP = "t_junction_signs"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    opened = Workspace.open(tmp_path_factory.mktemp("workspace"))
    opened.add_map(next(path for path in shipped_maps() if path.stem == MAP))
    return opened


@pytest.fixture
def empty(workspace: Workspace) -> Scenario:
    return new_scenario(load_map(workspace.map(MAP)).sumo.graph, name="empty")


def test_undo_and_redo_lead_through_all_steps_and_back(
    workspace: Workspace, empty: Scenario
) -> None:
    editing = Editing(workspace, empty)
    seen = [empty, *(editing.apply("set_seed", seed=seed) for seed in (1, 2, 3))]
    assert [one.seed for one in seen] == [0, 1, 2, 3]
    assert [editing.undo() for _ in range(3)] == seen[2::-1]
    assert editing.undo_label is None
    assert [editing.redo() for _ in range(3)] == seen[1:]
    assert (editing.undo_label, editing.redo_label) == ("Change the seed", None)
    with pytest.raises(ConflictError, match="nothing to redo"):
        editing.redo()


def test_a_new_step_forgets_those_that_were_taken_back(
    workspace: Workspace, empty: Scenario
) -> None:
    editing = Editing(workspace, empty)
    editing.apply("set_seed", seed=1)
    editing.undo()
    with pytest.raises(ConflictError, match="nothing to undo"):
        editing.undo()
    editing.apply("rename", name="other")
    assert editing.redo_label is None
    assert [step.edits for step in editing.steps] == [({"kind": "rename", "name": "other"},)]


def test_the_edits_of_steps_make_the_same_of_the_first_document(
    workspace: Workspace, empty: Scenario
) -> None:
    editing = Editing(workspace, empty)
    editing.apply("set_simulation", duration=600)
    both = [{"kind": "set_seed", "seed": 4}, {"kind": "rename", "name": "busy"}]
    editing.apply_all(both)
    assert editing.undo_label == "Change the seed and 1 more"
    data = [read_edit(one) for step in editing.steps for one in step.edits]
    assert edited(empty, data, load_map(workspace.map(MAP))) == editing.scenario


def test_a_refused_edit_changes_nothing(workspace: Workspace, empty: Scenario) -> None:
    editing = Editing(workspace, empty)
    before = editing.scenario
    with pytest.raises(NotFoundError, match="no actor or flow named 'nobody'"):
        editing.apply("remove_actors", actors=["nobody"])
    with pytest.raises(ScenarioError, match="kind: 'set_sed' is none of"):
        editing.apply("set_sed", seed=1)
    with pytest.raises(NotFoundError, match="'nobody'"):
        editing.apply_all(
            [{"kind": "set_seed", "seed": 4}, {"kind": "remove_actors", "actors": ["nobody"]}]
        )
    with pytest.raises(InputError, match="no edits"):
        editing.apply_all([])
    assert editing.scenario == before
    assert editing.steps == ()


def test_every_kind_of_edit_tells_its_arguments() -> None:
    assert {"add_actor", "set_seed", "set_matrix"} <= Editing.kinds().keys()
    assert Editing.arguments("set_seed")["properties"].keys() == {"kind", "seed"}
    with pytest.raises(NotFoundError, match="add_acter"):
        Editing.arguments("add_acter")


def test_the_page_undoes_what_was_saved_in_python_and_the_other_way_round(
    workspace: Workspace, empty: Scenario
) -> None:
    drafts = Drafts(workspace)
    drafts.create(empty, "shared", stem="shared", label="New scenario")
    edit = read_edit({"kind": "set_seed", "seed": 1})
    drafts.change(
        "shared", 1, edit.label, lambda old: old.model_copy(update={"seed": 1}), edits=[edit]
    )

    file = workspace.scenarios / f"shared{SUFFIX}"
    editing = Editing(workspace, file)
    assert [step.edits for step in editing.steps] == [({"kind": "set_seed", "seed": 1},)]
    assert editing.undo() == empty
    editing.redo()
    editing.apply("set_seed", seed=2)
    assert editing.save() == file

    draft = drafts.get("shared")
    assert (draft.scenario.seed, draft.history.undo) == (2, "Change the seed")
    assert drafts.undo("shared", draft.history.version).scenario.seed == 1
    assert [step.label for step in Editing(workspace, file).steps] == ["Change the seed"]


def test_the_page_keeps_some_scenarios_in_memory_and_reads_the_others_again(
    workspace: Workspace, empty: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("odscen.web.drafts.MOST_OPEN", 2)
    drafts = Drafts(workspace)
    for name in ("a", "b"):
        drafts.create(empty, name, stem=name, label="New scenario")
    drafts.change("a", 1, "Change", lambda old: old.model_copy(update={"seed": 7}))
    kept = drafts.get("a").scenario
    drafts.create(empty, "c", stem="c", label="New scenario")
    assert drafts.get("a").scenario is kept  # b was looked at longest ago
    for name in ("b", "c"):
        drafts.get(name)
    again = drafts.get("a")
    assert again.scenario is not kept
    assert (again.scenario, again.history.version, again.history.undo) == (kept, 2, "Change")
    assert drafts.undo("a", 2).scenario == empty


def test_what_the_page_has_changed_meanwhile_is_not_overwritten(
    workspace: Workspace, empty: Scenario
) -> None:
    drafts = Drafts(workspace)
    drafts.create(empty, "both", stem="both", label="New scenario")
    file = workspace.scenarios / f"both{SUFFIX}"
    editing = Editing(workspace, file)
    editing.apply("set_seed", seed=2)
    drafts.change("both", 1, "Change", lambda old: old.model_copy(update={"seed": 1}))
    with pytest.raises(ConflictError, match="has been changed since it was opened"):
        editing.save()
    assert read_scenario(file).seed == 1
    with pytest.raises(ConflictError, match="is there already"):
        Editing(workspace, empty).save(file)


def test_a_scenario_elsewhere_is_saved_without_a_history(
    workspace: Workspace, empty: Scenario, tmp_path: Path
) -> None:
    editing = Editing(workspace, write_scenario(empty, tmp_path / "own.json"))
    with pytest.raises(InputError, match="no file yet"):
        Editing(workspace, empty).save()
    editing.apply("set_seed", seed=5)
    editing.save()
    assert read_scenario(tmp_path / "own.json").seed == 5
    assert [path.name for path in tmp_path.iterdir()] == ["own.json"]
    copied = editing.save(workspace.scenarios / f"copied{SUFFIX}")
    assert [step.label for step in Editing(workspace, copied).steps] == ["Change the seed"]


def test_a_file_that_another_program_has_changed_is_a_step_of_its_own(
    workspace: Workspace, empty: Scenario
) -> None:
    editing = Editing(workspace, empty)
    file = editing.save(workspace.scenarios / f"changed{SUFFIX}")
    write_scenario(empty.model_copy(update={"seed": 9}), file)
    again = Editing(workspace, file)
    assert again.undo_label == "Change by another program"
    assert again.undo() == empty


def test_an_edit_cut_off_between_history_and_document_can_be_done_again(
    workspace: Workspace, empty: Scenario
) -> None:
    """As a kill leaves it: the history has the step, or the one that was taken back."""
    path = workspace.scenarios / f"cut-off{SUFFIX}"
    editing = Editing(workspace, empty)
    editing.apply("set_seed", seed=1)
    editing.save(path)
    before = path.read_bytes()
    editing.apply("rename", name="other")
    editing.save()
    after = path.read_bytes()

    path.write_bytes(before)
    cut = Editing(workspace, path)
    assert (cut.undo_label, cut.redo_label) == ("Change the seed", "Rename to other")
    page = Drafts(workspace)
    draft = page.get("cut-off")
    assert (draft.history.undo, draft.history.redo) == ("Change the seed", "Rename to other")
    page.redo("cut-off", draft.history.version)
    assert path.read_bytes() == after

    page.undo("cut-off", page.get("cut-off").history.version)
    path.write_bytes(after)
    cut = Editing(workspace, path)
    assert (cut.undo_label, cut.redo_label) == ("Rename to other", None)


@pytest.mark.slow
def test_a_history_keeps_so_many_steps(tmp_path: Path) -> None:
    folder = HistoryFolder(tmp_path / "history")
    history = folder.begin("0", label="Open")
    for number in range(MOST_UNDONE + 5):
        history = folder.add(history, f"{number}", label=f"{number}", edits=[{"kind": "a"}])
    assert len(history.entries) == MOST_UNDONE + 1
    files = [path.name for path in (tmp_path / "history").iterdir()]
    assert len([name for name in files if name.endswith(".z")]) == MOST_UNDONE + 1
    assert folder.read() == history
    assert folder.edits(history.current) == ({"kind": "a"},)
    assert folder.document(history.current) == f"{MOST_UNDONE + 4}"


def test_an_index_without_edits_opens_as_one_of_earlier_versions_does(tmp_path: Path) -> None:
    folder = HistoryFolder(tmp_path)
    entry = NO_HISTORY.add("{}", label="Open").current
    folder.write_document(entry, "{}")
    index = (
        '{"version": 1,'
        ' "sha256": "44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a",'
        ' "entries": [{"label": "Open", "file": "00000001.json.z"}], "position": 0}'
    )
    (tmp_path / "index.json").write_text(index)
    history = folder.read()
    assert history is not None
    assert open_history(history, "{}") is history
    assert folder.edits(history.current) == ()


def test_a_history_of_others_names_no_file_outside_and_unpacks_to_no_more_than_a_document(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, precious = HistoryFolder(tmp_path / "history"), tmp_path / "precious"
    precious.write_text("of others", encoding="utf-8")
    history = folder.add(folder.begin("{}", label="Open"), '{"a": 1}', label="Edit")
    index = folder.folder / "index.json"
    index.write_text(index.read_text().replace(history.entries[1].file, "../precious"))
    assert folder.read() is None
    index.write_text(index.read_text().replace("../precious", str(precious)))
    assert folder.read() is None
    assert precious.read_text(encoding="utf-8") == "of others"
    packed = folder.folder / history.entries[0].file
    monkeypatch.setattr("odscen.app.editing._MOST_BYTES", 1000)
    for content in (zlib.compress(bytes(10_000)), b"no archive", b"", zlib.compress(b"\xff")):
        packed.write_bytes(content)
        with pytest.raises(InputError, match="this step of the history is damaged"):
            folder.document(history.entries[0])
