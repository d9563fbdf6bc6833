"""The paper's test problem in GetFEM's form language, with exact Coulomb friction by a multiplier: what its users would write.

Scheme (PF) as in model.md on the right-diagonal mesh, with contact at the nodes by the trapezoidal rule. A step is one call of
GetFEM's Newton's method for the velocity w and the traction lam of the foundation, with MUMPS; the temperature is a linear model
of its own. Everything is dimensionless.

This file imports GetFEM and NumPy alone. It runs in the Python that GetFEM was installed for:
`python3 tests/reference/getfem_scheme.py 10.0 32 32` (theta_F, cells along a side, steps) prints one line of JSON.
"""

from __future__ import annotations

import json
import sys
import time

import getfem as gf
import numpy as np

E, KAPPA, MU_1, MU_2, RHO, T = 2.0, 0.1, 10.0, 10.0, 1.0, 1.0
C_NU, MU_TAU, K_C, Q0 = 1e4, 0.2, 1.0, 1.0
F0, FN = (0.0, -1.0), {"left": (1.4, 0.4), "right": (-0.8, 0.4)}
SIDES = {"left": (0, -1), "right": (0, 1), "bottom": (1, -1), "top": (1, 1)}  # axis and direction of the normal
REGION = {name: number for number, name in enumerate(SIDES, 1)}
AUGMENTATION = 10.0  # of the friction: the answer does not depend on it, the iterations do
RESIDUAL = 1e-11
ITERATIONS = 100


def square(n: int) -> gf.Mesh:
    line = np.linspace(0, 1, n + 1)
    mesh = gf.Mesh("triangles grid", line, line)
    faces = mesh.outer_faces()
    normals = mesh.normal_of_faces(faces)
    for name, (axis, sign) in SIDES.items():
        mesh.set_region(REGION[name], faces[:, normals[axis] * sign > 0.5])
    return mesh


def motion(
    k: float, displacement: gf.MeshFem, temperature: gf.MeshFem, volume: gf.MeshIm, nodes: gf.MeshIm
) -> gf.Model:
    """The momentum equation of a step for w and the traction of the foundation on the body."""
    md = gf.Model("real")
    md.add_fem_variable("w", displacement)
    md.add_filtered_fem_variable("lam", displacement, REGION["bottom"])
    md.add_fem_data("u", displacement)
    md.add_fem_data("w_old", displacement)
    md.add_fem_data("theta", temperature)
    values = {"k": k, "rho": RHO, "lam_e": E * KAPPA / (1 - KAPPA**2), "two_mu_e": E / (1 + KAPPA)}
    values |= {"mu_1": MU_1, "mu_2": MU_2, "c": C_NU, "mu": MU_TAU, "r": AUGMENTATION}
    for name, value in values.items():
        md.add_initialized_data(name, [value])
    md.add_linear_term(
        volume,
        "(rho/k)*w.Test_w+(mu_1*Trace(Sym(Grad_w))*Id(2)+mu_2*Sym(Grad_w)):Grad_Test_w"
        "+k*(lam_e*Trace(Sym(Grad_w))*Id(2)+two_mu_e*Sym(Grad_w)):Grad_Test_w",
    )
    md.add_source_term(
        volume,
        "(rho/k)*w_old.Test_w-(lam_e*Trace(Sym(Grad_u))*Id(2)+two_mu_e*Sym(Grad_u)):Grad_Test_w"
        f"+theta*[1,1;1,1]:Grad_Test_w+[{F0[0]},{F0[1]}].Test_w",
    )
    for part, (x, y) in FN.items():
        md.add_source_term(volume, f"[{x},{y}].Test_w", REGION[part])
    pressure = "c*pos_part(-u(2)-k*w(2))"
    friction = f"max(-mu*({pressure}),min(mu*({pressure}),lam(1)-r*w(1)))"
    md.add_nonlinear_term(nodes, f"-lam.Test_w+(1/r)*(lam-[{friction},{pressure}]).Test_lam", REGION["bottom"])
    md.add_Dirichlet_condition_with_simplification("w", REGION["top"])
    return md


def warmth(k: float, theta_F: float, displacement: gf.MeshFem, temperature: gf.MeshFem, volume: gf.MeshIm) -> gf.Model:
    """The heat equation of a step for theta, with the velocity of the same step."""
    md = gf.Model("real")
    md.add_fem_variable("theta", temperature)
    md.add_fem_data("theta_old", temperature)
    md.add_fem_data("w", displacement)
    for name, value in {"k": k, "q0": Q0, "kc": K_C, "theta_F": theta_F}.items():
        md.add_initialized_data(name, [value])
    md.add_linear_term(volume, "(1/k)*theta*Test_theta+Grad_theta.Grad_Test_theta")
    md.add_linear_term(volume, "kc*theta*Test_theta", REGION["bottom"])
    md.add_source_term(volume, "(1/k)*theta_old*Test_theta+q0*Test_theta+([1,1;1,1]:Grad_w)*Test_theta")
    md.add_source_term(volume, "kc*theta_F*Test_theta", REGION["bottom"])
    for part in ("top", "left", "right"):
        md.add_Dirichlet_condition_with_simplification("theta", REGION[part])
    return md


def simulate(theta_F: float, n: int, steps: int) -> dict[str, float]:
    """Staggered backward Euler to the end: final norms and forces, CPU seconds and Newton iterations."""
    gf.util_trace_level(0)  # else it prints every assembly
    k = T / steps
    mesh = square(n)
    displacement, temperature = gf.MeshFem(mesh, 2), gf.MeshFem(mesh, 1)
    displacement.set_fem(gf.Fem("FEM_PK(2,1)"))
    temperature.set_fem(gf.Fem("FEM_PK(2,1)"))
    volume = gf.MeshIm(mesh, gf.Integ("IM_TRIANGLE(3)"))
    nodes = gf.MeshIm(mesh, gf.Integ("IM_NC(2,1)"))
    moving, warming = (
        motion(k, displacement, temperature, volume, nodes),
        warmth(k, theta_F, displacement, temperature, volume),
    )
    iterations, began = 0, time.process_time()
    for _ in range(steps):
        iterations += moving.solve("lsolver", "mumps", "max_res", RESIDUAL, "max_iter", ITERATIONS)[0]
        w = moving.variable("w")
        warming.set_variable("w", w)
        warming.solve("lsolver", "mumps")
        theta = warming.variable("theta")
        warming.set_variable("theta_old", theta)
        moving.set_variable("theta", theta)
        moving.set_variable("u", moving.variable("u") + k * w)
        moving.set_variable("w_old", w)
    taken = time.process_time() - began

    def integral(form: str, model: gf.Model, rule: gf.MeshIm = volume, region: int = -1) -> float:
        return float(gf.asm_generic(rule, 0, form, region, model))

    return {
        "u_V": integral("Norm_sqr(Sym(Grad_u))", moving) ** 0.5,
        "w_L2": integral("Norm_sqr(w)", moving) ** 0.5,
        "theta_L2": integral("sqr(theta)", moving) ** 0.5,
        "traction_x": integral("lam(1)", moving, nodes, REGION["bottom"]),
        "traction_y": integral("lam(2)", moving, nodes, REGION["bottom"]),
        "seconds": taken,
        "factorizations": iterations + steps,
    }


if __name__ == "__main__":
    print(json.dumps(simulate(float(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))))
