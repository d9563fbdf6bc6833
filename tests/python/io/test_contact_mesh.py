"""The contact parts as lines and triangles: every point has its own values, and integrals of the surface are the forces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import warmslip
from warmslip import Trajectory
from warmslip.io.paraview import export
from warmslip.io.vtu import symmetric
from warmslip.records import tables

# an L turned over: it stands on its corner, and both of its contact parts meet there
WEDGE = {
    "mesh.n": 4,
    "time.steps": 2,
    "contact": [
        {"part": "bottom", "stiffness": 1e3, "gap": "-0.01 * (1 + x) * t", "friction": {"coefficient": 0.3}},
        {"part": "left", "stiffness": 1e3, "gap": "-0.02 * (1 + y * y) * t", "friction": {"coefficient": 0.2}},
    ],
}


def exported(folder: Path, scene: Any, form: str = "vtu") -> tuple[Any, Any, Any, dict[str, float]]:
    """The last files of a run: contact, contact points if there are any, body, and the resultants."""
    warmslip.run(scene, out=folder / "run")
    export(folder / "run", folder / "series", form=form)
    names = ("contact_0", "contact_points_0", "body_0")
    files = [sorted((folder / "series").glob(f"{name}*.vtu")) for name in names]
    contact, points, body = (meshio.read(found[-1]) if found else None for found in files)
    rows = tables.read(folder / "series/series.csv")
    return contact, points, body, rows[-1]


def sizes(mesh: Any) -> Any:
    """Lengths or areas of the facets."""
    corners = mesh.points[mesh.cells[0].data]
    edges = corners[:, 1:] - corners[:, :1]
    return (
        np.linalg.norm(edges[:, 0], axis=1)
        if edges.shape[1] == 1
        else np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    )


def integral(mesh: Any, name: str) -> Any:
    """Of a field over the surface, as ParaView's Integrate Variables forms it."""
    if name in mesh.cell_data:
        return sizes(mesh) @ mesh.cell_data[name][0]
    return sizes(mesh) @ mesh.point_data[name][mesh.cells[0].data].mean(axis=1)


SCENES = {
    "two parts at a corner": ("quasistatic_punch", WEDGE),
    "curved": (
        "plate_with_hole",
        {"time.steps": 2, "contact": [{"part": "hole", "stiffness": 10.0, "gap": "-0.01 * t"}]},
    ),
    "space": ("block_3d", {"time.steps": 2, "mesh.n": 2}),
    "round in space": ("quarter_sphere", {"time.steps": 2, "mesh.n": 2}),
}
FEW_POINTS = ("two parts at a corner", "curved", "space")


@pytest.mark.parametrize(
    ("name", "rule"),
    [*((name, "nodal") for name in SCENES), *((name, "gauss-2") for name in FEW_POINTS), ("curved", "gauss-3")],
)
def test_integrals_are_the_contact_forces(name: str, rule: str, tmp_path: Path) -> None:
    library, keys = SCENES[name]
    scene = warmslip.load(library).override(**keys)
    tables = [table.model_dump(exclude_none=True) | {"quadrature": rule} for table in scene.contacts]
    scene = scene.override(contact=tables)
    contact, points, _, forces = exported(tmp_path, scene)
    assert contact.cells[0].type == ("line" if scene.mesh.dim == 2 else "triangle")
    assert (points is not None) == (rule != "nodal")
    total = sum(forces[f"normal_force {table.part}"] for table in scene.contacts)
    assert abs(total) > 1e-3 and integral(contact, "pressure") == pytest.approx(total, rel=1e-12)
    for i, axis in enumerate("xyz"[: scene.mesh.dim]):
        friction = sum(forces[f"friction_{axis} {table.part}"] for table in scene.contacts)
        assert integral(contact, "friction traction")[i] == pytest.approx(friction, rel=1e-10, abs=1e-13)


@pytest.mark.parametrize("name", SCENES)
def test_nodal_values_are_those_of_the_contact_points(name: str, tmp_path: Path) -> None:
    """Of several points at a node, a facet has that with its own normal, on its own part."""
    library, keys = SCENES[name]
    scene = warmslip.load(library).override(**keys)
    contact, _, _, _ = exported(tmp_path, scene)
    fields, facets = contact.point_data, contact.cells[0].data
    d = scene.mesh.dim
    corners = contact.points[facets]
    edges = corners[:, 1:] - corners[:, :1]
    across = np.cross(edges[:, 0], edges[:, 1]) if d == 3 else np.cross(edges[:, 0], [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    normals, parts = fields["normal"][facets], fields["part"][facets]
    assert np.allclose(np.abs(np.einsum("fci,fi->fc", normals, across)), 1, atol=1e-9)
    assert (parts == parts[:, :1]).all() and set(parts.ravel()) == set(range(len(scene.contacts)))
    assert np.array_equal(np.unique(facets), np.arange(len(contact.points)))  # every point bears a facet
    with Trajectory(tmp_path / "run/trajectory.h5") as stored:
        for number, table in enumerate(scene.contacts):
            here = stored.contact_on(table.part)
            on = fields["part"] == number
            assert sorted(fields["pressure"][on]) == sorted(here.pressure)
            if d == 2:
                order = np.argsort(fields["arc length"][on], kind="stable")
                for field, values in (("arc length", here.arc_length), ("pressure", here.pressure), ("gap", here.gap)):
                    assert np.allclose(fields[field][on][order], values, rtol=1e-12, atol=1e-14), field
                own = (parts == number).all(axis=1)
                off = np.abs(np.ptp(fields["arc length"][facets[own]], axis=1) - sizes(contact)[own]) > 1e-12
                assert off.sum() == (name == "curved")  # the last line of a closed part ends at its first point, at 0
    assert ("arc length" in fields) == (d == 2)


def test_facets_of_gauss_points_have_their_means(tmp_path: Path) -> None:
    """Also where another part has nodal quadrature; the status is the largest."""
    scene = warmslip.load("quasistatic_punch").override(**WEDGE)
    tables = [table.model_dump(exclude_none=True) for table in scene.contacts]
    tables[0]["quadrature"] = "gauss-2"
    scene = scene.override(contact=tables)
    contact, points, _, forces = exported(tmp_path, scene)
    n = 4
    assert len(points.points) == 2 * n + n + 1 and len(contact.cells[0].data) == 2 * n
    part = contact.cell_data["part"][0]
    middles = contact.points[contact.cells[0].data].mean(axis=1)
    for facet in range(2 * n):
        if part[facet] == 0:
            on = (points.point_data["part"] == 0) & (np.abs(points.points[:, 0] - middles[facet, 0]) < 0.5 / n)
        else:
            on = (points.point_data["part"] == 1) & (np.abs(points.points[:, 1] - middles[facet, 1]) < 0.51 / n)
        assert on.sum() == 2
        for field in ("pressure", "gap", "arc length", "slip"):
            mean = points.point_data[field][on].mean(axis=0)
            assert np.allclose(contact.cell_data[field][0][facet], mean, rtol=1e-12, atol=1e-15), field
        assert contact.cell_data["status"][0][facet] == points.point_data["status"][on].max()
    total = forces["normal_force bottom"] + forces["normal_force left"]
    assert integral(contact, "pressure") == pytest.approx(total, rel=1e-12)


def test_chosen_fields_of_the_surface(tmp_path: Path) -> None:
    scene = warmslip.load("quasistatic_punch").override(**WEDGE)
    exported(tmp_path, scene)
    export(tmp_path / "run", tmp_path / "few", fields=["pressure", "normal", "arc length"], times=[1.0])
    contact = meshio.read(tmp_path / "few/contact_0002.vtu")
    assert set(contact.point_data) == {"pressure", "normal", "arc length"}
    said: list[str] = []
    export(tmp_path / "run", tmp_path / "few", fields=["pressure", "region"], warn=said.append)
    assert said[0].startswith("the run has no region, which is left out")
    gauss = scene.override(contact=[{"part": "bottom", "stiffness": 10.0, "quadrature": "gauss-2", "gap": "-0.1 * t"}])
    exported(tmp_path / "gauss", gauss)
    assert (tmp_path / "gauss/series/contact_points.pvd").exists()
    export(tmp_path / "run", tmp_path / "gauss/series")
    assert not list((tmp_path / "gauss/series").glob("contact_points*"))


def test_regions_are_numbered_in_the_order_of_the_scene(tmp_path: Path) -> None:
    _, _, body, _ = exported(tmp_path, warmslip.load("two_materials", ["mesh.n=10", "time.steps=1"]))
    middles = body.points[body.cells[0].data].mean(axis=1)
    inside = (np.abs(middles[:, :2] - 0.5) < 0.2).all(axis=1)
    assert 0 < inside.sum() < len(inside)
    assert np.array_equal(body.cell_data["region"][0], inside.astype(int))
    final = meshio.read(tmp_path / "run/final.vtu")
    assert np.array_equal(final.cell_data["region"][0], inside.astype(int))


def test_stress_has_the_components_that_paraview_names() -> None:
    """XX, YY, ZZ, XY, YZ, XZ, by which ParaView names six components; in the plane ZZ is the stress along z."""
    full = np.array([[1.0, 4.0, 6.0], [4.0, 2.0, 5.0], [6.0, 5.0, 3.0]])
    assert symmetric(full[None], np.zeros(1)).tolist() == [[1, 2, 3, 4, 5, 6]]
    assert symmetric(full[None, :2, :2], np.array([7.0])).tolist() == [[1, 2, 7, 4, 0, 0]]


@pytest.mark.parametrize("name", ["plate_with_hole", "block_with_hole"])
def test_stress_of_a_file_is_that_of_the_state(name: str, tmp_path: Path) -> None:
    _, _, body, _ = exported(tmp_path, warmslip.load(name, ["time.steps=2"]))
    with Trajectory(tmp_path / "run/trajectory.h5") as stored:
        stress = stored.state().stress
    found, d = body.cell_data["stress"][0], stress.shape[1]
    pairs = {0: (0, 0), 1: (1, 1), 3: (0, 1)} | ({2: (2, 2), 4: (1, 2), 5: (0, 2)} if d == 3 else {})
    for column, (i, j) in pairs.items():
        assert np.allclose(found[:, column], stress[:, i, j], rtol=1e-12, atol=1e-14)
        assert np.abs(found[:, column]).max() > 1e-3
    assert found.shape[1] == 6


def test_a_closed_part_is_a_closed_line(tmp_path: Path) -> None:
    """The rim of a hole: every place is the end of two lines."""
    library, keys = SCENES["curved"]
    contact, _, _, _ = exported(tmp_path, warmslip.load(library).override(**keys))
    facets = contact.cells[0].data
    _, count = np.unique(contact.points[facets].reshape(-1, 3), axis=0, return_counts=True)
    assert (count == 2).all()
