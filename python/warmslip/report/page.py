"""A stored run to look at: figures, an animation, and one page with everything that is known of it."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import tomli_w

from warmslip.figures import contact as contacts
from warmslip.figures import run as drawings
from warmslip.figures import style
from warmslip.figures.error import error as error_bars
from warmslip.io import drawn
from warmslip.io.paraview import opened
from warmslip.io.trajectory import state_number
from warmslip.scene import plan

FRAMES = 40


def view(
    run: str | Path,
    out: str | Path,
    *,
    at: float | None = None,
    animate: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Draws what the folder `run` of `warmslip run` holds into `out`: the files written.

    body.png (deformed, a panel a field) and contact.png at the stored state nearest to time `at` (default: the last one),
    pressure.png and stick_slip.png along the contact parts of a body in the plane, history.png, animation.gif of at most 40
    states, and report.html, one page with all of it that needs no other file. Raises ValueError for what holds no run, OSError
    for what cannot be written.
    """
    folder = Path(out)
    with opened(run) as t, style.applied():
        d, functions = t.discretisation(), t.functions
        folder.mkdir(parents=True, exist_ok=True)
        here = state_number(t.time, at)
        found: dict[str, tuple[Any, str]] = {}
        last = drawn.body(t, d, here)
        factor = drawn.magnification(t, d)
        if last.fields:
            found["body"] = drawings.bodies(last, factor)
        if parts := drawn.parts(t, here):
            found["contact"] = drawings.contact(parts, last.time)
        if d.dim == 2 and t.contact_parts and len(t.series("steps")["time"]):
            along = [drawn.line(t, part) for part in t.contact_parts]
            found |= {"pressure": contacts.pressure(along), "stick_slip": contacts.stick_slip(along)}
        if len(t.series("steps")["time"]):
            found["history"] = drawings.history(t.series("steps")["time"], drawn.history(t, d))
        solved = plan.text(plan.plan(t.built_scene()))  # while the mesh that the trajectory holds is there
        if (Path(run) / "error.csv").exists():
            found["error"] = error_bars([Path(run) / "error.csv"])
        files = []
        for name, (figure, caption) in found.items():
            style.save(figure, caption, folder / f"{name}.png")
            files.append(folder / f"{name}.png")
        if animate and last.fields and len(t.time) > 1:
            chosen = np.unique(np.linspace(0, len(t.time) - 1, min(FRAMES, len(t.time))).round().astype(int))
            name = next(n for n in ("temperature", "von Mises stress", "displacement") if n in last.fields)
            states = [drawn.body(t, d, int(i)) for i in chosen]
            drawings.animation(states, name, factor, folder / "animation.gif", progress)
            (folder / "animation.rst").write_text(
                f"{name} on the deformed body, {len(chosen)} states.\n", encoding="utf-8"
            )
            files.append(folder / "animation.gif")
    page = folder / "report.html"
    page.write_text(_page(Path(run), t.scene, solved, functions, files), encoding="utf-8")
    return [*files, page]


def _page(run: Path, scene: dict[str, Any], solved: str, functions: list[str], files: list[Path]) -> str:
    """The report, with what was `solved`; a run that was killed has no summary."""
    summary_file = run / "summary.json"
    summary = json.loads(summary_file.read_text(encoding="utf-8")) if summary_file.exists() else None
    images = [
        (
            base64.b64encode(path.read_bytes()).decode(),
            path.suffix[1:],
            path.with_suffix(".rst").read_text(encoding="utf-8"),
        )
        for path in files
    ]
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("warmslip.report", "templates"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template("report.html").render(
        scene=scene,
        functions=functions,
        summary=summary,
        images=images,
        plan=solved,
        toml=tomli_w.dumps(scene),
    )
