"""The campaign as a command: sample, run, judge, and tables of what came out.

    make extremes                                        all of it, about ten minutes
    make extremes ARGS="--families supported free --count 64"
    make extremes ARGS="--scene laws:50"                 one scene: its file and what the judge says
    make extremes ARGS="--seed 1 --out other"            another campaign: scenes that nobody has seen

campaign.csv has a line a scene, campaign_summary.csv one a family, campaign.png shows them; scenes that are not right go to
a folder of scene files if one is named (`--keep`).
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import tomli_w

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from campaign import sample as sampling
from campaign.workers import served
from warmslip.scene.errors import SceneError

CLASSES = (
    *(
        "right",
        "right_as_stated",
        "silently_wrong",
        "stopped_though_solvable",
        "ill_posed_and_said",
        "ill_posed_unsaid",
    ),
    *("refused", "crash", "hang", "unjudged"),
)
WELL_POSED = ("right", "right_as_stated", "silently_wrong", "stopped_though_solvable", "crash", "hang")
LIMIT = 60.0  # seconds a scene may take, its judgement included
GOAL = 98.0  # per cent of well-posed scenes that are to end right


def work(job: sampling.Sampled, tell: Callable[[Any], None]) -> dict[str, Any]:
    """Runs and judges one scene; tells that the run is over."""
    from campaign import judge

    try:
        scene = job.scene()
    except SceneError as error:
        return judge.row_of(judge.Ran("refused", str(error).replace("\n", " ")), "refused")
    ran = judge.run(scene)
    tell(judge.row_of(ran, "unjudged"))
    return judge.judge(scene, ran)


def judged(scenes: list[sampling.Sampled], *, jobs: int = 1, limit: float = LIMIT) -> Iterator[dict[str, Any]]:
    """A line a scene, as they come. A run that dies or hangs is `crash` or `hang`; a judge that does leaves it `unjudged`."""
    for job, how, row in served(work, scenes, processes=jobs, limit=limit):
        line = {"family": job.family, "number": job.number, **job.axes}
        yield line | (row or {"class": how, "outcome": how})


def summary(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Classes by family and of all, with the share of well-posed scenes that ended right, in per cent."""
    out = []
    for family in [*dict.fromkeys(line["family"] for line in lines), "all"]:
        own = [line for line in lines if family in (line["family"], "all")]
        count = Counter(line["class"] for line in own)
        posed = sum(count[name] for name in WELL_POSED)
        row = {"family": family, "scenes": len(own)} | {name: count[name] for name in CLASSES}
        row |= {"well_posed": posed, "completed_right": 100 * count["right"] / posed if posed else 100.0}
        for name in ("run_seconds", "judge_seconds"):
            row[f"mean_{name}"] = sum(float(line.get(name) or 0) for line in own) / len(own)
        out.append(row)
    return out


def write(path: Path, lines: list[dict[str, Any]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    names = list(dict.fromkeys(name for line in lines for name in line))
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, names, restval="")
        table.writeheader()
        table.writerows({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in line.items()} for line in lines)


def one(name: str, seed: int = sampling.SEED) -> int:
    """The scene FAMILY:NUMBER and its judgement."""
    family, _, number = name.partition(":")
    (job,) = sampling.sample(family, int(number) + 1, seed)[int(number) :]
    print(tomli_w.dumps(job.tables))
    for key, value in work(job, lambda _: None).items():
        print(f"# {key}: {value}")
    return 0


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", nargs="+", default=list(sampling.FAMILIES), choices=list(sampling.FAMILIES))
    parser.add_argument("--count", type=int, help="scenes a family; all of them unless given")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, default=Path("results/extremes"))
    parser.add_argument("--keep", type=Path, help="folder for the scene files of what is not right")
    parser.add_argument("--scene", help="one scene instead, FAMILY:NUMBER")
    parser.add_argument("--seed", type=int, default=sampling.SEED, help="of the scrambled sequences")
    given = parser.parse_args(arguments)
    if given.scene:
        return one(given.scene, given.seed)
    counts = {family: given.count or sampling.FAMILIES[family] for family in given.families}
    scenes = [s for family, count in counts.items() for s in sampling.sample(family, count, given.seed)]
    by_name = {(s.family, s.number): s for s in scenes}
    lines: list[dict[str, Any]] = []
    began = time.monotonic()
    for line in judged(scenes, jobs=given.jobs):
        lines.append(line)
        if given.keep and line["class"] != "right":
            given.keep.mkdir(parents=True, exist_ok=True)
            text = f"# {line['class']}: {line['outcome']} {line.get('reason', '')}\n"
            text += tomli_w.dumps(by_name[line["family"], line["number"]].tables)
            (given.keep / f"{line['family']}_{line['number']}.toml").write_text(text)
        if len(lines) % 100 == 0:
            print(f"{len(lines)} of {len(scenes)} scenes, {time.monotonic() - began:.0f} s", file=sys.stderr)
    order = list(sampling.FAMILIES)
    lines.sort(key=lambda line: (order.index(line["family"]), line["number"]))
    table = summary(lines)
    write(given.out / "campaign.csv", lines)
    write(given.out / "campaign_summary.csv", table)
    from warmslip import figures
    from warmslip.records import provenance

    stamp = provenance.stamp(
        seed=given.seed, scenes={f: sum(line["family"] == f for line in lines) for f in given.families}
    )
    (given.out / "campaign.json").write_text(json.dumps(stamp, indent=2) + "\n")
    figures.draw("campaign", [given.out / "campaign.csv"], given.out / "campaign.png")
    for row in table:
        print(
            ", ".join(
                f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}"
                for key, value in row.items()
                if value
            )
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
