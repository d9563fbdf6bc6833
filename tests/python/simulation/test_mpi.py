"""Two processes give the answer of one."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import weakref
from pathlib import Path

import numpy as np
import pytest
from support.processes import Command, child_environment

from warmslip import Trajectory, load
from warmslip.simulation.simulation import Simulation

CASES = {
    "plane": ["paper_mixed", "mesh.n=8", "time.steps=8", "contact.heat_exchange.foundation_temperature=10"],
    "plane, Gauss points, monolithic": [
        "paper_consistent",
        "mesh.n=8",
        "time.steps=4",
        "contact.quadrature=gauss-2",
        "time.coupling=monolithic",
    ],
    "sticking, Gauss points": [
        "paper_mixed",
        "mesh.n=8",
        "time.steps=8",
        "contact.quadrature=gauss-3",
        "contact.friction.coefficient=0.6",
    ],
    "block": ["block_3d", "mesh.n=3", "time.steps=4"],
}


@pytest.mark.mpi
@pytest.mark.parametrize("case", CASES)
def test_two_ranks_give_the_answer_of_one(command: Command, tmp_path: Path, case: str) -> None:
    scene, *overrides = CASES[case]
    options = [word for override in overrides for word in ("--set", override)]
    summaries, ends = [], []
    for ranks in (1, 2):
        result = command("run", scene, *options, "--out", f"run{ranks}", ranks=ranks)
        assert result.returncode == 0, result.stderr
        assert result.stdout.count("completed:") == 1
        summaries.append(json.loads((tmp_path / f"run{ranks}/summary.json").read_text()))
        with Trajectory(tmp_path / f"run{ranks}/trajectory.h5") as t:
            ends.append([t.u[-1], t.w[-1], t.theta[-1], t.series("contact")["force"][-1]])
    one, two = summaries
    assert two["stamp"]["ranks"] == 2
    assert two["norms"] == pytest.approx(one["norms"], rel=1e-10)
    for name in ("normal_force", "tangential_force", "max_penetration", "open", "stick", "slip"):
        assert two["contact"][name] == pytest.approx(one["contact"][name], rel=1e-9), name
    assert all(summary["balances"][i] <= 1e-11 for summary in summaries for i in ("energy", "heat", "force", "law"))
    for a, b in zip(*ends, strict=True):  # mesh numbering: field by field, point by point
        assert abs(a - b).max() <= 1e-9 * abs(a).max()


@pytest.mark.mpi
def test_refusals_are_said_once(command: Command) -> None:
    result = command("run", "paper_mixed", "--set", "mesh.n=0.5", "--out", "run", ranks=2)
    assert result.returncode == 2
    assert "Traceback" not in result.stderr
    assert result.stderr.count("mesh.n = 0.5: input should be a valid integer") == 1


FAILING = """
from dataclasses import replace
import numpy as np
import warmslip

def body(x, t):
    force = np.full(x.shape, -1.0)
    force[(x[:, 0] < 0.05) & (t > 0.6)] = np.nan  # in a corner that one rank owns
    return force

scene = warmslip.load("paper_mixed").override(**{"mesh.n": 8, "time.steps": 6})
done = warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), body=body))
print(done.outcome + ": " + done.summary["failure"]["reason"] + chr(10), end="", flush=True)
"""


@pytest.mark.mpi
def test_a_load_that_fails_on_one_rank_stops_both(tmp_path: Path) -> None:
    (tmp_path / "failing.py").write_text(FAILING)
    command = ["mpirun", "-n", "2", sys.executable, str(tmp_path / "failing.py")]
    result = subprocess.run(
        command, env=child_environment(), text=True, capture_output=True, timeout=300, cwd=tmp_path, check=True
    )
    assert result.stdout.count("data_not_finite: loads.body is not finite at t = 0.666667") == 2


OBSERVING = """
import numpy as np
import warmslip

found = []
def observer(state, report):
    contact = state.contact
    norms = np.linalg.norm(state.u), np.linalg.norm(state.theta)
    numbers = *norms, state.mises.max(), contact["pressure"].sum(), contact["gap"].min()
    found.append([float(number) for number in numbers])

law = warmslip.Law(compliance=lambda r: (10 * r, 10.0, 5 * r**2))
scene = warmslip.load("paper_mixed").override(**{"mesh.n": 8, "time.steps": 3})
done = warmslip.run(scene, laws={"bottom": law}, observers=[observer])
assert done.completed
from mpi4py import MPI
everyone = MPI.COMM_WORLD.allgather(found)
assert all(one == everyone[0] for one in everyone)
if MPI.COMM_WORLD.rank == 0:
    print(found)
"""


@pytest.mark.mpi
def test_states_and_laws_are_the_same_on_any_number_of_ranks(tmp_path: Path) -> None:
    (tmp_path / "observing.py").write_text(OBSERVING)
    output = []
    for ranks in (1, 2):
        command = ["mpirun", "-n", str(ranks), sys.executable, str(tmp_path / "observing.py")]
        result = subprocess.run(
            command, env=child_environment(), text=True, capture_output=True, timeout=300, cwd=tmp_path, check=True
        )
        output.append(np.array(json.loads(re.findall(r"\[\[.*\]\]", result.stdout)[0])))
    assert output[0].shape == (3, 5) and (output[0][:, :4] > 0).all()
    assert output[1] == pytest.approx(output[0], rel=1e-10, abs=1e-13)


def launched(folder: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """What `mpirun` makes of these words."""
    return subprocess.run(
        ["mpirun", *map(str, words)],
        env=child_environment(),
        cwd=folder,
        text=True,
        capture_output=True,
        check=False,
        timeout=300,
    )


COLLECTED_APART = """
import gc
from mpi4py import MPI
import warmslip

gc.disable()
for turn in range(4):
    job = warmslip.Simulation(warmslip.load("block_3d").override(**{"mesh.n": 2, "time.steps": 1}))
    for _ in job.steps():
        pass
    job.itself = job
    del job
    if MPI.COMM_WORLD.rank == turn % 2:
        gc.collect()
print(warmslip.load("block_3d").title)
"""


@pytest.mark.mpi
def test_ranks_may_collect_a_dropped_run_at_different_times(tmp_path: Path) -> None:
    """A run in a circle of references is collected when Python likes; its solver is destroyed by all ranks together."""
    result = launched(tmp_path, "-n", "2", sys.executable, "-c", COLLECTED_APART)
    assert result.returncode == 0, result.stderr
    assert result.stdout.count("\n") == 2


def test_a_dropped_run_frees_its_memory_at_once() -> None:
    simulation = Simulation(load("block_3d").override(**{"mesh.n": 2, "time.steps": 1}))
    for _ in simulation.steps():
        pass
    dropped = weakref.ref(simulation)
    del simulation
    assert dropped() is None


FAILING_ALONE = """
import os
import signal
import sys
from mpi4py import MPI
import warmslip

rank, how = MPI.COMM_WORLD.rank, sys.argv[1]

def observer(state, report):
    if state.step == 2 and rank == int(sys.argv[2]):
        if how == "raises":
            raise ValueError("no such thing")
        if how == "out of memory":
            raise MemoryError("no room")
        if how == "everywhere":
            raise ValueError("no such thing")
        os.kill(os.getpid(), signal.SIGKILL)
    elif how == "everywhere" and state.step == 2:
        raise ValueError("no such thing")

scene = warmslip.load("paper_mixed").override(**{"mesh.n": 4, "time.steps": 2000})
warmslip.run(scene, observers=[observer], out="run")
"""


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("how", "rank"),
    [("raises", 0), ("raises", 1), ("out of memory", 1), ("is killed", 0), ("is killed", 1), ("everywhere", 0)],
)
def test_a_rank_that_fails_alone_ends_all(tmp_path: Path, how: str, rank: int) -> None:
    """A script as users write it, without `-m mpi4py`; where all ranks raise, each ends by itself and none is aborted."""
    (tmp_path / "script.py").write_text(FAILING_ALONE)
    result = launched(tmp_path, "-n", "2", sys.executable, "script.py", how, rank)
    assert result.returncode != 0
    message = {"raises": "ValueError: no such thing", "out of memory": "MemoryError: no room", "is killed": "signal 9"}
    if how == "everywhere":
        assert result.stderr.count("ValueError: no such thing") == 2
        assert "failed alone" not in result.stderr
    else:
        assert result.stderr.count(message[how]) == 1
        assert result.stderr.count(f"rank {rank} failed alone: all ranks are ended") == (how != "is killed")


@pytest.mark.mpi
def test_ranks_that_read_different_scenes_end_together(tmp_path: Path) -> None:
    """As where a file is on one machine and not on the other."""
    program = Path(sys.executable).parent / "warmslip"
    mine = [program, "run", "paper_mixed", "--set", "mesh.n=8", "--set", "time.steps=4000"]
    theirs = [program, "run", "nowhere.toml"]
    result = launched(tmp_path, "-n", "1", *mine, ":", "-n", "1", *theirs)
    assert result.returncode == 2
    assert result.stderr.count("the ranks read different scenes; one of them refused: cannot read scene") == 1
