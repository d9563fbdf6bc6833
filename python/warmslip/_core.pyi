"""
The compiled core of warmslip: meshes, operators on PETSc, the contact solver and the time stepper, for d = 2 and 3.
"""
from __future__ import annotations
import collections.abc
import mpi4py.MPI
import numpy
import numpy.typing
import petsc4py.PETSc
import scipy.sparse
import typing
__all__: list[str] = ['Backend', 'ContactOptions', 'ContactSurface2', 'ContactSurface3', 'Cost', 'Coupling', 'Diagonal', 'Errors', 'Factor', 'Layout2', 'Layout3', 'Balances', 'LoadQuadrature2', 'LoadQuadrature3', 'Material2', 'Material3', 'Mesh2', 'Mesh3', 'Norms2', 'Norms3', 'Operators2', 'Operators3', 'Outcome', 'PartSprings2', 'PartSprings3', 'Problem2', 'Problem3', 'Stage', 'StepReport2', 'StepReport3', 'Stepper2', 'Stepper3', 'Symmetry', 'compiler', 'heat_matrix', 'largest_strain', 'momentum_matrix', 'petsc_version', 'prolongation', 'simplex_rule', 'stress', 'stress_out_of_plane']
class Diagonal:
    """
    Members:
    
      right
    
      left
    
      crisscross
    """
    __members__: typing.ClassVar[dict[str, Diagonal]]
    crisscross: typing.ClassVar[Diagonal]
    left: typing.ClassVar[Diagonal]
    right: typing.ClassVar[Diagonal]
    @typing.overload
    def __eq__(self, other: Diagonal) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Diagonal) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class Mesh2:
    """
    Simplicial mesh with named boundary parts.
    """
    @staticmethod
    def box(counts: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(2)"], lengths: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"], diagonal: Diagonal) -> Mesh2:
        """
        Box of counts[a] cells along axis a, each cut along `diagonal`; parts left, right, bottom, top (front, back).
        """
    @staticmethod
    def from_lists(nodes: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"], cells: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 3]"], parts: collections.abc.Mapping[str, typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 2]"]]) -> Mesh2:
        """
        Mesh from nodes (n, d), cells (c, d+1) and facets (f, d) by part; ValueError names the first faulty entry.
        """
    @property
    def cells(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 3]"]:
        """
        (cells, d+1) node numbers.
        """
    @property
    def dim(self) -> int:
        ...
    @property
    def nodes(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (nodes, d) coordinates, length.
        """
    @property
    def parts(self) -> dict[str, typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 2]"]]:
        """
        Facets (f, d) of every named boundary part.
        """
    def area_normals(self, part: str) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Outward normals of the facets of a part, (f, d); their lengths are the areas.
        """
class Mesh3:
    """
    Simplicial mesh with named boundary parts.
    """
    @staticmethod
    def box(counts: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"], lengths: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"], diagonal: Diagonal) -> Mesh3:
        """
        Box of counts[a] cells along axis a, each cut along `diagonal`; parts left, right, bottom, top (front, back).
        """
    @staticmethod
    def from_lists(nodes: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], cells: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 4]"], parts: collections.abc.Mapping[str, typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 3]"]]) -> Mesh3:
        """
        Mesh from nodes (n, d), cells (c, d+1) and facets (f, d) by part; ValueError names the first faulty entry.
        """
    @property
    def cells(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 4]"]:
        """
        (cells, d+1) node numbers.
        """
    @property
    def dim(self) -> int:
        ...
    @property
    def nodes(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (nodes, d) coordinates, length.
        """
    @property
    def parts(self) -> dict[str, typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 3]"]]:
        """
        Facets (f, d) of every named boundary part.
        """
    def area_normals(self, part: str) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Outward normals of the facets of a part, (f, d); their lengths are the areas.
        """
class NormalCompliance:
    """
    p_nu(r) = min(stiffness max(r, 0)^exponent, pressure_limit) (2.8).
    """
    def __init__(self, *, stiffness: typing.SupportsFloat | typing.SupportsIndex, exponent: typing.SupportsFloat | typing.SupportsIndex, pressure_limit: typing.SupportsFloat | typing.SupportsIndex, custom: collections.abc.Callable[[float], collections.abc.Sequence[float]] | None) -> None:
        """
        `custom`, when not None, takes its place: r > 0 to (pressure, derivative, energy).
        """
    def energy(self, penetration: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    def pressure(self, penetration: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    @property
    def stiffness(self) -> float:
        ...
class Friction:
    """
    |sigma_tau| <= min(cohesion + mu(|w_tau|) p_nu, limit) (2.9).
    """
    def __init__(self, *, coefficient: typing.SupportsFloat | typing.SupportsIndex, cohesion: typing.SupportsFloat | typing.SupportsIndex, limit: typing.SupportsFloat | typing.SupportsIndex, kinetic: typing.SupportsFloat | typing.SupportsIndex, speed: typing.SupportsFloat | typing.SupportsIndex, regularisation: typing.SupportsFloat | typing.SupportsIndex, custom: collections.abc.Callable[[float, float], collections.abc.Sequence[float]] | None) -> None:
        """
        `custom`, when not None, takes its place: (pressure, speed) to (bound, derivative by pressure, by speed).
        """
    def bound(self, pressure: typing.SupportsFloat | typing.SupportsIndex, speed: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
class ContactLaw:
    def __init__(self, *, compliance: NormalCompliance, friction: Friction) -> None:
        ...
    @property
    def compliance(self) -> NormalCompliance:
        ...
    @property
    def friction(self) -> Friction:
        ...
class ContactPart:
    """
    One part of Gamma_C; without a law it only exchanges heat.
    """
    def __init__(self, *, part: str, law: ContactLaw | None, quadrature: typing.SupportsInt | typing.SupportsIndex, conductance: typing.SupportsFloat | typing.SupportsIndex, per_pressure: typing.SupportsFloat | typing.SupportsIndex, share: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        quadrature 0 is nodal, n Gauss's with n points; q . nu = (conductance + per_pressure p_nu) (theta - theta_F) - share |sigma_tau . w_tau|.
        """
    @property
    def law(self) -> ContactLaw | None:
        ...
    @property
    def part(self) -> str:
        ...
class Material2:
    """
    Density and the constant tensors of (2.1)-(2.4), fourth-order ones in Mandel form; None is absent.
    """
    def __init__(self, *, density: typing.SupportsFloat | typing.SupportsIndex, elasticity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None, viscosity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None, conductivity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 2]"] | None, expansion: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 2]"] | None, heating: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 2]"] | None, capacity: typing.SupportsFloat | typing.SupportsIndex, reference: typing.SupportsFloat | typing.SupportsIndex, out_of_plane: collections.abc.Sequence[float]) -> None:
        """
        `reference` is the temperature without thermal stress; `out_of_plane` what tr eps(u), tr eps(w) and -(theta - reference) are multiplied by in sigma_zz of a plane.
        """
    @property
    def capacity(self) -> float:
        ...
    @property
    def conductivity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 2]"] | None:
        ...
    @property
    def density(self) -> float:
        ...
    @property
    def elasticity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"] | None:
        ...
    @property
    def expansion(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 2]"] | None:
        ...
    @property
    def heating(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 2]"] | None:
        ...
    @property
    def out_of_plane(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        """
        what tr eps(u), tr eps(w) and -(theta - reference) are multiplied by in sigma_zz
        """
    @property
    def reference(self) -> float:
        ...
    @property
    def viscosity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"] | None:
        ...
class PartSprings2:
    """
    Springs and dashpots on a part.
    """
    def __init__(self, *, part: str, stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], normal_stiffness: typing.SupportsFloat | typing.SupportsIndex, damping: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 1]"], normal_damping: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        Traction -(stiffness u + damping w), along the axes and along the normal.
        """
class Problem2:
    """
    A mesh with materials, supports and contact parts.
    """
    def __init__(self, *, mesh: Mesh2, materials: collections.abc.Sequence[Material2], regions: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], prescribed_displacement: collections.abc.Sequence[str], prescribed_temperature: collections.abc.Sequence[str], contacts: collections.abc.Sequence[ContactPart], lumped: bool, held_nodes: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[2, 2]"]]] = ..., springs: collections.abc.Sequence[PartSprings2] = ...) -> None:
        """
        `regions` is the material of every cell, or empty; `prescribed_displacement` and `prescribed_temperature` are parts with given u and theta; `lumped` makes capacity and exchange diagonal; `held_nodes` are pairs of a node and the projector onto the directions in which its displacement is given.
        """
    @property
    def conducts(self) -> bool:
        """
        Whether there is a temperature to solve for.
        """
    @property
    def lumped(self) -> bool:
        ...
    @property
    def material(self) -> Material2:
        """
        the first one
        """
    @property
    def materials(self) -> list[Material2]:
        ...
    @property
    def mesh(self) -> Mesh2:
        ...
    @property
    def moves(self) -> bool:
        """
        Whether there is a velocity to solve for.
        """
class Material3:
    """
    Density and the constant tensors of (2.1)-(2.4), fourth-order ones in Mandel form; None is absent.
    """
    def __init__(self, *, density: typing.SupportsFloat | typing.SupportsIndex, elasticity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"] | None, viscosity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"] | None, conductivity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None, expansion: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None, heating: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None, capacity: typing.SupportsFloat | typing.SupportsIndex, reference: typing.SupportsFloat | typing.SupportsIndex, out_of_plane: collections.abc.Sequence[float]) -> None:
        """
        `reference` is the temperature without thermal stress; `out_of_plane` what tr eps(u), tr eps(w) and -(theta - reference) are multiplied by in sigma_zz of a plane.
        """
    @property
    def capacity(self) -> float:
        ...
    @property
    def conductivity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"] | None:
        ...
    @property
    def density(self) -> float:
        ...
    @property
    def elasticity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"] | None:
        ...
    @property
    def expansion(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"] | None:
        ...
    @property
    def heating(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"] | None:
        ...
    @property
    def out_of_plane(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        """
        what tr eps(u), tr eps(w) and -(theta - reference) are multiplied by in sigma_zz
        """
    @property
    def reference(self) -> float:
        ...
    @property
    def viscosity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"] | None:
        ...
class PartSprings3:
    """
    Springs and dashpots on a part.
    """
    def __init__(self, *, part: str, stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], normal_stiffness: typing.SupportsFloat | typing.SupportsIndex, damping: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], normal_damping: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        Traction -(stiffness u + damping w), along the axes and along the normal.
        """
class Problem3:
    """
    A mesh with materials, supports and contact parts.
    """
    def __init__(self, *, mesh: Mesh3, materials: collections.abc.Sequence[Material3], regions: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], prescribed_displacement: collections.abc.Sequence[str], prescribed_temperature: collections.abc.Sequence[str], contacts: collections.abc.Sequence[ContactPart], lumped: bool, held_nodes: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]]] = ..., springs: collections.abc.Sequence[PartSprings3] = ...) -> None:
        """
        `regions` is the material of every cell, or empty; `prescribed_displacement` and `prescribed_temperature` are parts with given u and theta; `lumped` makes capacity and exchange diagonal; `held_nodes` are pairs of a node and the projector onto the directions in which its displacement is given.
        """
    @property
    def conducts(self) -> bool:
        """
        Whether there is a temperature to solve for.
        """
    @property
    def lumped(self) -> bool:
        ...
    @property
    def material(self) -> Material3:
        """
        the first one
        """
    @property
    def materials(self) -> list[Material3]:
        ...
    @property
    def mesh(self) -> Mesh3:
        ...
    @property
    def moves(self) -> bool:
        """
        Whether there is a velocity to solve for.
        """
class Layout2:
    """
    A mesh distributed over the ranks of a communicator.
    """
    def __init__(self, comm: mpi4py.MPI.Comm | petsc4py.PETSc.Comm | None, mesh: Mesh2) -> None:
        ...
    def distribute(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], vec: petsc4py.PETSc.Vec) -> None:
        """
        Sets `vec` from values in mesh numbering, (nodes * block).
        """
    def gather(self, vec: petsc4py.PETSc.Vec) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        The whole vector in mesh numbering, on every rank (collective).
        """
    def vector(self, block: typing.SupportsInt | typing.SupportsIndex) -> petsc4py.PETSc.Vec:
        """
        A zero vector, `block` unknowns a node.
        """
    @property
    def local_cells(self) -> int:
        """
        Cells of this rank.
        """
    @property
    def mesh_nodes(self) -> list[int]:
        """
        Mesh number of every local node, owned first.
        """
    @property
    def owned_nodes(self) -> int:
        """
        Nodes this rank owns.
        """
class Norms2:
    """
    Exact norms of P1 functions.
    """
    def __init__(self, layout: Layout2) -> None:
        ...
    def l2(self, vec: petsc4py.PETSc.Vec) -> float:
        """
        |v|_L2 of a scalar or a vector field (collective).
        """
    def v(self, vec: petsc4py.PETSc.Vec) -> float:
        """
        |v|_V = |eps(v)|_L2 of a displacement (collective).
        """
class Operators2:
    """
    The constant matrices as petsc4py objects, without boundary conditions; None is absent.
    """
    def __init__(self, layout: Layout2, problem: Problem2) -> None:
        ...
    @property
    def prescribed_displacement(self) -> list[int]:
        """
        Global scalar indices with u = 0 owned by this rank.
        """
    @property
    def conductivity(self) -> petsc4py.PETSc.Mat | None:
        """
        d(theta, eta), times the capacity
        """
    @property
    def prescribed_temperature(self) -> list[int]:
        """
        Global nodes with theta = 0 owned by this rank.
        """
    @property
    def elasticity(self) -> petsc4py.PETSc.Mat | None:
        """
        a(u, v)
        """
    @property
    def exchange(self) -> petsc4py.PETSc.Mat | None:
        """
        int k_c theta eta over Gamma_C
        """
    @property
    def expansion(self) -> petsc4py.PETSc.Mat | None:
        """
        m(theta, v)
        """
    @property
    def heating(self) -> petsc4py.PETSc.Mat | None:
        """
        e(w, eta)
        """
    @property
    def mass(self) -> petsc4py.PETSc.Mat | None:
        """
        (theta, eta), times the capacity
        """
    @property
    def inertia(self) -> petsc4py.PETSc.Mat | None:
        """
        rho (w, v), of PETSc's type MAIJ; convert('aij') has its entries
        """
    @property
    def reference(self) -> petsc4py.PETSc.Vec | None:
        """
        m(reference temperature, v), a vector that is a load; None where that is 0 or the same in all regions, and the stepper knows it
        """
    @property
    def viscosity(self) -> petsc4py.PETSc.Mat | None:
        """
        b(w, v)
        """
class ContactSurface2:
    """
    Contact points, weights and normals, the same on every rank.
    """
    def __init__(self, layout: Layout2, problem: Problem2) -> None:
        ...
    def unknowns(self, block: typing.SupportsInt | typing.SupportsIndex) -> list[int]:
        """
        Global scalar indices of the contact unknowns, (d nodes).
        """
    @property
    def contacts(self) -> list[int]:
        """
        (points), which of the problem's contact parts a point lies on
        """
    @property
    def nodes(self) -> int:
        """
        Number of contact nodes.
        """
    @property
    def normals(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (points, d), outward unit normals
        """
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (points, d)
        """
    @property
    def weights(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (points), area
        """
class LoadQuadrature2:
    """
    Quadrature over the rank's cells, or the facets of a part.
    """
    def __init__(self, layout: Layout2, part: str | None, points: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def load(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> petsc4py.PETSc.Vec:
        """
        int f . v with values (points, components) (collective).
        """
    def squared_distance(self, field: petsc4py.PETSc.Vec, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> float:
        """
        |field - values|_L2 squared (collective).
        """
    def squared_strain_distance(self, field: petsc4py.PETSc.Vec, gradients: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> float:
        """
        |eps(field) - sym gradients|_L2 squared; gradients (points, d*d) (collective).
        """
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        (points, d), this rank's.
        """
class Layout3:
    """
    A mesh distributed over the ranks of a communicator.
    """
    def __init__(self, comm: mpi4py.MPI.Comm | petsc4py.PETSc.Comm | None, mesh: Mesh3) -> None:
        ...
    def distribute(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], vec: petsc4py.PETSc.Vec) -> None:
        """
        Sets `vec` from values in mesh numbering, (nodes * block).
        """
    def gather(self, vec: petsc4py.PETSc.Vec) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        The whole vector in mesh numbering, on every rank (collective).
        """
    def vector(self, block: typing.SupportsInt | typing.SupportsIndex) -> petsc4py.PETSc.Vec:
        """
        A zero vector, `block` unknowns a node.
        """
    @property
    def local_cells(self) -> int:
        """
        Cells of this rank.
        """
    @property
    def mesh_nodes(self) -> list[int]:
        """
        Mesh number of every local node, owned first.
        """
    @property
    def owned_nodes(self) -> int:
        """
        Nodes this rank owns.
        """
class Norms3:
    """
    Exact norms of P1 functions.
    """
    def __init__(self, layout: Layout3) -> None:
        ...
    def l2(self, vec: petsc4py.PETSc.Vec) -> float:
        """
        |v|_L2 of a scalar or a vector field (collective).
        """
    def v(self, vec: petsc4py.PETSc.Vec) -> float:
        """
        |v|_V = |eps(v)|_L2 of a displacement (collective).
        """
class Operators3:
    """
    The constant matrices as petsc4py objects, without boundary conditions; None is absent.
    """
    def __init__(self, layout: Layout3, problem: Problem3) -> None:
        ...
    @property
    def prescribed_displacement(self) -> list[int]:
        """
        Global scalar indices with u = 0 owned by this rank.
        """
    @property
    def conductivity(self) -> petsc4py.PETSc.Mat | None:
        """
        d(theta, eta)
        """
    @property
    def prescribed_temperature(self) -> list[int]:
        """
        Global nodes with theta = 0 owned by this rank.
        """
    @property
    def elasticity(self) -> petsc4py.PETSc.Mat | None:
        """
        a(u, v)
        """
    @property
    def exchange(self) -> petsc4py.PETSc.Mat | None:
        """
        int k_c theta eta over Gamma_C
        """
    @property
    def expansion(self) -> petsc4py.PETSc.Mat | None:
        """
        m(theta, v)
        """
    @property
    def heating(self) -> petsc4py.PETSc.Mat | None:
        """
        e(w, eta)
        """
    @property
    def mass(self) -> petsc4py.PETSc.Mat | None:
        """
        (theta, eta), times the capacity
        """
    @property
    def inertia(self) -> petsc4py.PETSc.Mat | None:
        """
        rho (w, v), of PETSc's type MAIJ; convert('aij') has its entries
        """
    @property
    def reference(self) -> petsc4py.PETSc.Vec | None:
        """
        m(reference temperature, v), a vector that is a load; None where that is 0 or the same in all regions, and the stepper knows it
        """
    @property
    def viscosity(self) -> petsc4py.PETSc.Mat | None:
        """
        b(w, v)
        """
class ContactSurface3:
    """
    Contact points, weights and normals, the same on every rank.
    """
    def __init__(self, layout: Layout3, problem: Problem3) -> None:
        ...
    def unknowns(self, block: typing.SupportsInt | typing.SupportsIndex) -> list[int]:
        """
        Global scalar indices of the contact unknowns, (d nodes).
        """
    @property
    def contacts(self) -> list[int]:
        """
        (points), which of the problem's contact parts a point lies on
        """
    @property
    def nodes(self) -> int:
        """
        Number of contact nodes.
        """
    @property
    def normals(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (points, d), outward unit normals
        """
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (points, d)
        """
    @property
    def weights(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (points), area
        """
class LoadQuadrature3:
    """
    Quadrature over the rank's cells, or the facets of a part.
    """
    def __init__(self, layout: Layout3, part: str | None, points: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def load(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> petsc4py.PETSc.Vec:
        """
        int f . v with values (points, components) (collective).
        """
    def squared_distance(self, field: petsc4py.PETSc.Vec, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> float:
        """
        |field - values|_L2 squared (collective).
        """
    def squared_strain_distance(self, field: petsc4py.PETSc.Vec, gradients: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> float:
        """
        |eps(field) - sym gradients|_L2 squared; gradients (points, d*d) (collective).
        """
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        (points, d), this rank's.
        """
class Backend:
    """
    Members:
    
      automatic
    
      cholmod
    
      petsc
    """
    __members__: typing.ClassVar[dict[str, Backend]]
    automatic: typing.ClassVar[Backend]
    cholmod: typing.ClassVar[Backend]
    petsc: typing.ClassVar[Backend]
    @typing.overload
    def __eq__(self, other: Backend) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Backend) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class Symmetry:
    """
    Members:
    
      positive_definite
    
      definite_or_refused
    
      symmetric
    
      general
    """
    __members__: typing.ClassVar[dict[str, Symmetry]]
    definite_or_refused: typing.ClassVar[Symmetry]
    general: typing.ClassVar[Symmetry]
    positive_definite: typing.ClassVar[Symmetry]
    symmetric: typing.ClassVar[Symmetry]
    @typing.overload
    def __eq__(self, other: Symmetry) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Symmetry) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class Errors:
    """
    Estimated relative errors of the fields of one step; nan is absent or not measured.
    """
    fields: typing.ClassVar[tuple[str, ...]] = ('u', 'theta', 'stress', 'contact_force')
    @property
    def contact_force(self) -> float:
        ...
    @property
    def measured(self) -> bool:
        """
        Whether the error of any field was estimated.
        """
    @property
    def stress(self) -> float:
        ...
    @property
    def theta(self) -> float:
        ...
    @property
    def u(self) -> float:
        ...
class Factor:
    """
    A factored operator with some unknowns held apart (collective).
    """
    def __init__(self, matrix: petsc4py.PETSc.Mat, trailing: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], symmetry: Symmetry, block: typing.SupportsInt | typing.SupportsIndex, prefix: str, backend: Backend) -> None:
        ...
    def compliance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        E^T K^-1 E.
        """
    def expand(self, load: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], out: petsc4py.PETSc.Vec) -> None:
        """
        K^-1 (r - E load): the second half.
        """
    def reduce(self, right: petsc4py.PETSc.Vec) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        E^T K^-1 r: the first half of a solve.
        """
    def solve(self, right: petsc4py.PETSc.Vec, out: petsc4py.PETSc.Vec) -> None:
        """
        K^-1 r.
        """
    @property
    def bytes(self) -> float:
        ...
    @property
    def description(self) -> str:
        ...
    @property
    def substitutions(self) -> int:
        ...
class Coupling:
    """
    Members:
    
      staggered
    
      lagged
    
      monolithic
    """
    __members__: typing.ClassVar[dict[str, Coupling]]
    lagged: typing.ClassVar[Coupling]
    monolithic: typing.ClassVar[Coupling]
    staggered: typing.ClassVar[Coupling]
    @typing.overload
    def __eq__(self, other: Coupling) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Coupling) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class Outcome:
    """
    Members:
    
      completed
    
      contact_not_converged
    
      not_finite
    
      balance_violated
    
      precision_lost
    
      unsupported
    
      solver_failed
    """
    __members__: typing.ClassVar[dict[str, Outcome]]
    contact_not_converged: typing.ClassVar[Outcome]
    balance_violated: typing.ClassVar[Outcome]
    not_finite: typing.ClassVar[Outcome]
    precision_lost: typing.ClassVar[Outcome]
    completed: typing.ClassVar[Outcome]
    solver_failed: typing.ClassVar[Outcome]
    unsupported: typing.ClassVar[Outcome]
    @typing.overload
    def __eq__(self, other: Outcome) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Outcome) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class Stage:
    """
    Members:
    
      none
    
      newton
    
      restart
    
      tresca_fixed_point
    
      enumeration
    """
    __members__: typing.ClassVar[dict[str, Stage]]
    enumeration: typing.ClassVar[Stage]
    tresca_fixed_point: typing.ClassVar[Stage]
    newton: typing.ClassVar[Stage]
    none: typing.ClassVar[Stage]
    restart: typing.ClassVar[Stage]
    @typing.overload
    def __eq__(self, other: Stage) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: Stage) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class ContactOptions:
    def __init__(self) -> None:
        ...
    @property
    def enumerate_points(self) -> int:
        ...
    @enumerate_points.setter
    def enumerate_points(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def fixed_point_steps(self) -> int:
        ...
    @fixed_point_steps.setter
    def fixed_point_steps(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def newton_steps(self) -> int:
        ...
    @newton_steps.setter
    def newton_steps(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def tolerance(self) -> float:
        ...
    @tolerance.setter
    def tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Balances:
    """
    Terms and relative residuals of the balances of one step.
    """
    terms: typing.ClassVar[tuple[str, ...]] = ('kinetic', 'elastic', 'contact', 'kinetic_change', 'elastic_change', 'contact_change', 'inertia_damping', 'elastic_damping', 'contact_damping', 'viscous', 'friction', 'load_work', 'expansion_work', 'gap_work', 'support_work', 'foundation_work', 'heat_change', 'heat_damping', 'conducted', 'exchanged', 'supplied', 'heating', 'friction_heating', 'held', 'energy_residual', 'heat_residual', 'force_residual', 'law_residual', 'force_defect', 'heat_defect', 'force_scale')
    @property
    def conducted(self) -> float:
        ...
    @property
    def contact(self) -> float:
        ...
    @property
    def contact_change(self) -> float:
        ...
    @property
    def contact_damping(self) -> float:
        ...
    @property
    def elastic(self) -> float:
        ...
    @property
    def elastic_change(self) -> float:
        ...
    @property
    def elastic_damping(self) -> float:
        ...
    @property
    def energy_residual(self) -> float:
        ...
    @property
    def exchanged(self) -> float:
        ...
    @property
    def expansion_work(self) -> float:
        ...
    @property
    def force_defect(self) -> float:
        ...
    @property
    def force_residual(self) -> float:
        ...
    @property
    def force_scale(self) -> float:
        ...
    @property
    def friction(self) -> float:
        ...
    @property
    def friction_heating(self) -> float:
        ...
    @property
    def gap_work(self) -> float:
        ...
    @property
    def heat_change(self) -> float:
        ...
    @property
    def heat_damping(self) -> float:
        ...
    @property
    def heat_defect(self) -> float:
        ...
    @property
    def heat_residual(self) -> float:
        ...
    @property
    def heating(self) -> float:
        ...
    @property
    def support_heat(self) -> float:
        ...
    @property
    def inertia_damping(self) -> float:
        ...
    @property
    def kinetic(self) -> float:
        ...
    @property
    def kinetic_change(self) -> float:
        ...
    @property
    def law_residual(self) -> float:
        ...
    @property
    def load_work(self) -> float:
        ...
    @property
    def supplied(self) -> float:
        ...
    @property
    def support_work(self) -> float:
        ...
    @property
    def foundation_work(self) -> float:
        ...
    @property
    def viscous(self) -> float:
        ...
class Cost:
    """
    What a run cost so far: CPU seconds of this process for the set-up and the steps, elapsed seconds for the parts of a step, counts, bytes of the factors.
    """
    items: typing.ClassVar[tuple[str, ...]] = ('setup_seconds', 'step_seconds', 'momentum_seconds', 'contact_seconds', 'heat_seconds', 'balance_seconds', 'steps', 'refinements', 'estimates', 'substitutions', 'factorizations', 'dense_factorizations', 'newton_iterations', 'factor_bytes')
    @property
    def balance_seconds(self) -> float:
        ...
    @property
    def contact_seconds(self) -> float:
        ...
    @property
    def dense_factorizations(self) -> int:
        ...
    @property
    def estimates(self) -> int:
        ...
    @property
    def factor_bytes(self) -> float:
        ...
    @property
    def factorizations(self) -> int:
        ...
    @property
    def heat_seconds(self) -> float:
        ...
    @property
    def momentum_seconds(self) -> float:
        ...
    @property
    def newton_iterations(self) -> int:
        ...
    @property
    def refinements(self) -> int:
        ...
    @property
    def setup_seconds(self) -> float:
        ...
    @property
    def step_seconds(self) -> float:
        ...
    @property
    def steps(self) -> int:
        ...
    @property
    def substitutions(self) -> int:
        ...
class StepReport2:
    """
    What one step did.
    """
    @property
    def errors(self) -> Errors:
        """
        estimated, of the fields
        """
    @property
    def undetermined(self) -> bool:
        """
        a change of the loads has no definite answer
        """
    @property
    def friction_traction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        its tangential part, (d)
        """
    @property
    def balances(self) -> Balances:
        ...
    @property
    def max_penetration(self) -> float:
        """
        length
        """
    @property
    def newton_iterations(self) -> int:
        ...
    @property
    def normal_force(self) -> float:
        """
        int p_nu, force
        """
    @property
    def open(self) -> int:
        ...
    @property
    def outcome(self) -> Outcome:
        ...
    @property
    def reason(self) -> str:
        """
        of a step that was rejected, in words
        """
    @property
    def slip(self) -> int:
        ...
    @property
    def stage(self) -> Stage:
        ...
    @property
    def stick(self) -> int:
        ...
    @property
    def traction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[2, 1]"]:
        """
        int sigma nu over Gamma_C, (d)
        """
class Stepper2:
    """
    Backward Euler (collective).
    """
    @typing.overload
    def __init__(self, layout: Layout2, problem: Problem2, operators: Operators2, surface: ContactSurface2, *, k: typing.SupportsFloat | typing.SupportsIndex, coupling: Coupling, backend: Backend, contact: ContactOptions) -> None:
        ...
    @typing.overload
    def __init__(self, problem: Problem2, *, like: Stepper2) -> None:
        """
        For a problem that differs in loads, contact laws and initial data alone; shares the factors of `like`.
        """
    def advance(self, force: petsc4py.PETSc.Vec | None, heat: petsc4py.PETSc.Vec | None, gap: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], support_velocity: petsc4py.PETSc.Vec | None = None, support_temperature: petsc4py.PETSc.Vec | None = None, foundation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., foundation_velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., measured: bool = False, time: typing.SupportsFloat | typing.SupportsIndex = ...) -> StepReport2:
        """
        One step; the state stays when the outcome is not completed. See StepLoads.
        """
    def part(self, strained: petsc4py.PETSc.Vec, strained_w: petsc4py.PETSc.Vec, rigid: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        """
        After `start`: displacement and velocity of a body without supports but for rigid motions, and the velocities of those.
        """
    def has_factored(self, k: typing.SupportsFloat | typing.SupportsIndex) -> bool:
        """
        Whether factors for a step size are kept.
        """
    def revert(self) -> None:
        """
        Takes the last step back, once for each step.
        """
    def set_step(self, k: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        The size of the next steps, time; factors that are kept are used again (collective).
        """
    @property
    def refactoring_price(self) -> float:
        """
        About how many steps the factorization for another step size costs.
        """
    @property
    def step(self) -> float:
        """
        Size of the next steps, time.
        """
    def clear_cache(self) -> None:
        """
        Drops what is remembered of earlier steps beside the state.
        """
    def resume(self, contact_force: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], status: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], extents: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(18)"], taken: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        After `start`: the contact points of the step before, the extents so far and the number of steps, for the same next step to the last bit.
        """
    def start(self, u: petsc4py.PETSc.Vec | None, w: petsc4py.PETSc.Vec | None, theta: petsc4py.PETSc.Vec | None, gap: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], time: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        Sets the state; None for a field the problem does not have.
        """
    @property
    def extents(self) -> typing.Annotated[list[float], "FixedSize(18)"]:
        """
        Of displacement, temperature, stress and contact force so far: the largest value, that or what rounding may make of it, and the largest estimated change; then the largest nodal force, the displacement at the last look at the stress, the largest velocity, and the largest displacements, by axis.
        """
    @property
    def contact_compliance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (d points, d points), velocity per force; rigid motions apart where the body has no support
        """
    @property
    def reactions(self) -> petsc4py.PETSc.Vec:
        """
        Forces of the supports on the body at the nodes in the step that was evaluated last, force.
        """
    @property
    def support_heat(self) -> petsc4py.PETSc.Vec:
        """
        Heat per time from the supports of the temperature into the body at the nodes in that step; None without heat.
        """
    @property
    def contact_heat_flow(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Heat per time at the contact points in that step, (points, 2): what pressure conducts into the foundation, and what friction gives to the body. Empty where the contact does neither.
        """
    @property
    def contact_displacement(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (d points)
        """
    @property
    def contact_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (d points), of the body on the foundation
        """
    @property
    def contact_free(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (d points), velocity without contact force in the step tried last, rigid motions apart
        """
    @property
    def contact_inertia(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (motions, motions), force per velocity; 0 in a step without inertia
        """
    @property
    def contact_motions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (d points, motions), velocities of the points in the rigid motions apart
        """
    @property
    def contact_penetration(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (points), length, at the start of the step tried last with the gap of its end
        """
    @property
    def contact_rigid(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (motions), load on the rigid motions in the step tried last
        """
    @property
    def cost(self) -> Cost:
        ...
    @property
    def heat_factor(self) -> Factor | None:
        ...
    @property
    def momentum_factor(self) -> Factor | None:
        ...
    @property
    def rigid(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Velocities of the rigid motions of a body without supports, along motions that the mesh gives.
        """
    @property
    def solver(self) -> str:
        """
        The factorizations in words.
        """
    @property
    def status(self) -> list[int]:
        """
        0 open, 1 stick, 2 slip, a point
        """
    @property
    def theta(self) -> petsc4py.PETSc.Vec | None:
        """
        Temperature.
        """
    @property
    def time(self) -> float:
        ...
    @property
    def u(self) -> petsc4py.PETSc.Vec | None:
        """
        Displacement. The vectors change owner at every step: ask again.
        """
    @property
    def w(self) -> petsc4py.PETSc.Vec | None:
        """
        Velocity.
        """
    @property
    def strained_w(self) -> petsc4py.PETSc.Vec | None:
        """
        Velocity likewise.
        """
    @property
    def strained(self) -> petsc4py.PETSc.Vec | None:
        """
        Displacement but for a rigid motion, with the digits that this would take; None where the body has a support.
        """
class StepReport3:
    """
    What one step did.
    """
    @property
    def errors(self) -> Errors:
        """
        estimated, of the fields
        """
    @property
    def undetermined(self) -> bool:
        """
        a change of the loads has no definite answer
        """
    @property
    def friction_traction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        its tangential part, (d)
        """
    @property
    def balances(self) -> Balances:
        ...
    @property
    def max_penetration(self) -> float:
        """
        length
        """
    @property
    def newton_iterations(self) -> int:
        ...
    @property
    def normal_force(self) -> float:
        """
        int p_nu, force
        """
    @property
    def open(self) -> int:
        ...
    @property
    def outcome(self) -> Outcome:
        ...
    @property
    def reason(self) -> str:
        """
        of a step that was rejected, in words
        """
    @property
    def slip(self) -> int:
        ...
    @property
    def stage(self) -> Stage:
        ...
    @property
    def stick(self) -> int:
        ...
    @property
    def traction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        int sigma nu over Gamma_C, (d)
        """
class Stepper3:
    """
    Backward Euler (collective).
    """
    @typing.overload
    def __init__(self, layout: Layout3, problem: Problem3, operators: Operators3, surface: ContactSurface3, *, k: typing.SupportsFloat | typing.SupportsIndex, coupling: Coupling, backend: Backend, contact: ContactOptions) -> None:
        ...
    @typing.overload
    def __init__(self, problem: Problem3, *, like: Stepper3) -> None:
        """
        For a problem that differs in loads, contact laws and initial data alone; shares the factors of `like`.
        """
    def advance(self, force: petsc4py.PETSc.Vec | None, heat: petsc4py.PETSc.Vec | None, gap: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], support_velocity: petsc4py.PETSc.Vec | None = None, support_temperature: petsc4py.PETSc.Vec | None = None, foundation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., foundation_velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., measured: bool = False, time: typing.SupportsFloat | typing.SupportsIndex = ...) -> StepReport3:
        """
        One step; the state stays when the outcome is not completed. See StepLoads.
        """
    def part(self, strained: petsc4py.PETSc.Vec, strained_w: petsc4py.PETSc.Vec, rigid: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        """
        After `start`: displacement and velocity of a body without supports but for rigid motions, and the velocities of those.
        """
    def has_factored(self, k: typing.SupportsFloat | typing.SupportsIndex) -> bool:
        """
        Whether factors for a step size are kept.
        """
    def revert(self) -> None:
        """
        Takes the last step back, once for each step.
        """
    def set_step(self, k: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        The size of the next steps, time; factors that are kept are used again (collective).
        """
    @property
    def refactoring_price(self) -> float:
        """
        About how many steps the factorization for another step size costs.
        """
    @property
    def step(self) -> float:
        """
        Size of the next steps, time.
        """
    def clear_cache(self) -> None:
        """
        Drops what is remembered of earlier steps beside the state.
        """
    def resume(self, contact_force: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], status: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], extents: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(18)"], taken: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        After `start`: the contact points of the step before, the extents so far and the number of steps, for the same next step to the last bit.
        """
    def start(self, u: petsc4py.PETSc.Vec | None, w: petsc4py.PETSc.Vec | None, theta: petsc4py.PETSc.Vec | None, gap: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], time: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        Sets the state; None for a field the problem does not have.
        """
    @property
    def extents(self) -> typing.Annotated[list[float], "FixedSize(18)"]:
        """
        Of displacement, temperature, stress and contact force so far: the largest value, that or what rounding may make of it, and the largest estimated change; then the largest nodal force, the displacement at the last look at the stress, the largest velocity, and the largest displacements, by axis.
        """
    @property
    def contact_compliance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (d points, d points), velocity per force; rigid motions apart where the body has no support
        """
    @property
    def reactions(self) -> petsc4py.PETSc.Vec:
        """
        Forces of the supports on the body at the nodes in the step that was evaluated last, force.
        """
    @property
    def support_heat(self) -> petsc4py.PETSc.Vec:
        """
        Heat per time from the supports of the temperature into the body at the nodes in that step; None without heat.
        """
    @property
    def contact_heat_flow(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
        """
        Heat per time at the contact points in that step, (points, 2): what pressure conducts into the foundation, and what friction gives to the body. Empty where the contact does neither.
        """
    @property
    def contact_displacement(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (d points)
        """
    @property
    def contact_force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (d points), of the body on the foundation
        """
    @property
    def contact_free(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (d points), velocity without contact force in the step tried last, rigid motions apart
        """
    @property
    def contact_inertia(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (motions, motions), force per velocity; 0 in a step without inertia
        """
    @property
    def contact_motions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (d points, motions), velocities of the points in the rigid motions apart
        """
    @property
    def contact_penetration(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (points), length, at the start of the step tried last with the gap of its end
        """
    @property
    def contact_rigid(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (motions), load on the rigid motions in the step tried last
        """
    @property
    def cost(self) -> Cost:
        ...
    @property
    def heat_factor(self) -> Factor | None:
        ...
    @property
    def momentum_factor(self) -> Factor | None:
        ...
    @property
    def rigid(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Velocities of the rigid motions of a body without supports, along motions that the mesh gives.
        """
    @property
    def solver(self) -> str:
        """
        The factorizations in words.
        """
    @property
    def status(self) -> list[int]:
        """
        0 open, 1 stick, 2 slip, a point
        """
    @property
    def theta(self) -> petsc4py.PETSc.Vec | None:
        """
        Temperature.
        """
    @property
    def time(self) -> float:
        ...
    @property
    def u(self) -> petsc4py.PETSc.Vec | None:
        """
        Displacement. The vectors change owner at every step: ask again.
        """
    @property
    def w(self) -> petsc4py.PETSc.Vec | None:
        """
        Velocity.
        """
    @property
    def strained_w(self) -> petsc4py.PETSc.Vec | None:
        """
        Velocity likewise.
        """
    @property
    def strained(self) -> petsc4py.PETSc.Vec | None:
        """
        Displacement but for a rigid motion, with the digits that this would take; None where the body has a support.
        """
@typing.overload
def heat_matrix(operators: Operators2, k: typing.SupportsFloat | typing.SupportsIndex) -> petsc4py.PETSc.Mat:
    """
    M / k + D + J with prescribed temperatures eliminated.
    """
@typing.overload
def heat_matrix(operators: Operators3, k: typing.SupportsFloat | typing.SupportsIndex) -> petsc4py.PETSc.Mat:
    """
    M / k + D + J with prescribed temperatures eliminated.
    """
@typing.overload
def largest_strain(mesh: Mesh2, u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"]) -> float:
    """
    Largest principal strain, in size, of all cells for nodal u (nodes, d); dimensionless.
    """
@typing.overload
def largest_strain(mesh: Mesh3, u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> float:
    """
    Largest principal strain, in size, of all cells for nodal u (nodes, d); dimensionless.
    """
@typing.overload
def momentum_matrix(layout: Layout2, problem: Problem2, operators: Operators2, k: typing.SupportsFloat | typing.SupportsIndex) -> petsc4py.PETSc.Mat:
    """
    rho M / k + B + k A with prescribed displacements eliminated.
    """
@typing.overload
def momentum_matrix(layout: Layout3, problem: Problem3, operators: Operators3, k: typing.SupportsFloat | typing.SupportsIndex) -> petsc4py.PETSc.Mat:
    """
    rho M / k + B + k A with prescribed displacements eliminated.
    """
@typing.overload
def prolongation(coarse: Mesh2, fine: Mesh2) -> scipy.sparse.csr_matrix:
    """
    Exact interpolation of P1 functions between nested meshes, a SciPy CSR matrix (fine nodes, coarse nodes); ValueError if they are not nested.
    """
@typing.overload
def prolongation(coarse: Mesh3, fine: Mesh3) -> scipy.sparse.csr_matrix:
    """
    Exact interpolation of P1 functions between nested meshes, a SciPy CSR matrix (fine nodes, coarse nodes); ValueError if they are not nested.
    """
def simplex_rule(dim: typing.SupportsInt | typing.SupportsIndex, points: typing.SupportsInt | typing.SupportsIndex) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]:
    """
    Barycentric points (q, dim+1) and weights (q), exact to degree 2 points - 1.
    """
@typing.overload
def stress(problem: Problem2, u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"], w: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"], theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 4]"]:
    """
    Cauchy stress (2.1) at the cells' centroids, (cells, d*d), from nodal u, w (nodes, d) and theta (nodes); a field the problem does not have may be empty.
    """
@typing.overload
def stress(problem: Problem3, u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], w: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 9]"]:
    """
    Cauchy stress (2.1) at the cells' centroids, (cells, d*d), from nodal u, w (nodes, d) and theta (nodes); a field the problem does not have may be empty.
    """
@typing.overload
def stress_out_of_plane(problem: Problem2, u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"], w: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"], theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    sigma_zz at the cells' centroids, (cells,), of a plane; zero in space. Arrays as for stress.
    """
@typing.overload
def stress_out_of_plane(problem: Problem3, u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], w: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"], theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    sigma_zz at the cells' centroids, (cells,), of a plane; zero in space. Arrays as for stress.
    """
compiler: str = 'g++ 12.2.0'
petsc_version: str = '3.18.5'
