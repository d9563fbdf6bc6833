"""From a scene to the discrete problem: mesh, operators, contact surface and loads in the compiled core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip import _core
from warmslip.loads import Array, Loads, LoadVectors, evaluate
from warmslip.scene import Scene
from warmslip.tables import IsotropicTable


def _d(name: str, dim: int) -> Any:
    return getattr(_core, f"{name}{dim}")


def mandel(table: IsotropicTable, dim: int) -> Array:
    """The isotropic tensor lambda tr(e) I + 2 mu e in Mandel form, (3, 3) or (6, 6)."""
    lam, mu = table.pair(dim)
    tensor = 2 * mu * np.eye(dim * (dim + 1) // 2)
    tensor[:dim, :dim] += lam
    return tensor


def make_mesh(scene: Scene) -> Any:
    """The scene's mesh as a `_core.Mesh2` or `_core.Mesh3`."""
    table = scene.mesh
    return _d("Mesh", table.dim).box(table.counts, table.sides, getattr(_core.Diagonal, table.diagonal))


@dataclass(frozen=True)
class Discretisation:
    """Everything of a scene that does not depend on the step size. Matrices are petsc4py objects (`operators.elasticity` ...)."""

    scene: Scene
    loads: Loads
    mesh: Any
    problem: Any
    layout: Any
    operators: Any
    surface: Any
    norms: Any
    load_vectors: LoadVectors

    @property
    def dim(self) -> int:
        return self.scene.mesh.dim

    @property
    def unknowns(self) -> int:
        """Degrees of freedom of u and theta together, supports included."""
        return (self.dim + 1) * len(self.mesh.nodes)

    def stepper(self, *, backend: str = "automatic", tolerance: float | None = None) -> Any:
        """A `_core.Stepper` at the initial data; `backend` is automatic, cholmod or petsc."""
        scene = self.scene
        options = _core.ContactOptions()
        if tolerance is not None:
            options.tolerance = tolerance
        stepper = _d("Stepper", self.dim)(
            self.layout,
            self.problem,
            self.operators,
            self.surface,
            k=scene.step,
            coupling=getattr(_core.Coupling, scene.time.coupling),
            backend=getattr(_core.Backend, backend),
            contact=options,
        )
        zero = np.zeros(self.dim)
        initial = scene.initial
        return self.restart(
            stepper,
            np.tile(zero if initial.displacement is None else initial.displacement, (len(self.mesh.nodes), 1)),
            np.tile(zero if initial.velocity is None else initial.velocity, (len(self.mesh.nodes), 1)),
            np.full(len(self.mesh.nodes), initial.temperature),
            0.0,
        )

    def restart(self, stepper: Any, u: Array, w: Array, theta: Array, time: float) -> Any:
        """Sets the state from nodal arrays (nodes, d), (nodes, d), (nodes,), made zero on the supports."""
        u, w, theta = u.copy(), w.copy(), theta.copy()
        for part in self.scene.supports.displacement:
            u[np.unique(self.mesh.parts[part])] = 0
            w[np.unique(self.mesh.parts[part])] = 0
        for part in self.scene.supports.temperature:
            theta[np.unique(self.mesh.parts[part])] = 0
        vectors = [self.layout.vector(self.dim), self.layout.vector(self.dim), self.layout.vector(1)]
        for values, vector in zip((u, w, theta), vectors, strict=True):
            self.layout.distribute(values.ravel(), vector)
        gap = evaluate(self.loads.gap, self.surface.positions, time, 1)[:, 0]
        stepper.start(*vectors, gap, time)
        for vector in vectors:
            vector.destroy()  # petsc4py would only mark it for a later collection
        return stepper

    def field(self, vec: Any) -> Array:
        """A vector in mesh numbering on every rank: (nodes, d), or (nodes,) for theta. Collective."""
        values = np.asarray(self.layout.gather(vec))
        return values if len(values) == len(self.mesh.nodes) else values.reshape(len(self.mesh.nodes), -1)

    def stress(self, u: Array, w: Array, theta: Array) -> Array:
        """Cauchy stress (2.1) at the centroids, (cells, d, d)."""
        flat = _core.stress(self.mesh, self.problem.material, u, w, theta)
        return np.asarray(flat).reshape(-1, self.dim, self.dim)

    def mises(self, stepper: Any) -> Array:
        """Von Mises stress of a stepper's state, (cells,). Collective."""
        u, w, theta = (self.field(getattr(stepper, name)) for name in ("u", "w", "theta"))
        return von_mises(self.stress(u, w, theta))


def discretise(scene: Scene, *, comm: Any = None, loads: Loads | None = None, mesh: Any = None) -> Discretisation:
    """Assembles a scene on a communicator (default: all ranks). `loads` replaces the scene's, `mesh` its structured mesh.

    Collective. Raises ValueError when the contact part has no free node.
    """
    from mpi4py import MPI

    comm = MPI.COMM_WORLD if comm is None else comm
    d, contact = scene.mesh.dim, scene.contact
    loads = loads or Loads.of(scene)
    mesh = make_mesh(scene) if mesh is None else mesh
    material = _d("Material", d)(
        density=scene.inertia.density,
        elasticity=mandel(scene.elasticity, d),
        viscosity=mandel(scene.viscosity, d),
        conductivity=np.array(scene.heat.conductivity),
        expansion=np.array(scene.heat.expansion.tensor),
        heating=np.array(scene.heat.heating.tensor),
    )
    problem = _d("Problem", d)(
        mesh=mesh,
        material=material,
        clamped=scene.supports.displacement,
        cooled=scene.supports.temperature,
        contact_part=contact.part,
        stiffness=contact.stiffness,
        friction=contact.friction.coefficient,
        quadrature=contact.points,
        conductance=contact.heat_exchange.conductance,
    )
    layout = _d("Layout", d)(comm, mesh)
    surface = _d("ContactSurface", d)(layout, problem)
    if len(surface.weights) == 0:
        raise ValueError(
            f"contact.part: every node of '{contact.part}' is clamped, there is nothing to touch; release one"
        )
    vectors = LoadVectors(layout, surface, loads, contact.part, contact.heat_exchange.conductance, d, comm)
    return Discretisation(
        scene,
        loads,
        mesh,
        problem,
        layout,
        _d("Operators", d)(layout, problem),
        surface,
        _d("Norms", d)(layout),
        vectors,
    )


def stress_measures(d: Discretisation, stepper: Any) -> dict[str, float]:
    """L2 norm and maximum of the von Mises stress of a stepper's state, at the cells' centroids (collective)."""
    mises = d.mises(stepper)
    x = np.asarray(d.mesh.nodes)[np.asarray(d.mesh.cells)]
    volume = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / (2 if d.dim == 2 else 6)
    return {"mises_L2": float(np.sqrt(volume @ mises**2)), "mises_max": float(mises.max())}


def von_mises(stress: Array) -> Array:
    """sqrt(3/2 s:s) with s the deviator of the stress, its missing row and column zero for d = 2 (plane stress): (cells,)."""
    full = np.zeros((len(stress), 3, 3))
    d = stress.shape[1]
    full[:, :d, :d] = stress
    deviator = full - np.trace(full, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("cij,cij->c", deviator, deviator)))
