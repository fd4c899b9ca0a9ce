from __future__ import annotations

import subprocess
import sys

import pytest

from odscen.base.errors import OpenDriveError
from odscen.opendrive.parse import parse

STARVED = """
import resource
from pathlib import Path
from odscen.base.errors import LimitError
from odscen.opendrive.parse import parse

data = b"<OpenDRIVE>" + b"<road a='b'><x/></road>" * 500_000 + b"</OpenDRIVE>"
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 20 * 2**20,) * 2)
try:
    parse(data)
except LimitError as error:
    print(error.exit_code, error)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited by RLIMIT_AS")
def test_too_little_memory_is_said_and_not_blamed_on_the_file() -> None:
    command = [sys.executable, "-c", STARVED]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout == (
        "3 there is not enough memory to read XML of 11500023 bytes; free some and retry\n"
    )


@pytest.mark.parametrize("text", ["<OpenDRIVE>", "nothing", "", b"\xff\xfe<"])
def test_messages_on_xml_name_the_line_and_no_file_that_is_none(text: str | bytes) -> None:
    with pytest.raises(OpenDriveError, match=r"not well-formed XML: .+") as caught:
        parse(text)
    assert "<string>" not in str(caught.value)
