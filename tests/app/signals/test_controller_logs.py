"""Event logs of signal controllers: read, played back by a light, and measured."""

from __future__ import annotations

import os
import subprocess
from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.app.running.runs import run
from odscen.app.signals.controller_logs import controller_measures, play_controller_log
from odscen.base.errors import InputError, NotFoundError
from odscen.formats.controller_log import read_controller_log, read_log_detectors
from odscen.maps.store import Workspace
from odscen.runs.recorded import read_light_states
from odscen.scenario.document.scenario_document import MapReference
from tests.signal_case import JUNCTION, MAP, scenario

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

ATSPM = os.environ.get("ODSCEN_TEST_ATSPM", "")
"""Python of an environment with atspm 2.6 and duckdb before 1.4: two hours of a real controller."""
START = datetime(2024, 4, 15, 12)
PHASES = {
    "2": ("r1", "r3 straight", "r3 right"), "5": ("r3 left",), "8": ("r2", "r4"),
    "P2": ("walk r2", "walk r4"),
}  # fmt: skip
GREENS = {"2": (0.0, 20.3), "5": (25.0, 32.0), "8": (36.4, 50.1)}
"""Seconds of a cycle of 57.3 s."""
CYCLE = 57.3
DETECTORS = b"""DeviceId,Phase,Parameter,Function
7,2,11,Advance
7,2,12,Presence
7,8,13,Presence
"""


def made_log(seconds: float) -> str:
    """What a controller logs in greens of broken tenths, with detectors and a push button."""
    rows: list[tuple[float, int, int]] = []
    for number in range(round(seconds / CYCLE)):
        for phase, (green, yellow) in GREENS.items():
            at = number * CYCLE
            codes = ((green, 0), (green, 1), (yellow, 7), (yellow, 8), (yellow + 3.6, 9))
            rows += [(at + second, code, int(phase)) for second, code in codes]
            rows += [(at + yellow + 3.6, 10, int(phase))]
        rows += [(number * CYCLE + s, code, 2) for s, code in ((0.0, 21), (7.0, 22), (15.0, 23))]
    # Four vehicles arrive in the second cycle: two in green, one in yellow, one in red.
    for second in (5.0, 20.3, 15.0, 40.0):
        rows += [(CYCLE + second - 0.001, 82, 11), (CYCLE + second + 0.3, 81, 11)]
    # At the stop line the detector of phase 8 is occupied for all the green and 4 s of red.
    rows += [(CYCLE + 30.0, 82, 13), (CYCLE + 57.6, 81, 13), (10.0, 82, 12), (11.0, 81, 12)]
    rows += [(1.0, 82, 13), (2.0, 81, 13), (CYCLE + 10.0, 90, 2), (CYCLE + 12.0, 90, 2)]
    lines = ["TimeStamp,DeviceId,EventId,Parameter"]
    for second, code, parameter in sorted(rows):
        stamp = START + timedelta(seconds=second)
        lines.append(f"{stamp:%Y-%m-%d %H:%M:%S.%f},7,{code},{parameter}")
    return "\n".join(lines)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    space = Workspace.open(tmp_path_factory.mktemp("logs"))
    space.add_map(MAP)
    return space


def on_map(store: Workspace, *, until: float, clock: float = 0.0) -> Scenario:
    one = scenario(None, until=until, walkers=0.0, vehicles=60.0, clock=clock)
    sha256 = store.map(MAP.stem).sha256
    return one.model_copy(update={"map": MapReference(name=MAP.stem, sha256=sha256)})


def greens_shown(folder: Path, link: int, until: float) -> list[tuple[float, float]]:
    """Begin and end of each green that a run has shown to a movement."""
    states = read_light_states(folder)
    assert states is not None
    found: list[tuple[float, float]] = []
    begun = None
    for time, state in zip([*states["time"], until], [*states["state"], ""], strict=True):
        green = state[link : link + 1] in tuple("Gg")
        if green and begun is None:
            begun = time
        elif not green and begun is not None:
            found.append((begun, time))
            begun = None
    return found


@pytest.mark.slow
def test_a_light_is_green_when_the_log_says(store: Workspace, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(made_log(600.0))
    played, notes = play_controller_log(
        store, on_map(store, until=550.0), tmp_path / "log.csv", junction=JUNCTION, phases=PHASES
    )
    assert notes == ("no phase is named for walk r1 and walk r3: red all the time",)
    done = run(store, played, out=tmp_path / "run")
    for link, phase in ((3, "2"), (12, "2"), (14, "5"), (6, "8"), (21, "P2")):
        begin, end = {**GREENS, "P2": (0.0, 7.0)}[phase]
        wanted = [(n * CYCLE + begin, n * CYCLE + end) for n in range(20)]
        wanted = [(a, min(b, 550.0)) for a, b in wanted if a < 550.0]
        shown = greens_shown(done.folder, link, 550.0)
        assert len(shown) == len(wanted)
        for (a, b), (c, d) in zip(shown, wanted, strict=True):
            assert abs(a - c) <= 0.5
            assert abs(b - d) <= 0.5


@pytest.mark.slow
def test_a_run_begins_in_the_log_where_one_says(store: Workspace, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(made_log(600.0))

    def played(**more: str) -> str:
        found, _ = play_controller_log(
            store, on_map(store, until=100.0, clock=12 * 3600.0 + 30), tmp_path / "log.csv",
            junction=JUNCTION, phases=PHASES, **more,
        )  # fmt: skip
        assert found.sumo is not None
        return found.sumo.files[0].text

    # By the clock it is 12:00:30, when phase 5 has green for two seconds more.
    assert '<phase duration="2.000" state="rrrrrrrrrrrrrrGrr' in played()
    assert '<phase duration="7.000" state="' in played(begin="2024-04-15 12:00:00")
    with pytest.raises(InputError, match="the run would begin at 2024-04-15 09:00:00"):
        played(begin="9:00")


def test_measures_of_a_log(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(made_log(600.0))
    (tmp_path / "detectors.csv").write_bytes(DETECTORS)
    found = controller_measures(tmp_path / "log.csv", tmp_path / "detectors.csv")
    assert found["arrivals"].select("light", "in_cycle").rows() == [
        ("green", 4.999), ("green", 14.999), ("green", 20.299), ("red", 39.999),
    ]  # fmt: skip
    assert found["arrivals_on_green"]["on_green"].to_list() == [0.75]
    splits = found["split_failures"].select("phase", "cycles", "failures").rows()
    assert splits == [(2, 9, 0), (8, 10, 0)]
    waits = found["pedestrian_delays"].select("phase", "waits", "delay").rows()
    assert waits == [(2, 1, pytest.approx(CYCLE - 10.0, abs=0.001))]
    # A second more of occupied red, and the split has failed.
    text = (tmp_path / "log.csv").read_text()
    late = (START + timedelta(seconds=CYCLE + 57.6)).strftime("%H:%M:%S.%f")
    later = (START + timedelta(seconds=CYCLE + 58.0)).strftime("%H:%M:%S.%f")
    (tmp_path / "log.csv").write_text(text.replace(late, later))
    found = controller_measures(tmp_path / "log.csv", tmp_path / "detectors.csv")
    assert found["split_failures"]["failures"].to_list() == [0, 1]


HEAD = b"TimeStamp,DeviceId,EventId,Parameter\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (HEAD, "the log has no events"),
        (b"TimeStamp,DeviceId,EventId\n2024-04-15 12:00:00,7,1\n", "no column for parameter"),
        (HEAD + b"noon,7,1,2\n", "row 1: 'noon' is no time such as"),
        (HEAD + b"2024-04-15 12:00:00,7,green,2\n", "row 1: event is no whole number .* 'green'"),
        (HEAD + b"2024-04-15 12:00:00,7,1.5,2\n", "event is no whole number .* '1.5'"),
        (HEAD + b"2024-04-15 12:00:00,7,1,-2\n", "parameter is no whole number .* '-2'"),
        (HEAD + b"2024-04-15 12:00:00,7,1\n2024-04-15,7,1,2,3,4\n", "no table|no time|no whole"),
        (b"PK\x03\x04xx", "this is an Excel file; save the log as CSV"),
        (b"<additional><tlLogic/></additional>", "this is XML; programs of SUMO"),
        (b"PAR1 broken", "no table that can be read"),
    ],
)
def test_wrong_logs_are_refused_in_clear_words(content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_controller_log(content)


@pytest.mark.parametrize(
    ("phases", "more", "words"),
    [
        ({"2": ("r1",)}, {}, "no phase shows green to r2>r1"),
        ({**PHASES, "6": ("r9",)}, {}, "phase 6: the light has no movement 'r9'"),
        ({**PHASES, "X": ("r1",)}, {}, "'X' is no phase such as 2, P2"),
        ({**PHASES, "4": ("r1",)}, {}, "the log has no green of phase 4"),
        (PHASES, {"device": "8"}, "8"),
        (PHASES, {"junction": "99"}, "99"),
        (PHASES, {"begin": "soon"}, "'soon' is no time such as 12:30"),
        (PHASES, {"begin": "23:00"}, "the log is of 2024-04-15 12:00:00"),
    ],
)
def test_wrong_playbacks_are_refused_in_clear_words(
    store: Workspace,
    tmp_path: Path,
    phases: dict[str, tuple[str, ...]],
    more: dict[str, str],
    words: str,
) -> None:
    (tmp_path / "log.csv").write_text(made_log(120.0))
    given = {"junction": JUNCTION, **more}
    with pytest.raises((InputError, NotFoundError), match=words):
        play_controller_log(
            store, on_map(store, until=60.0), tmp_path / "log.csv", phases=phases, **given
        )


def test_tables_of_detectors_without_a_use_are_refused() -> None:
    with pytest.raises(InputError, match="no column for function"):
        read_log_detectors(b"DeviceId,Phase,Parameter\n7,2,11\n")
    with pytest.raises(InputError, match="no detector has the function advance or presence"):
        read_log_detectors(b"DeviceId,Phase,Parameter,Function\n7,2,11,Count\n")


_THEIRS = """
import sys
from atspm import SignalDataProcessor, sample_data
red = {"red_time": 5, "red_occupancy_threshold": 0.8, "green_occupancy_threshold": 0.8}
named = {
    "has_data": {"no_data_min": 5, "min_data_points": 3},
    "arrival_on_green": {"latency_offset_seconds": 0},
    "split_failures": {**red, "by_approach": True, "by_cycle": False},
    "timeline": {"maxtime": True, "min_duration": 0, "cushion_time": 0},
    "ped_delay": {},
}
done = SignalDataProcessor(
    raw_data=sample_data.data, detector_config=sample_data.config, bin_size=15, verbose=0,
    remove_incomplete=False, controller_type="maxtime",
    aggregations=[{"name": name, "params": params} for name, params in named.items()],
)
done.load()
done.aggregate()
for name in ("arrival_on_green", "split_failures", "ped_delay"):
    done.conn.query(f"select * from {name}").df().to_csv(f"{sys.argv[1]}/{name}.csv", index=False)
sample_data.data.df().to_csv(f"{sys.argv[1]}/log.csv", index=False)
sample_data.config.df().to_csv(f"{sys.argv[1]}/detectors.csv", index=False)
"""


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log that atspm ships, and what it says of it."""
    if not ATSPM:
        pytest.skip("ODSCEN_TEST_ATSPM names no Python that has the package atspm")
    folder = tmp_path_factory.mktemp("atspm")
    subprocess.run([ATSPM, "-c", _THEIRS, str(folder)], check=True, capture_output=True)
    return folder


@pytest.mark.slow
def test_measures_of_a_real_log_are_those_of_atspm(theirs: Path) -> None:
    mine = controller_measures(theirs / "log.csv", theirs / "detectors.csv")
    for name, table, columns in (
        ("arrivals_on_green", "arrival_on_green", {"arrivals": "Total_Actuations",
                                                   "on_green": "Percent_AOG"}),
        ("split_failures", "split_failures", {"green": "Green_Time", "failures": "Split_Failure",
                                              "green_occupancy": "Green_Occupancy",
                                              "red_occupancy": "Red_Occupancy"}),
        ("pedestrian_delays", "ped_delay", {"waits": "Samples", "delay": "AvgPedDelay"}),
    ):  # fmt: skip
        other = pl.read_csv(theirs / f"{table}.csv", try_parse_dates=True).select(
            phase="Phase", begin=pl.col("TimeStamp").cast(pl.Datetime("ms")),
            **{f"{own}_theirs": name for own, name in columns.items()},
        )  # fmt: skip
        both = mine[name].join(other, on=["phase", "begin"], how="inner")
        assert len(both) == len(other) == len(mine[name]) > 0
        for own in columns:
            assert both[own].to_list() == pytest.approx(
                both[f"{own}_theirs"].to_list(), rel=0.01, abs=1e-6
            )


@pytest.mark.slow
def test_two_hours_of_a_real_log_are_played_back_to_a_second(
    theirs: Path, store: Workspace, tmp_path: Path
) -> None:
    phases = {"2": ("r1 straight", "r1 right"), "6": ("r3",), "5": ("r1 left",), "8": ("r2", "r4")}
    one = on_map(store, until=7190.0)
    played, _ = play_controller_log(
        store, one, theirs / "log.csv", junction=JUNCTION, phases=phases
    )
    done = run(store, played, out=tmp_path / "run")
    events = read_controller_log((theirs / "log.csv").read_bytes())
    for link, phase in ((3, 2), (12, 6), (4, 5), (6, 8)):
        own = events.filter(pl.col("parameter") == phase, pl.col("event").is_in([1, 8, 10]))
        seconds = ((own["time"] - START).dt.total_milliseconds() / 1000).to_list()
        # Of one green the log has lost the begin of yellow: it ends with red.
        greens = [
            (begin, end)
            for (begin, code), (end, _) in pairwise(zip(seconds, own["event"], strict=True))
            if code == 1 and begin > 0.5 and end < 7000.0
        ]
        found = [green for green in greens_shown(done.folder, link, 7190.0) if green[0] > 0]
        assert len(greens) > 60
        for (a, b), (c, d) in zip(found, greens, strict=False):
            assert abs(a - c) <= 1.0
            assert abs(b - d) <= 1.0
        assert len(found) >= len(greens)
