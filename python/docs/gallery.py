"""The example gallery: every scene of the library is run; its end becomes a picture, its file ten lines, its run one number."""

from __future__ import annotations

import logging
import re
import tempfile
from importlib import resources
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PICTURES = HERE / "_gallery"  # made anew, not committed


def number(summary: dict[str, Any]) -> str:
    """The one number of a run: the force on the foundation, or the heat of a scene without motion."""
    if "u_V" in summary["norms"]:
        return f"normal force on the foundation at the end {summary['contact']['normal_force']:.6g}"
    return f"norm of the temperature at the end {summary['norms']['theta_L2']:.6g}"


def lines(text: str, count: int = 10) -> list[str]:
    """The first lines of a scene file that hold data."""
    data = [line for line in text.splitlines() if line.strip() and not line.startswith(("#", "title"))]
    return data[:count] + (["# ..."] if len(data) > count else [])


def picture(folder: Path, out: Path) -> str:
    """Draws the end of a stored run; its caption."""
    from warmslip.figures import run as drawings
    from warmslip.figures import style
    from warmslip.io.drawn import body, magnification
    from warmslip.io.trajectory import Trajectory

    with Trajectory(folder / "trajectory.h5") as stored, style.applied():
        d = stored.discretisation()
        figure, caption = drawings.bodies(body(stored, d, len(stored.time) - 1), magnification(stored, d))
        style.save(figure, caption, out)
        out.with_suffix(".rst").unlink()  # the caption stands on the page
    return " ".join(caption.split())


def gallery() -> str:
    """The page, in Markdown."""
    import warmslip
    from warmslip.scene.reader import library

    logging.getLogger("warmslip").setLevel(logging.WARNING)
    PICTURES.mkdir(exist_ok=True)
    scenes, out = resources.files("warmslip") / "scenes", []
    for name in library():
        scene, text = warmslip.load(name), (scenes / f"{name}.toml").read_text()
        with tempfile.TemporaryDirectory() as folder:
            summary = warmslip.run(scene, out=folder).summary
            caption = picture(Path(folder), PICTURES / f"{name}.png")
        what = " ".join(re.findall(r"^# (.*)$", text.split("\n[")[0], re.MULTILINE))
        out += [
            "",
            f"## {name}",
            "",
            f"{scene.title}. {what}",
            "",
            f"![{scene.title}](_gallery/{name}.png)",
            "",
            caption,
        ]
        out += ["", "```toml", *lines(text), "```", ""]
        out += [f"`warmslip run {name}`: {summary['outcome']} after {summary['steps']} steps, {number(summary)}."]
    return "\n".join(out)
