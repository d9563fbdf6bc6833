"""The stress along z of a body in the plane: what it is under each assumption, and that von Mises counts it everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest

import warmslip
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.scene.errors import SceneError
from warmslip.scene.reader import build

YOUNG, POISSON, STRAIN, RATE = 2000.0, 0.3, 0.1, 0.7
LAM, MU = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
STRAINED = {"young": YOUNG, "poisson": POISSON, "assumption": "plane_strain"}


def body(elasticity: dict[str, Any] = STRAINED, **tables: Any) -> Discretisation:
    data = {
        "mesh": {"shape": "square", "n": 2},
        "time": {"end": 1.0, "steps": 1},
        "elasticity": elasticity,
        "supports": {"displacement": ["left"]},
    }
    return discretise(build(data | tables))


def stretched(d: Discretisation, warming: float = 0.0) -> tuple[float, float]:
    """Stress along z and von Mises stress of a uniaxial strain with a rate, the same in all cells."""
    x = np.asarray(d.mesh.nodes)
    u, w = np.zeros_like(x), np.zeros_like(x)
    u[:, 0], w[:, 0] = STRAIN * x[:, 0], RATE * x[:, 0]
    found = [f(u, w, np.full(len(x), warming)) for f in (d.stress_zz, d.mises_of)]
    assert all(np.ptp(values) <= 1e-11 for values in found)
    return float(found[0][0]), float(found[1][0])


def mises(xx: float, yy: float, zz: float) -> float:
    return float(np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2))


def test_uniaxial_plane_strain() -> None:
    zz, found = stretched(body())
    assert zz == pytest.approx(LAM * STRAIN, rel=1e-12)
    assert found == pytest.approx(153.846153846, rel=1e-9)  # 2 mu eps: the two lateral stresses are equal
    lame = {"lame": [LAM, MU], "assumption": "plane_strain"}
    assert stretched(body(lame)) == pytest.approx((zz, found), rel=1e-12)


def test_what_says_nothing_about_z_has_no_stress_there() -> None:
    flat = mises((LAM + 2 * MU) * STRAIN, LAM * STRAIN, 0.0)
    tensor = {"tensor": [[LAM + 2 * MU, LAM, 0.0], [LAM, LAM + 2 * MU, 0.0], [0.0, 0.0, MU]]}
    for elasticity in ({"lame": [LAM, MU]}, tensor):
        assert stretched(body(elasticity)) == pytest.approx((0.0, flat), rel=1e-12)
    plane = LAM * 2 * MU / (LAM + 2 * MU)
    stress = mises((plane + 2 * MU) * STRAIN, plane * STRAIN, 0.0)
    assert stretched(body(STRAINED | {"assumption": "plane_stress"})) == pytest.approx((0.0, stress), rel=1e-12)


def test_viscosity_and_temperature_press_along_z() -> None:
    """A Lame viscosity is in plane strain where the elasticity is; M_zz is the mean of M_xx and M_yy."""
    heat = {"conductivity": 1.0, "expansion": {"tensor": [[3.0, 0.0], [0.0, 5.0]]}}
    d = body(viscosity={"lame": [7.0, 11.0]}, heat=heat)
    xx = (LAM + 2 * MU) * STRAIN + 29.0 * RATE - 3.0 * 2.0
    yy, zz = LAM * STRAIN + 7.0 * RATE - 5.0 * 2.0, LAM * STRAIN + 7.0 * RATE - 4.0 * 2.0
    assert stretched(d, 2.0) == pytest.approx((zz, mises(xx, yy, zz)), rel=1e-12)
    other = body({"lame": [LAM, MU]}, viscosity=STRAINED)
    assert stretched(other)[0] == pytest.approx(LAM * (STRAIN + RATE), rel=1e-12)


def test_every_region_has_its_own() -> None:
    soft = {"where": "x > 0.5", "elasticity": {"lame": [10.0, 20.0], "assumption": "plane_strain"}}
    d = body(regions={"soft": soft})
    x = np.asarray(d.mesh.nodes)
    u = np.column_stack([STRAIN * x[:, 0], np.zeros(len(x))])
    right = x[np.asarray(d.mesh.cells)].mean(axis=1)[:, 0] > 0.5
    expected = np.where(right, 10.0 * STRAIN, LAM * STRAIN)
    assert np.allclose(d.stress_zz(u, u, None), expected, rtol=1e-12)


def test_everything_that_is_written_counts_it(tmp_path: Path) -> None:
    """State, trajectory, VTU and the drawn body have one von Mises stress."""
    from warmslip.io.drawn import body as drawn
    from warmslip.io.trajectory import Trajectory

    scene = build(
        {
            "mesh": {"shape": "square", "n": 3},
            "time": {"end": 1.0, "steps": 1},
            "elasticity": STRAINED,
            "supports": {"displacement": {"left": [0.0, 0.0], "right": [0.1, 0.0]}},
        }
    )
    states: list[Any] = []
    done = warmslip.run(scene, out=tmp_path, observers=[lambda s, _: states.append((s.mises, s.stress, s.stress_zz))])
    assert done.completed
    found, stress, zz = states[-1]
    by_hand = [mises(*np.linalg.eigvalsh(s), z) for s, z in zip(stress, zz, strict=True)]
    assert np.abs(zz).min() > 1
    assert np.allclose(found, by_hand, rtol=1e-12)
    with h5py.File(tmp_path / "trajectory.h5") as file:
        assert np.allclose(file["fields/mises"][:], found, rtol=1e-12)
    vtu = meshio.read(tmp_path / "final.vtu")
    assert np.allclose(vtu.cell_data["von Mises"][0], found, rtol=1e-12)
    assert np.allclose(vtu.cell_data["stress"][0][:, 2], zz, rtol=1e-12)
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert np.allclose(drawn(t, t.discretisation(), 1).fields["von Mises stress"], found, rtol=1e-12)


def test_a_pair_that_leaves_open_which_is_refused() -> None:
    with pytest.raises(
        SceneError, match=r"elasticity: lame with plane_stress leaves open which pair is meant; give young"
    ):
        body({"lame": [1.0, 1.0], "assumption": "plane_stress"})
