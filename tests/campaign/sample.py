"""Scenes for the campaign: quasi-random points in a space of many axes, each a scene file.

A family has its Sobol sequence (fixed seed, scrambled), whose first 2^m points fill the space evenly. Axes are dimensionless and
logarithmic where sizes matter: the step over the time a wave takes through the body, the contact stiffness over E/h, a strain
for the loads. The units (SI, mm-t-s, or none) then give the numbers, rounded to three digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from scipy.stats import qmc

from warmslip.scene.reader import build
from warmslip.scene.scene import Scene

SEED = 20240617
FAMILIES = {"supported": 2048, "solid": 256, "free": 256, "laws": 512}
UNITS = {"SI": (0.1, 2.1e11, 7.8e3), "mm-t-s": (100.0, 2.1e5, 7.8e-9), "one": (1.0, 1.0, 1.0)}  # length, E, density
AXES = [
    *("units", "n", "aspect", "diagonal", "step", "steps", "density", "poisson", "viscosity", "stiffness", "friction"),
    *("gap", "strain", "shape", "course", "velocity", "support", "quadrature", "law", "compliance", "heat", "coupling"),
    *("conductance", "foundation", "warm", "diffusion", "strength", "expansion", "moved", "contact_heat", "side"),
]


@dataclass(frozen=True)
class Sampled:
    """One scene as plain data, the tables of its TOML file, and where it lies on the axes."""

    family: str
    number: int
    tables: dict[str, Any]
    axes: dict[str, Any]

    def scene(self) -> Scene:
        """Raises SceneError where the scene is refused."""
        return build(self.tables)


def points(family: str, count: int, seed: int = SEED) -> Any:
    """The first `count` points of a family, (count, axes) in [0, 1); another seed scrambles the sequence anew."""
    sobol = qmc.Sobol(len(AXES), scramble=True, seed=seed + list(FAMILIES).index(family))
    return sobol.random_base2(max(0, math.ceil(math.log2(max(count, 1)))))[:count]


def sample(family: str, count: int, seed: int = SEED) -> list[Sampled]:
    """The first `count` scenes of a family; another seed gives other scenes."""
    rows = enumerate(points(family, count, seed))
    return [_scene(family, i, dict(zip(AXES, map(float, row), strict=True))) for i, row in rows]


def three(value: float) -> float:
    return float(f"{value:.3g}")


def log(x: float, low: float, high: float) -> float:
    """10 to a power between low and high."""
    return float(10.0 ** (low + x * (high - low)))


def pick(x: float, **weights: float) -> str:
    """A name, with probability by weight."""
    left = x * sum(weights.values())
    for name, weight in weights.items():
        left -= weight
        if left < 0:
            return name
    return next(reversed(weights))


def _scene(family: str, number: int, x: dict[str, float]) -> Sampled:
    d = 3 if family == "solid" else 2
    units = pick(x["units"], SI=1, **{"mm-t-s": 1}, one=1)
    L, E, rho = UNITS[units]
    ratio = log(x["aspect"], -3, 3) if x["aspect"] < 0.4 or x["aspect"] > 0.6 else 1.0
    lengths = [three(L * ratio), *[L] * (d - 1)]
    diagonal = pick(x["diagonal"], right=3, left=2, crisscross=1 if d == 2 else 0)
    n = int(1 + x["n"] * (2 if d == 3 else 3 if diagonal == "crisscross" else 6))
    h = L / n
    transit = min(lengths) / math.sqrt(E / rho)
    tau, steps = log(x["step"], -6, 6), int(2 + x["steps"] * 5)
    k = tau * transit
    end = three(k * steps)
    k = end / steps
    strain = log(x["strain"], -7, -2)
    density = rho if family == "free" or x["density"] < 0.85 else None
    poisson = float(f"{0.4999 if x['poisson'] > 0.95 else x['poisson'] * 0.5:.4g}")
    assumption = "solid" if d == 3 else "plane_strain" if x["poisson"] * 1e3 % 2 < 1 else "plane_stress"
    tables: dict[str, Any] = {
        "mesh": {"shape": "cube" if d == 3 else "square", "n": n, "lengths": lengths, "diagonal": diagonal},
        "time": {"end": end, "steps": steps},
        "elasticity": {"young": E, "poisson": poisson, "assumption": assumption},
        "loads": {},
        "supports": {},
        "initial": {},
    }
    axes: dict[str, Any] = {"units": units, "n": n, "aspect": ratio, "diagonal": diagonal, "tau": tau, "steps": steps}
    axes |= {"density": density or 0.0, "poisson": poisson, "strain": strain}
    if density:
        tables["inertia"] = {"density": density}
    axes["viscosity"] = 0.0
    if x["viscosity"] > 0.5:
        time = log(2 * x["viscosity"] - 1, -4, 3) * transit
        tables["viscosity"] = {"lame": [three(E * time / 2), three(E * time)]}
        axes["viscosity"] = time / transit
    if family == "free":  # it flies no more than a hundred lengths
        strain = min(strain, 100 / (tau * steps) ** 2)
    _supports(family, tables, axes, x, L, strain)
    _loads(tables, axes, x, d, L, E, strain, end)
    speed = pick(x["velocity"], zero=2, down=2, along=1, spin=1)
    if speed != "zero":
        size = three(min(math.sqrt(E / rho) * log(x["velocity"] * 37 % 1, -6, -2), 100 * L / end))
        spin = [f"{size / L!r} * y", f"-{size / L!r} * x"]
        velocity = {"down": [0.1 * size, -size], "along": [size, -0.1 * size], "spin": spin}[speed]
        tables["initial"]["velocity"] = velocity[:1] + ([0.0] if d == 3 else []) + velocity[1:]
    axes["velocity"] = speed
    _contact(family, tables, axes, x, d, E, h, L, strain, tau)
    _heat(family, tables, axes, x, d, E, h, L, k, strain)
    tables = {name: table for name, table in tables.items() if table}
    return Sampled(family, number, tables, axes)


def _supports(
    family: str, tables: dict[str, Any], axes: dict[str, Any], x: dict[str, float], L: float, strain: float
) -> None:
    """What is held, and the traction's side, which is free."""
    place = "none" if family == "free" else pick(x["support"], top=3, left=2)
    axes["support"], axes["moved"] = place, "no"
    if place == "none":
        return
    if family == "laws" and x["moved"] < 0.4:
        axes["moved"] = "yes"
        size, end = three(strain * L), tables["time"]["end"]
        along = f"{size!r} * t / {end!r}" if x["moved"] < 0.2 else 0.0
        tables["supports"]["displacement"] = {place: [along, f"-{size!r} * t / {end!r}"]}
        return
    tables["supports"]["displacement"] = [place]


def _loads(
    tables: dict[str, Any],
    axes: dict[str, Any],
    x: dict[str, float],
    d: int,
    L: float,
    E: float,
    strain: float,
    end: float,
) -> None:
    """A force of the size of the strain: over the body or on a side, for ever or for a time."""
    shape = pick(x["shape"], body=3, side=2, top=2, none=1)
    course = pick(x["course"], steady=3, off=1, ramp=1, field=1)
    axes |= {"load": shape, "course": course}
    if shape == "none":
        return
    side = 2 * x["side"] - 1  # along over down
    size = E * strain / (L if shape == "body" else 1.0)
    force: list[Any] = [three(size * side), *([three(0.3 * size)] if d == 3 else []), -three(size)]
    if course == "off":
        force = [f"where(t < {0.57 * end!r}, {f!r}, 0)" for f in force]
    elif course == "ramp":
        force = [f"{f!r} * t / {end!r}" for f in force]
    elif course == "field":
        force = [f"{f!r} * (1 - 2 * x / {tables['mesh']['lengths'][0]!r})" for f in force]
    if shape == "body":
        tables["loads"]["body"] = force
    else:
        part = "top" if shape == "top" and axes["support"] != "top" else "right"
        tables["loads"]["traction"] = {part: force}


def _contact(
    family: str,
    tables: dict[str, Any],
    axes: dict[str, Any],
    x: dict[str, float],
    d: int,
    E: float,
    h: float,
    L: float,
    strain: float,
    tau: float,
) -> None:
    relative = log(x["stiffness"], -6, 12)
    gap = pick(x["gap"], zero=3, open=2, pressed=2, touching=1)
    mu = 0.0 if x["friction"] < 0.1 else three(2 * (x["friction"] - 0.1) / 0.9)
    contact: dict[str, Any] = {"part": "bottom", "stiffness": three(relative * E / h)}
    depth = three(strain * L)
    contact["gap"] = {"zero": 0.0, "open": depth / 4, "pressed": -depth / 4, "touching": depth / 2}[gap]
    if gap == "touching" and axes["moved"] == "yes":  # reached exactly at the end of a step by a body that follows
        contact["gap"] = depth * (1 + int(axes["steps"] / 2)) / axes["steps"]
    elif gap == "touching":
        tables["initial"]["displacement"] = [0.0] * (d - 1) + [-depth / 2]
        if axes["support"] != "none":
            tables["initial"]["displacement"][-1] = f"-{depth / 2!r} * (1 - y / {L!r})" if d == 2 else -depth / 2
    friction: dict[str, Any] = {"coefficient": mu} if mu else {}
    quadrature, law, compliance = "nodal", "coulomb", "linear"
    if family == "solid":
        quadrature = pick(x["quadrature"], nodal=3, **{"gauss-1": 1, "gauss-2": 1 if axes["n"] == 1 else 0})
    if family == "laws":
        quadrature = pick(x["quadrature"], nodal=2, **{"gauss-1": 1, "gauss-2": 2, "gauss-3": 1})
        law = pick(x["law"], coulomb=2, tresca=2, both=1, limit=1, kinetic=2, regularised=1)
        compliance = pick(x["compliance"], linear=3, bent=1, square=1, capped=1)
        speed, stress = three(strain * L / tables["time"]["end"] * log(x["law"] * 53 % 1, -3, 3)), three(E * strain)
        if law in ("tresca", "both"):
            friction = ({"coefficient": mu} if law == "both" else {}) | {"cohesion": three(0.3 * stress)}
        elif law == "limit":
            friction |= {"limit": three(0.1 * stress)}
        elif law == "kinetic":
            friction = {"coefficient": mu, "kinetic": three(0.5 * mu), "speed": speed}
        elif law == "regularised":
            friction |= {"regularisation": speed}
        if compliance in ("bent", "square"):
            contact["exponent"] = 1.5 if compliance == "bent" else 2.0
            contact["stiffness"] = three(contact["stiffness"] / depth ** (contact["exponent"] - 1))
        elif compliance == "capped":
            contact["pressure_limit"] = three(0.5 * stress)
    contact["quadrature"] = quadrature
    if friction:
        contact["friction"] = friction
    tables["contact"] = contact
    axes |= {"stiffness": relative, "gap": gap, "friction": mu, "quadrature": quadrature}
    axes |= {"law": law, "compliance": compliance}


def _heat(
    family: str,
    tables: dict[str, Any],
    axes: dict[str, Any],
    x: dict[str, float],
    d: int,
    E: float,
    h: float,
    L: float,
    k: float,
    strain: float,
) -> None:
    kind = pick(x["heat"], none=3, plain=1, expansion=2, damped=2, driven=1)
    coupling = pick(x["coupling"], staggered=2, lagged=1, monolithic=1) if kind != "none" else "staggered"
    axes |= {
        "heat": kind,
        "coupling": coupling,
        "diffusion": 0.0,
        "conductance": 0.0,
        "foundation": 0.0,
        "contact_heat": "no",
    }
    axes["warm"] = "no"
    if kind == "none":
        return
    capacity = {"SI": 3.6e6, "mm-t-s": 3.6, "one": 1.0}[axes["units"]]
    diffusion = log(x["diffusion"], -6, 6)
    conductivity = three(diffusion * capacity * h * h / k)
    foundation = 0.0 if x["foundation"] < 0.1 else three(log(x["foundation"], -1, 6))
    heat: dict[str, Any] = {"conductivity": conductivity, "capacity": capacity}
    size = max(foundation, 1.0)
    if kind != "plain":
        M = three(E * min(strain, 1e-3) / size)
        heat["expansion"] = {"tensor": M}
        if kind in ("damped", "driven"):
            strength = log(x["strength"], -4, -0.5)
            heat["heating"] = {"tensor": (-1 if kind == "damped" else 1) * three(strength * capacity * E / M)}
    warm = pick(x["warm"], none=2, held=2, warm=2 if family == "laws" else 0, insulated=1)
    exchange: dict[str, Any] = {"foundation_temperature": foundation}
    if warm != "insulated":
        relative = 0.0 if x["conductance"] < 0.1 else log(x["conductance"], -4, 12)
        exchange["conductance"] = three(relative * conductivity / h)
        axes["conductance"] = relative
    if warm == "held":
        tables["supports"]["temperature"] = ["top"]
    elif warm == "warm":
        tables["supports"]["temperature"] = {"top": f"{size!r} * t / {tables['time']['end']!r}"}
    elif warm == "insulated":
        tables["initial"]["temperature"] = size
    if family == "laws" and x["contact_heat"] < 0.6:
        coupling = "lagged" if coupling == "monolithic" else coupling
        if x["contact_heat"] < 0.4:
            exchange["per_pressure"] = three(conductivity / h / (E * strain) * log(x["contact_heat"] / 0.4, -3, 3))
        if x["contact_heat"] > 0.2 and "friction" in tables["contact"]:
            tables["contact"]["friction_heating"] = {"share": 0.5}
        axes |= {"contact_heat": "yes", "coupling": coupling}
    tables["heat"], tables["time"]["coupling"] = heat, coupling
    tables["contact"]["heat_exchange"] = exchange
    axes |= {"diffusion": diffusion, "foundation": foundation, "warm": warm}
