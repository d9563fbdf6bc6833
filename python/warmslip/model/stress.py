"""Measures of the stress."""

from __future__ import annotations

import numpy as np

from warmslip.typing import Array


def von_mises(stress: Array, zz: Array | None = None) -> Array:
    """Von Mises stress sqrt(3/2 s:s), with s the deviator of the stress.

    Parameters
    ----------
    stress : array (cells, d, d)
        Cauchy stress, of cells or of nodes.
    zz : array (cells,), optional
        Stress along z of a body in the plane, 0 unless given. Shear stresses along z are 0.

    Returns
    -------
    array (cells,)
        Von Mises stress.

    Raises
    ------
    ValueError
        For stresses of another shape.
    """
    if stress.ndim != 3 or stress.shape[1:] not in ((2, 2), (3, 3)):
        raise ValueError(f"stress: the shape is {stress.shape}; give (cells, d, d) with d = 2 or 3")
    full = np.zeros((len(stress), 3, 3))
    d = stress.shape[1]
    full[:, :d, :d] = stress
    if zz is not None:
        full[:, 2, 2] = zz
    deviator = full - np.trace(full, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    with np.errstate(over="ignore"):  # a run that overflowed is drawn as far as it came
        return np.asarray(np.sqrt(1.5 * np.einsum("cij,cij->c", deviator, deviator)))


def stress_measures(mises: Array, volumes: Array) -> dict[str, float]:
    """L2 norm and maximum of a von Mises stress of the cells (cells,) with their volumes (cells,)."""
    return {"mises_L2": float(np.sqrt(volumes @ mises**2)), "mises_max": float(mises.max())}
