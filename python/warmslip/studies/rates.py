"""Orders of convergence from tables of errors: observed, corrected for the self-reference, and expected."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from warmslip.records import tables
from warmslip.records.tables import Row
from warmslip.scene.errors import SceneError
from warmslip.scene.full import FullScene, full_model
from warmslip.scene.reader import build
from warmslip.studies.error_norms import SUMS, TERMS

# an energy-norm error is orthogonal to the finer space: its square adds up, the others' values do
QUADRATIC = {"u_V"}


def observed(coarse: float, fine: float, ratio: float = 2.0) -> float:
    """log(coarse/fine)/log(ratio); nan when either error is not positive."""
    return float(np.log(coarse / fine) / np.log(ratio)) if coarse > 0 and fine > 0 else float("nan")


def corrected(coarse: float, fine: float, h: float, reference: float, *, quadratic: bool, ratio: float = 2.0) -> float:
    """The order p of a true error C h^p that, measured against a solution of size `reference`, shows these two errors.

    Measured against that solution the error is C (h^p - reference^p), or the root of the same with squares when the
    errors are orthogonal, so a plain ratio flatters: a true first order shows 1.58 at the last halving of 1/16 .. 1/128
    against 1/256. `h` belongs to `coarse`, h/ratio to `fine`. nan when no p in (0.02, 8) fits.
    """
    from scipy.optimize import brentq  # a quarter of a second, for few commands

    if not (coarse > 0 and fine > 0):  # of a field that is not there
        return float("nan")
    r = h / reference
    target = (coarse / fine) ** (2 if quadratic else 1)

    def mismatch(p: float) -> float:
        q = 2 * p if quadratic else p
        return float((r**q - 1) / ((r / ratio) ** q - 1) - target)

    try:
        return float(brentq(mismatch, 0.02, 8.0))
    except ValueError:
        return float("nan")


def least_squares(h: Iterable[float], errors: Iterable[float]) -> tuple[float, float]:
    """Order and root mean square misfit of log(error) = p log(h) + c over a grid.

    Raises ValueError for fewer than three sizes.
    """
    x, y = np.log(np.array(list(h))), np.log(np.array(list(errors)))
    if len(x) < 3:
        raise ValueError(f"{len(x)} grids say nothing about an order; give at least three")
    (p, c), *_ = np.linalg.lstsq(np.stack([x, np.ones_like(x)], axis=1), y, rcond=None)
    return float(p), float(np.sqrt(np.mean((y - p * x - c) ** 2)))


def williams_exponent(lam: float, mu: float, angle: float = np.pi / 2) -> float:
    """Smallest singular exponent of u ~ r^L at a clamped-free corner, for the plane Lame pair (lam, mu).

    M. L. Williams, J. Appl. Mech. 19, 1952: sin^2(L angle) = (c+1)^2/(4c) - L^2 sin^2(angle)/c, c = (lam+3mu)/(lam+mu).
    """
    from scipy.optimize import brentq

    c = (lam + 3 * mu) / (lam + mu)

    def equation(exponent: float) -> float:
        side = (c + 1) ** 2 / (4 * c) - exponent**2 * np.sin(angle) ** 2 / c
        return float(np.sin(exponent * angle) ** 2 - side)

    grid = np.linspace(1e-3, 2.0, 2000)
    values = [equation(x) for x in grid]
    for left, right, a, b in zip(grid, grid[1:], values, values[1:], strict=False):
        if a * b <= 0:
            return float(brentq(equation, left, right))
    return 1.0


def expected_order(term: str, *, hot: bool, singular_conductivity: bool, viscosity: tuple[float, float]) -> float:
    """The order in h = k that the paper's scene is expected to, by term (verification notes, section 4).

    |u|_V is held back by the clamped-free corners; |w|_L2 by tractions that act from t = 0 on a body at rest, and
    |theta|_L2 by theta_F = 10 against theta_0 = 0 (each O(k^(3/4)) in the maximum over time) or by a singular K (a jump
    across x = y, O(h^(1/2))), which |u|_V then inherits. For the paper's problem alone, see `papers`.
    """
    theta = 0.5 if singular_conductivity else 0.75 if hot else 1.0
    u = min(williams_exponent(*viscosity), 1.0, theta if singular_conductivity else 1.0)
    single = {"u_V": u, "w_L2": min(0.75, 2 * u), "theta_L2": theta}
    return single[term] if term in single else min(single[one] for one in SUMS[term])


def is_paper_problem(scene: FullScene) -> bool:
    """Whether `expected` speaks of the scene: the paper's square with its supports, loads at rest, whatever the constants."""
    supports, initial = scene.supports, scene.initial
    return (
        scene.mesh.name == "square"
        and (supports.displacement, set(supports.temperature)) == (["top"], {"top", "left", "right"})
        and (initial.displacement, initial.velocity, initial.temperature) == (None, None, 0)
        and set(scene.loads.traction) == {"left", "right"}
        and scene.inertia.density > 0
        and scene.viscosity.pair(2)[1] > 0
    )


def table(path: Path, scene: Row) -> list[Row]:
    """Orders along the diagonal h = k (of a mesh file h ~ k) of one study; `scene` is the resolved scene of its stamp.

    A sum of terms has no corrected order, as its terms are corrected in different ways; a scene that is not the paper's has no
    expected one here (`warmslip check` states what its corners and its start allow). Raises ValueError for fewer than three
    levels there.
    """
    rows = tables.read(path)
    try:
        built: FullScene | None = full_model(build(dict(scene)))
    except SceneError:  # not of the paper's kind
        built = None
    reference = rows[-1]["h"]
    # in a study of a mesh file n counts pieces of an edge, and steps are that many times the scene's: h ~ k in place of h = k
    steps_per_level = rows[-1]["steps"] / rows[-1]["n"]
    diagonal = sorted((r for r in rows[:-1] if r["steps"] == steps_per_level * r["n"]), key=lambda r: -r["h"])
    if len(diagonal) < 3:
        raise ValueError(
            f"{path}: an order needs three levels on which h and k shrink together, here are {len(diagonal)}; give "
            "`warmslip study` three --levels or more"
        )
    out: list[Row] = []
    for term in [*TERMS, *SUMS]:
        limit = float("nan")
        if built is not None and is_paper_problem(built):
            singular = abs(np.linalg.det(np.array(built.heat.conductivity))) < 1e-12
            hot = built.contact.heat_exchange.foundation_temperature != built.initial.temperature
            limit = expected_order(term, hot=hot, singular_conductivity=singular, viscosity=built.viscosity.pair(2))
        before: Row | None = None
        for line in diagonal:
            error = line[f"e_{term}"]
            p = q = float("nan")
            if before is not None:
                ratio = before["h"] / line["h"]
                p = observed(before[f"e_{term}"], error, ratio)
                if term in TERMS:
                    how = {"quadratic": term in QUADRATIC, "ratio": ratio}
                    q = corrected(before[f"e_{term}"], error, before["h"], reference, **how)
            out.append(
                {
                    "case": path.stem,
                    "term": term,
                    "h": line["h"],
                    "error": error,
                    "observed": p,
                    "corrected": q,
                    "expected": limit,
                }
            )
            before = line
    return out
