from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from odscen.runs.reporter import Progress
from odscen.sumo.worker.protocol import Done, Failed, Message, decode, encode

NUMBERS = st.floats(0, 1e6)
COUNTS = st.integers(0, 10**6)
MESSAGES: st.SearchStrategy[Message] = st.one_of(
    st.builds(Progress, NUMBERS, NUMBERS, COUNTS, COUNTS, COUNTS, COUNTS),
    st.builds(Done, NUMBERS, COUNTS, NUMBERS),
    st.builds(Failed, st.text()),
)


@given(MESSAGES)
def test_a_message_survives_the_pipe_as_one_line(message: Message) -> None:
    line = encode(message)
    assert line.endswith("\n")
    assert line.count("\n") == 1
    assert decode(line) == message


@given(st.one_of(st.text(), st.just("[]"), st.just('{"kind": "done"}'), st.just("3")))
def test_a_line_that_is_no_message_is_ignored(line: str) -> None:
    assert decode(line) is None


def test_the_share_done_is_that_of_time_or_of_arrivals_whichever_is_further() -> None:
    assert Progress(50, 100, 1, 4, 3, 4).share == 0.75
    assert Progress(90, 100, 1, 4, 3, 4).share == 0.9
    assert Progress(50, 100, 0, 0, 0, 0).share == 0.5
