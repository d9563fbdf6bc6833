"""From a scene to the discrete problem: mesh, operators, contact surface and loads in the compiled core."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip import _core, mesh_files
from warmslip.expressions import Expression
from warmslip.laws import Law
from warmslip.loads import Array, Loads, LoadVectors, data, evaluate
from warmslip.scene import FullScene, Scene
from warmslip.tables import ContactTable, IsotropicTable, RegionTable

COUPLINGS = ("expansion", "heating")
log = logging.getLogger(__name__)


def _d(name: str, dim: int) -> Any:
    return getattr(_core, f"{name}{dim}")


def mandel(table: IsotropicTable, dim: int) -> Array:
    """The tensor of a table in Mandel form, (3, 3) or (6, 6): lambda tr(e) I + 2 mu e, or the full one."""
    if table.tensor is not None:
        shear = np.concatenate([np.ones(dim), np.full(dim * (dim - 1) // 2, np.sqrt(2))])
        return np.asarray(np.array(table.tensor) * np.outer(shear, shear))
    lam, mu = table.pair(dim)
    tensor = 2 * mu * np.eye(dim * (dim + 1) // 2)
    tensor[:dim, :dim] += lam
    return tensor


def _matrix(value: Any, dim: int) -> Array:
    return np.array(value, dtype=float) if isinstance(value, list) else value * np.eye(dim)


def make_mesh(scene: Scene) -> Any:
    """The scene's mesh as a `_core.Mesh2` or `_core.Mesh3`."""
    table = scene.mesh
    kind = _d("Mesh", table.dim)
    if table.file is not None:
        read = mesh_files.read(table.file)
        return kind.from_lists(read.nodes, read.cells, read.parts)
    mesh = kind.box(table.counts, table.sides, getattr(_core.Diagonal, table.diagonal))
    if table.grading is None:
        return mesh
    nodes = np.array(mesh.nodes)
    for axis, (ratio, length) in enumerate(zip(table.grading, table.sides, strict=True)):
        if ratio != 1:  # a geometric row of bricks; halving them keeps meshes nested
            with np.errstate(over="ignore", invalid="ignore"):  # the mesh refuses what is not finite
                nodes[:, axis] = length * np.expm1(np.log(ratio) * nodes[:, axis] / length) / (ratio - 1)
    return kind.from_lists(nodes, mesh.cells, {name: np.array(facets) for name, facets in mesh.parts.items()})


def _materials(scene: Scene, mesh: Any) -> tuple[list[Any], Any]:
    """One `_core.Material` for the body and each region, and the number of that of every cell (empty without regions)."""
    d = scene.mesh.dim

    def material(region: RegionTable | None) -> Any:
        def table(name: str) -> Any:
            return getattr(region, name, None) or getattr(scene, name)

        inertia, heat = table("inertia"), table("heat")
        coupling = {name: getattr(heat, name, None) or getattr(scene.heat, name, None) for name in COUPLINGS}
        return _d("Material", d)(
            density=inertia.density if inertia is not None else 0.0,
            **{
                name: mandel(table(name), d) if table(name) is not None else None
                for name in ("elasticity", "viscosity")
            },
            conductivity=_matrix(heat.conductivity, d) if heat is not None else None,
            **{name: _matrix(value.tensor, d) if value is not None else None for name, value in coupling.items()},
            capacity=heat.capacity if heat is not None else 1.0,
        )

    materials = [material(None), *(material(region) for region in scene.regions.values())]
    if not scene.regions:
        return materials, []
    numbers = np.zeros(len(mesh.cells), dtype=int)
    centroids = np.asarray(mesh.nodes)[np.asarray(mesh.cells)].mean(axis=1)
    for i, (name, region) in enumerate(scene.regions.items(), start=1):
        if region.where is None:
            cells = mesh_files.read(str(scene.mesh.file)).regions[name]
        else:
            cells = np.flatnonzero(Expression(region.where)(centroids, 0.0))
        if len(cells) == 0:
            raise ValueError(f"regions.{name}: no cell lies in it; correct its `where`")
        numbers[cells] = i
    return materials, numbers.tolist()


def contact_part(contact: ContactTable, own: Law | None = None) -> Any:
    """A contact table as a `_core.ContactPart`, with functions of one's `own` in the place of its laws."""
    law, friction, exchange = None, contact.friction, contact.heat_exchange
    own = own or Law()
    if contact.stiffness is not None:
        compliance = _core.NormalCompliance(
            stiffness=contact.stiffness,
            exponent=contact.exponent,
            most=np.inf if contact.pressure_limit is None else contact.pressure_limit,
            custom=own.compliance,
        )
        bound = _core.Friction(
            coefficient=friction.coefficient if friction else 0.0,
            cohesion=friction.cohesion if friction else 0.0,
            limit=np.inf if friction is None or friction.limit is None else friction.limit,
            kinetic=(friction and friction.kinetic) or 0.0,
            speed=(friction and friction.speed) or 0.0,
            regularisation=(friction and friction.regularisation) or 0.0,
            custom=own.friction,
        )
        law = _core.ContactLaw(compliance=compliance, friction=bound)
    return _core.ContactPart(
        part=contact.part,
        law=law,
        quadrature=contact.points,
        conductance=exchange.conductance if exchange else 0.0,
        per_pressure=exchange.per_pressure if exchange else 0.0,
        friction_share=contact.friction_heating.share if contact.friction_heating else 0.0,
    )


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
    laws: dict[str, Law]

    @property
    def dim(self) -> int:
        return self.scene.mesh.dim

    @property
    def full(self) -> FullScene:
        """The scene with every block there, see `Scene.full`."""
        return self.scene if isinstance(self.scene, FullScene) else self.scene.full()

    @property
    def unknowns(self) -> int:
        """Degrees of freedom of u and theta together, supports included."""
        return (self.dim * int(self.problem.moves) + int(self.problem.conducts)) * len(self.mesh.nodes)

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
        x, initial = np.asarray(self.mesh.nodes), scene.initial

        def start(value: Any) -> Array:
            return evaluate(data(value) if value is not None else 0.0, x, 0.0, self.dim)

        return self.restart(
            stepper,
            start(initial.displacement),
            start(initial.velocity),
            evaluate(data(initial.temperature), x, 0.0, 1)[:, 0],
            0.0,
        )

    def restart(self, stepper: Any, u: Array, w: Array, theta: Array, time: float) -> Any:
        """Sets the state from nodal arrays (nodes, d), (nodes, d), (nodes,), made what is given on the supports.

        Fields that the problem does not have are left aside.
        """
        u, w, theta = u.copy(), w.copy(), theta.copy()
        for part, (nodes, values) in self.load_vectors.held("displacement", time).items():
            u[nodes] = values
            if part not in self.loads.displacement:  # a support that moves has the velocity that is given
                w[nodes] = 0
        for nodes, values in self.load_vectors.held("temperature", time).values():
            theta[nodes] = values[:, 0]
        return self.state(stepper, u, w, theta, time)

    def state(self, stepper: Any, u: Array, w: Array, theta: Array, time: float) -> Any:
        """Sets the state as it is given, see `restart`."""
        vectors: list[Any] = [None, None, None]
        for i, (there, values) in enumerate(
            ((self.problem.moves, u), (self.problem.moves, w), (self.problem.conducts, theta))
        ):
            if there:
                vectors[i] = self.layout.vector(1 if values.ndim == 1 else self.dim)
                self.layout.distribute(values.ravel(), vectors[i])
        stepper.start(*vectors, self.load_vectors.on_points("gap", time), time)
        for vector in vectors:
            if vector is not None:
                vector.destroy()  # petsc4py would only mark it for a later collection
        return stepper

    def field(self, vec: Any) -> Any:
        """A vector in mesh numbering on every rank: (nodes, d), or (nodes,) for theta; None for no vector. Collective."""
        if vec is None:
            return None
        values = np.asarray(self.layout.gather(vec))
        return values if len(values) == len(self.mesh.nodes) else values.reshape(len(self.mesh.nodes), -1)

    def stress(self, u: Array | None, w: Array | None, theta: Array | None) -> Array:
        """Cauchy stress (2.1) at the centroids, (cells, d, d); None for a field the problem does not have."""
        none = np.empty((0, self.dim))
        flat = _core.stress(
            self.problem, none if u is None else u, none if w is None else w, none[:, 0] if theta is None else theta
        )
        return np.asarray(flat).reshape(-1, self.dim, self.dim)

    def mises(self, stepper: Any) -> Array:
        """Von Mises stress of a stepper's state, (cells,). Collective."""
        u, w, theta = (self.field(getattr(stepper, name)) for name in ("u", "w", "theta"))
        return von_mises(self.stress(u, w, theta))


def _checked(laws: dict[str, Law], scene: Scene, mesh: Any) -> dict[str, Law]:
    """The laws, each on a part that touches and tried on samples. Raises ValueError."""
    touching = [contact.part for contact in scene.contacts if contact.stiffness is not None]
    for part, law in laws.items():
        if part not in touching:
            known = ", ".join(touching) or "none has"
            raise ValueError(
                f"laws.{part}: no contact part with a stiffness is called so ({known}); the scene says what touches, even "
                "where a law takes the place of its stiffness"
            )
        law.check(part, float(np.ptp(np.asarray(mesh.nodes), axis=0).max()))
        log.warning(
            "laws.%s: evaluated in Python at every contact point and iteration, slower than the scene's own laws", part
        )
    return laws


def discretise(
    scene: Scene,
    *,
    comm: Any = None,
    loads: Loads | None = None,
    laws: dict[str, Law] | None = None,
    mesh: Any = None,
) -> Discretisation:
    """Assembles a scene on a communicator (default: all ranks).

    `loads` replaces the scene's, `mesh` its mesh, and `laws` the contact laws of the parts it names. Collective. Raises
    ValueError when the contact part has no free node or a law is none.
    """
    from mpi4py import MPI

    comm = MPI.COMM_WORLD if comm is None else comm
    d = scene.mesh.dim
    loads = loads or Loads.of(scene)
    mesh = make_mesh(scene) if mesh is None else mesh
    laws = _checked(laws or {}, scene, mesh)
    materials, regions = _materials(scene, mesh)
    problem = _d("Problem", d)(
        mesh=mesh,
        materials=materials,
        regions=regions,
        clamped=list(scene.supports.displacement),
        cooled=list(scene.supports.temperature),
        contacts=[contact_part(contact, laws.get(contact.part)) for contact in scene.contacts],
    )
    layout = _d("Layout", d)(comm, mesh)
    surface = _d("ContactSurface", d)(layout, problem)
    touched = set(surface.contacts)
    for i, contact in enumerate(scene.contacts):
        if contact.stiffness is not None and i not in touched:
            raise ValueError(
                f"contact.part: every node of '{contact.part}' is clamped, there is nothing to touch; release one"
            )
    vectors = LoadVectors(scene, loads, mesh, layout, surface, comm)
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
        laws,
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
