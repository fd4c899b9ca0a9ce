"""Which case to try next: at random, as a Latin hypercube, or where earlier ones were critical.

A case is a place in the unit cube, a share of each range that is varied. A proposer is asked for
some, told how critical each was, and asked again; with the same seed and the same answers it asks
the same.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol, get_args

import numpy as np

from odscen.base.errors import InputError, MissingDependencyError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray

SearchMethod = Literal["random", "latin", "tpe"]
SEARCH_METHODS: Final[tuple[str, ...]] = get_args(SearchMethod)
_FIRST_AT_RANDOM = 10
"""Cases before TPE has anything to go by, as optuna has it."""


class Proposer(Protocol):
    """Proposes cases."""

    def ask(self, count: int) -> FloatArray:
        """Places in the unit cube to try, shape ``(count, axes)``."""

    def tell(self, values: Sequence[float | None]) -> None:
        """Hear how critical those were that were asked last; ``None``: not possible."""


def proposer_of(method: str, *, axes: int, runs: int, seed: int) -> Proposer:
    """Make the proposer of a method.

    Parameters
    ----------
    axes
        Of the unit cube.
    runs
        How many cases there will be; a Latin hypercube is one of all.

    Raises
    ------
    InputError
        If there is no such method.
    MissingDependencyError
        If it is ``tpe`` and optuna is not installed.
    """
    if method == "tpe":
        return _Tpe(axes, seed)
    if method not in SEARCH_METHODS:
        raise InputError(f"method {method!r} is not one of {', '.join(SEARCH_METHODS)}")
    rng = np.random.default_rng(seed)
    if method == "random":
        return _Listed(rng.random((runs, axes)))
    from scipy.stats import qmc

    return _Listed(qmc.LatinHypercube(axes, rng=rng).random(runs))


class _Listed:
    """Places that do not depend on what is found."""

    def __init__(self, places: FloatArray) -> None:
        self._places = places
        self._next = 0

    def ask(self, count: int) -> FloatArray:
        found = self._places[self._next : self._next + count]
        self._next += count
        return found

    def tell(self, values: Sequence[float | None]) -> None:
        del values


class _Tpe:
    """Tree-structured Parzen estimator (Bergstra et al., 2011), optuna's."""

    def __init__(self, axes: int, seed: int) -> None:
        try:
            import optuna
        except ImportError as error:
            raise MissingDependencyError(
                "method tpe needs optuna: pip install 'odscen[search]'"
            ) from error
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # parts of the sampler are called experimental
            sampler = optuna.samplers.TPESampler(
                n_startup_trials=_FIRST_AT_RANDOM, multivariate=True, constant_liar=True, seed=seed
            )
        self._study = optuna.create_study(sampler=sampler, direction="maximize")
        self._ranges: dict[str, Any] = {
            f"x{axis:03}": optuna.distributions.FloatDistribution(0.0, 1.0) for axis in range(axes)
        }
        self._failed = optuna.trial.TrialState.FAIL
        self._asked: list[Any] = []

    def ask(self, count: int) -> FloatArray:
        self._asked = [self._study.ask(self._ranges) for _ in range(count)]
        rows = [[trial.params[name] for name in self._ranges] for trial in self._asked]
        return np.array(rows, dtype=np.float64).reshape(count, len(self._ranges))

    def tell(self, values: Sequence[float | None]) -> None:
        for trial, value in zip(self._asked, values, strict=True):
            if value is None:
                self._study.tell(trial, state=self._failed)
            else:
                self._study.tell(trial, value)
