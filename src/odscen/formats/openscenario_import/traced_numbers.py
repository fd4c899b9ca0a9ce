"""Numbers that remember which parameters they come from, through the arithmetic of the readers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Self

from odscen.scenario.document.formulas import LONGEST

if TYPE_CHECKING:
    from lxml.etree import _Element

    Source = tuple[_Element, str]

_NEVER_FORMULAS: Final = frozenset({"id", "name", "description"})


_NOTHING: Final = frozenset({("+", 0.0), ("*", 1.0)})
_NOTHING_BEFORE: Final = frozenset({("-", 0.0, False), ("/", 1.0, False)})
"""What changes no number: whichever side it is on, and on the right only."""


class TracedText(str):
    """Text of a parameter that a formula of the document gives as well."""

    __slots__ = ("formula",)

    formula: str

    @classmethod
    def of(cls, text: str, formula: str) -> Self:
        """Text with its formula."""
        made = cls(text)
        made.formula = formula
        return made


class TracedNumber(float):
    """A number with the formula that gives it, and the attributes of the file it is read from.

    Sums, products, quotients and absolute values of it are traced as well; what else is made of it
    is a plain number.
    """

    __slots__ = ("formula", "sources")

    formula: str
    sources: frozenset[Source]

    @classmethod
    def of(cls, value: float, formula: str, sources: frozenset[Source]) -> Self:
        """Value with its formula."""
        made = cls(value)
        made.formula, made.sources = formula, sources
        return made

    def _combine_with(self, other: object, sign: str, value: Any, *, turned: bool = False) -> Any:
        if value is NotImplemented or not isinstance(other, int | float):
            return value
        if not isinstance(other, TracedNumber):
            if sign == "*" and other == 0:
                return 0.0
            if (sign, other) in _NOTHING or (sign, other, turned) in _NOTHING_BEFORE:
                return TracedNumber.of(value, self.formula, self.sources)
        mine, its = _bracket_formula(self), _bracket_formula(other)
        formula = f"{its} {sign} {mine}" if turned else f"{mine} {sign} {its}"
        more = other.sources if isinstance(other, TracedNumber) else frozenset()
        return TracedNumber.of(value, formula, self.sources | more)

    def __add__(self, other: float) -> Any:
        return self._combine_with(other, "+", float.__add__(self, other))

    def __radd__(self, other: float) -> Any:
        return self._combine_with(other, "+", float.__radd__(self, other), turned=True)

    def __sub__(self, other: float) -> Any:
        return self._combine_with(other, "-", float.__sub__(self, other))

    def __rsub__(self, other: float) -> Any:
        return self._combine_with(other, "-", float.__rsub__(self, other), turned=True)

    def __mul__(self, other: float) -> Any:
        return self._combine_with(other, "*", float.__mul__(self, other))

    def __rmul__(self, other: float) -> Any:
        return self._combine_with(other, "*", float.__rmul__(self, other), turned=True)

    def __truediv__(self, other: float) -> Any:
        return self._combine_with(other, "/", float.__truediv__(self, other))

    def __rtruediv__(self, other: float) -> Any:
        return self._combine_with(other, "/", float.__rtruediv__(self, other), turned=True)

    def __neg__(self) -> TracedNumber:
        return TracedNumber.of(-float(self), f"-{_bracket_formula(self)}", self.sources)

    def __abs__(self) -> TracedNumber:
        return TracedNumber.of(abs(float(self)), f"abs({self.formula})", self.sources)

    def __reduce__(self) -> Any:
        return float, (float(self),)


def _bracket_formula(value: float) -> str:
    if not isinstance(value, TracedNumber):
        return f"{value!r}" if value >= 0 else f"({value!r})"
    simple = value.formula.replace("_", "").lstrip("$").isalnum()
    return value.formula if simple else f"({value.formula})"


def with_formulas(node: Any, reached: set[Source], *, key: str = "") -> Any:
    """Copy a document as JSON, with formulas in place of the numbers they give.

    Parameters
    ----------
    reached
        Gets the attributes of the file that the formulas come from.
    """
    if isinstance(node, dict):
        return {name: with_formulas(part, reached, key=name) for name, part in node.items()}
    if isinstance(node, list | tuple):
        return [with_formulas(inner, reached, key=key) for inner in node]
    if not isinstance(node, TracedNumber):
        return node
    if len(node.formula) > LONGEST or key in _NEVER_FORMULAS:
        return float(node)
    reached |= node.sources
    return node.formula
