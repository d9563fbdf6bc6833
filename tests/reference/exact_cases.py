"""Problems small enough for the exact scheme, and the core's runs of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import warmslip
from reference.exact_forms import Mesh, box
from reference.exact_numbers import exact, floats
from reference.exact_scheme import Scheme, State
from warmslip import Scene, _core, discretise
from warmslip.simulation.simulation import Simulation

COUPLINGS = "staggered", "lagged", "monolithic"

# one triangle that floats; a wedge on two slopes of 3-4-5, whose tip has a contact point for each normal
TRIANGLE = Mesh(
    exact([[0, 0], [1, 0], [0.25, 1]]), [(0, 1, 2)], {"bottom": [(0, 1)], "right": [(1, 2)], "left": [(0, 2)]}
)
WEDGE = Mesh(
    exact([[0, 0.75], [1, 0], [2, 0.75], [0, 2], [2, 2]]),
    [(0, 1, 3), (1, 4, 3), (1, 2, 4)],
    {"bottom": [(0, 1), (1, 2)], "left": [(0, 3)], "right": [(2, 4)], "top": [(3, 4)]},
)
# a tetrahedron that floats on three points, and one held on the facet x = 0 that touches in the point (1, 0, 0)
FLOATING = Mesh(
    exact([[0, 0, 0], [1, 0, 0], [0.25, 1, 0], [0.5, 0.75, 1]]),
    [(0, 1, 2, 3)],
    {"bottom": [(0, 1, 2)], "front": [(0, 1, 3)], "left": [(0, 2, 3)], "right": [(1, 2, 3)]},
)
ARM = Mesh(
    exact([[1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]),
    [(0, 1, 2, 3)],
    {"bottom": [(0, 1, 2)], "left": [(1, 2, 3)], "back": [(0, 1, 3)], "front": [(0, 2, 3)]},
)

PAPER = {"time.end": 1.0, "time.steps": 3, "supports.temperature": ["top"]}
# no two constants alike, so that none can stand in for another
GENERIC: dict[str, Any] = {
    "time.end": 0.5,
    "time.steps": 2,
    "inertia.density": 1.5,
    "elasticity": {"lame": [3.0, 1.25]},
    "viscosity": {"lame": [0.5, 0.75]},
    "heat.conductivity": [[1.5, 0.25], [0.25, 0.75]],
    "heat.expansion.tensor": [[0.5, 0.25], [0.25, 1.0]],
    "heat.heating.tensor": [[1.0, -0.5], [-0.5, 0.25]],
    "heat.source": 2.0,
    "loads.body": [1.5, -3.0],
    "loads.traction": {"left": [1.25, 0.5], "right": [-0.5, -0.75]},
    "supports.temperature": ["top"],
    "contact.stiffness": 200.0,
    "contact.gap": 0.01,
    "contact.friction.coefficient": 0.3,
    "contact.heat_exchange.conductance": 0.75,
    "contact.heat_exchange.foundation_temperature": -4.0,
    "initial.displacement": [0.05, -0.02],
    "initial.velocity": [-0.25, -0.5],
    "initial.temperature": 1.5,
}
AFLOAT: dict[str, Any] = {"supports.displacement": [], "supports.temperature": ["left"]}
SOLID: dict[str, Any] = GENERIC | {
    "heat.conductivity": [[1.5, 0.25, 0.0], [0.25, 0.75, 0.125], [0.0, 0.125, 1.0]],
    "heat.expansion.tensor": [[0.5, 0.25, 0.0], [0.25, 1.0, 0.5], [0.0, 0.5, 0.75]],
    "heat.heating.tensor": [[1.0, -0.5, 0.25], [-0.5, 0.25, 0.0], [0.25, 0.0, 0.5]],
    "loads.body": [1.5, -0.75, -3.0],
    "loads.traction": {"front": [-0.5, 0.25, -0.75]},
    "initial.displacement": [0.05, 0.02, -0.02],
    "initial.velocity": [-0.25, 0.5, -0.5],
}
# mirror-symmetric in y: the tip of the arm slides along x
MIRRORED: dict[str, Any] = SOLID | {
    "heat.conductivity": [[1.5, 0.0, 0.25], [0.0, 0.75, 0.0], [0.25, 0.0, 1.0]],
    "heat.expansion.tensor": [[0.5, 0.0, 0.25], [0.0, 1.0, 0.0], [0.25, 0.0, 0.75]],
    "heat.heating.tensor": [[1.0, 0.0, 0.25], [0.0, 0.25, 0.0], [0.25, 0.0, 0.5]],
    "loads.traction": {},
    "supports.displacement": ["left"],
    "supports.temperature": ["left"],
    "initial.displacement": [0.05, 0.0, -0.02],
    "initial.velocity": [0.0, 0.0, -0.5],
}


@dataclass(frozen=True, eq=False)
class Case:
    """A scene of the library with keys replaced, on a mesh; a mesh named by its number of cells a side is the scene's own."""

    mesh: Mesh | int
    keys: dict[str, Any]
    library: str = "paper_printed"

    def scene(self, **more: Any) -> Scene:
        size = {"mesh.n": self.mesh} if isinstance(self.mesh, int) else {}
        return warmslip.load(self.library).override(**size | self.keys | more)

    def exact_mesh(self) -> Mesh:
        dim = 2 if self.library.startswith("paper") else 3
        return box(*[self.mesh] * dim) if isinstance(self.mesh, int) else self.mesh

    @cached_property
    def scheme(self) -> Scheme:
        return Scheme(self.scene().resolved(), self.exact_mesh())

    @cached_property
    def states(self) -> list[State]:
        """The exact states, the initial one first."""
        return [self.scheme.start(), *self.scheme.advance()]

    def run(self, **more: Any) -> Simulation:
        """The core on this case, not yet stepped."""
        scene, mesh = self.scene(**more), self.exact_mesh()
        if isinstance(self.mesh, int):
            return Simulation(scene)
        kind = _core.Mesh2 if mesh.dim == 2 else _core.Mesh3
        parts = {name: np.array(facets) for name, facets in mesh.parts.items()}
        return Simulation(
            scene, discretisation=discretise(scene, mesh=kind.from_lists(floats(mesh.nodes), mesh.cells, parts))
        )


CASES: dict[str, Case] = {
    f"{mesh}, {coupling}, {quadrature}": Case(
        cells, GENERIC | keys | {"time.coupling": coupling, "contact.quadrature": quadrature}
    )
    for mesh, cells, keys in (
        ("triangle", TRIANGLE, AFLOAT | {"loads.traction": {"right": [-0.5, -0.75]}}),
        ("square", 1, {}),
        ("squares", 2, {}),
        ("wedge", WEDGE, {}),
    )
    for coupling in COUPLINGS
    for quadrature in ("nodal", "gauss-2")
    # 256 combinations in Q(sqrt 3) take seconds
    if quadrature == "nodal" or mesh in ("triangle", "square") or coupling == "monolithic"
}
CASES |= {
    f"{reading}, {coupling}, {foundation}": Case(
        2,
        PAPER | {"time.coupling": coupling, "contact.heat_exchange.foundation_temperature": foundation},
        f"paper_{reading}",
    )
    for reading in ("printed", "mixed", "isotropic", "consistent")
    for coupling, foundation in zip(COUPLINGS, (0.0, 10.0, 10.0), strict=True)
}
CASES |= {
    f"arm pulled by {pull:g}, {coupling}": Case(
        ARM, MIRRORED | {"time.coupling": coupling, "loads.body": [pull, 0.0, -3.0]}, "block_3d"
    )
    for coupling, pull in zip(COUPLINGS, (8.0, -8.0, 0.5), strict=True)
}
CASES |= {
    "tetrahedron, frictionless": Case(FLOATING, SOLID | AFLOAT | {"contact.friction.coefficient": 0.0}, "block_3d"),
    "cube, frictionless": Case(1, SOLID | {"contact.friction.coefficient": 0.0}, "block_3d"),
    "tetrahedron, stuck": Case(FLOATING, SOLID | AFLOAT | {"contact.friction.coefficient": 20.0}, "block_3d"),
}

TWO_TRIANGLES: dict[str, Any] = {"time.steps": 2, "supports.temperature": ["top"]}
# where Newton cycled, with the threshold of the pressure in place of that of the unknown force, although the answer is
# unique
CYCLES = {
    "the paper's data, eight triangles, k = 1/3": CASES["printed, lagged, 10.0"],
    "mu = 0.2, two triangles": Case(
        1,
        TWO_TRIANGLES
        | {
            "time.coupling": "monolithic",
            "contact.stiffness": 1e3,
            "contact.heat_exchange.foundation_temperature": 10.0,
            "loads.body": [0.0, -2.0],
            "initial.velocity": [-1.0, -1.0],
        },
    ),
    "mu = 0.5, k = 100": Case(
        2,
        {
            "time.end": 200.0,
            "time.steps": 2,
            "contact.friction.coefficient": 0.5,
            "contact.heat_exchange.foundation_temperature": -10.0,
            "loads.body": [1.0, -2.0],
        },
    ),
    "mu = 2, two Gauss points": Case(
        1,
        TWO_TRIANGLES
        | {
            "time.coupling": "monolithic",
            "time.end": 2.0,
            "contact.friction.coefficient": 2.0,
            "loads.body": [4.0, -2.0],
            "initial.velocity": [-1.0, -1.0],
            "contact.quadrature": "gauss-2",
        },
    ),
    "mu = 5, k = 1/8": Case(
        1,
        TWO_TRIANGLES
        | {
            "time.coupling": "lagged",
            "time.end": 0.25,
            "contact.friction.coefficient": 5.0,
            "loads.body": [-4.0, -1.0],
            "loads.traction": {},
            "initial.velocity": [-1.0, 0.0],
        },
        "paper_isotropic",
    ),
}
# where friction is so strong that the scheme has several solutions: their number in the first step, and the case
SEVERAL = {
    "mu = 2, k = 4": (
        3,
        Case(
            1,
            {
                "time.coupling": "monolithic",
                "time.end": 8.0,
                "time.steps": 2,
                "contact.stiffness": 100.0,
                "contact.friction.coefficient": 2.0,
                "loads.body": [1.0, -1.0],
                "contact.quadrature": "gauss-2",
            },
        ),
    ),
    "mu = 5, k = 1": (
        5,
        Case(
            2,
            TWO_TRIANGLES
            | {
                "time.end": 2.0,
                "contact.friction.coefficient": 5.0,
                "loads.body": [4.0, -1.0],
                "loads.traction": {},
                "initial.velocity": [1.0, 0.0],
            },
            "paper_consistent",
        ),
    ),
}
