"""How far each datum of five scenes can be moved before a run is not right any more, judged in 80 digits.

From the scene's own value outwards by decades, then bisection to a tenth of one. envelope.csv has a line an axis:
`smallest` and `largest` factor that runs right, the range `from` and `to` that was tried, and what came next at either end
(`below`, `above`: a class of the judge, empty where the whole range runs right).

    python tests/campaign/envelope.py [--scenes paper impact] [--jobs 2]
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from campaign.run import write
from campaign.workers import served
from warmslip.scene.errors import SceneError
from warmslip.scene.reader import build, load
from warmslip.scene.scene import Scene

BISECTIONS = 3  # of a decade
LIMIT = 300.0  # seconds an axis may take
STEEL = {"young": 2.1e11, "poisson": 0.3, "assumption": "plane_strain"}
BLOCK: dict[str, Any] = {
    "mesh": {"n": 4, "lengths": [0.1, 0.1]},
    "inertia": {"density": 7800.0},
    "elasticity": STEEL,
    "viscosity": {"lame": [2e5, 2e5]},
}
SCENES: dict[str, Callable[[], Scene]] = {
    "paper": lambda: load("paper_isotropic").override(
        **{"mesh.n": 4, "time.steps": 4, "contact.heat_exchange.foundation_temperature": 10.0}
    ),
    "impact": lambda: build(
        BLOCK
        | {
            "time": {"end": 1.2e-4, "steps": 6},
            "initial": {"velocity": [0.3, -1.0]},
            "contact": {"part": "bottom", "stiffness": 1e14, "gap": 2e-5, "friction": {"coefficient": 0.3}},
        }
    ),
    "held by contact": lambda: build(
        BLOCK
        | {
            "time": {"end": 1e-2, "steps": 4},
            "loads": {"traction": {"top": ["1e6 * t / 0.01", "-1e7 * t / 0.01"]}},
            "contact": {"part": "bottom", "stiffness": 1e14, "friction": {"coefficient": 0.3}},
        }
    ),
    "free": lambda: build(
        BLOCK
        | {
            "time": {"end": 1e-2, "steps": 4},
            "initial": {"velocity": [1.0, 0.3]},
            "heat": {"conductivity": 50.0, "capacity": 3.6e6, "source": "1e9 * x", "expansion": {"tensor": 6e6}},
        }
    ),
    "solid": lambda: load("block_3d").override(**{"mesh.n": 2, "time.steps": 4}),
}
Change = Callable[[Scene, float], dict[str, Any]]


def scaled(value: Any, factor: float) -> Any:
    """Numbers times a factor, formulas too."""
    if isinstance(value, dict):
        return {key: scaled(one, factor) for key, one in value.items()}
    if isinstance(value, list):
        return [scaled(one, factor) for one in value]
    return f"{factor!r} * ({value})" if isinstance(value, str) else value * factor


def filled(value: Any) -> bool:
    """Whether there is a number or a formula in it that is not zero."""
    if isinstance(value, dict):
        return any(map(filled, value.values()))
    return any(map(filled, value)) if isinstance(value, list) else bool(value)


def key(*names: str) -> Change:
    """Scales keys of the scene; LookupError where one is absent or zero."""

    def change(scene: Scene, factor: float) -> dict[str, Any]:
        out = {}
        for name in names:
            value: Any = scene.resolved()
            for part in name.split("."):
                value = value[part]
            if not filled(value):
                raise LookupError(name)
            out[name] = scaled(value, factor)
        return out

    return change


def poisson(scene: Scene, factor: float) -> dict[str, Any]:
    """Scales the distance of Poisson's ratio from where the body is incompressible."""
    table = scene.elasticity
    if table is None or table.poisson is None:
        raise LookupError("poisson")
    top = 1.0 if table.assumption == "plane_stress" else 0.5
    return {"elasticity.poisson": top - factor * (top - table.poisson)}


def aspect(scene: Scene, factor: float) -> dict[str, Any]:
    return {"mesh.lengths": [scene.mesh.sides[0] * factor, *scene.mesh.sides[1:]]}


# what is scaled, and by how many decades down and up
AXES: dict[str, tuple[Change, int, int]] = {
    "stiffness": (key("contact.stiffness"), -12, 12),
    "friction": (key("contact.friction.coefficient"), -3, 3),
    "step": (key("time.end"), -8, 8),
    "density": (key("inertia.density"), -12, 12),
    "viscosity": (key("viscosity.lame"), -12, 8),
    "load": (key("loads"), -9, 9),
    "velocity": (key("initial.velocity"), -9, 6),
    "gap": (key("contact.gap"), -12, 6),
    "half less Poisson's ratio": (poisson, -9, 0),
    "aspect": (aspect, -4, 4),
    "conductance": (key("contact.heat_exchange.conductance"), -12, 12),
    "foundation": (key("contact.heat_exchange.foundation_temperature"), -6, 6),
    "conductivity": (key("heat.conductivity"), -9, 9),
    "expansion": (key("heat.expansion.tensor"), -6, 4),
    "heating": (key("heat.heating.tensor"), -6, 4),
}


@cache
def verdict(name: str, axis: str, exponent: float) -> str:
    """The judge's class of one scene with one datum times 10^exponent."""
    from campaign import judge

    scene = SCENES[name]()
    try:
        moved = scene.override(**AXES[axis][0](scene, 10.0**exponent))
    except SceneError:
        return "refused"
    return str(judge.judge(moved, judge.run(moved))["class"])


def edge(name: str, axis: str, end: int) -> tuple[float, str]:
    """The last exponent on the way from 0 to `end` that runs right, and what comes after it."""
    sign = 1 if end > 0 else -1
    good = 0.0
    for decade in range(1, abs(end) + 1):
        found = verdict(name, axis, float(sign * decade))
        if found == "right":
            good = float(sign * decade)
            continue
        bad = float(sign * decade)
        for _ in range(BISECTIONS):
            middle = (good + bad) / 2
            after = verdict(name, axis, middle)
            good, bad, found = (middle, bad, found) if after == "right" else (good, middle, after)
        return good, found
    return good, ""


def work(job: tuple[str, str], tell: Callable[[Any], None]) -> dict[str, Any] | None:
    """One axis of one scene; None where the scene has no such datum."""
    name, axis = job
    change, low, high = AXES[axis]
    scene = SCENES[name]()
    try:
        change(scene, 1.0)
    except LookupError:
        return None
    if verdict(name, axis, 0.0) != "right":
        raise ValueError(f"{name} itself does not run right: {verdict(name, axis, 0.0)}")
    smallest, below = edge(name, axis, low) if low else (0.0, "")
    largest, above = edge(name, axis, high) if high else (0.0, "")
    line = {"scene": name, "axis": axis, "smallest": 10.0**smallest, "largest": 10.0**largest}
    return line | {"from": 10.0**low, "to": 10.0**high, "below": below, "above": above}


def table(scenes: list[str], axes: list[str], jobs: int = 1) -> list[dict[str, Any]]:
    """A line for every axis that a scene has."""
    pairs = [(name, axis) for name in scenes for axis in axes]
    lines = []
    for (name, axis), how, line in served(work, pairs, processes=jobs, limit=LIMIT):
        if how != "done":
            raise RuntimeError(f"{name}, {axis}: {how}")
        if line is not None:
            lines.append(line)
    return sorted(lines, key=lambda line: (scenes.index(line["scene"]), axes.index(line["axis"])))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--axes", nargs="+", default=list(AXES), choices=list(AXES))
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, default=Path("results/extremes"))
    given = parser.parse_args(arguments)
    lines = table(given.scenes, given.axes, given.jobs)
    write(given.out / "envelope.csv", lines)
    from warmslip import figures
    from warmslip.records import provenance

    stamp = provenance.stamp(scenes={name: SCENES[name]().resolved() for name in given.scenes})
    (given.out / "envelope.json").write_text(json.dumps(stamp, indent=2) + "\n")
    figures.draw("envelope", [given.out / "envelope.csv"], given.out / "envelope.png")
    for line in lines:
        print(", ".join(f"{v:.3g}" if isinstance(v, float) else str(v) for v in line.values()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
