"""The estimated error of a single step of backward Euler, from what the last two steps changed. It costs no solve.

Backward Euler leaves out k^2/2 times the second derivative: k/2 (w_n - w_{n-1}) of the displacement, and of velocity and
temperature k_n/(k_n + k_{n-1}) times what the step adds to the straight line through the two states before (Hairer & Wanner,
Solving Ordinary Differential Equations II, section IV.8).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array

FIELDS = ("w", "theta")


NOISE = 1e-8  # strain per displacement over the size of the body below which a strain is rounding


class LocalError:
    """Of one run. `remember` notes the state before a step, `of` estimates the step, `take` makes it the last one.

    Errors are relative to the largest value of a field in the states so far, those of steps that were taken back included: the
    first try of a run is a longest step, which tells what the fields are going to be. The displacement is measured by |.|_V and,
    as that does not see rigid motions, by |.|_L2; velocity and temperature by |.|_L2. The velocity may jump, when a body meets
    its foundation; its error is therefore that of its mean over the longest step, which shrinks with the step also then. Without
    inertia the velocity is no state and has no part.
    """

    def __init__(self, discretisation: Discretisation, stepper: Any, longest: float) -> None:
        self._d, self._longest = discretisation, longest
        scene = discretisation.scene
        self._inertial = scene.inertia is not None and scene.inertia.density > 0
        self._creeps = scene.viscosity is not None
        self._extent = float(np.ptp(np.asarray(discretisation.mesh.nodes), axis=0).max())
        there = {name: getattr(stepper, name) for name in FIELDS}

        def vectors() -> dict[str, Any]:
            return {name: field.duplicate() for name, field in there.items() if field is not None}

        self._before, self._tried, self._change = vectors(), vectors(), vectors()  # the last: of the last step
        self._size = 0.0  # of the last step, time
        self._scales = self._norms(stepper)

    def _norms(self, stepper: Any) -> dict[str, float]:
        norms, found = self._d.norms, {}
        if stepper.u is not None:
            found = {"strain": norms.v(stepper.u), "u": norms.l2(stepper.u), "w": norms.l2(stepper.w)}
        if stepper.theta is not None:
            found["theta"] = norms.l2(stepper.theta)
        return found

    def remember(self, stepper: Any) -> None:
        """Notes the state before a step (collective)."""
        for name, before in self._before.items():
            getattr(stepper, name).copy(before)

    def of(self, stepper: Any, size: float) -> float:
        """The estimated error of the step of this `size` (time) that was taken last, dimensionless (collective)."""
        worst = 0.0
        for name, value in self._norms(stepper).items():
            self._scales[name] = max(self._scales[name], value)
        for name, before in self._before.items():
            now = getattr(stepper, name)
            change = self._tried[name]
            now.copy(change)
            change.axpy(-1.0, before)
            if name == "w":
                worst = max(worst, self._displacement(change, size))
            if name == "theta" or self._inertial:
                weight = math.sqrt(size / self._longest) if name == "w" else 1.0
                worst = max(worst, weight * _ratio(self._bend(name, change, size), self._scales[name]))
        return worst

    def _displacement(self, change: Any, size: float) -> float:
        """The estimated error of the displacement from the change of the velocity."""
        if self._size == 0 and not (self._inertial or self._creeps):
            return 0.0  # every step is in equilibrium, and there is no velocity before the first
        norms, scales = self._d.norms, self._scales
        strain = max(scales["strain"], NOISE * scales["u"] / self._extent)
        return max(_ratio(size / 2 * norms.v(change), strain), _ratio(size / 2 * norms.l2(change), scales["u"]))

    def _bend(self, name: str, change: Any, size: float) -> float:
        """k_n/(k_n + k_{n-1}) times the distance to the straight line through the two states before."""
        if self._size == 0:
            return float(self._d.norms.l2(change)) / 2
        bend = change.copy()
        bend.axpy(-size / self._size, self._change[name])
        found = float(self._d.norms.l2(bend)) * size / (size + self._size)
        bend.destroy()
        return found

    def take(self, size: float) -> None:
        """Makes the step that was estimated the last one."""
        self._change, self._tried = self._tried, self._change
        self._size = size

    def state(self) -> tuple[dict[str, float], dict[str, Array]]:
        """What a checkpoint keeps: numbers, and changes of the last step in mesh numbering (collective)."""
        arrays = {f"change_{name}": self._d.field(change) for name, change in self._change.items()}
        return {"size": self._size} | self._scales, arrays

    def restore(self, numbers: dict[str, float], arrays: dict[str, Array]) -> None:
        """Takes over what a checkpoint kept (collective)."""
        self._size = numbers["size"]
        self._scales = {name: numbers[name] for name in self._scales}
        for name, change in self._change.items():
            self._d.layout.distribute(arrays[f"change_{name}"].ravel(), change)


def _ratio(error: float, scale: float) -> float:
    """An error against its scale; 0 where there is neither."""
    return error / scale if error > 0 else 0.0
