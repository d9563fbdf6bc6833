"""Our reader of gmsh files against meshio's, in every format that meshio writes."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from warmslip.mesh import files, gmsh

FILES = ["plate_with_hole.msh", "block_with_hole.msh"]
SIZES = {"vertex": 1, "line": 2, "triangle": 3, "tetra": 4}


def theirs(path: Path) -> tuple[np.ndarray, dict[tuple[int, int], set[tuple[int, ...]]]]:
    """Nodes, and the elements by (nodes an element, physical group)."""
    mesh = meshio.gmsh.read(path)
    found: dict[tuple[int, int], set[tuple[int, ...]]] = {}
    for block, tags in zip(mesh.cells, mesh.cell_data["gmsh:physical"], strict=True):
        for nodes, tag in zip(block.data.tolist(), tags.tolist(), strict=True):
            found.setdefault((SIZES[block.type], tag), set()).add(tuple(nodes))
    return mesh.points, found


def ours(path: Path) -> tuple[np.ndarray, dict[tuple[int, int], set[tuple[int, ...]]]]:
    raw = gmsh.parse(path.read_bytes())
    found: dict[tuple[int, int], set[tuple[int, ...]]] = {}
    for block in raw.blocks:
        for member, tag in zip(block.member.tolist(), block.group.tolist(), strict=True):
            found.setdefault((block.nodes.shape[1], tag), set()).add(tuple(block.nodes[member].tolist()))
    return raw.nodes, found


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
@pytest.mark.parametrize("version", ["gmsh22", "gmsh"])
@pytest.mark.parametrize("file", FILES)
def test_the_same_nodes_elements_and_groups(file: str, version: str, binary: bool, tmp_path: Path) -> None:
    path = tmp_path / "copy.msh"
    meshio.write(path, meshio.gmsh.read(files.find(file)), file_format=version, binary=binary)
    (x, elements), (y, expected) = ours(path), theirs(path)
    assert np.array_equal(x, y)
    assert elements == expected and len(expected) >= 3
    assert all(elements.values())


@pytest.mark.parametrize("file", FILES)
def test_the_packaged_files_read_alike(file: str) -> None:
    path = files.find(file)
    assert np.array_equal(ours(path)[0], theirs(path)[0])
    assert ours(path)[1] == theirs(path)[1]
