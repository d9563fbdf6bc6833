"""A scene assembled: mesh, operators, contact surface and loads in the compiled core."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from warmslip._core import Backend, ContactOptions, Coupling
from warmslip._core import largest_strain as largest_principal_strain
from warmslip._core import stress as cell_stress
from warmslip._core import stress_out_of_plane as cell_stress_out_of_plane
from warmslip.messages import Shown, quoted
from warmslip.model.contact_laws import CheckedLaw, Law
from warmslip.model.initial import initial_fields
from warmslip.model.load_vectors import LoadVectors
from warmslip.model.loads import Loads
from warmslip.model.materials import contact_part, materials, of_dim
from warmslip.model.meshes import make_mesh
from warmslip.model.prescribed import PrescribedContact
from warmslip.model.stress import von_mises
from warmslip.model.supports import Supports, part_springs, supports
from warmslip.scene.full import FullScene, full_model
from warmslip.scene.scene import Scene
from warmslip.scene.structure import structure
from warmslip.typing import Array

log = logging.getLogger(__name__)


@dataclass(frozen=True, repr=False)
class Discretisation(Shown):
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
    laws: list[CheckedLaw]  # functions in the place of the scene's laws
    prescribed: PrescribedContact  # contact points that supports hold
    user_functions: list[str]  # what took the place of the scene's: "loads", "laws.PART.compliance"
    like: Any = None  # a stepper whose factors are those of this scene too
    known: dict[Any, Any] = field(default_factory=dict)  # what was found of mesh and operators, see `remember`

    def _facts(self) -> dict[str, str]:
        return {
            "": quoted(self.scene.title),
            "nodes": str(len(self.mesh.nodes)),
            "cells": str(len(self.mesh.cells)),
            "unknowns": str(self.unknowns),
            "contact points": str(len(self.surface.weights)),
        }

    def remember(self, key: Any, find: Callable[[], Any]) -> Any:
        """What `find` finds, kept under a `key` for this discretisation and those that share its operators."""
        if key not in self.known:
            self.known[key] = find()
        return self.known[key]

    def with_data(self, scene: Scene, stepper: Any, comm: Any) -> Discretisation:
        """Another scene of the same `structure`, which shares mesh, operators and the factors of `stepper`.

        Only one of the steppers that share factors may step at a time. Collective.

        Raises
        ------
        ValueError
            For a scene of another structure, or data that cannot be.
        """
        if structure(scene) != structure(self.scene) or self.user_functions:
            raise ValueError("only scenes that differ in data alone share their operators; assemble this one")
        posed = _posed(scene, self.mesh, None, None)
        rules = self.load_vectors.rules
        return _finished(
            posed, self.mesh, self.layout, self.operators, self.surface, self.norms, comm, rules, stepper, self.known
        )

    @property
    def dim(self) -> int:
        return self.scene.mesh.dim

    @property
    def full(self) -> FullScene:
        """The scene with every block there, see `Scene.full`."""
        return self.scene if isinstance(self.scene, FullScene) else full_model(self.scene)

    @property
    def unknowns(self) -> int:
        """Degrees of freedom of u and theta together, supports included."""
        return (self.dim * int(self.problem.moves) + int(self.problem.conducts)) * len(self.mesh.nodes)

    def stepper(self, *, backend: str = "automatic", tolerance: float | None = None) -> Any:
        """A `_core.Stepper` at the initial data; `backend` is automatic, cholmod or petsc. Raises ValueError for another one."""
        scene = self.scene
        if backend not in Backend.__members__:
            raise ValueError(f"backend '{backend}' is unknown; use {', '.join(Backend.__members__)}")
        options = ContactOptions()
        if tolerance is not None:
            options.tolerance = tolerance
        kind = of_dim("Stepper", self.dim)
        if self.like is not None:
            stepper = kind(self.problem, like=self.like)
            stepper.set_step(scene.clock.step(1)[1])
        else:
            stepper = kind(
                self.layout,
                self.problem,
                self.operators,
                self.surface,
                k=scene.clock.step(1)[1],
                coupling=getattr(Coupling, scene.time.coupling),
                backend=getattr(Backend, backend),
                contact=options,
            )
        return self.restart(stepper, *initial_fields(scene, self.mesh, self.load_vectors), 0.0)

    def law(self, part: str) -> Any:
        """The `_core.ContactLaw` of a contact part."""
        (contact,) = (one for one in self.scene.contacts if one.part == part)
        own = (law for law in self.laws if law.functions[0].name.startswith(f"laws.{part}."))
        return contact_part(contact, next(own, None)).law

    def restart(self, stepper: Any, u: Array | None, w: Array | None, theta: Array | None, time: float) -> Any:
        """Sets the state from nodal arrays (nodes, d), (nodes, d), (nodes,), made what is given on the supports.

        Fields that the problem does not have are left aside, and may be None.
        """
        x = np.asarray(self.mesh.nodes)
        u, w = (np.zeros_like(x) if field is None else field.copy() for field in (u, w))
        theta = np.zeros(len(x)) if theta is None else theta.copy()
        supports = self.load_vectors.supports
        u[supports.nodes] = supports.released(u[supports.nodes]) + self.load_vectors.displacement(time)
        still = supports.still  # a support that moves has the velocity that is given
        w[still.nodes] = still.released(w[still.nodes])
        for nodes, values in self.load_vectors.temperature(time):
            theta[nodes] = values
        return self.state(stepper, u, w, theta, time)

    def state(self, stepper: Any, u: Array, w: Array, theta: Array, time: float) -> Any:
        """Sets the state as it is given, see `restart`."""
        vectors: list[Any] = [None, None, None]
        for i, (there, values) in enumerate(
            ((self.problem.moves, u), (self.problem.moves, w), (self.problem.conducts, theta))
        ):
            if there:
                vectors[i] = self.distributed(values)
        stepper.start(*vectors, self.load_vectors.on_points("gap", time), time)
        for vector in vectors:
            if vector is not None:
                vector.destroy()  # petsc4py would only mark it for a later collection
        return stepper

    def distributed(self, values: Array) -> Any:
        """A new vector of values in mesh numbering, (nodes, d) or (nodes,). Collective."""
        vector = self.layout.vector(1 if values.ndim == 1 else self.dim)
        self.layout.distribute(values.ravel(), vector)
        return vector

    def field(self, vec: Any) -> Any:
        """A vector in mesh numbering on every rank: (nodes, d), or (nodes,) for theta; None for no vector. Collective."""
        if vec is None:
            return None
        values = np.asarray(self.layout.gather(vec))
        return values if len(values) == len(self.mesh.nodes) else values.reshape(len(self.mesh.nodes), -1)

    def stress(self, u: Array | None, w: Array | None, theta: Array | None) -> Array:
        """Cauchy stress (2.1) at the centroids, (cells, d, d); None for a field the problem does not have."""
        return np.asarray(cell_stress(self.problem, *self._fields(u, w, theta))).reshape(-1, self.dim, self.dim)

    def stress_zz(self, u: Array | None, w: Array | None, theta: Array | None) -> Array:
        """Stress along z of a plane at the centroids, (cells,), see `materials.out_of_plane`; 0 in plane stress, and in space."""
        return np.asarray(cell_stress_out_of_plane(self.problem, *self._fields(u, w, theta)))

    def _fields(self, u: Array | None, w: Array | None, theta: Array | None) -> tuple[Array, Array, Array]:
        none = np.empty((0, self.dim))
        return none if u is None else u, none if w is None else w, none[:, 0] if theta is None else theta

    def nodal(self, values: Array) -> Array:
        """Means of values of the cells (cells, ...) over the cells around each node, weighted by their volumes: (nodes, ...).

        They smooth a jump between materials too.
        """
        cells = np.asarray(self.mesh.cells)
        count, corners = cells.shape
        around = np.repeat(self.volumes, corners), (cells.ravel(), np.repeat(np.arange(count), corners))
        share = csr_array(around, shape=(len(self.mesh.nodes), count))
        mean = (share @ values.reshape(count, -1)) / np.asarray(share.sum(axis=1))[:, None]
        return np.asarray(mean.reshape(-1, *values.shape[1:]))

    @property
    def volumes(self) -> Array:
        """Areas or volumes of the cells, (cells,)."""
        x = np.asarray(self.mesh.nodes)[np.asarray(self.mesh.cells)]
        return np.asarray(np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / (2 if self.dim == 2 else 6))

    def largest_strain(self, u: Array) -> float:
        """Largest principal strain, in size, of all cells for a nodal displacement (nodes, d); dimensionless."""
        return largest_principal_strain(self.mesh, u)

    def mises_of(self, u: Array | None, w: Array | None, theta: Array | None) -> Array:
        """Von Mises stress of nodal fields at the centroids, (cells,); that of a plane counts the stress along z."""
        return von_mises(self.stress(u, w, theta), self.stress_zz(u, w, theta) if self.dim == 2 else None)

    def straining(self, stepper: Any) -> tuple[Any, Any, Any]:
        """Displacement and velocity (nodes, d) but for rigid motions, which strain nothing, and temperature (nodes,). Collective.

        A body without supports may move by more digits than its strain has; the core keeps the two apart.
        """
        u, w = stepper.strained, stepper.strained_w
        return tuple(self.field(v) for v in (u or stepper.u, w or stepper.w, stepper.theta))

    def mises(self, stepper: Any) -> Array:
        """Von Mises stress of a stepper's state, (cells,). Collective."""
        return self.mises_of(*self.straining(stepper))


def _checked(laws: dict[str, Law], scene: Scene, mesh: Any) -> dict[str, CheckedLaw]:
    """The laws, each on a part that touches and tried on samples. Raises ValueError, TypeError for what is no Law."""
    tried: dict[str, CheckedLaw] = {}
    touching = [contact.part for contact in scene.contacts if contact.stiffness is not None]
    for part, law in laws.items():
        if part not in touching:
            known = ", ".join(touching) or "none has"
            raise ValueError(
                f"laws.{part}: no contact part with a stiffness is called so ({known}); the scene says what touches, even "
                "where a law takes the place of its stiffness"
            )
        if not isinstance(law, Law):
            raise TypeError(f"laws['{part}'] is {law!r}; give a Law, such as Law(friction=...)")
        tried[part] = law.validate(part, float(np.ptp(np.asarray(mesh.nodes), axis=0).max()))
        log.warning(
            "laws.%s: evaluated in Python at every contact point and iteration, slower than the scene's own laws", part
        )
    return tried


def refuse_types(scene: Any, loads: Any, laws: Any) -> None:
    """Raises TypeError, in a sentence, for what is easily given in the place of a scene, of loads or of laws."""
    if not isinstance(scene, Scene):
        cure = (
            "read it with warmslip.load"
            if isinstance(scene, str | Path)
            else "warmslip.load and warmslip.Scene make one"
        )
        raise TypeError(f"scene: {quoted(scene)} is no Scene; {cure}")
    if loads is not None and not isinstance(loads, Loads):
        cure = "write dataclasses.replace(warmslip.Loads.of(scene), body=...) with the names of those that change"
        raise TypeError(f"loads: {quoted(loads)} is no warmslip.Loads; {cure}")
    if laws is not None and not isinstance(laws, dict):
        raise TypeError(f"laws: {quoted(laws)} is no dictionary; give laws by part, {{'bottom': warmslip.Law(...)}}")


def discretise(
    scene: Scene,
    *,
    comm: Any = None,
    loads: Loads | None = None,
    laws: dict[str, Law] | None = None,
    mesh: Any = None,
) -> Discretisation:
    """Assembles a scene (collective).

    Parameters
    ----------
    scene : Scene
        What to assemble.
    comm : mpi4py communicator, optional
        The ranks that share the mesh; all by default.
    loads : Loads, optional
        Loads in the place of the scene's.
    laws : dict of Law, optional
        Contact laws by part, in the place of the scene's.
    mesh : _core.Mesh2 or _core.Mesh3, optional
        Mesh in the place of the scene's.

    Returns
    -------
    Discretisation
        Mesh, operators, contact surface and load vectors.

    Raises
    ------
    TypeError
        For what is no scene, loads or laws.
    ValueError
        When a contact part has no free node, a law is none, or a support at rest holds a part inside a rigid foundation.
    """
    from mpi4py import MPI

    refuse_types(scene, loads, laws)
    comm = MPI.COMM_WORLD if comm is None else comm
    mesh = make_mesh(scene) if mesh is None else mesh
    posed = _posed(scene, mesh, loads, laws)
    layout = of_dim("Layout", scene.mesh.dim)(comm, mesh)
    surface = of_dim("ContactSurface", scene.mesh.dim)(layout, posed.problem)
    held = set(np.flatnonzero(posed.supports.held))
    for contact in scene.contacts:
        if contact.stiffness is not None and held.issuperset(np.unique(mesh.parts[contact.part])):
            raise ValueError(
                f"contact.part: every node of '{contact.part}' is clamped, there is nothing to touch; release one"
            )
    operators = of_dim("Operators", scene.mesh.dim)(layout, posed.problem)
    norms = of_dim("Norms", scene.mesh.dim)(layout)
    return _finished(posed, mesh, layout, operators, surface, norms, comm, {})


@dataclass(frozen=True)
class _Posed:
    """A scene with its loads and laws, and the core's problem, before anything is assembled."""

    scene: Scene
    loads: Loads
    problem: Any
    laws: list[CheckedLaw]
    user_functions: list[str]
    supports: Supports


def _posed(scene: Scene, mesh: Any, loads: Loads | None, laws: dict[str, Law] | None) -> _Posed:
    watched = _checked(laws or {}, scene, mesh)
    user_functions = ["loads"] * (loads is not None) + [
        name for part in sorted(laws or {}) for name in (laws or {})[part].names(part)
    ]
    given, regions = materials(scene, mesh)
    loads = loads or Loads.of(scene)
    held = Supports(supports(scene, loads, mesh), np.asarray(mesh.nodes))
    problem = of_dim("Problem", scene.mesh.dim)(
        mesh=mesh,
        materials=given,
        regions=regions,
        prescribed_displacement=scene.supports.clamped,
        prescribed_temperature=list(scene.supports.temperature),
        contacts=[contact_part(contact, watched.get(contact.part)) for contact in scene.contacts],
        lumped=scene.heat is not None and scene.heat.capacity_matrix == "lumped",
        held_nodes=held.partly_clamped(scene.supports.clamped, mesh.parts),
        springs=part_springs(scene),
    )
    return _Posed(scene, loads, problem, list(watched.values()), user_functions, held)


def _finished(
    posed: _Posed,
    mesh: Any,
    layout: Any,
    operators: Any,
    surface: Any,
    norms: Any,
    comm: Any,
    rules: dict[Any, Any],
    like: Any = None,
    known: dict[Any, Any] | None = None,
) -> Discretisation:
    """The discretisation of a scene whose operators are assembled. Raises ValueError for data that cannot be."""
    scene, loads = posed.scene, posed.loads
    vectors = LoadVectors(scene, loads, posed.supports, mesh, layout, surface, comm, operators.reference, rules)
    rigid = frozenset(
        name.removeprefix("laws.").removesuffix(".compliance")
        for name in posed.user_functions
        if name.endswith(".compliance")
    )
    prescribed = PrescribedContact(scene, mesh, surface, loads, vectors, rigid)
    if not prescribed.of_time and (why := prescribed.inside(0.0)):
        raise ValueError(f"supports.displacement: {why}")
    return Discretisation(
        scene,
        loads,
        mesh,
        posed.problem,
        layout,
        operators,
        surface,
        norms,
        vectors,
        posed.laws,
        prescribed,
        posed.user_functions,
        like,
        {} if known is None else known,
    )
