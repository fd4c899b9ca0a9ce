"""What differs between CARLA's releases, behind one interface: nothing outside knows a number.

A client speaks to servers of its own release only, so the package that is installed decides. What
is known of each release, and from where, is in docs/carla.md.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from odscen.base.errors import CarlaError

_NUMBER = re.compile(r"\d+\.\d+\.\d+(?!\d)")
_UNSET_DELTA = 1e-6
"""Seconds: 0.9.16 shows an uninitialised number far below this where no time step is fixed."""
_GROUNDS = frozenset(
    (
        "Roads",
        "Sidewalks",
        "Terrain",
        "Ground",
        "RoadLines",
        "Bridge",
        "RailTrack",
        "Static",
        "NONE",
    )
)
"""What one may stand on, by CARLA's labels; a generated world has none at all."""


@dataclass(frozen=True, slots=True)
class ReleaseAdapter:
    """How one release is spoken to.

    Attributes
    ----------
    number
        The release, as ``0.9.16``.
    generates_worlds
        Whether a world can be made of an OpenDRIVE text.
    labels_ground
        Whether places carry the label of what they are of. Otherwise whatever is below is taken.
    turns_wheels
        Whether the wheels of vehicles without physics can be steered and rolled.
    slow_lane_rule
        Name of the Traffic Manager's call for how often a vehicle changes to the slow lane.
    warning
        What a user should know of it, in words; empty if there is nothing.
    """

    number: str
    generates_worlds: bool = True
    labels_ground: bool = True
    turns_wheels: bool = True
    slow_lane_rule: str = "keep_slow_lane_rule_percentage"
    warning: str = ""

    def fixed_delta(self, settings: Any) -> float | None:
        """Seconds of a tick in a server's settings; ``None`` where time is not in fixed steps."""
        # Reading one that is not set gives any number, raises, or ends the process, by release and
        # by how the package was built; comparing does none of these.
        unset = type(settings)()
        for name in dir(settings):
            if not name.startswith("_") and name != "fixed_delta_seconds":
                setattr(unset, name, getattr(settings, name))
        if settings == unset:
            return None
        delta = settings.fixed_delta_seconds
        return float(delta) if delta and delta >= _UNSET_DELTA else None

    def generation(self, carla: Any) -> Any:
        """Parameters by which a world is made of an OpenDRIVE text: as the text says, no more.

        By default a generated world has walls of a metre, driving lanes 0.6 m wider on each side
        (pull request 8975 of carla-simulator/carla), and in junctions, where lanes overlap, heights
        that are evened out (``MeshFactory::MergeAndSmooth``), so that the ground is not the map's.

        Raises
        ------
        CarlaError
            If this release makes no worlds.
        """
        if not self.generates_worlds:
            raise CarlaError(
                f"CARLA {self.number} makes no world of an OpenDRIVE file: load a map on the "
                "server that is the scenario's"
            )
        return carla.OpendriveGenerationParameters(
            wall_height=0.0, additional_width=0.0, smooth_junctions=False
        )

    def stay_in_lane(self, manager: Any, car: Any) -> None:
        """Let a Traffic Manager never change to the slow lane with a vehicle."""
        getattr(manager, self.slow_lane_rule)(car, 0)

    def is_ground(self, label: object) -> bool:
        """Whether one may stand on what has a label of CARLA's."""
        return not self.labels_ground or str(label) in _GROUNDS


_NEVER_TRIED = "CARLA {} was never tried, not even on a stand-in: it is taken to be as 0.9.16"
_BEFORE_SLOW_LANE = "keep_right_rule_percentage"

RELEASES = (
    ReleaseAdapter(
        "0.9.15",
        turns_wheels=False,
        slow_lane_rule=_BEFORE_SLOW_LANE,
        warning="CARLA 0.9.15 does not turn the wheels of vehicles that are shown",
    ),
    ReleaseAdapter("0.9.16"),
    ReleaseAdapter(
        "0.10.0",
        generates_worlds=False,
        # Semantic labels were made anew, and Town 10's road has potholes and speed bumps.
        labels_ground=False,
        turns_wheels=False,
        slow_lane_rule=_BEFORE_SLOW_LANE,
        warning="CARLA 0.10.0 makes no worlds of OpenDRIVE files and does not turn wheels; native "
        "mode was never seen to work with it; it is "
        "said to have two maps and 13 models of vehicles, none on two wheels, other physics, and "
        "roads that are less even than their OpenDRIVE file",
    ),
)
"""Those of which something is known."""


def release_number(words: str) -> str | None:
    """The leading ``x.y.z`` of what a server or a package calls itself.

    Those that are built from source say 0.9.16-dirty or 0.9.16-12-g0123abc; some say a hash only.
    """
    match = _NUMBER.match(words)
    return match[0] if match else None


def release_of(words: str) -> ReleaseAdapter:
    """Adapter for what a package calls itself; of an unknown one, as the newest that was tried."""
    number = release_number(words) or words
    known = next((release for release in RELEASES if release.number == number), None)
    if known is not None:
        return known
    return ReleaseAdapter(number, warning=_NEVER_TRIED.format(number))
