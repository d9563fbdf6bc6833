"""Meshes from files, refined: nested, conforming, of the same shape, with the same parts and regions."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import warmslip
from warmslip import _core
from warmslip.mesh import files
from warmslip.mesh.refinement import refined
from warmslip.model.meshes import make_mesh
from warmslip.studies import refinement_study

FILES = ["plate_with_hole.msh", "block_with_hole.msh"]


def volumes(mesh: files.MeshFile) -> np.ndarray:
    return np.linalg.det(mesh.nodes[mesh.cells[:, 1:]] - mesh.nodes[mesh.cells[:, :1]])


@pytest.mark.parametrize("file", FILES)
def test_cells_parts_and_regions_are_cut(file: str) -> None:
    coarse = files.read(file)
    fine = refined(coarse)
    children = 2**coarse.dim
    assert len(fine.cells) == children * len(coarse.cells)
    assert (volumes(fine) > 0).all()
    assert volumes(fine).reshape(-1, children).sum(axis=1) == pytest.approx(volumes(coarse), rel=1e-12)
    assert volumes(fine) == pytest.approx(np.repeat(volumes(coarse), children) / children, rel=1e-9)
    facets = Counter(tuple(sorted(np.delete(cell, i))) for cell in fine.cells.tolist() for i in range(fine.dim + 1))
    assert set(facets.values()) == {1, 2}  # conforming
    for name, part in fine.parts.items():
        assert len(part) == 2 ** (fine.dim - 1) * len(coarse.parts[name])
        assert all(facets[tuple(sorted(facet))] == 1 for facet in part.tolist())
    for name, own in fine.regions.items():
        assert volumes(fine)[own].sum() == pytest.approx(volumes(coarse)[coarse.regions[name]].sum(), rel=1e-12)


@pytest.mark.parametrize("file", FILES)
def test_spaces_are_nested(file: str) -> None:
    """A P1 function of the coarse mesh is interpolated exactly, which the core refuses when the meshes are not nested."""
    coarse, fine = files.read(file), refined(files.read(file))
    kind = getattr(_core, f"Mesh{coarse.dim}")
    matrix = _core.prolongation(*(kind.from_lists(m.nodes, m.cells, m.parts) for m in (coarse, fine)))
    x = coarse.nodes @ np.arange(1.0, coarse.dim + 1)
    assert matrix @ x == pytest.approx(fine.nodes @ np.arange(1.0, coarse.dim + 1), rel=1e-13)


def test_no_worse_shapes() -> None:
    """Twice refined, the worst tetrahedron is not much flatter: the octahedra are cut along their shortest diagonals."""

    def worst(mesh: files.MeshFile) -> float:
        corners = mesh.nodes[mesh.cells]
        edges = np.stack([np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i in range(4) for j in range(i)])
        return float((volumes(mesh) / edges.max(axis=0) ** 3).min())

    coarse = files.read("block_with_hole.msh")
    assert worst(refined(coarse, 2)) > 0.4 * worst(coarse)


@pytest.mark.parametrize("name", ["plate_with_hole", "block_with_hole"])
def test_a_scene_asks_for_it(name: str) -> None:
    scene = warmslip.load(name, ["mesh.refine=1", "time.steps=2"])
    found = warmslip.run(scene)
    assert found.completed and len(make_mesh(scene).nodes) == len(found.theta)
    coarse = warmslip.run(warmslip.load(name, ["time.steps=2"]))
    one, other = found.summary["norms"]["theta_L2"], coarse.summary["norms"]["theta_L2"]
    assert 0 < abs(one - other) < 0.05 * other


def test_only_files_are_refined() -> None:
    with pytest.raises(warmslip.SceneError, match="refine is for a mesh from a file; give a larger n"):
        warmslip.load("paper_mixed", ["mesh.refine=1"])


def test_a_study_of_a_file() -> None:
    """Errors fall as the file is refined with the steps; its members are plain runs."""
    scene = warmslip.load("plate_with_hole", ["time.steps=2"])
    rows = refinement_study.study(scene, levels=[1, 2], reference=4)
    assert [(row["n"], row["steps"], row["h"]) for row in rows] == [(1, 2, 1.0), (2, 4, 0.5), (4, 8, 0.25)]
    for term in ("u_V", "theta_L2"):
        assert 0 < rows[1][f"e_{term}"] < 0.75 * rows[0][f"e_{term}"]
    alone = warmslip.run(scene.override(**{"mesh.refine": 1, "time.steps": 4})).summary["norms"]
    assert rows[1]["norm_theta_L2"] == pytest.approx(alone["theta_L2"], rel=1e-12)


def test_a_study_of_a_file_in_space() -> None:
    scene = warmslip.load("block_with_hole", ["time.steps=2"])
    coarse, fine = refinement_study.study(scene, levels=[1], reference=2)
    assert (fine["n"], fine["steps"]) == (2, 4)
    assert 0 < coarse["e_theta_L2"] < 0.2 * fine["norm_theta_L2"]
