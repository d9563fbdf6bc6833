"""Where a formula has a kink or a jump, as far as its functions say so."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from warmslip.scene.expressions import Expression
from warmslip.typing import Array

ROUNDING = 1e-9  # values that are this close to a kink, relative to the largest, lie on it


@dataclass(frozen=True)
class Switch:
    """The argument of a kink: the kink lies where its sign changes or, of `steps`, where it passes an integer."""

    argument: Expression
    steps: bool = False

    def inside(self, corners: Array, t: float) -> Any:
        """Whether the kink separates vertices of a simplex at time t, (n,); `corners` are (n, vertices, d), length."""
        try:
            values = self.argument(corners.reshape(-1, corners.shape[2]), t).reshape(corners.shape[:2])
        except ValueError:  # a condition that is compared with another has no sign
            return np.zeros(len(corners), dtype=bool)
        if not np.isfinite(values).all():
            return np.zeros(len(corners), dtype=bool)
        near = ROUNDING * max(float(np.abs(values).max(initial=0.0)), float(self.steps))
        low, high = values.min(axis=1), values.max(axis=1)
        if self.steps:
            return np.ceil(low + near) <= np.floor(high - near)
        return (low < -near) & (high > near)


def switches(formula: str) -> list[Switch]:
    """The kinks and jumps of a formula: of abs, min, max, comparisons, floor, ceil and %."""
    tree = ast.parse(formula.strip(), mode="eval")
    found = {(ast.unparse(argument), steps) for node in ast.walk(tree) for argument, steps in _arguments(node)}
    out = []
    for text, steps in sorted(found):
        with suppress(ValueError):  # t / 0, of t % 0: the values themselves say so
            out.append(Switch(Expression(text), steps))
    return out


def _arguments(node: ast.AST) -> Iterator[tuple[ast.expr, bool]]:
    """What switches at a node of a formula, and whether at integers."""
    if isinstance(node, ast.Compare):
        yield ast.BinOp(node.left, ast.Sub(), node.comparators[0]), False
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod):
        yield ast.BinOp(node.left, ast.Div(), node.right), True
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
        return
    if node.func.id == "abs":
        yield node.args[0], False
    if node.func.id in ("floor", "ceil"):
        yield node.args[0], True
    if node.func.id in ("min", "max"):
        for one, other in combinations(node.args, 2):
            yield ast.BinOp(one, ast.Sub(), other), False
