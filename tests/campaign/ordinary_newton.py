"""What a user would write: the paper's scheme on uniform meshes in Python, as points of the atlas.

`ordinary Newton` is what most would write first, with the matrices of scikit-fem: every Newton iteration factors the whole
system anew, bordered by the contact. The heat matrix is factored once. `SciPy, factored once` is what remains to be had in
Python: both matrices are factored once, and contact is a small dense problem. Assembly is not counted, as with every other
method. The discrete solution is that of equal steps, whose errors are taken over once the two agree; `from_ours` is their largest
relative difference of final norms, and of forces for the former.

`python tests/campaign/ordinary_newton.py paper_hot --table results/tradeoff/trade_paper_hot.csv` adds the points to the table.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # tests, for the independent code

import warmslip
from warmslip.figures.trade import ORDINARY, OTHERS
from warmslip.records import tables
from warmslip.scene.scene import Scene
from warmslip.studies.tradeoff import CONTESTS

LEVELS = (8, 16, 32, 64, 128)
SAME = 1e-8  # relative difference up to which two codes have one discrete solution
SYMMETRIC: dict[str, Any] = {  # the fastest of SuperLU's orderings here
    "permc_spec": "MMD_AT_PLUS_A",
    "diag_pivot_thresh": 0.01,
    "options": {"SymmetricMode": True},
}


@dataclass
class Counted:
    """A direct solver that factors every matrix it is given, and counts them."""

    factorizations: int = 0

    def __call__(self, matrix: Any, right: Any, **_: Any) -> Any:
        from scipy.sparse.linalg import splu

        self.factorizations += 1
        return splu(matrix.tocsc(), **SYMMETRIC).solve(right)


def simulate(theta_F: float, n: int, steps: int) -> dict[str, float]:
    """Staggered backward Euler to the end: final norms and forces, CPU seconds and factorizations."""
    from reference import skfem_scheme as code
    from scipy.sparse.linalg import splu

    on, k = code.space(n), code.T / steps
    ops = code.Operators(on, "mixed", theta_F, code.F0)
    momentum = ops.inertia / k + ops.viscosity + k * ops.elasticity
    heat = ops.mass / k + ops.conduction + ops.exchange
    free = np.setdiff1d(np.arange(on.scalar.N), on.prescribed_temperature)
    u, w, theta = np.zeros(on.vector.N), np.zeros(on.vector.N), np.zeros(on.scalar.N)
    status, solver = np.full(n + 1, code.OPEN), Counted()
    began = time.process_time()
    warm = splu(heat[free][:, free].tocsc(), **SYMMETRIC)
    for _ in range(steps):
        right = ops.force + ops.inertia @ w / k - ops.elasticity @ u + ops.expansion @ theta
        w, status, friction, pressure = code.contact_step(
            on, momentum, right, on.prescribed_displacement, -u[on.vertical], k, code.MU_TAU, status, solver
        )
        theta_new = np.zeros_like(theta)
        theta_new[free] = warm.solve((ops.source + ops.mass @ theta / k + ops.heating @ w)[free])
        theta, u = theta_new, u + k * w
    taken = time.process_time() - began
    strain, plain = code.STRAIN.assemble(on.vector), ops.inertia / code.RHO
    return {
        "u_V": float(np.sqrt(u @ strain @ u)),
        "w_L2": float(np.sqrt(w @ plain @ w)),
        "theta_L2": float(np.sqrt(theta @ ops.mass @ theta)),
        "traction_x": -float(friction.sum()),
        "traction_y": float(pressure.sum()),
        "seconds": taken,
        "factorizations": solver.factorizations + 1,
    }


def factored_once(theta_F: float, n: int, steps: int) -> dict[str, float]:
    """The same with both matrices factored once, without forces."""
    from reference import scipy_scheme as code

    run = code.simulate("mixed", theta_F, n, steps, keep="final", store=False)
    norms = code.norms(n, run.u[-1], run.w[-1], run.theta[-1])
    known = {name: norms[name] for name in ("u_V", "w_L2", "theta_L2")}
    return known | {"seconds": run.seconds_factor + run.seconds_loop, "factorizations": 2}


def from_ours(scene: Scene, found: dict[str, float]) -> float:
    """The largest relative difference of final norms and forces to a run of the scene."""
    result = warmslip.run(scene)
    traction = result.summary["contact"]["traction"]
    known = {name: result.summary["norms"][name] for name in ("u_V", "w_L2", "theta_L2")}
    known |= {"traction_x": traction[0], "traction_y": traction[1]}
    whole = float(np.hypot(*traction))
    scale = {name: whole if name.startswith("traction") else abs(value) for name, value in known.items()}
    return max(abs(found[name] - known[name]) / scale[name] for name in known if name in found)


def point(contest: str, like: dict[str, Any], method: str = ORDINARY) -> dict[str, Any]:
    """The row of a mesh, from that of equal steps. Raises RuntimeError where the two codes differ."""
    n = like["n"]
    scene = CONTESTS[contest].at("equal steps", n)
    exchange = scene.contacts[0].heat_exchange
    assert exchange is not None
    found = (simulate if method == ORDINARY else factored_once)(
        float(exchange.foundation_temperature), n, scene.time.steps
    )
    gap = from_ours(scene, found)
    print(
        f"{method}, n = {n}: {found['seconds']:.3g} s, {found['factorizations']} factorizations, {gap:.1e} from ours",
        flush=True,
    )
    if gap > SAME:
        raise RuntimeError(f"n = {n}: the two codes differ by {gap:.1e}; one of them is wrong")
    blank = dict.fromkeys(("step_seconds", "factor_bytes", "substitutions", "newton_iterations", "work"), float("nan"))
    known = {"method": method, "cpu_seconds": found["seconds"], "factorizations": found["factorizations"]}
    return like | blank | known | {"setting": "", "from_ours": gap}


def main() -> None:
    """Adds the points to a table, or says why there are none."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("contest", choices=["paper_hot", "paper_cold"])
    parser.add_argument("--table", type=Path, required=True)
    parser.add_argument("--levels", type=int, nargs="+", default=list(LEVELS))
    given = parser.parse_args()
    try:
        import skfem
    except ImportError:
        print(f"no curve of {ORDINARY}: scikit-fem is not installed (pip install scikit-fem)", file=sys.stderr)
        return
    rows = [row for row in tables.read(given.table) if row["method"] not in OTHERS]
    equal = {row["n"]: row for row in rows if row["method"] == "equal steps"}
    stamp = json.loads(given.table.with_suffix(".json").read_text())
    rows += [point(given.contest, equal[n], method) for method in OTHERS for n in given.levels if n in equal]
    tables.write(given.table, rows, stamp | {"ordinary_newton": f"scikit-fem {skfem.__version__}"})


if __name__ == "__main__":
    main()
