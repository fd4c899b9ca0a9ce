"""Scenarios of ScenarioNet as tracks: nuScenes, Waymo, nuPlan and others, each in a pickle.

https://github.com/metadriverse/scenarionet; the fields are those of ``ScenarioDescription`` in
https://github.com/metadriverse/metadrive, ``metadrive/scenario/scenario_description.py``. Nothing
is unpickled, see :mod:`odscen.formats.tracks.plain_pickle`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from odscen.base.errors import InputError
from odscen.base.shown import shown
from odscen.formats.tracks.plain_pickle import PickledArray, read_plain_pickle
from odscen.formats.tracks.recorded_traffic import RecordedTraffic, complete_tracks

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray

_KINDS: Final = {"VEHICLE": "vehicle", "PEDESTRIAN": "pedestrian", "CYCLIST": "bicycle"}
"""MetaDrive's types of objects that move; the others are kept as they are called."""
_USUAL_STEP: Final = 0.1
_MOST_STEPS, _MOST_ROWS = 1_000_000, 50_000_000
_COLORS: Final = {
    "GO": "green", "STOP": "red", "CAUTION": "yellow",
    "GREEN": "green", "RED": "red", "YELLOW": "yellow",
}  # fmt: skip
"""By the last word of the state, of Waymo (``LANE_STATE_ARROW_GO``) or MetaDrive."""


def read_scenario_description(content: bytes, begin: float, end: float) -> RecordedTraffic:
    """Objects of a scenario, from one second to another.

    Raises
    ------
    InputError
        If it is no pickle of plain values, or no scenario; names the object, the field and the
        value.
    """
    scenario = read_plain_pickle(content)
    tracks = scenario.get("tracks") if isinstance(scenario, dict) else None
    if not isinstance(tracks, dict):
        index = isinstance(scenario, dict) and any(str(key).endswith(".pkl") for key in scenario)
        what = "an index of scenarios; give one of its sd_*.pkl" if index else "no scenario"
        raise InputError(f"it has no tracks: it is {what}")
    about = scenario.get("metadata")
    about = about if isinstance(about, dict) else {}
    times = _times_of(scenario, about)
    if len(tracks) * len(times) > _MOST_ROWS:
        raise InputError(
            f"{len(tracks):,} tracks of {len(times):,} steps are more than {_MOST_ROWS:,} states"
        )
    rows = (_rows_of(str(name), track, times, begin, end) for name, track in tracks.items())
    parts = [part for part in rows if part is not None]
    if not parts:
        raise InputError("no road user is in it at that time")
    notes = []
    dataset = about.get("dataset")
    if isinstance(dataset, str):
        notes.append(f"of the data set {shown(dataset)}")
    if isinstance(about.get("sdc_id"), (str, int)):
        notes.append(f"recorded from {shown(str(about['sdc_id']))}")
    return complete_tracks(
        pl.concat(parts),
        "scenarionet",
        signals=_signals_of(scenario.get("dynamic_map_states"), times, begin, end),
        notes=tuple(notes),
    )


def _times_of(scenario: dict[Any, Any], about: dict[Any, Any]) -> FloatArray:
    if about.get("ts") is not None:
        times = _numbers_of(about["ts"], "metadata, ts").reshape(-1)
        if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
            raise InputError("its times do not grow", element="metadata, ts")
        return np.round(times, 6)
    length = scenario.get("length")
    if not isinstance(length, int) or not 0 < length <= _MOST_STEPS:
        raise InputError("it has no times, and no length in steps", element="length")
    return np.round(np.arange(length) * _USUAL_STEP, 6)


def _numbers_of(value: object, element: str) -> FloatArray:
    if isinstance(value, PickledArray):
        found = value.values
    elif isinstance(value, (list, tuple)) and all(isinstance(v, (int, float)) for v in value):
        try:
            found = np.array(value, dtype=np.float64)
        except OverflowError as error:
            raise InputError("it has a number that no float holds", element=element) from error
    else:
        raise InputError("it is no array of numbers", element=element)
    if found.dtype.kind not in "biuf":
        raise InputError("it is no array of numbers", element=element)
    return found.astype(np.float64)


def _rows_of(
    name: str, track: object, times: FloatArray, begin: float, end: float
) -> pl.DataFrame | None:
    element = f"track {shown(name)}"
    state = track.get("state") if isinstance(track, dict) else None
    if not isinstance(track, dict) or not isinstance(state, dict):
        raise InputError("it has no state", element=element)
    count = len(times)

    def column(field: str, width: int) -> FloatArray:
        where = f"{element}, {field}"
        if field not in state:
            raise InputError("it is missing", element=where)
        found = _numbers_of(state[field], where)
        # Sizes are written as one number for each step, or as one in a row of its own.
        if len(found.shape) == 0 or found.shape[0] != count or found.size < width * count:
            raise InputError(
                f"it is of shape {found.shape}, and there are {count} steps", element=where
            )
        return found.reshape(count, -1)[:, :width]

    valid: BoolArray = column("valid", 1)[:, 0] > 0.0
    valid &= (times >= begin) & (times <= end)
    if not valid.any():
        return None
    position, velocity = column("position", 2)[valid], column("velocity", 2)[valid]
    metadata = track.get("metadata")
    category = metadata.get("category") if isinstance(metadata, dict) else None
    kind = track.get("type")
    kind = kind if isinstance(kind, str) else "other"
    return pl.DataFrame(
        {
            "id": name,
            "time": times[valid],
            "x": position[:, 0],
            "y": position[:, 1],
            "hdg": column("heading", 1)[valid, 0],
            "vx": velocity[:, 0],
            "vy": velocity[:, 1],
            **{
                size: column(size, 1)[valid, 0] if size in state else np.zeros(int(valid.sum()))
                for size in ("length", "width")
            },
        }
    ).with_columns(
        # What odscen wrote says which kind of vehicle it is.
        kind=pl.lit(category if isinstance(category, str) else _KINDS.get(kind, kind.lower()))
    )


def _signals_of(lights: object, times: FloatArray, begin: float, end: float) -> pl.DataFrame | None:
    rows: list[tuple[float, str, str]] = []
    for name, light in lights.items() if isinstance(lights, dict) else ():
        element = f"light {shown(str(name))}"
        state = light.get("state") if isinstance(light, dict) else None
        shows = state.get("object_state") if isinstance(state, dict) else None
        if isinstance(shows, PickledArray):
            shows = shows.values.tolist()
        if not isinstance(shows, (list, tuple)) or len(shows) != len(times):
            raise InputError("it does not say what it shows in each step", element=element)
        for time, shown_state in zip(times.tolist(), shows, strict=True):
            last = shown_state.rpartition("_")[2] if isinstance(shown_state, str) else ""
            color = _COLORS.get(last)
            if color is not None and begin <= time <= end:
                rows.append((time, str(name), color))
    schema = {"time": pl.Float64, "light": pl.String, "color": pl.String}
    return pl.DataFrame(rows, schema=schema, orient="row").sort("light", "time") if rows else None
