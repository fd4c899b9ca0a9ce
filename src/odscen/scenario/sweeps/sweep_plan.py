"""What a sweep varies, and how: ranges, sets and tables of values, on a grid or as samples."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from odscen.base.errors import InputError, ScenarioError
from odscen.scenario.document.json_form import with_values

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.scenario.document.scenario_document import Scenario

Method = Literal["grid", "latin", "sobol", "random"]
METHODS: Final[tuple[str, ...]] = get_args(Method)
MOST_CASES: Final = 100_000
_DIGITS: Final = 9
"""Digits of values: enough for any number of a scenario, and 0.1 + 0.2 is 0.3."""
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

    def on_grid(self) -> tuple[tuple[float, ...], ...]:
        """Values on a grid.

        Raises
        ------
        InputError
            Without steps.
        """
        if self.steps is None:
            raise InputError(
                f"{self.name}: a grid needs the number of steps: {self.name}={self.low:g}.."
                f"{self.high:g}:10; or give a number of samples"
            )
        return tuple((_rounded(v),) for v in np.linspace(self.low, self.high, self.steps))

    def at(self, share: float) -> tuple[float, ...]:
        """Value at a share of the range, from 0 to 1."""
        return (_rounded(self.low + share * (self.high - self.low)),)


@dataclass(frozen=True, slots=True)
class Table:
    """Values that are given one by one; those of several parameters belong together."""

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]

    def on_grid(self) -> tuple[tuple[float, ...], ...]:
        """All rows."""
        return self.rows

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
        ``grid``: all combinations; ``latin``: a Latin hypercube; ``sobol``: a scrambled Sobol
        sequence; ``random``: independent draws.
    samples
        How many cases, of all methods but the grid.
    seed
        Of the samples.
    """

    axes: tuple[Range | Table, ...]
    method: Method = "grid"
    samples: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        names = self.names
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"parameter {name!r} is varied twice")
        if not names:
            raise InputError(
                "nothing is varied: name a parameter and its values, for example gap=1..4:7"
            )
        if (self.method == "grid") != (self.samples is None):
            needs = "takes no" if self.method == "grid" else "needs a"
            raise InputError(f"method {self.method} {needs} number of samples")

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that are varied, in order."""
        return tuple(name for axis in self.axes for name in axis.names)

    def cases(self) -> tuple[dict[str, float], ...]:
        """Values of each case, in order; the same plan gives the same ones.

        Raises
        ------
        InputError
            If there are too many, or a grid lacks the steps of a range.
        """
        if self.method == "grid":
            grids = [axis.on_grid() for axis in self.axes]
            _refuse_many(math.prod(map(len, grids)))
            return tuple(self._case(parts) for parts in product(*grids))
        _refuse_many(self.samples or 0)
        return tuple(
            self._case([axis.at(share) for axis, share in zip(self.axes, row, strict=True)])
            for row in self._shares().tolist()
        )

    def _case(self, parts: Sequence[tuple[float, ...]]) -> dict[str, float]:
        return dict(zip(self.names, (value for part in parts for value in part), strict=True))

    def _shares(self) -> FloatArray:
        """Samples of the unit cube; shape ``(samples, axes)``."""
        count, axes = self.samples or 0, len(self.axes)
        generator = np.random.default_rng(self.seed)
        if self.method == "random":
            return generator.random((count, axes))
        from scipy.stats import qmc

        if self.method == "latin":
            found: FloatArray = qmc.LatinHypercube(axes, rng=generator).random(count)
            return found
        power = max(math.ceil(math.log2(count)), 0)
        balanced: FloatArray = qmc.Sobol(axes, rng=generator).random_base2(power)
        return balanced[:count]

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; :func:`plan_from_data` reads it."""
        vary = [
            {"parameter": axis.name, "from": axis.low, "to": axis.high, "steps": axis.steps}
            if isinstance(axis, Range)
            else {"parameters": list(axis.names), "table": [list(row) for row in axis.rows]}
            for axis in self.axes
        ]
        return {"vary": vary, "method": self.method, "samples": self.samples, "seed": self.seed}


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
        given = ", ".join(f"{one} = {value:g}" for one, value in values.items())
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
    name, sign, said = text.partition("=")
    name, said = name.strip(), said.strip()
    if not sign or not name or not said:
        raise InputError(f"{text!r} varies nothing; write gap=1..4:7, gap=1..4 or gap=1,2,4")
    if (match := _RANGE.fullmatch(said)) is not None:
        steps = match["steps"]
        return _range(
            name,
            _number(match["low"], text),
            _number(match["high"], text),
            None if steps is None else _number(steps, text),
        )
    return Table((name,), tuple((_number(one, text),) for one in said.split(",")))


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
    if not isinstance(vary, list) or not all(isinstance(one, dict) for one in vary):
        raise InputError("vary must be a list of ranges, sets and tables")
    samples = data.get("samples")
    method = data.get("method", "grid" if samples is None else "sobol")
    if method not in METHODS:
        raise InputError(f"method {method!r} is not one of {', '.join(METHODS)}")
    count = None if samples is None else _whole(samples, "samples", least=1)
    seed = _whole(data.get("seed", 0), "seed", least=0)
    axes = tuple(_axis(one, f"vary[{index}]") for index, one in enumerate(vary))
    return SweepPlan(axes, method, count, seed)


def _axis(data: Mapping[str, Any], place: str) -> Range | Table:
    keys = set(data)
    if keys <= {"parameter", "from", "to", "steps"} and {"parameter", "from", "to"} <= keys:
        low, high = (_real(data[key], f"{place}.{key}") for key in ("from", "to"))
        steps = data.get("steps")
        return _range(
            str(data["parameter"]),
            low,
            high,
            None if steps is None else _real(steps, f"{place}.steps"),
        )
    if keys == {"parameter", "values"} and isinstance(data["values"], list):
        rows = tuple((_real(one, f"{place}.values"),) for one in data["values"])
        return _table((str(data["parameter"]),), rows, place)
    if keys == {"parameters", "table"} and isinstance(data["table"], list):
        names = tuple(map(str, data["parameters"]))
        return _table(names, tuple(_row(row, names, place) for row in data["table"]), place)
    raise InputError(
        f"{place} has {', '.join(sorted(keys)) or 'nothing'}; give parameter, from, to and steps, "
        "or parameter and values, or parameters and table"
    )


def _row(row: object, names: tuple[str, ...], place: str) -> tuple[float, ...]:
    if not isinstance(row, list) or len(row) != len(names):
        raise InputError(
            f"{place}.table: row {row!r:.60} does not have a value of each of {', '.join(names)}"
        )
    return tuple(_real(one, f"{place}.table") for one in row)


def _table(names: tuple[str, ...], rows: tuple[tuple[float, ...], ...], place: str) -> Table:
    if not rows or not names:
        raise InputError(f"{place} has no values")
    return Table(names, rows)


def _range(name: str, low: float, high: float, steps: float | None) -> Range:
    if low > high:
        raise InputError(f"{name}: the range {low:g}..{high:g} ends before it begins")
    if steps is not None:
        steps = _whole(steps, f"{name}: steps", least=2)
    return Range(name, low, high, steps)


def _number(text: str, whole: str) -> float:
    try:
        return _real(float(text), whole)
    except ValueError:
        raise InputError(f"{text.strip()!r} in {whole!r} is not a number") from None


def _real(value: object, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{place}: {value!r:.60} is not a finite number")
    return float(value)


def _whole(value: object, place: str, *, least: int) -> int:
    number = _real(value, place)
    if not number.is_integer() or number < least or number > MOST_CASES * 1e6:
        raise InputError(f"{place}: {number:g} is not a whole number from {least} on")
    return int(number)


def _refuse_many(count: int) -> None:
    if count > MOST_CASES:
        raise InputError(f"the sweep has {count:,} cases; at most {MOST_CASES:,} are possible")


def _rounded(value: float) -> float:
    return round(float(value), _DIGITS)
