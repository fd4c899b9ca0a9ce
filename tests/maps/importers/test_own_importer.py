"""Maps of another format, by the importer of CONTRIBUTING.md from outside these sources."""

from __future__ import annotations

import doctest
import gzip
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import odscen
from odscen.app.doctor import examine
from odscen.base.errors import InputError, LimitError, OpenDriveError
from odscen.convert.model.conversion_report import ConversionReport, ElementOutcome, ReportEntry
from odscen.maps.allowances import BuildLimits
from odscen.maps.importers import base
from odscen.maps.importers.base import ImportSettings
from odscen.maps.importers.registry import importer_for, map_importers
from odscen.maps.store import Workspace, is_outdated
from tests import own_importer
from tests.own_importer import PLACE

HEAD = "from odscen import ImportedMap, InputError, MapImporter\n"
BAD = HEAD + (
    "class RoadImporter(MapImporter):\n"
    "    name, label, suffixes, version = 'road', 'roads', ('.road',), '1'\n"
    "    def to_opendrive(self, content, options):\n"
    "        {}\n"
)


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "site"
    folder.mkdir()
    own_importer.install(folder, monkeypatch)
    yield folder
    own_importer.forget()


@pytest.fixture
def store(tmp_path: Path) -> Workspace:
    return Workspace.open(tmp_path / "workspace")


@pytest.fixture
def place(tmp_path: Path) -> Path:
    file = tmp_path / "place.road"
    file.write_bytes(PLACE)
    return file


def test_the_example_of_the_seam_runs() -> None:
    names = {"ReportEntry": ReportEntry, "ElementOutcome": ElementOutcome}
    failed, tried = doctest.testmod(base, extraglobs=names)
    assert (failed, tried) == (0, 3)


@pytest.mark.slow
def test_the_file_is_added_and_its_original_kept_with_its_checksum(
    store: Workspace, place: Path
) -> None:
    entry = store.add_map(place)
    assert entry.name == "place"
    assert entry.info["source"] == "place.road"
    assert entry.read("original") == PLACE
    assert entry.path("original").name == "original.road"
    assert entry.read("xodr").startswith(b"<OpenDRIVE>")
    assert entry.info["statistics"]["speed_limit_max"] == pytest.approx(30 / 3.6, abs=0.001)
    assert entry.info["import"]["options"] == {"lane_width": 3.5}
    assert len(entry.graph().lanes.s) > 200
    entry.path("original").write_bytes(PLACE + b"1 1\n")
    assert [one.file for one in store.map("place").damaged()] == ["original.road"]


@pytest.mark.slow
def test_its_rows_come_first_in_the_import_report(store: Workspace, place: Path) -> None:
    report = store.add_map(place).info["report"]
    assert report["entries"][0] == {
        "fate": "guessed",
        "element": "road 1",
        "reason": "straight for 40.0 m, as nothing is said of curves",
        "confidence": 0.5,
        "source_id": "line 3",
    }
    assert report["counts"]["guessed"] == 7
    assert ConversionReport.from_dict(report).to_dict() == report


@pytest.mark.slow
def test_a_map_is_kept_until_file_options_or_importer_change(
    store: Workspace, place: Path, installed: Path
) -> None:
    first = store.add_map(place)
    assert store.add_map(place) == first
    wide = store.add_map(place, importing=ImportSettings(options={"lane_width": 4.0}))
    assert wide.sha256 != first.sha256
    assert store.add_map(place) == wide, "options that are not given stay"
    own_importer.forget()
    newer = own_importer.shown_code().replace('(".road",), "1"', '(".road",), "2"')
    (installed / "my_maps.py").write_text(newer)
    assert is_outdated(store.stored("place"))
    rebuilt = store.map("place")
    assert rebuilt.info["import"]["version"] == "2"
    assert rebuilt.sha256 == wide.sha256


@pytest.mark.slow
def test_a_map_whose_importer_is_gone_is_used_as_it_is(
    store: Workspace, place: Path, installed: Path
) -> None:
    entry = store.add_map(place)
    (installed / "my_maps-1.0.dist-info" / "entry_points.txt").write_text("")
    own_importer.forget()
    assert not is_outdated(entry)
    assert store.map("place") == entry
    with pytest.raises(InputError, match=r"^place\.road: no importer 'road' is installed"):
        store.add_map(place, importing=ImportSettings(options={"lane_width": 3.0}))


@pytest.mark.slow
def test_a_network_that_is_brought_in_keeps_the_import(store: Workspace, place: Path) -> None:
    entry = store.add_map(place)
    changed = store.set_network("place", entry.path("net"))
    assert changed.converter == "file"
    assert changed.read("original") == PLACE
    assert changed.sha256 == entry.sha256


@pytest.mark.slow
def test_a_damaged_map_is_built_again_from_the_original(store: Workspace, place: Path) -> None:
    entry = store.add_map(place, importing=ImportSettings(options={"lane_width": 4.0}))
    entry.path("xodr").write_text("<OpenDRIVE/>")
    steps = [step for step in examine(store, repair=True) if step.what == "map"]
    assert [(step.action, "built from original.road" in step.words) for step in steps] == [
        ("rebuilt", True)
    ]
    assert store.map("place") == entry


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"lanes 2\n0 0\n80,5\n", r"^place\.road: line 3: '80,5' is neither"),
        (b"0 0\n", r"^place\.road: road 1: importer 'road' made OpenDRIVE that cannot be used: "),
    ],
)
def test_what_the_importer_refuses_names_file_and_line(
    store: Workspace, place: Path, content: bytes, words: str
) -> None:
    place.write_bytes(content)
    with pytest.raises(InputError, match=words):
        store.add_map(place)
    assert store.map_names() == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "error", "words"),
    [
        ("return 1 / 0", InputError, r"importer 'road' failed: ZeroDivisionError"),
        ("return None", InputError, r"importer 'road' failed: TypeError"),
        ("return ImportedMap('<a', ())", OpenDriveError, r"importer 'road' made OpenDRIVE that"),
        ("return ImportedMap(b'x' * 10**10, ())", LimitError, r"more than .* GB of memory"),
        ("exec('while True: pass')", LimitError, r"building the map (needs more than|did not)"),
    ],
    ids=["raises", "returns nothing", "no XML", "memory", "time"],
)
def test_what_goes_wrong_in_the_importer_ends_with_a_message(
    store: Workspace, place: Path, installed: Path, body: str, error: type[Exception], words: str
) -> None:
    (installed / "my_maps.py").write_text(BAD.format(body))
    limits = BuildLimits(minutes=0.02 if "while" in body else None)
    with pytest.raises(error, match=words):
        store.add_map(place, limits=limits)
    assert store.map_names() == []


@pytest.mark.slow
def test_options_that_it_does_not_have_are_refused(store: Workspace, place: Path) -> None:
    for options, words in (
        ({"width": 3.0}, "importer road: it has no option 'width'; there are lane_width"),
        ({"lane_width": 1.0}, "option 'lane_width' is 1, not within 2.."),
    ):
        with pytest.raises(InputError, match=words):
            store.add_map(place, importing=ImportSettings(options=options))


def test_a_package_that_cannot_be_imported_hides_no_other(installed: Path) -> None:
    (installed / "my_maps.py").write_text("import nowhere")
    own_importer.forget()
    importers = map_importers()
    assert "road" not in importers.usable
    assert importers.broken == {"road": "No module named 'nowhere'"}
    with pytest.raises(InputError, match=r"seems to be text: .*'road' cannot be used: No module"):
        importer_for(PLACE, "place.road")


def test_opendrive_is_an_entry_of_the_list_and_is_asked_first() -> None:
    names = list(map_importers().usable)
    assert (names[0], names[-1]) == ("opendrive", "road")
    assert importer_for(b"<OpenDRIVE/>", "town.xml").name == "opendrive"
    assert importer_for(b"<OpenDRIVE/>", "town.road").name == "opendrive"
    assert importer_for(b"anything", "town.XODR").name == "opendrive"
    assert importer_for(PLACE, "PLACE.ROAD").name == "road"


@pytest.mark.slow
def test_a_file_that_no_importer_takes_says_what_it_seems_to_be(
    store: Workspace, tmp_path: Path
) -> None:
    (tmp_path / "town.kml").write_text("<kml/>")
    with pytest.raises(InputError, match=r"^town\.kml: no importer takes this file; it seems"):
        store.add_map(tmp_path / "town.kml")


@pytest.mark.slow
def test_packed_opendrive_is_refused_with_what_to_do(store: Workspace, tmp_path: Path) -> None:
    (tmp_path / "town.xodr").write_bytes(gzip.compress(b"<OpenDRIVE/>"))
    with pytest.raises(OpenDriveError, match=r"^town\.xodr: this is a gzip archive: unpack it"):
        store.add_map(tmp_path / "town.xodr")


@pytest.mark.slow
def test_the_command_line_takes_it(place: Path, tmp_path: Path) -> None:
    def odscen_maps(*words: str) -> dict[str, object]:
        command = [sys.executable, "-m", "odscen", "maps", *words, "--json"]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        found: dict[str, object] = json.loads(done.stdout)
        return found

    root = str(tmp_path / "other")
    added = odscen_maps("add", str(place), "--option", "lane_width=3", "--workspace", root)
    assert added["maps"][0]["name"] == "place"  # type: ignore[index]
    shown = odscen_maps("show", "place", "--workspace", root)
    assert shown["import"]["options"] == {"lane_width": 3.0}  # type: ignore[index]
    listed = odscen_maps("importers")
    names = [row["name"] for row in listed["importers"]]  # type: ignore[attr-defined]
    assert (names[0], names[-1]) == ("opendrive", "road")


@pytest.mark.slow
def test_a_scenario_is_made_on_it(store: Workspace, place: Path) -> None:
    store.add_map(place)
    settings = odscen.GenerationSettings(map_name="place", seed=1, fill=0.2)
    (path,) = odscen.generate(store, settings=settings)
    assert not odscen.check(store, odscen.read_scenario(path))
