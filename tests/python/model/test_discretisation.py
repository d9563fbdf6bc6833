"""The assembled problem: operators against SciPy's, petsc4py at work, load quadrature, norms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from petsc4py import PETSc
from reference import scipy_scheme

from warmslip import _core
from warmslip.model.discretisation import discretise
from warmslip.model.loads import Loads, evaluate
from warmslip.model.meshes import make_mesh
from warmslip.model.stress import von_mises
from warmslip.scene.reader import load
from warmslip.scene.scene import Scene

MakeScene = Callable[..., Scene]


def scipy_of(matrix: Any) -> Any:
    if matrix.getType().endswith("maij"):  # the mass of every component, stored once
        matrix = matrix.convert("aij", PETSc.Mat())
    indptr, indices, data = matrix.getValuesCSR()
    return sp.csr_matrix((data, indices, indptr), shape=matrix.getSize())


def relative(a: Any, b: Any) -> float:
    return float(abs(a - b).max() / abs(b).max())


@pytest.mark.parametrize("reading", scipy_scheme.READINGS)
def test_operators_equal_scipy(small: MakeScene, reading: str) -> None:
    n, k_c, k = 5, 0.7, 0.1
    scene = small(reading, mesh__n=n, contact__heat_exchange__conductance=k_c)
    d = discretise(scene)
    own, theirs = d.operators, scipy_scheme.operators(n, reading, k_c)
    names = {
        "mass": "M",
        "elasticity": "A",
        "viscosity": "B",
        "conductivity": "D",
        "expansion": "G",
        "heating": "E",
        "exchange": "J",
    }
    for name, letter in names.items():
        assert relative(scipy_of(getattr(own, name)), theirs[letter]) <= 1e-13, name
    vector_mass = sp.kron(theirs["M"], np.eye(2))
    assert relative(scipy_of(own.inertia.convert("aij", PETSc.Mat())), vector_mass) <= 1e-13
    # the operators of a step: supports are rows and columns of the identity
    free = np.ones(2 * (n + 1) ** 2)
    free[own.prescribed_displacement] = 0
    momentum = sp.diags(free) @ (vector_mass / k + theirs["B"] + k * theirs["A"]) @ sp.diags(free) + sp.diags(1 - free)
    assert relative(scipy_of(_core.momentum_matrix(d.layout, d.problem, own, k)), momentum) <= 1e-13
    free = np.ones((n + 1) ** 2)
    free[own.prescribed_temperature] = 0
    heat = sp.diags(free) @ (theirs["M"] / k + theirs["D"] + theirs["J"]) @ sp.diags(free) + sp.diags(1 - free)
    assert relative(scipy_of(_core.heat_matrix(own, k)), heat) <= 1e-13
    assert sorted(own.prescribed_temperature) == [
        i for i in range((n + 1) ** 2) if i % (n + 1) in (0, n) or i // (n + 1) == n
    ]


def test_petsc4py_owns_the_operators(small: MakeScene) -> None:
    """They work in petsc4py's hands, and outlive the discretisation they came from."""
    d = discretise(small(mesh__n=3))
    elasticity, mass = d.operators.elasticity, d.operators.mass
    x = d.layout.vector(2)
    nodes = np.asarray(d.mesh.nodes)
    d.layout.distribute(np.stack([-nodes[:, 1], nodes[:, 0]], axis=1).ravel(), x)
    area = d.layout.vector(1)
    area.set(1)
    del d
    assert (elasticity * x).norm() <= 1e-13 * elasticity.norm()
    assert area.dot(mass * area) == pytest.approx(1, rel=1e-14)
    assert elasticity.convert("aij", PETSc.Mat()).isSymmetric(1e-14)  # it is stored in blocks


def test_matrices_keep_their_values_when_python_lets_go(small: MakeScene) -> None:
    d = discretise(small(mesh__n=2))
    norms = {d.operators.viscosity.norm() for _ in range(50)}
    assert len(norms) == 1


@pytest.mark.parametrize("dim", [2, 3])
def test_load_quadrature_is_exact_for_polynomials(dim: int) -> None:
    """Total load and total first moment of x^a y^b (z^c), in the volume and on the bottom."""
    scene = load("paper_mixed" if dim == 2 else "block_3d", ["mesh.n=2"])
    d = discretise(scene)
    quadrature = _core.LoadQuadrature2 if dim == 2 else _core.LoadQuadrature3
    points, nodes = 3, np.asarray(d.mesh.nodes)
    one, x = d.layout.vector(1), d.layout.vector(1)
    one.set(1)
    d.layout.distribute(nodes[:, 0].copy(), x)
    powers = [p for p in np.ndindex(*[2 * points] * dim) if sum(p) <= 2 * points - 2]
    for part in (None, "bottom"):
        rule = quadrature(d.layout, part, points)
        at = np.asarray(rule.positions)
        for p in powers:
            vector = rule.load(np.prod(at**p, axis=1)[:, None])
            axes = list(p) if part is None else list(p[:-1])
            exact = np.prod([1 / (a + 1) for a in axes]) * (part is None or p[-1] == 0)
            moment = exact * (axes[0] + 1) / (axes[0] + 2)
            assert vector.dot(one) == pytest.approx(exact, rel=1e-12, abs=1e-15)
            assert vector.dot(x) == pytest.approx(moment, rel=1e-12, abs=1e-15)
    # vector loads keep their components apart
    both = d.layout.gather(quadrature(d.layout, None, 1).load(np.tile(np.arange(1.0, dim + 1), (len(d.mesh.cells), 1))))
    assert np.asarray(both).reshape(-1, dim).sum(axis=0) == pytest.approx(np.arange(1.0, dim + 1), rel=1e-13)


def test_unknown_part_is_refused(small: MakeScene) -> None:
    d = discretise(small())
    with pytest.raises(ValueError, match=r"no boundary part 'roof'.*bottom, left, right, top"):
        _core.LoadQuadrature2(d.layout, "roof", 1)


def test_data_must_have_its_shape_and_be_finite() -> None:
    x = np.zeros((3, 2))
    assert evaluate(2.0, x, 0, 1).tolist() == [[2.0]] * 3
    assert evaluate([1.0, 2.0], x, 0, 2).tolist() == [[1.0, 2.0]] * 3
    assert evaluate(lambda x, t: t * np.ones(len(x)), x, 5, 1).tolist() == [[5.0]] * 3
    with pytest.raises(ValueError, match="shape"):
        evaluate(np.zeros((2, 2)), x, 0, 2)
    with pytest.raises(ValueError, match="not finite at t = 1"):
        evaluate(lambda x, t: np.full(3, np.nan), x, 1, 1)


def test_norms_are_exact(small: MakeScene) -> None:
    d = discretise(small(mesh__diagonal="crisscross"))
    nodes = np.asarray(d.mesh.nodes)
    v = d.layout.vector(2)
    d.layout.distribute(np.stack([2 * nodes[:, 1], 3 * nodes[:, 1]], axis=1).ravel(), v)
    assert d.norms.v(v) == pytest.approx(np.sqrt(9 + 2), rel=1e-14)  # eps = [[0, 1], [1, 3]]
    assert d.norms.l2(v) == pytest.approx(np.sqrt(13 / 3), rel=1e-14)


def test_stress_and_von_mises(small: MakeScene) -> None:
    d = discretise(small())
    nodes = np.asarray(d.mesh.nodes)
    u, w = nodes @ np.array([[1.0, 0], [0.5, 2]]).T, nodes @ np.array([[0, 1.0], [0, 0]]).T
    theta = np.full(len(nodes), 3.0)
    lam, mu = d.scene.elasticity.pair(2)
    eps, rate = np.array([[1, 0.25], [0.25, 2]]), np.array([[0, 0.5], [0.5, 0]])
    exact = lam * 3 * np.eye(2) + 2 * mu * eps + 10 * rate - 3 * np.ones((2, 2))
    assert np.abs(d.stress(u, w, theta) - exact).max() <= 1e-13 * np.abs(exact).max()
    assert von_mises(np.array([[[2.0, 0], [0, 0]]])) == pytest.approx([2])
    assert von_mises(np.array([[[0, 1.0], [1.0, 0]]])) == pytest.approx([np.sqrt(3)])


def test_contact_surface(small: MakeScene) -> None:
    surface = discretise(small()).surface
    assert np.asarray(surface.weights).tolist() == [0.125, 0.25, 0.25, 0.25, 0.125]
    assert (np.asarray(surface.normals) == [0, -1]).all()
    assert (np.asarray(surface.positions)[:, 1] == 0).all()
    gauss = discretise(small(contact__quadrature="gauss-3")).surface
    assert (len(gauss.weights), gauss.nodes, np.sum(gauss.weights)) == (12, 5, pytest.approx(1, rel=1e-14))
    with pytest.raises(
        ValueError, match=r"contact\.part"
    ):  # one grid cell: every bottom node is clamped by left and right
        discretise(small(mesh__n=1, supports__displacement=["left", "right"], loads__traction={}))


def test_meshes_of_scenes(small: MakeScene) -> None:
    mesh = make_mesh(small(mesh__n=[2, 3], mesh__lengths=[2.0, 1.0]))
    assert len(mesh.cells) == 12
    assert np.asarray(mesh.nodes).max(axis=0).tolist() == [2, 1]
    assert Loads.of(small()).foundation_temperature == 0


@pytest.mark.parametrize(("n", "ratio"), [(3, 8.0), (4, 0.25)])
def test_graded_bricks_grow_as_the_key_says(small: MakeScene, n: int, ratio: float) -> None:
    """A geometric progression, added up: its last cell is ratio^((n-1)/n) times the first; twice as many keep its nodes."""

    def places(cells: int) -> Any:
        mesh = make_mesh(small(mesh__n=[cells, 1], mesh__lengths=[2.0, 1.0], mesh__grading=[ratio, 1.0]))
        return np.unique(np.asarray(mesh.nodes)[:, 0].round(13))

    row = ratio ** (np.arange(n) / n)
    sizes = np.diff(places(n))
    assert np.abs(sizes - 2 * row / row.sum()).max() <= 1e-12
    assert sizes[-1] / sizes[0] == pytest.approx(ratio ** ((n - 1) / n), rel=1e-10)
    assert np.abs(places(2 * n)[::2] - places(n)).max() <= 1e-12
