"""The picture under a map: set, shown, drawn, kept with a removed map, and taken away."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path

import pytest
from PIL import Image
from starlette.testclient import TestClient
from typer.testing import CliRunner

from odscen.app.doctor import examine
from odscen.cli.commands import command_line
from odscen.maps.background import PicturePoint
from odscen.maps.store import Workspace
from odscen.maps.wastebasket import Wastebasket

URL = "/api/maps/signal_crossing/background"


def picture() -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (200, 100), (255, 0, 255)).save(out, "PNG")
    return out.getvalue()


def test_a_picture_is_laid_under_a_map_shown_and_taken_away(client: TestClient) -> None:
    assert client.get(URL).json() is None
    assert client.get(f"{URL}/picture").status_code == 404
    files = {"file": ("../p.png", picture()), "world": ("p.pgw", b"1 0 0 -1 -99.5 49.5")}
    set_ = client.post(URL, files=files)
    assert set_.status_code == 200, set_.text
    info = client.get(URL).json()
    assert info == set_.json()
    assert (info["source"], info["width"], info["height"]) == ("../p.png", 200, 100)
    assert info["affine"] == [1, 0, -100, 0, -1, 50]
    shown = client.get(f"{URL}/picture")
    assert (shown.content, shown.headers["content-type"]) == (picture(), "image/png")
    points = json.dumps([[0, 0, -50, 25], [200, 0, 50, 25]])
    placed = client.post(URL, files={"file": ("q.png", picture())}, data={"points": points}).json()
    assert placed["affine"] == pytest.approx([0.5, 0, -50, 0, -0.5, 25])
    assert client.delete(URL).status_code == 204
    assert client.get(URL).json() is None


@pytest.mark.parametrize(
    ("files", "data", "problem"),
    [
        ({"file": ("p.png", b"no picture")}, {}, "PNG, JPEG or TIFF"),
        ({"file": ("p.png", picture())}, {"points": "[[1]]"}, "rows of column, row, x and y"),
        ({"file": ("p.png", picture())}, {"points": "[" * 100_000}, "rows of column"),
        ({"file": ("p.png", picture())}, {"points": f"[[{'9' * 400}, 0, 0, 0]]"}, "rows of column"),
        ({"file": ("p.png", picture()), "world": ("w", b"\xff")}, {}, "six numbers"),
    ],
)
def test_a_wrong_picture_is_refused_and_the_one_before_stays(
    client: TestClient, files: dict[str, tuple[str, bytes]], data: dict[str, str], problem: str
) -> None:
    kept = {"file": ("p.png", picture()), "world": ("p.pgw", b"1 0 0 -1 -99.5 49.5")}
    assert client.post(URL, files=kept).status_code == 200
    refused = client.post(URL, files=files, data=data)
    assert refused.status_code == 422, refused.text
    assert problem in refused.text
    assert client.get(URL).json()["source"] == "p.png"


def test_a_removed_map_takes_its_picture_along_and_brings_it_back(workspace: Workspace) -> None:
    points = [PicturePoint(0, 0, -50, 25), PicturePoint(200, 0, 50, 25)]
    workspace.set_background("signal_crossing", picture(), points=points)
    basket = Wastebasket(workspace)
    item = basket.put("map", "signal_crossing")
    assert [found.name for found in basket.items()] == ["signal_crossing"]
    assert not list((workspace.root / "maps" / ".backgrounds").iterdir())
    basket.restore(item.id)
    found = workspace.background("signal_crossing")
    assert found is not None
    assert found.path.read_bytes() == picture()


@pytest.mark.parametrize("file", ["background.json", "picture.png", "SHA256SUMS"])
def test_a_changed_byte_of_a_picture_is_noticed(
    client: TestClient, workspace: Workspace, file: str
) -> None:
    points = [PicturePoint(0, 0, -50, 25), PicturePoint(200, 0, 50, 25)]
    path = workspace.set_background("signal_crossing", picture(), points=points).path.parent / file
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    refused = client.get(f"{URL}/picture")
    assert 400 <= refused.status_code < 500
    assert file in refused.text
    assert [(step.what, step.harm) for step in examine(workspace)] == [("background", True)]
    assert client.delete(URL).status_code == 204


@pytest.mark.slow
def test_a_mended_copy_has_the_picture_too(workspace: Workspace) -> None:
    points = [PicturePoint(0, 0, -50, 25), PicturePoint(200, 0, 50, 25)]
    before = workspace.set_background("signal_crossing", picture(), points=points)
    workspace.mend_map("signal_crossing", [], out="copy")
    found = workspace.background("copy")
    assert found is not None
    assert (found.affine, found.path.read_bytes()) == (before.affine, picture())
    assert found.path != before.path


def test_a_drawing_of_the_map_has_the_picture_at_its_place(
    workspace: Workspace, tmp_path: Path
) -> None:
    (tmp_path / "plan.png").write_bytes(picture())
    (tmp_path / "plan.pgw").write_text("1 0 0 -1 -99.5 49.5")
    root = ["--workspace", str(workspace.root)]

    def command(*words: str) -> str:
        given = ["maps", *words, *root]
        done = CliRunner().invoke(command_line(given), given)
        assert done.exit_code == 0, done.output
        return done.stdout

    told = json.loads(
        command("background", "signal_crossing", str(tmp_path / "plan.png"), "--json")
    )
    assert told["background"]["bounds"] == [-100, -50, 100, 50]
    out = tmp_path / "map.svg"
    command("render", "signal_crossing", "-o", str(out), "--picture")
    svg = out.read_text()
    assert 'transform="matrix(100 -0 0 100 -10000 -5000)"' in svg
    assert base64.b64encode(picture()).decode() in svg
    command("background", "signal_crossing", "--remove")
    assert workspace.background("signal_crossing") is None
