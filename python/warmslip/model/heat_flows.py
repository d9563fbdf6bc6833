"""Heat that contact parts and supports of the temperature give to the body."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip._core import LoadQuadrature2, LoadQuadrature3
from warmslip.model.discretisation import Discretisation
from warmslip.model.loads import HEATED, evaluate, of_time
from warmslip.typing import Array


class HeatFlows:
    """Heat per time into the body, by part: positive where it warms the body.

    A node in several supports counts for the first in the order of the scene.

    Attributes
    ----------
    names : list of str
        `exchange PART`, conducted from the foundation; `friction PART`, made by friction; `support PART`, of a part whose
        temperature is given.
    """

    def __init__(self, d: Discretisation) -> None:
        self._d = d
        heated = d.scene.contacts if d.scene.heat is not None else []
        self._exchanging = [i for i, contact in enumerate(heated) if contact.heat_exchange is not None]
        self._rubbing = [i for i, contact in enumerate(heated) if contact.friction_heating is not None]
        self._supports = list(d.scene.supports.temperature)
        self.names = [f"exchange {heated[i].part}" for i in self._exchanging]
        self.names += [f"friction {heated[i].part}" for i in self._rubbing]
        self.names += [f"support {part}" for part in self._supports]
        self._of_point = np.asarray(d.surface.contacts, dtype=int)
        self._owner = self._owners()
        self._foundation: dict[int, float] = {}

    def _owners(self) -> Any:
        """The number of the support of every node of this rank, -1 for none."""
        layout, out = self._d.layout, np.full(len(self._d.mesh.nodes), -1)
        for number, part in reversed(list(enumerate(self._supports))):
            out[np.unique(self._d.mesh.parts[part])] = number
        return out[np.asarray(layout.mesh_nodes)[: layout.owned_nodes]]

    def of(self, stepper: Any) -> Array:
        """Of the step that a stepper evaluated last, heat per time, in the order of `names` (collective)."""
        if not self.names:
            return np.empty(0)
        pressed = np.asarray(stepper.contact_heat_flow).reshape(-1, 2)
        out = [-self._at_points(i, pressed, 0) for i in self._exchanging]
        conducting = [at for at, i in enumerate(self._exchanging) if self._conductance(i)]
        theta = self._d.field(stepper.theta) if conducting else np.empty(0)
        for at in conducting:
            out[at] += self._conducted(self._exchanging[at], theta, float(stepper.time))
        out += [self._at_points(i, pressed, 1) for i in self._rubbing]
        return np.array([*out, *self._of_supports(stepper.support_heat)])

    def _conductance(self, number: int) -> float:
        exchange = self._d.scene.contacts[number].heat_exchange
        return exchange.conductance if exchange is not None else 0.0

    def _at_points(self, number: int, flow: Array, column: int) -> float:
        return float(flow[self._of_point == number, column].sum()) if len(flow) else 0.0

    def _of_supports(self, vector: Any) -> Array:
        if not self._supports:
            return np.empty(0)
        here = self._owner >= 0
        sums = np.bincount(self._owner[here], vector.getArray(readonly=1)[here], minlength=len(self._supports))
        return np.asarray(vector.comm.tompi4py().allreduce(sums))

    def _conducted(self, number: int, theta: Array, t: float) -> float:
        """k_c int (theta_F - theta) over a part."""
        part = self._d.scene.contacts[number].part
        area = np.linalg.norm(self._d.mesh.area_normals(part), axis=1)
        body = float(area @ theta[np.asarray(self._d.mesh.parts[part])].mean(axis=1))
        return self._conductance(number) * (self._of_foundation(number, t) - body)

    def _of_foundation(self, number: int, t: float) -> float:
        """int theta_F over a part, by the quadrature of the loads."""
        if number in self._foundation:
            return self._foundation[number]
        d, part = self._d, self._d.scene.contacts[number].part
        data = d.loads.on_contact("foundation_temperature", number)
        lumped = d.scene.heat is not None and d.scene.heat.capacity_matrix == "lumped"
        key = part, 0 if lumped else d.loads.points if callable(data) else 1
        rules = d.load_vectors.rules
        if key not in rules:
            rules[key] = (LoadQuadrature2 if d.dim == 2 else LoadQuadrature3)(d.layout, *key)
        vector = rules[key].load(evaluate(data, rules[key].positions, t, 1, HEATED))
        total = float(vector.sum())
        vector.destroy()
        if not of_time(data):
            self._foundation[number] = total
        return total
