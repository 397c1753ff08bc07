"""Formulas of authored files, such as ``"2*(30+n)"``: parsed, bounded, never executed as code.

Only numbers, names, + - * / ** and unary signs, parentheses, and a few functions are understood;
every formula is bounded in length and depth, and exponents in size, so that a hostile one costs
nothing. Evaluation works on floats and on NumPy arrays alike.
"""

import ast
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import FaultError, Parameter, look_alikes, nearest
from reference.geometry import FloatArray

MAX_LENGTH = 200
MAX_DEPTH = 20
MAX_EXPONENT = 16

Value = FloatArray | float

CONSTANTS: Mapping[str, float] = {"pi": math.pi}
ROUNDING = 1e-12
"""A cosine that exceeds 1 by this little is 1: at a dead point the law of cosines has a rounding error."""


def _within_one(ratio: Value) -> Value:
    return np.where(np.abs(ratio) <= 1.0 + ROUNDING, np.clip(ratio, -1.0, 1.0), np.nan)


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": lambda ratio: np.arcsin(_within_one(ratio)),
    "acos": lambda ratio: np.arccos(_within_one(ratio)),
    "atan": np.arctan,
    "atan2": np.arctan2,
    "abs": np.abs,
    "floor": np.floor,
    "ceil": np.ceil,
    "min": lambda *values: reduce(np.minimum, values),
    "max": lambda *values: reduce(np.maximum, values),
    "radians": np.radians,
    "degrees": np.degrees,
}
"""Angles are in radians, except for the argument of `radians` and the result of `degrees`."""
ARGUMENTS: Mapping[str, tuple[int, int]] = {"atan2": (2, 2), "min": (2, 20), "max": (2, 20)}
"""Number of arguments of a function, least and most (default: one). Twenty fill a formula."""
_OPERATORS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda x, y: x + y,
    ast.Sub: lambda x, y: x - y,
    ast.Mult: lambda x, y: x * y,
    ast.Div: np.true_divide,
    ast.Mod: np.mod,
    ast.Pow: np.power,
}


class FormulaError(FaultError):
    """A formula that cannot be parsed, or has no usable value for the variants in `which`.

    `path` is its place below the mechanism, where it is known.
    """

    def __init__(self, code: str, which: NDArray[np.bool_] | None = None, /, **parameters: Parameter) -> None:
        super().__init__(code, **parameters)
        self.which, self.path = which, ""


@dataclass(frozen=True, slots=True)
class Formula:
    """A parsed formula: its text, and the names that it needs."""

    text: str
    tree: ast.expr
    names: frozenset[str]

    def __call__(self, values: Mapping[str, Value]) -> FloatArray:
        """Evaluate with the named values (floats or arrays that broadcast).

        Raises FormulaError for an unknown name (with the near ones) and for a result that is not
        finite everywhere.
        """
        if not self.names:
            return _constant(self.text)
        unknown = sorted(self.names - values.keys())
        if unknown:
            raise _unknown_name(self.text, unknown[0], values)
        return _finite(self, values)


@cache
def _constant(text: str) -> FloatArray:
    """Return the value of a formula without names, computed once."""
    return _finite(parse(text), {})


def _finite(formula: Formula, values: Mapping[str, Value]) -> FloatArray:
    with np.errstate(all="ignore"):
        result = np.asarray(_evaluate(formula.tree, values), dtype=np.float64)
    if not np.isfinite(result).all():
        raise FormulaError("no_finite_value", ~np.isfinite(result), text=formula.text)
    return result


def parse(text: str | float) -> Formula:
    """Parse a number or the text of a formula.

    Raises FormulaError that says what is not allowed in it.
    """
    text = str(text).strip()
    if len(text) > MAX_LENGTH:
        raise FormulaError("too_long", most=MAX_LENGTH)
    try:
        tree = ast.parse(text.replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        raise FormulaError("not_formula", text=text, **_advice(text)) from error
    names: set[str] = set()
    _check(tree, names, text, depth=0)
    return Formula(text, tree, frozenset(names))


def _advice(text: str) -> dict[str, Parameter]:
    """Return advice on a text that is often written in place of a formula; nothing for any other."""
    if re.fullmatch(r"\d+([.,]\d+)?\s*:\s*\d+([.,]\d+)?", text):
        return {"advice": "scale_number"}
    if text.count("(") != text.count(")"):
        return {"advice": "bracket_unclosed"}
    if re.search(r"\d,\d", text) and "(" not in text:
        return {"advice": "decimal_point"}
    if re.fullmatch(r"[+-]?\d+(\.\d*)?\s*[^\d\s(+*/-][^(+*]*", text):
        return {"advice": "unit_of_key"}
    return {}


def _check(node: ast.expr, names: set[str], text: str, depth: int) -> None:
    if depth > MAX_DEPTH:
        raise FormulaError("nested", most=MAX_DEPTH)
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if not math.isfinite(float(value)):
                raise FormulaError("no_finite_value", text=text)
        case ast.Name(id=name):
            if name not in CONSTANTS:
                names.add(name)
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            _check(operand, names, text, depth + 1)
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            if isinstance(operator, ast.Pow):
                _check_exponent(right, text)
            _check(left, names, text, depth + 1)
            _check(right, names, text, depth + 1)
        case ast.Call(func=ast.Name(id=function), args=arguments, keywords=[]):
            _check_function(function, len(arguments), text)
            for argument in arguments:
                _check(argument, names, text, depth + 1)
        case _:
            raise FormulaError("not_in_formulas", text=text, names=tuple(FUNCTIONS), **_advice(text))


def _check_function(function: str, count: int, text: str) -> None:
    if function not in FUNCTIONS:
        raise _unknown_name(text, function, FUNCTIONS)
    least, most = ARGUMENTS.get(function, (1, 1))
    if not least <= count <= most:
        wanted = f"{least}..{most}" if most > least else least
        raise FormulaError("takes", text=text, name=function, count=wanted)


def _check_exponent(exponent: ast.expr, text: str) -> None:
    match exponent:
        case ast.Constant(value=int() | float() as value) if abs(value) <= MAX_EXPONENT:
            return
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as value)) if (
            abs(value) <= MAX_EXPONENT
        ):
            return
    raise FormulaError("exponent_large", text=text, most=MAX_EXPONENT)


def _evaluate(node: ast.expr, values: Mapping[str, Value]) -> Any:  # noqa: ANN401 - floats or arrays
    match node:
        case ast.Constant(value=value):
            return float(value)  # type: ignore[arg-type]
        case ast.Name(id=name):
            return CONSTANTS[name] if name in CONSTANTS else values[name]
        case ast.UnaryOp(op=operator, operand=operand):
            inner = _evaluate(operand, values)
            return -inner if isinstance(operator, ast.USub) else inner
        case ast.BinOp(left=left, op=operator, right=right):
            return _OPERATORS[type(operator)](_evaluate(left, values), _evaluate(right, values))
        case ast.Call(func=ast.Name(id=function), args=arguments):
            return FUNCTIONS[function](*(_evaluate(argument, values) for argument in arguments))
    raise AssertionError(f"an unchecked node {node!r}")  # pragma: no cover - `parse` refuses all others


def _unknown_name(text: str, name: str, known: Mapping[str, object]) -> FormulaError:
    near = nearest(name, known, 2) or {"names": tuple(sorted(known))}
    return FormulaError("name_unknown", text=text, name=name, **near, **look_alikes(name))
