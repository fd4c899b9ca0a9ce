"""What is generated: one frozen object from the door to the sampler."""

from __future__ import annotations

from dataclasses import dataclass, field

from odscen.base.errors import InputError
from odscen.scenario.document.sampling_config import SamplingConfig, overridden

_LAST_SEED = 2**31 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class GenerationSettings:
    """Which scenarios are sampled.

    Attributes
    ----------
    map_name
        Map to use; drawn by the configuration's filters and weights if ``None``.
    count
        How many scenarios, at least 1.
    seed
        Random seed of the first, at least 0; scenario ``k`` has ``seed + k``, so that each can be
        made again alone.
    fill
        Share (0 to 1) of the largest number of actors that fit, instead of the configuration's.
    roi_segments
        Size of the region of interest in segments, at least 1, instead of the configuration's.
    config
        Everything else that is drawn from.

    Raises
    ------
    InputError
        If count or seed is not possible.
    ScenarioError
        If fill or roi_segments is not.
    """

    map_name: str | None = None
    count: int = 1
    seed: int = 0
    fill: float | None = None
    roi_segments: int | None = None
    config: SamplingConfig = field(default_factory=SamplingConfig)

    def __post_init__(self) -> None:
        for name, value in (("count", self.count), ("seed", self.seed)):
            if not isinstance(value, int) or isinstance(value, bool):
                raise InputError(f"{name} must be a whole number, not {value!r}")
        if self.count < 1:
            raise InputError(f"count must be at least 1, not {self.count}")
        if not 0 <= self.seed <= _LAST_SEED - self.count + 1:
            raise InputError(
                f"seeds must lie between 0 and {_LAST_SEED}, not {self.seed} and those after it"
            )
        overridden(self.config, fill=self.fill, roi_segments=self.roi_segments)

    @property
    def sampling(self) -> SamplingConfig:
        """The configuration with what stands in for its own."""
        return overridden(self.config, fill=self.fill, roi_segments=self.roi_segments)


ONE_SCENARIO = GenerationSettings()
"""One scenario on any map, as the sampler has it."""
