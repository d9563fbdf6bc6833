"""Data written as formulas of x, y, z and t: checked when a scene is read, evaluated by numexpr, never by Python."""

from __future__ import annotations

import ast
import sys
import warnings
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from warmslip.messages import quoted

FUNCTIONS = frozenset(
    {
        "sin",
        "cos",
        "tan",
        "arcsin",
        "arccos",
        "arctan",
        "arctan2",
        "sinh",
        "cosh",
        "tanh",
        "exp",
        "log",
        "log10",
        "sqrt",
    }
    | {"abs", "floor", "ceil", "where", "min", "max"}
)
VARIABLES = ("x", "y", "z", "t")
MAX_FORMULA_CHARS = 2000  # characters: what a person writes
NODES = (
    *(ast.Expression, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.Call, ast.Name, ast.Constant, ast.Load),
    *(ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.Mod, ast.USub, ast.UAdd, ast.And, ast.Or),
    *(ast.Lt, ast.LtE, ast.Gt, ast.GtE),
)


class _Numexpr(ast.NodeTransformer):
    """The formula in numexpr's words: numbers as floats, pi, min, max, and, or."""

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        # a power of integers could be longer than the machine
        return ast.Constant(float(node.value))  # type: ignore[arg-type]

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Constant(float(np.pi)) if node.id == "pi" else node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in ("min", "max"):
            return node
        first, *others = node.args
        for other in others:
            first = ast.Call(ast.Name(f"{name}imum"), [first, other], [])
        return first

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        self.generic_visit(node)
        first, *others = node.values
        for other in others:
            first = ast.BinOp(first, ast.BitAnd() if isinstance(node.op, ast.And) else ast.BitOr(), other)
        return first


def _problem(node: ast.AST) -> str:
    """What a formula must not hold, in words, or nothing."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor):
        return "'^' is no power; write x ** 2"
    if isinstance(node, ast.IfExp):
        return "write where(condition, one, other) in place of if and else"
    if isinstance(node, ast.Tuple):
        return "a comma stands between the arguments of a function only; a decimal takes a point"
    if not isinstance(node, NODES):
        return f"'{ast.unparse(node)}' is no part of a formula"
    if isinstance(node, ast.Name) and node.id not in (*VARIABLES, "pi", *FUNCTIONS):
        return f"unknown name '{node.id}'; use x, y, z, t, pi and {', '.join(sorted(FUNCTIONS))}"
    if isinstance(node, ast.Constant) and (isinstance(node.value, bool) or not isinstance(node.value, int | float)):
        return f"{node.value!r} is not a number"
    if isinstance(node, ast.Constant) and not abs(float(node.value)) < float("inf"):  # type: ignore[arg-type]
        return "a number is too large"
    if isinstance(node, ast.Compare) and len(node.ops) > 1:
        return "write a < b and b < c in place of a < b < c"
    if isinstance(node, ast.Call):
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS or node.keywords:
            return f"'{ast.unparse(node)}' is no call of {', '.join(sorted(FUNCTIONS))}"
        wanted = {"where": 3, "arctan2": 2}.get(node.func.id, 1)
        least = node.func.id in ("min", "max")
        if len(node.args) < 2 if least else len(node.args) != wanted:
            return f"{node.func.id} takes {'two or more' if least else wanted} values, not {len(node.args)}"
    return ""


class Expression:
    """A formula of positions and time, e.g. Expression("10 * (1 - exp(-t)) * (x < 0.5)"); calling it evaluates it.

    `names` are the variables in it. Raises ValueError with a sentence for anything that is not a formula.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        if len(text) > MAX_FORMULA_CHARS:
            raise ValueError(f"a formula of {len(text)} characters; at most {MAX_FORMULA_CHARS} are read")
        if "\0" in text:
            raise ValueError("a formula has no null bytes; remove them")
        try:
            with warnings.catch_warnings():  # Python has advice on its own syntax
                warnings.simplefilter("ignore")
                tree = ast.parse(text.strip(), mode="eval")
            for node in ast.walk(tree):
                if problem := _problem(node):
                    raise ValueError(f"in '{text}': {problem}")
            self.names = frozenset(n.id for n in ast.walk(tree) if isinstance(n, ast.Name)) & set(VARIABLES)
            self._numexpr = ast.unparse(ast.fix_missing_locations(_Numexpr().visit(tree)))
        except (SyntaxError, RecursionError, MemoryError, OverflowError) as error:
            raise ValueError(f"'{text}' is not a formula ({getattr(error, 'msg', None) or error})") from None
        # types are wrong here or nowhere
        self.condition = self._evaluate(np.full((1, 3), 0.5), 0.5).dtype == bool

    @property
    def of_time(self) -> bool:
        return "t" in self.names

    def __call__(self, x: NDArray[np.float64], t: float) -> NDArray[np.float64]:
        """Values at positions x (points, d) and time t, (points,); z is zero in the plane.

        Raises ValueError when it cannot be evaluated; what is not finite is for the caller to refuse.
        """
        return np.array(np.broadcast_to(self._evaluate(x, t), (len(x),)), dtype=float)

    def _evaluate(self, x: NDArray[np.float64], t: float) -> NDArray[Any]:
        import numexpr

        columns = [np.ascontiguousarray(x[:, i]) if i < x.shape[1] else np.zeros(len(x)) for i in range(3)]
        known = dict(zip(VARIABLES, (*columns, float(t)), strict=True))
        try:
            with np.errstate(all="ignore"):
                value = numexpr.evaluate(self._numexpr, local_dict=known, global_dict={}, sanitize=False)
        except Exception as error:  # numexpr raises what it likes
            raise ValueError(f"'{self.text}' cannot be evaluated ({error})") from None
        return np.asarray(value)

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"


def finite(value: float) -> bool:
    """Whether a number is one in double precision; an integer may be too large for that."""
    return abs(value) <= sys.float_info.max


def _checked(value: Any) -> Any:
    if isinstance(value, str):
        Expression(value)
    elif isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{quoted(value)} is neither a number nor a formula in quotes; give one")
    elif not finite(value):
        raise ValueError(f"{quoted(value)} is not a finite number; give one")
    return value


# what a scene file holds: a finite number, or a formula of x, y, z, t
Value = Annotated[float | str, BeforeValidator(_checked)]


def constant(*values: float | str) -> bool:
    """Whether no value is a formula."""
    return not any(isinstance(value, str) for value in values)
