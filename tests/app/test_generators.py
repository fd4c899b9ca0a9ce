"""Generators of traffic: classes, installed packages and other programs, good ones and broken."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.app.generation import generate
from odscen.app.generators import GeneratorDoor, Placer, installed_generators, open_generator
from odscen.app.maps import load_map
from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError
from odscen.learning.fill import CheckedFill, Fill, FillRequest, fill_from_bytes
from odscen.maps.store import Workspace
from odscen.runs.recorded import trajectory_files
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.document.scenario_document import Actor
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.scenario.sampling.sampler import sample_scenario
from tests import own_generator
from tests.app.conftest import CROSSING

PROGRAM = """
import sys
import numpy as np

given = np.load(sys.argv[1])
rng = np.random.default_rng(given["seed"])
nodes = rng.permutation(np.flatnonzero(given["allowed"][0]))
apart = [node for k, node in enumerate(nodes) if not np.any(np.abs(nodes[:k] - node) < 6)]
nodes = np.array(apart[: given["wanted"][0]])
speed = 0.5 * given["node_speed_limit"][nodes]
np.savez(sys.argv[2], node=nodes, category=np.full(len(nodes), "car"), initial_speed=speed)
"""  # the twenty lines of docs/generators.md
SETTINGS = GenerationSettings(map_name=CROSSING, seed=4, count=2, fill=0.3)


class Every24Metres:
    """A class that is asked more than once."""

    def __init__(self) -> None:
        self.asked = 0

    def fill(self, _: object, request: FillRequest, rng: np.random.Generator) -> Fill:
        self.asked += 1
        nodes = np.flatnonzero(request.allowed[next(iter(request.allowed))])[::12]
        nodes = rng.permutation(nodes)[: request.vehicles]
        return Fill(node=nodes, category=np.full(len(nodes), "car"))


class Failing:
    def fill(self, *_: object) -> Fill:
        raise RuntimeError("no weights")


class WithoutFill:
    pass


def command(program: Path, *more: str) -> GeneratorDoor:
    return GeneratorDoor(
        command=" ".join([sys.executable, str(program), "{in}.npz {out}.npz", *more])
    )


@pytest.fixture
def program(tmp_path: Path) -> Callable[[str], Path]:
    def written(text: str) -> Path:
        path = tmp_path / "program.py"
        path.write_text(text, encoding="utf-8")
        return path

    return written


@pytest.mark.slow
def test_a_program_of_twenty_lines_fills_a_map_and_its_cars_start_as_fast_as_it_says(
    workspace: Workspace, tmp_path: Path, program: Callable[[str], Path]
) -> None:
    fills: dict[str, CheckedFill] = {}
    paths = generate(
        workspace,
        settings=SETTINGS,
        out=tmp_path / "out",
        generator=command(program(PROGRAM)),
        filled=fills.__setitem__,
    )
    assert [len(one.remarks) / one.given < 0.5 for one in fills.values()] == [True, True]
    scenario = read_scenario(paths[0])
    assert len(scenario.actors) >= 3
    asked = {actor.id: actor.initial_speed for actor in scenario.actors}
    assert all(asked.values())
    run = carry_out(checked := check_run(workspace, scenario, name="filled"), prepare_run(checked))
    assert run.summary["actors"]["inserted"] == len(scenario.actors)
    rows = pl.scan_parquet(trajectory_files(run.folder)).filter(pl.col("timestep_time") == 0.0)
    first = dict(rows.select("vehicle_id", "vehicle_speed").collect().iter_rows())
    assert first == pytest.approx(asked, abs=0.1)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_by_any_door(
    workspace: Workspace, tmp_path: Path, program: Callable[[str], Path]
) -> None:
    for name, door in (
        ("class", GeneratorDoor(name=f"{__name__}:Every24Metres")),
        ("command", command(program(PROGRAM))),
    ):
        once = generate(workspace, settings=SETTINGS, out=tmp_path / name / "1", generator=door)
        again = generate(workspace, settings=SETTINGS, out=tmp_path / name / "2", generator=door)
        assert [one.read_bytes() for one in once] == [one.read_bytes() for one in again]
        assert once[0].read_bytes() != once[1].read_bytes()


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "site"
    folder.mkdir()
    own_generator.install(folder, monkeypatch)


@pytest.mark.usefixtures("installed")
def test_installed_generators_are_listed_with_their_options_and_what_fails() -> None:
    reference, gone, spread = installed_generators()
    assert (reference.name, reference.options, reference.error) == ("reference", (), "")
    assert reference.summary
    assert gone.name == "gone"
    assert "it cannot be imported from my_traffic:Gone" in gone.error
    assert spread.summary == "Places cars a number of nodes apart."
    assert [(one.name, one.kind, one.usual) for one in spread.options] == [
        ("apart", "integer", 12), ("category", "string", "car"), ("moving", "boolean", False),
    ]  # fmt: skip


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_options_reach_the_generator(workspace: Workspace, tmp_path: Path) -> None:
    def actors(**options: bool | float | str) -> list[Actor]:
        door = GeneratorDoor(name="spread", options=options)
        (path, _) = generate(workspace, settings=SETTINGS, out=tmp_path / "out", generator=door)
        return [*read_scenario(path).actors]

    few, many = actors(apart=60, category="truck"), actors(apart=12, moving=True)
    assert {one.category for one in few} == {"truck"}
    assert len(many) > 2 * len(few)
    assert all(one.initial_speed for one in many)


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("door", "said"),
    [
        (GeneratorDoor(name="spread", options={"apart": 1}), "spread: option 'apart' is 1, not w"),
        (GeneratorDoor(name="reference", options={"a": 1}), "reference: it has no option 'a'"),
        (GeneratorDoor(command="a {in} {out}", options={"a": 1}), "go into its command"),
    ],
)
def test_options_that_cannot_be_are_refused(door: GeneratorDoor, said: str) -> None:
    with pytest.raises(InputError) as refused:
        open_generator(door)
    assert said in str(refused.value)


def test_one_object_fills_all_scenarios(workspace: Workspace) -> None:
    loaded = load_map(workspace.map(CROSSING))
    made = Every24Metres()
    placer = Placer(made)
    assert placer.checked is None
    for seed in (1, 2):
        sample_scenario(
            loaded.sumo.graph, SamplingConfig(), seed=seed, name="s", usable=loaded.usable,
            place=placer.for_scenario(loaded.usable.bodies, seed),
        )  # fmt: skip
    assert made.asked == 2
    assert placer.checked is not None


@pytest.mark.parametrize(
    ("door", "said"),
    [
        (GeneratorDoor(name="nowhere"), "there is no generator 'nowhere'"),
        (GeneratorDoor(name="nowhere.at:All"), "nowhere.at:All: it cannot be imported"),
        (GeneratorDoor(name=f"{__name__}:Nothing"), "it cannot be imported"),
        (GeneratorDoor(name=f"{__name__}:WithoutFill"), "it has no method `fill"),
        (GeneratorDoor(command="program {in}.npz"), "does not say where {out} goes"),
        (GeneratorDoor(command="program {in} {out} {more}"), "is no command with {in} and {out}"),
        (GeneratorDoor(command="program '{in} {out}"), "is no command with {in} and {out}"),
        (GeneratorDoor(name="a", command="b {in} {out}"), "by its name or as a command, not both"),
    ],
)
def test_a_door_that_leads_nowhere_is_refused(door: GeneratorDoor, said: str) -> None:
    with pytest.raises(InputError) as refused:
        open_generator(door)
    assert said in str(refused.value)


def refusal(workspace: Workspace, out: Path, door: GeneratorDoor) -> str:
    with pytest.raises(InputError) as refused:
        generate(workspace, settings=SETTINGS, out=out, generator=door)
    assert not out.exists()
    return str(refused.value)


def test_an_error_of_a_class_ends_in_a_message(workspace: Workspace, tmp_path: Path) -> None:
    said = refusal(workspace, tmp_path / "out", GeneratorDoor(name=f"{__name__}:Failing"))
    assert said == f"{__name__}:Failing: it failed: RuntimeError('no weights')"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import sys; sys.exit('no GPU')", "it ended with exit code 1: no GPU"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "exit code -9"),
        ("", "written no file where {out}.npz says"),
        ("import sys; open(sys.argv[2], 'w').write('nodes')", "cannot be read as an .npz file"),
        (
            "import sys, numpy as np; np.savez(sys.argv[2], node=[1.5], category=['car'])",
            "node: 1.5 of road user 0 is no whole number",
        ),
        ("import time; time.sleep(60)", "it took more than 2 s"),
    ],
)
def test_a_program_that_fails_ends_in_a_message_and_nothing_is_written(
    workspace: Workspace,
    tmp_path: Path,
    program: Callable[[str], Path],
    text: str,
    said: str,
) -> None:
    door = command(program(text))._replace(time_limit=2.0)
    assert said in refusal(workspace, tmp_path / "out", door)


def test_a_program_that_is_not_there_is_named(workspace: Workspace, tmp_path: Path) -> None:
    door = GeneratorDoor(command="no-such-program {in}.npz {out}.npz")
    assert refusal(workspace, tmp_path / "out", door) == (
        "no-such-program: there is no such program"
    )


def broken(rng: np.random.Generator) -> bytes:
    """Bytes of a fill with one thing wrong."""
    count = int(rng.integers(1, 20))
    arrays: dict[str, object] = {
        "node": rng.integers(0, 400, count), "category": rng.choice(["car", "bus"], count),
        "initial_speed": rng.uniform(0, 15, count), "goal": rng.integers(0, 400, count),
    }  # fmt: skip
    wrong = int(rng.integers(0, 9))
    name = str(rng.choice(["node", "category", "initial_speed", "goal"]))
    if wrong == 0:
        arrays["initial_speed"] = np.full(count, np.nan)
    elif wrong == 1:
        arrays["node"] = rng.integers(-(10**12), 10**12, count)
    elif wrong == 2:
        arrays["node"] = np.full(count, rng.integers(0, 400))
    elif wrong == 3:
        del arrays[name]
    elif wrong == 4:
        arrays[name] = np.array([None] * count, dtype=object)
    elif wrong == 5:
        arrays[name] = rng.uniform(-1e30, 1e30, (count, 2))
    elif wrong == 6:
        arrays[name] = rng.uniform(-1e300, 1e300, count)
    buffer = BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    data = buffer.getvalue()
    if wrong == 7:
        data = data[: int(rng.integers(0, len(data)))]
    if wrong == 8:
        with zipfile.ZipFile(buffer := BytesIO(), "w") as archive:
            archive.writestr("node.npy", rng.bytes(80))
        data = buffer.getvalue()
    return data


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_of_a_hundred_broken_fills_each_is_repaired_or_refused_with_a_reason(
    workspace: Workspace, seed: int
) -> None:
    class Given:
        def fill(self, *_: object) -> Fill:
            return fill_from_bytes(broken(np.random.default_rng(seed)), file="fill")

    loaded = load_map(workspace.map(CROSSING))
    placer = Placer(Given())
    try:
        scenario = sample_scenario(
            loaded.sumo.graph, SamplingConfig(), seed=0, name="s", usable=loaded.usable,
            roi=loaded.sumo.graph.segments.ids,
            place=placer.for_scenario(loaded.usable.bodies, 0),
        )  # fmt: skip
    except InputError as refused:
        said = refused.problem
        assert any(
            part in said
            for part in (
                "is missing",
                "it has",
                "malformed",
                "no whole",
                "be read",
                "can be placed",
            )
        )
        return
    assert placer.checked is not None
    dropped = [one for one in placer.checked.remarks if one.what == "dropped"]
    assert len(scenario.actors) == placer.checked.given - len(dropped)
    assert all(one.why for one in placer.checked.remarks)
