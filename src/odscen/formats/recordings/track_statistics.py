"""What a recording has, in numbers that add up over runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.formats.recordings.run_recording import STEP

if TYPE_CHECKING:
    from odscen.formats.recordings.run_recording import RunRecording

SPEED_STEP: Final = 0.5
"""m/s of a class of speeds; class 0 has those below :data:`STANDING`, k those up to ``k * 0.5``."""
STANDING: Final = 0.1
_CLASSES: Final = 121
"""The last has all above 59.5 m/s."""


def track_statistics(recording: RunRecording) -> dict[str, Any]:
    """JSON-ready: seconds of the recording, sizes of its arrays, and by category of road users.

    ``most`` has the sizes: ``agents``, ``lights`` (lanes with one), ``steps`` (instants) and
    ``lanes`` of the map. Of each category: ``tracks``, ``seconds`` that they were there, ``metres``
    that they moved, and ``speeds``, how many states are of each class of speeds.
    """
    tracks = recording.tracks
    speed = np.abs(tracks.speed)
    classes = np.minimum(np.ceil(speed / SPEED_STEP).astype(np.int64), _CLASSES - 1)
    classes = np.where(speed < STANDING, 0, np.maximum(classes, 1))
    found: dict[str, Any] = {}
    for category in sorted(set(tracks.categories)):
        own = np.array(
            [track_category == category for track_category in tracks.categories], dtype=np.bool_
        )
        valid = tracks.valid[own]
        counts = np.bincount(classes[own][valid], minlength=_CLASSES)
        found[category] = {
            "tracks": int(own.sum()),
            "seconds": round(float(valid.sum()) * STEP, 1),
            "metres": round(float((speed[own] * valid).sum()) * STEP, 1),
            "speeds": np.trim_zeros(counts, "b").tolist(),
        }
    seconds = round(float(recording.times[-1] - recording.times[0]), 6)
    most = {
        "agents": len(tracks.ids),
        "lights": len(recording.signals.lane),
        "steps": len(recording.times),
        "lanes": len(recording.elements.lanes),
    }
    return {"seconds": seconds, "most": most, "categories": found}
