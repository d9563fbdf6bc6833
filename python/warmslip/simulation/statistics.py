"""What a run has counted so far: residuals of its balances, estimated errors of its fields, iterations of its contact solver."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

BALANCES = ("energy", "heat", "force", "law")
RESIDUALS = {name: f"{name}_residual" for name in BALANCES}  # what they are called in `_core.Balances`
FIELDS = ("u", "theta", "stress", "contact_force")  # whose errors are estimated, `_core.Errors`


def residuals(report: Any) -> dict[str, float]:
    """The relative residual of each balance of a step, dimensionless."""
    balances = report.balances
    return {name: getattr(balances, attribute) for name, attribute in RESIDUALS.items()}


def estimates(report: Any) -> dict[str, float]:
    """Estimated relative errors of the fields that were measured in the step, dimensionless."""
    errors = report.errors
    found = {name: getattr(errors, name) for name in FIELDS}
    return {name: value for name, value in found.items() if value == value}


def worse(one: float, other: float) -> float:
    """The larger of two residuals; a nan is worse than anything."""
    return other if not other <= one else one


def digits(errors: dict[str, float]) -> dict[str, float]:
    """Decimal digits that estimated relative errors leave to be trusted, 16 at most, by field; rounded down to a tenth."""
    return {
        name: math.floor(10 * min(16.0, max(0.0, -math.log10(value)))) / 10 if value > 0 else 16.0
        for name, value in errors.items()
    }


@dataclass
class Statistics:
    """Largest relative residual of each balance, largest estimated relative error of each field that was measured
    (dimensionless), largest number of Newton iterations in a step, and steps by the stage that solved them."""

    residuals: dict[str, float] = field(default_factory=lambda: dict.fromkeys(BALANCES, 0.0))
    errors: dict[str, float] = field(default_factory=dict)
    newton_max: int = 0
    stages: dict[str, int] = field(default_factory=dict)

    def attempted(self, report: Any) -> None:
        """Counts the work of a step, taken or not."""
        self.newton_max = max(self.newton_max, report.newton_iterations)
        stage = report.stage.name
        self.stages[stage] = self.stages.get(stage, 0) + 1

    def taken(self, report: Any, undetermined: tuple[str, ...]) -> None:
        """Counts what a step that was taken leaves; `undetermined` are the fields without digits where its report says so."""
        for name, value in residuals(report).items():
            self.residuals[name] = worse(self.residuals[name], value)
        if report.errors.measured:  # in few steps
            for name, value in estimates(report).items():
                self.errors[name] = max(self.errors.get(name, 0.0), value)
        if report.undetermined:
            self.errors |= dict.fromkeys(undetermined, 1.0)

    def trusted(self, extents: Any) -> dict[str, float]:
        """Estimated relative errors of the fields that were measured, dimensionless: the largest of all steps.

        Also the largest change of a field against its largest value in the run, whatever rounding of other fields makes;
        `extents` are those of the stepper.
        """
        found = dict(self.errors)
        for name, (size, _, change) in zip(FIELDS, np.reshape(extents[:-6], (-1, 3)), strict=True):
            if name in found and size > 0:
                found[name] = max(found[name], float(change / size))
        return found

    @property
    def sound(self) -> bool:
        """Whether every entry is what a run counts, as one that was read from a file may not be."""
        counts = [self.newton_max, *self.stages.values()]
        return (
            self.residuals.keys() == set(BALANCES)
            and self.errors.keys() <= set(FIELDS)
            and all(type(value) is float for value in (*self.residuals.values(), *self.errors.values()))
            and all(type(count) is int and count >= 0 for count in counts)
        )
