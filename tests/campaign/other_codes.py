"""What a user would pick instead: the paper's scheme on uniform meshes by other codes, as points of the atlas.

- `ordinary Newton` is what most would write first, with the matrices of scikit-fem: every Newton iteration factors the whole
  system anew, bordered by the contact. The heat matrix is factored once.
- `SciPy, factored once` has both matrices factored once, and contact is a small dense problem. What contact forces do to the body
  is computed once and stored as a dense matrix: the fastest script that was found.
- `PETSc SNES` has the friction forces as unknowns, and assembles and factors its Jacobian in every iteration (MUMPS).
- `GetFEM` has the contact tractions as multipliers, in its form language (MUMPS).

What a code assembles once is not counted, as with every other method; what it assembles in every iteration is, and so are factors
and the compliance of the contact points. The discrete solution is that of equal steps, whose errors are taken over once the two
agree; `from_ours` is their largest relative difference of final norms, and of forces where the code states them.

`python tests/campaign/other_codes.py paper_hot --table results/tradeoff/trade_paper_hot.csv` adds the points to the table.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # tests, for the independent codes

import warmslip
from warmslip.figures.trade import FACTORED, GETFEM, ORDINARY, OTHERS, SNES
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
Final = dict[str, float]


class NotInstalledError(Exception):
    """A code is absent on this machine; the message says how to get it."""


@dataclass
class Counted:
    """A direct solver that factors every matrix it is given, and counts them."""

    factorizations: int = 0

    def __call__(self, matrix: Any, right: Any, **_: Any) -> Any:
        from scipy.sparse.linalg import splu

        self.factorizations += 1
        return splu(matrix.tocsc(), **SYMMETRIC).solve(right)


def ordinary_newton(theta_F: float, n: int, steps: int) -> Final:
    """Staggered backward Euler to the end: final norms and forces, CPU seconds and factorizations."""
    _needs("scikit-fem")
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
    final = code.final(on, ops, u, w, theta, friction, pressure)
    return final | {"seconds": taken, "factorizations": solver.factorizations + 1}


def factored_once(theta_F: float, n: int, steps: int) -> Final:
    """The same with both matrices factored once, without forces."""
    from reference import scipy_scheme as code

    run = code.simulate("mixed", theta_F, n, steps, keep="final", store=True)
    norms = code.norms(n, run.u[-1], run.w[-1], run.theta[-1])
    known = {name: norms[name] for name in ("u_V", "w_L2", "theta_L2")}
    return known | {"seconds": run.seconds_factor + run.seconds_compliance + run.seconds_loop, "factorizations": 2}


def snes(theta_F: float, n: int, steps: int) -> Final:
    """The same by PETSc's SNES."""
    _needs("scikit-fem")
    from reference import snes_scheme

    return snes_scheme.simulate(theta_F, n, steps)


def getfem(theta_F: float, n: int, steps: int) -> Final:
    """The same by GetFEM, in the Python that it is installed for."""
    script = Path(__file__).parents[1] / "reference/getfem_scheme.py"
    answer = _outside([_python_of_getfem(), str(script), str(theta_F), str(n), str(steps)])
    if answer.returncode:
        raise RuntimeError(f"GetFEM: {answer.stderr.strip().splitlines()[-1]}")
    found: Final = json.loads(answer.stdout)
    return found


CODES: dict[str, Callable[[float, int, int], Final]] = {
    ORDINARY: ordinary_newton,
    FACTORED: factored_once,
    SNES: snes,
    GETFEM: getfem,
}


def _needs(package: str) -> None:
    try:
        version(package)
    except PackageNotFoundError:
        raise NotInstalledError(f"{package} is not installed (pip install {package})") from None


@cache
def _python_of_getfem() -> str:
    for python in filter(None, (sys.executable, shutil.which("python3", path="/usr/bin:/usr/local/bin"))):
        if _outside([python, "-c", "import getfem"]).returncode == 0:
            return python
    raise NotInstalledError("GetFEM is not installed (Debian: apt install python3-getfem)")


def _outside(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Runs another Python without the paths of this one."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def from_ours(scene: Scene, found: Final) -> float:
    """The largest relative difference of final norms and forces to a run of the scene."""
    result = warmslip.run(scene)
    traction = result.summary["contact"]["traction"]
    known = {name: result.summary["norms"][name] for name in ("u_V", "w_L2", "theta_L2")}
    known |= {"traction_x": traction[0], "traction_y": traction[1]}
    whole = float(np.hypot(*traction))
    scale = {name: whole if name.startswith("traction") else abs(value) for name, value in known.items()}
    return max(abs(found[name] - known[name]) / scale[name] for name in known if name in found)


def point(contest: str, like: dict[str, Any], method: str = ORDINARY) -> dict[str, Any]:
    """The row of a mesh, from that of equal steps.

    Raises NotInstalledError, and RuntimeError where the code fails or has another answer.
    """
    n = like["n"]
    scene = CONTESTS[contest].at("equal steps", n)
    exchange = scene.contacts[0].heat_exchange
    assert exchange is not None
    found = CODES[method](float(exchange.foundation_temperature), n, scene.time.steps)
    gap = from_ours(scene, found)
    print(
        f"{method}, n = {n}: {found['seconds']:.3g} s, {found['factorizations']} factorizations, {gap:.1e} from ours",
        flush=True,
    )
    if gap > SAME:
        raise RuntimeError(f"n = {n}: the two codes differ by {gap:.1e}; one of them is wrong")
    blank = dict.fromkeys(("step_seconds", "factor_bytes", "substitutions", "newton_iterations", "work"), float("nan"))
    known = {"method": method, "cpu_seconds": found["seconds"], "factorizations": found["factorizations"]}
    return like | blank | known | {"setting": _typed(contest, method, n), "from_ours": gap}


def _tried(contest: str, like: dict[str, Any], method: str) -> dict[str, Any]:
    """As `point`; a failure is a row without numbers, whose outcome says why."""
    try:
        return point(contest, like, method)
    except RuntimeError as why:
        print(f"{method}, n = {like['n']}: {why}", file=sys.stderr)
        numbers = {name: float("nan") for name, value in like.items() if isinstance(value, float)}
        return like | numbers | {"method": method, "outcome": str(why), "setting": _typed(contest, method, like["n"])}


def _typed(contest: str, method: str, n: int) -> str:
    return f"python tests/campaign/other_codes.py {contest} --code {method.replace(' ', '-')} --levels {n}"


def main() -> None:
    """Adds the points to a table, or prints them; says why a code has none."""
    typed = {name.replace(" ", "-"): name for name in OTHERS}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("contest", choices=["paper_hot", "paper_cold"])
    parser.add_argument("--table", type=Path, help="where equal steps have points, and to which those of the codes go")
    parser.add_argument("--code", choices=typed, action="append", help="default: all")
    parser.add_argument("--levels", type=int, nargs="+", default=list(LEVELS))
    given = parser.parse_args()
    methods = [typed[name] for name in given.code or typed]
    known = tables.read(given.table) if given.table else [{"method": "equal steps", "n": n} for n in given.levels]
    rows = [row for row in known if row["method"] not in methods]
    equal = {row["n"]: row for row in rows if row["method"] == "equal steps"}
    for method in methods:
        try:
            rows += [_tried(given.contest, equal[n], method) for n in given.levels if n in equal]
        except NotInstalledError as why:
            print(f"no curve of {method}: {why}", file=sys.stderr)
    if given.table:
        tables.write(given.table, rows, json.loads(given.table.with_suffix(".json").read_text()))


if __name__ == "__main__":
    main()
