from __future__ import annotations

import json
from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.regression.baseline import read_baseline

HEAD = {"format": "odscen-baseline", "version": 1, "fingerprint": {}, "seeds": [1]}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (json.dumps({**HEAD, "rows": [{"light": "1", "values": [1]}]}), "light, values"),
        ("[" * 100_000, "too many brackets"),
        (json.dumps({**HEAD, "rows": [{"figure": "a", "values": [10**399]}]}), "not a baseline"),
        (json.dumps({**HEAD, "rows": [[]]}), "not a baseline"),
        (json.dumps({**HEAD, "rows": [{"segment": [], "delay": [1]}]}), "not a baseline"),
        ('{"format": ' + "9" * 5000 + "}", "not a baseline"),
        ("null", "not a baseline"),
    ],
)
def test_a_damaged_baseline_is_an_error_that_names_the_file(
    tmp_path: Path, text: str, words: str
) -> None:
    file = tmp_path / "town.json"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as error:
        read_baseline(file)
    assert error.value.file == str(file)
