"""Cases of a scenario: which parameters are varied, and what proposes their values.

A case is a place in the unit cube, a share of each range, set or table that is varied. A proposer
is asked for some, told how critical each was, and asked again; with the same seed and the same
answers it asks the same. :data:`PROPOSALS` has all kinds: one more is a line there, or a call of
:func:`register_proposal`, and the commands that vary parameters take it.
"""

from __future__ import annotations

import math
import re
import warnings
from collections import Counter
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from odscen.base.errors import InputError, MissingDependencyError, ScenarioError
from odscen.base.shown import some_of
from odscen.scenario.document.json_form import with_values

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.scenario.document.scenario_document import Scenario

MOST_CASES: Final = 100_000
_DIGITS: Final = 9
"""Digits of values: enough for any number of a scenario, and 0.1 + 0.2 is 0.3."""
_FIRST_AT_RANDOM = 10
"""Cases before TPE has anything to go by, as optuna has it."""
_RANGE = re.compile(r"(?P<low>[^.]+(?:\.\d+)?)\.\.(?P<high>[^:]+)(?::(?P<steps>.+))?")


@dataclass(frozen=True, slots=True)
class Range:
    """Values between two bounds; ``steps`` of them on a grid, both bounds included."""

    name: str
    low: float
    high: float
    steps: int | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The one parameter that is varied."""
        return (self.name,)

    @property
    def count(self) -> int:
        """How many values there are on a grid; :class:`InputError` without steps."""
        if self.steps is None:
            raise InputError(
                f"{self.name}: a grid needs the number of steps: {self.name}={self.low:g}.."
                f"{self.high:g}:10; or give a number of samples"
            )
        return self.steps

    @property
    def shares(self) -> Sequence[float]:
        """Shares of the range of the values on a grid; :class:`InputError` without steps."""
        return [step / (self.count - 1) for step in range(self.count)]

    def at(self, share: float) -> tuple[float, ...]:
        """Value at a share of the range, from 0 to 1."""
        return (_round_value(self.low + share * (self.high - self.low)),)


@dataclass(frozen=True, slots=True)
class Table:
    """Values that are given one by one; those of several parameters belong together."""

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]

    @property
    def count(self) -> int:
        """How many rows there are."""
        return len(self.rows)

    @property
    def shares(self) -> Sequence[float]:
        """Shares of the table of its rows: the middle of each row's part."""
        return [(row + 0.5) / len(self.rows) for row in range(len(self.rows))]

    def at(self, share: float) -> tuple[float, ...]:
        """Row at a share of the table, from 0 to 1."""
        return self.rows[min(int(share * len(self.rows)), len(self.rows) - 1)]


@dataclass(frozen=True, slots=True)
class SweepPlan:
    """Which values the parameters of a scenario take, case by case.

    Attributes
    ----------
    axes
        What is varied; no parameter twice.
    method
        Name of a kind of :data:`PROPOSALS`.
    samples
        How many cases, of all methods but the grid.
    seed
        Of the samples.
    """

    axes: tuple[Range | Table, ...]
    method: str = "grid"
    samples: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        names = self.names
        for name, number in Counter(names).items():
            if number > 1:
                raise InputError(f"parameter {name!r} is varied twice")
        if not names:
            raise InputError(
                "nothing is varied: name a parameter and its values, for example gap=1..4:7"
            )
        counted = proposal_kind(self.method).counted
        if counted != (self.samples is not None):
            needs = "needs a" if counted else "takes no"
            raise InputError(f"method {self.method} {needs} number of samples")
        self._refuse_too_many()

    def _refuse_too_many(self) -> None:
        """Raise if there are more cases than may be: before any of them is made."""
        if self.samples is not None:
            if self.samples > MOST_CASES:
                raise InputError(
                    f"samples: the sweep has {self.samples:,} cases; at most {MOST_CASES:,} are "
                    "possible"
                )
            return
        counts = [
            (",".join(axis.names), axis.count)
            for axis in self.axes
            if isinstance(axis, Table) or axis.steps is not None
        ]
        number = math.prod(count for _, count in counts)
        if number > MOST_CASES:
            listed = some_of([f"{name} has {count:,} values" for name, count in counts])
            raise InputError(
                f"the sweep has {number:,} cases; at most {MOST_CASES:,} are possible: {listed}"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that are varied, in order."""
        return tuple(name for axis in self.axes for name in axis.names)

    def cases(self) -> tuple[dict[str, float], ...]:
        """Values of each case, in order; the same plan gives the same ones.

        Raises
        ------
        InputError
            If a grid lacks the steps of a range, or the method proposes cases by what became of
            others.
        """
        kind = proposal_kind(self.method)
        if kind.learns:
            raise InputError(
                f"method {self.method} learns from cases that have been run: only a search has it"
            )
        count = self.samples or math.prod(axis.count for axis in self.axes)
        return tuple(map(self.values_at, kind.start(self).ask(count).tolist()))

    def values_at(self, place: Sequence[float]) -> dict[str, float]:
        """Values of the parameters at a place of the unit cube."""
        parts = (axis.at(share) for axis, share in zip(self.axes, place, strict=True))
        return dict(zip(self.names, (value for part in parts for value in part), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; :func:`plan_from_data` reads it."""
        vary = [
            {"parameter": axis.name, "from": axis.low, "to": axis.high, "steps": axis.steps}
            if isinstance(axis, Range)
            else {"parameters": list(axis.names), "table": [list(row) for row in axis.rows]}
            for axis in self.axes
        ]
        return {"vary": vary, "method": self.method, "samples": self.samples, "seed": self.seed}


class Proposer(Protocol):
    """Proposes cases."""

    def ask(self, count: int) -> FloatArray:
        """Places in the unit cube to try next, shape ``(count, axes)``; fewer if none are left."""

    def tell(self, values: Sequence[float | None]) -> None:
        """Take how critical those were that were asked last; ``None``: not possible."""


@dataclass(frozen=True, slots=True)
class ProposalKind:
    """A way to propose cases.

    Attributes
    ----------
    name
        The ``method`` of plans and options.
    start
        Makes a proposer of a plan.
    counted
        Whether it takes a number of cases, as all but a grid do.
    learns
        Whether it goes by what became of the cases before: only a search tells.
    """

    name: str
    start: Callable[[SweepPlan], Proposer]
    counted: bool = True
    learns: bool = False


class _ListedPlaces:
    """Places that do not depend on what becomes of them."""

    def __init__(self, places: FloatArray) -> None:
        self._places = places
        self._next = 0

    def ask(self, count: int) -> FloatArray:
        asked = self._places[self._next : self._next + count]
        self._next += count
        return asked

    def tell(self, values: Sequence[float | None]) -> None:
        del values


class _Tpe:
    """Tree-structured Parzen estimator (Bergstra et al., 2011), optuna's."""

    def __init__(self, plan: SweepPlan) -> None:
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
                n_startup_trials=_FIRST_AT_RANDOM,
                multivariate=True,
                constant_liar=True,
                seed=plan.seed,
            )
        # In memory: what is stored is unpickled when it is read, and cases are on the disk already.
        self._study = optuna.create_study(
            storage=optuna.storages.InMemoryStorage(), sampler=sampler, direction="maximize"
        )
        self._ranges: dict[str, Any] = {
            f"x{axis:03}": optuna.distributions.FloatDistribution(0.0, 1.0)
            for axis in range(len(plan.axes))
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


def _start_grid(plan: SweepPlan) -> Proposer:
    shares = list(product(*(axis.shares for axis in plan.axes)))
    return _ListedPlaces(np.array(shares, dtype=np.float64).reshape(-1, len(plan.axes)))


def _start_latin(plan: SweepPlan) -> Proposer:
    from scipy.stats import qmc

    cube = qmc.LatinHypercube(len(plan.axes), rng=np.random.default_rng(plan.seed))
    return _ListedPlaces(cube.random(plan.samples or 0))


def _start_sobol(plan: SweepPlan) -> Proposer:
    from scipy.stats import qmc

    # The sequence is balanced in powers of two only.
    power = max(math.ceil(math.log2(plan.samples or 1)), 0)
    cube = qmc.Sobol(len(plan.axes), rng=np.random.default_rng(plan.seed))
    return _ListedPlaces(cube.random_base2(power)[: plan.samples])


def _start_random(plan: SweepPlan) -> Proposer:
    generator = np.random.default_rng(plan.seed)
    return _ListedPlaces(generator.random((plan.samples or 0, len(plan.axes))))


PROPOSALS: Final[dict[str, ProposalKind]] = {
    kind.name: kind
    for kind in (
        ProposalKind("grid", _start_grid, counted=False),
        ProposalKind("latin", _start_latin),
        ProposalKind("sobol", _start_sobol),
        ProposalKind("random", _start_random),
        ProposalKind("tpe", _Tpe, learns=True),
    )
}
"""By name: all combinations, a Latin hypercube, a scrambled Sobol sequence, independent draws, and
where earlier cases were critical."""


def register_proposal(kind: ProposalKind) -> None:
    """Add a way to propose cases: plans, ``--method`` of commands and the server know its name."""
    PROPOSALS[kind.name] = kind


def proposal_kind(method: str) -> ProposalKind:
    """Look up a way to propose cases; :class:`InputError` names those that there are."""
    if method not in PROPOSALS:
        raise InputError(f"method {method!r} is not one of {', '.join(PROPOSALS)}")
    return PROPOSALS[method]


def concrete(scenario: Scenario, values: Mapping[str, float], *, name: str) -> Scenario:
    """Make a scenario of numbers only: its parameters have these values, formulas are done with.

    Raises
    ------
    ScenarioError
        If a value is outside the bounds of its parameter, or not possible; names it.
    """
    try:
        found = with_values(scenario, values)
    except ScenarioError as error:
        given = ", ".join(f"{parameter} = {value:g}" for parameter, value in values.items())
        raise ScenarioError(
            f"{name} ({given}): {error.problem}", problems=error.problems
        ) from error
    return found.model_copy(update={"name": name, "formulas": {}})


def axis_from_text(text: str) -> Range | Table:
    """Read ``gap=1..4:7`` (a range in 7 steps), ``gap=1..4`` or ``gap=1,2,4`` (a set).

    Raises
    ------
    InputError
        If it is none of them.
    """
    name, sign, values_text = text.partition("=")
    name, values_text = name.strip(), values_text.strip()
    if not sign or not name or not values_text:
        raise InputError(f"{text!r} varies nothing; write gap=1..4:7, gap=1..4 or gap=1,2,4")
    if (match := _RANGE.fullmatch(values_text)) is not None:
        steps = match["steps"]
        return _make_range(
            name,
            _parse_number(match["low"], text),
            _parse_number(match["high"], text),
            None if steps is None else _parse_number(steps, text),
        )
    return Table((name,), tuple((_parse_number(part, text),) for part in values_text.split(",")))


def plan_from_data(data: Mapping[str, Any]) -> SweepPlan:
    """Read a plan as :meth:`SweepPlan.to_dict` writes it.

    Raises
    ------
    InputError
        If a part is missing, unknown or wrong; names it.
    """
    unknown = sorted(set(data) - {"vary", "method", "samples", "seed", "scenario"})
    if unknown:
        raise InputError(f"a sweep has no {unknown[0]!r}; it has vary, method, samples and seed")
    vary = data.get("vary", [])
    if not isinstance(vary, list) or not all(isinstance(axis, dict) for axis in vary):
        raise InputError("vary must be a list of ranges, sets and tables")
    samples = data.get("samples")
    method = data.get("method", "grid" if samples is None else "sobol")
    if not isinstance(method, str):
        raise InputError(f"method must be a name, not {method!r:.60}")
    proposal_kind(method)
    count = None if samples is None else _require_whole(samples, "samples", least=1)
    seed = _require_whole(data.get("seed", 0), "seed", least=0)
    axes = tuple(_read_axis(axis, f"vary[{index}]") for index, axis in enumerate(vary))
    return SweepPlan(axes, method, count, seed)


def _read_axis(data: Mapping[str, Any], place: str) -> Range | Table:
    keys = set(data)
    if keys <= {"parameter", "from", "to", "steps"} and {"parameter", "from", "to"} <= keys:
        low, high = (_require_real(data[key], f"{place}.{key}") for key in ("from", "to"))
        steps = data.get("steps")
        return _make_range(
            str(data["parameter"]),
            low,
            high,
            None if steps is None else _require_real(steps, f"{place}.steps"),
        )
    if keys == {"parameter", "values"} and isinstance(data["values"], list):
        rows = tuple((_require_real(number, f"{place}.values"),) for number in data["values"])
        return _make_table((str(data["parameter"]),), rows, place)
    if keys == {"parameters", "table"} and isinstance(data["table"], list):
        if not isinstance(data["parameters"], list):
            raise InputError(
                f"{place}.parameters must be a list of names, not {data['parameters']!r:.60}"
            )
        names = tuple(map(str, data["parameters"]))
        return _make_table(
            names, tuple(_read_row(row, names, place) for row in data["table"]), place
        )
    raise InputError(
        f"{place} has {', '.join(sorted(keys)) or 'nothing'}; give parameter, from, to and steps, "
        "or parameter and values, or parameters and table"
    )


def _read_row(row: object, names: tuple[str, ...], place: str) -> tuple[float, ...]:
    if not isinstance(row, list) or len(row) != len(names):
        raise InputError(
            f"{place}.table: row {row!r:.60} does not have a value of each of {', '.join(names)}"
        )
    return tuple(_require_real(number, f"{place}.table") for number in row)


def _make_table(names: tuple[str, ...], rows: tuple[tuple[float, ...], ...], place: str) -> Table:
    if not rows or not names:
        raise InputError(f"{place} has no values")
    return Table(names, rows)


def _make_range(name: str, low: float, high: float, steps: float | None) -> Range:
    if low > high:
        raise InputError(f"{name}: the range {low:g}..{high:g} ends before it begins")
    if steps is not None:
        steps = _require_whole(steps, f"{name}: steps", least=2)
    return Range(name, low, high, steps)


def _parse_number(text: str, whole: str) -> float:
    try:
        return _require_real(float(text), whole)
    except ValueError:
        raise InputError(f"{text.strip()!r} in {whole!r} is not a number") from None


def _require_real(value: object, place: str) -> float:
    try:
        if isinstance(value, int | float) and not isinstance(value, bool):
            number = float(value)
            if math.isfinite(number):
                return number
    except OverflowError:  # a whole number that no double holds
        raise InputError(f"{place}: a number of so many digits is not finite") from None
    raise InputError(f"{place}: {value!r:.60} is not a finite number")


def _require_whole(value: object, place: str, *, least: int) -> int:
    number = _require_real(value, place)
    if not number.is_integer() or number < least or number > MOST_CASES * 1e6:
        raise InputError(f"{place}: {number:g} is not a whole number from {least} on")
    return int(number)


def _round_value(value: float) -> float:
    return round(float(value), _DIGITS)
