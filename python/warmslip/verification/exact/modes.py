"""Free vibration in a mode of the discrete problem: backward Euler's 2 x 2 recursion, to round-off, on any mesh.

For A phi = omega^2 rho M phi and viscosity B = beta A the momentum balance of u = a phi, w = b phi is scalar:

    (b_n - b_(n-1))/k + beta omega^2 b_n + omega^2 a_n = 0,    a_n = a_(n-1) + k b_n.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import eigsh

from warmslip.model.loads import Loads
from warmslip.records.check import Check, below, order
from warmslip.simulation.simulation import Simulation
from warmslip.studies.rates import least_squares
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

DENSITY, DAMPING, LAME, FAR = 1.7, 0.02, [1.5, 2.0], 10.0


def _scipy(matrix: Any) -> Any:
    """A petsc4py matrix as SciPy's, (rows, columns); on one rank."""
    copy = matrix.convert("aij", type(matrix)())  # `maij` stores a scalar block once
    pointers, columns, values = copy.getValuesCSR()
    out = sparse.csr_matrix((values.copy(), columns.copy(), pointers.copy()), shape=copy.getSize())
    copy.destroy()
    return out


def _job(mesh: fixtures.Triangulation, lame: list[float], k: float, steps: int) -> Simulation:
    scene = fixtures.blank(
        time__end=k * steps,
        time__steps=steps,
        inertia__density=DENSITY,
        elasticity__lame=lame,
        viscosity__lame=[DAMPING * value for value in lame],
        supports__displacement=["top"],
        contact__stiffness=1e4,
    )
    return fixtures.run(scene, Loads(gap=FAR), mesh)


def _modes(simulation: Simulation, count: int) -> tuple[Array, Array]:
    """The lowest eigenvalues omega^2 (count,) and modes (count, nodes, 2) of the clamped body, mass-normalised."""
    d = simulation.discretisation
    unit = 1 / d.full.inertia.density  # the density of the prediction is the one written above
    elastic, mass = _scipy(d.operators.elasticity), DENSITY * unit * _scipy(d.operators.inertia)
    held = np.zeros((len(fixtures.nodes(simulation)), 2))
    held[fixtures.on(simulation, "top")] = 1
    vector = d.layout.vector(2)
    d.layout.distribute(held.ravel(), vector)
    free = np.flatnonzero(np.asarray(vector) == 0)
    a, m = (matrix[free][:, free].tocsc() for matrix in (elastic, mass))
    values, modes = eigsh(a, count, m, sigma=0.0)
    out = []
    for mode in modes.T:
        full = np.zeros(elastic.shape[0])
        full[free] = mode
        vector.setArray(full)
        out.append(d.field(vector).copy())
    vector.destroy()
    return values, np.array(out)


def recursion() -> list[Check]:
    """Three modes of a distorted body at once, each with its own amplitude and velocity, for 50 steps."""
    k, steps = 0.05, 50
    simulation = _job(fixtures.distorted((4, 6), (1.0, 1.5)), LAME, k, steps)
    squares, modes = _modes(simulation, 3)
    a, b = np.array([0.3, -0.2, 0.1]), np.array([0.5, 0.4, -0.6])
    fixtures.start(simulation, u=np.tensordot(a, modes, 1), w=np.tensordot(b, modes, 1))
    scale = float(np.abs(np.tensordot(a, modes, 1)).max())
    speed = float(np.abs(np.tensordot(b, modes, 1)).max())
    wrong = {"u": 0.0, "w": 0.0}
    for _ in fixtures.steps(simulation):
        b = (b - k * squares * a) / (1 + k * DAMPING * squares + k * k * squares)
        a = a + k * b
        u, w, _ = fixtures.fields(simulation)
        wrong["u"] = max(wrong["u"], fixtures.worst(u, np.tensordot(a, modes, 1), scale))
        wrong["w"] = max(wrong["w"], fixtures.worst(w, np.tensordot(b, modes, 1), speed))
    name = "three modes, 50 steps"
    return [
        below(
            name,
            f"{part} follows backward Euler's recursion in the body's own modes",
            "theory",
            error,
            fixtures.ROUND_OFF,
        )
        for part, error in wrong.items()
    ]


def frequency() -> list[Check]:
    """Longitudinal modes of a bar: omega = (pi/2) sqrt(2 mu/rho)/H for lambda = 0; P1's lie above by (omega h/c)^2/12."""
    height, lame = 1.0, [0.0, 2.0]
    exact = (np.pi / 2 / height) ** 2 * 2 * lame[1] / DENSITY
    levels, excess = [4, 8, 16], []
    for n in levels:
        mesh = fixtures.crossed(np.linspace(0, height / 2, n // 2 + 1), np.linspace(0, height, n + 1))
        simulation = _job(mesh, lame, 1.0, 1)
        squares, modes = _modes(simulation, 4)
        # the bar bends too: the longitudinal mode is the one whose mean moves along y
        along = np.abs([fixtures.mean(simulation, mode)[1] for mode in modes])
        excess.append(float(squares[along.argmax()]) / exact - 1)
    p, _ = least_squares([1 / n for n in levels], excess)
    name = f"longitudinal mode, n = {levels[-1]}"
    # the nodes in the middle of the cells lower the excess of P1 on the cells' heights, and cannot make it negative
    most = (np.pi / 2 / levels[-1]) ** 2 / 12
    return [
        order(name, "omega^2 is O(h^2) too large", "analytic", 2.0, p),
        Check(name, "the excess is at most P1's on cells, positive", "analytic", most, excess[-1], 0.0, most),
    ]
