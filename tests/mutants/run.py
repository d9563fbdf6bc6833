"""Seeded faults against the tests: which check kills which mutant. `make mutants` runs all of them.

A mutant is an entry of faults.toml: a file, a text that stands in it exactly once, and what to put there instead. Each worker
builds one copy of the tree, applies one mutant after another, compiles what changed and runs the fast tests until the
first fails. The table says who killed it; a survivor is a check that is missing, or a fault that changes nothing (its
entry then says why).
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue
from threading import Lock
from typing import NamedTuple

from rich.progress import Progress

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# not those that compare files with files: they would notice the seeding itself
SELECT = [
    "-m",
    "not slow",
    "--deselect",
    "tests/repository/test_public_files.py",
    "--deselect",
    "tests/repository/test_faults.py",
]
STORED = "*norms on any number of ranks*"  # native tests that compare with stored numbers: they come last
CONTROL = "control"  # the fault that is none: nothing may notice it
PATIENCE = 1800  # seconds of a test run after which it is said to loop
TABLE = ROOT / "results/verification/mutants.csv"
CORES = os.cpu_count() or 1


class Fault(NamedTuple):
    name: str
    file: str
    old: str
    new: str
    what: str
    survives: str = ""  # why no check can fail, when none can

    @property
    def key(self) -> str:
        """Changes with the fault, and not with the place of its file."""
        return hashlib.sha256("\0".join((self.old, self.new)).encode()).hexdigest()[:8]


class Found(NamedTuple):
    fault: Fault
    outcome: str  # killed, survived, invalid, untried
    by: str  # of an untried fault: who killed it when its text was another
    commit: str = ""  # at which it was tried


def faults() -> list[Fault]:
    """All entries of faults.toml. Raises ValueError when a text does not stand in its file exactly once."""
    out = [Fault(**entry) for entry in tomllib.loads((HERE / "faults.toml").read_text())["fault"]]
    for fault in out:
        count = (ROOT / fault.file).read_text().count(fault.old)
        if count != 1:
            raise ValueError(f"{fault.name}: its old text stands {count} times in {fault.file}; it must stand once")
    if len({fault.name for fault in out}) < len(out):
        raise ValueError("two faults have the same name")
    return out


class Tree:
    """A copy of the tracked files with a build of its own; one that is there already is brought up to date."""

    def __init__(self, at: Path, cores: int) -> None:
        self.at, self.cores = at, cores
        tracked = subprocess.run(
            ["git", "ls-files", "-coz", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
        )
        for name in filter(None, tracked.stdout.split("\0")):
            source, copy = ROOT / name, at / name
            if name.startswith("results/") or source.is_symlink():
                continue
            if not copy.exists() or copy.read_bytes() != source.read_bytes():
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, copy)
        pybind = self._run(sys.executable, "-m", "pybind11", "--cmakedir").stdout.strip()
        self._run(
            *("cmake", "-S", ".", "-B", "build/tests", "-G", "Ninja", "-DWARMSLIP_PYTHON=ON", "-DWARMSLIP_TESTS=ON"),
            *(f"-Dpybind11_DIR={pybind}", f"-DPython_EXECUTABLE={sys.executable}"),
            "-DCMAKE_BUILD_TYPE=Release",
        ).check_returncode()

    def _run(self, *command: str) -> subprocess.CompletedProcess[str]:
        # the tree's own package in place of the installed one, in every process the tests start
        environment = os.environ | {"PYTHONPATH": f"{self.at / 'tests/shadow'}:{self.at / 'python'}"}
        try:
            return subprocess.run(
                command, cwd=self.at, env=environment, capture_output=True, text=True, check=False, timeout=PATIENCE
            )
        except subprocess.TimeoutExpired:
            return subprocess.CompletedProcess(command, -1, "", "it loops")

    def build(self) -> str:
        """Compiles; the compiler's first error, or nothing."""
        result = self._run("cmake", "--build", "build/tests", f"-j{self.cores}")
        for core in (self.at / "build/tests").glob("_core.*.so"):
            shutil.copy2(core, self.at / "python/warmslip" / core.name)
        error = re.search(r"error: .*", result.stdout + result.stderr)
        return "" if result.returncode == 0 else error[0] if error else "the build failed"

    def failures(self, *, every: bool, near: str = "", first: Sequence[str] = (), alone: bool = False) -> list[str]:
        """The tests that fail: the first, or all of them. The files in `first` and those that name the Python module `near`
        come first, without one the native tests of the core. No other Python tests run where those are to be `alone`."""
        found = [] if near else self._native(f"--test-case-exclude={STORED}")
        if not found or every:
            found += self._python(near, first, every=every, alone=alone)
        if not found or every:
            found += self._native() if near else self._native(f"--test-case={STORED}")
        return list(dict.fromkeys(found))

    def _native(self, *which: str) -> list[str]:
        tests = self._run("build/tests/tests/cpp/test_core", *which)
        found = [f"ctest: {name.strip()}" for name in re.findall(r"TEST CASE: (.*)", tests.stdout)]
        return found or self._crash(tests)

    def _python(self, near: str, first: Sequence[str], *, every: bool, alone: bool) -> list[str]:
        # of the mathematics first
        files = [
            p
            for folder in ("core", "python", "repository")
            for p in sorted((self.at / "tests" / folder).rglob("test_*.py"))
        ]

        def rank(path: Path) -> int:
            if str(path.relative_to(self.at)) in first:
                return 0
            return 1 if near and re.search(rf"\b{near}\b", path.read_text()) else 2

        files.sort(key=rank)
        if alone:
            files = [path for path in files if rank(path) < 2]
        if not files:
            return []
        tests = self._run(
            *(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--no-header", "--tb=no", "-rfE"),
            *([] if every else ["-x"]),
            *SELECT,
            *map(str, files),
        )
        found = re.findall(r"^(?:FAILED|ERROR) (?:tests/)?(.+?)(?: - .*)?$", tests.stdout, re.MULTILINE)
        if any("::" not in name for name in found):
            raise RuntimeError("the tests cannot be collected, so no check has looked at it")
        return found or self._crash(tests)

    def _crash(self, tests: subprocess.CompletedProcess[str]) -> list[str]:
        if tests.returncode == 0:
            return []
        if tests.returncode > 0:
            raise RuntimeError(f"the tests did not run: {(tests.stdout + tests.stderr).strip()[-300:]}")
        return ["it loops" if tests.stderr == "it loops" else "a crash"]

    def verdict(self) -> list[str]:
        """What the small workflow finds: the checks that its verdict fails, or the jobs that stopped before it."""
        environment = self.at / ".venv"
        environment.unlink(missing_ok=True)
        environment.symlink_to(sys.prefix)
        for leftover in (".snakemake", "results/runs"):  # of a run that was ended
            shutil.rmtree(self.at / leftover, ignore_errors=True)
        result = self._run(
            *("bash", "-c", ". workflows/env.sh && exec snakemake judged --cores 2 --keep-going --configfile $0"),
            "workflows/config/ci.yaml",
        )
        stopped = re.findall(r"Error in rule (\w+)", result.stdout + result.stderr)
        failed = [job for job in dict.fromkeys(stopped) if job != "judged"]
        written = self.at / "results/runs/ci/paper/verdict.json"
        if "judged" in stopped:
            failed += json.loads(written.read_text())["failed"]
        return failed or (["it did not run"] if result.returncode else [])

    def judge(self, fault: Fault, first: Sequence[str], options: argparse.Namespace) -> Found:
        """What finds the fault; the files of tests in `first` run before the others."""
        path = self.at / fault.file
        original = path.read_text()
        path.write_text(original.replace(fault.old, fault.new))
        try:
            error = self.build()
            if error:
                return Found(fault, "invalid", error)
            python = fault.file.endswith(".py")
            failed = self.failures(
                every=options.every, near=path.stem if python else "", first=first, alone=options.near
            )
            if options.workflow:
                failed += [f"workflow: {name}" for name in self.verdict()]
            return Found(fault, "killed" if failed else "survived", "; ".join(failed) or fault.survives)
        except RuntimeError as error:
            return Found(fault, "invalid", str(error))
        finally:
            path.write_text(original)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="faults to try (default: all)")
    parser.add_argument("--handful", type=int, help="so many, others after every commit; the tests are taken to pass")
    parser.add_argument("--jobs", type=int, default=CORES, help="trees at work at once")
    parser.add_argument("--resume", action="store_true", help="keep what the table at --out says of other faults")
    parser.add_argument("--every", action="store_true", help="run all tests, not only up to the first that fails")
    parser.add_argument(
        "--near", action="store_true", help="run the native tests and those that belong to a fault alone"
    )
    parser.add_argument("--workflow", action="store_true", help="run the small workflow as well, for its verdict")
    parser.add_argument("--trees", type=Path, help="where to keep the built trees for the next time (default: nowhere)")
    parser.add_argument("--out", type=Path, help=f"a CSV of what was found (all: {TABLE.relative_to(ROOT)})")
    options = parser.parse_args()
    chosen = [f for f in faults() if not options.names or f.name in options.names]
    if options.handful:  # of those that the table says were killed: a survivor means that the tests have got worse
        before = read(TABLE)
        known = [f for f in chosen if f.name in before and before[f.name].outcome == "killed"]
        chosen = handful(known or chosen, options.handful)
    elif not options.names:
        options.out = options.out or TABLE
    if unknown := set(options.names) - {f.name for f in chosen}:
        parser.error(f"unknown faults: {', '.join(sorted(unknown))}")
    table = read(options.out) if options.resume and options.out else {}
    chosen = [f for f in chosen if f.name not in table]
    earlier = killers(options.out or TABLE)

    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, Progress() as progress:
        jobs = min(options.jobs, len(chosen))
        building = progress.add_task("building the trees", total=jobs)
        trees: Queue[Tree] = Queue()

        def ready(number: int) -> None:
            tree = Tree((options.trees or Path(folder)) / str(number), max(1, CORES // jobs))
            untested = not options.handful
            wrong = tree.build() or "; ".join(tree.failures(every=False) if untested else [])
            if wrong:
                raise SystemExit(f"the tests must pass before faults are seeded: {wrong}")
            trees.put(tree)
            progress.advance(building)

        def one(fault: Fault) -> Found:
            tree = trees.get()
            try:
                found = tree.judge(
                    fault, first=[*files_in(earlier.get(fault.name, "")), *born_with(fault)], options=options
                )
            finally:
                trees.put(tree)
            progress.print(f"{fault.name}: {found.outcome}, {found.by}", markup=False, highlight=False)
            sys.stdout.flush()
            progress.advance(judging)
            if options.near and found.outcome == "survived":
                return found  # the other tests have not looked at it
            found = found._replace(commit=commit())
            with writing:
                table[fault.name] = found
                write(options.out, table, earlier)
            return found

        writing = Lock()
        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(ready, range(jobs)))
            judging = progress.add_task("mutants", total=len(chosen))
            list(pool.map(one, chosen))

    return report(list(table.values()))


def born_with(fault: Fault) -> list[str]:
    """The files of tests that were changed by the commit with which the fault came; none without a history."""
    found = subprocess.run(
        [
            "git",
            "log",
            "--full-diff",
            "--pickaxe-all",
            "--format=",
            "--name-only",
            f'-Sname = "{fault.name}"',
            "--",
            "tests/mutants",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return found.stdout.split()


def commit() -> str:
    """The commit that is checked out, eight digits."""
    answer = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return answer[:8]


def handful(all_: list[Fault], count: int) -> list[Fault]:
    """`count` faults spread over the list, from a place that every commit moves."""
    first = int(commit(), 16)
    return [all_[(first + i * len(all_) // count) % len(all_)] for i in range(min(count, len(all_)))]


def read(path: Path) -> dict[str, Found]:
    """What an earlier call wrote, of faults that still exist; nothing when it wrote nothing."""
    if not path.exists():
        return {}
    known = {fault.name: fault for fault in faults()}
    with path.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["fault"] in known and row["outcome"] != "untried"]
    return {
        row["fault"]: Found(known[row["fault"]], row["outcome"], row["by"], row["commit"])
        for row in rows
        if row["key"] == known[row["fault"]].key
    }


def killers(path: Path) -> dict[str, str]:
    """Who killed a fault of this name the last time, whatever its text was then."""
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        return {row["fault"]: row["by"] for row in csv.DictReader(file) if row["outcome"] in {"killed", "untried"}}


def files_in(by: str) -> list[str]:
    """The files of the Python tests that a line of the table names."""
    return [f"tests/{name}" for name in re.findall(r"\S+/test_\w+\.py(?=::)", by)]


def write(path: Path | None, table: dict[str, Found], earlier: dict[str, str]) -> None:
    """The table so far, in the order of faults.toml."""
    if path is None:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(["fault", "file", "what", "outcome", "by", "commit", "key"])
        found = [table.get(fault.name, Found(fault, "untried", earlier.get(fault.name, ""))) for fault in faults()]
        lines.writerows(
            [f.fault.name, f.fault.file, f.fault.what, f.outcome, f.by, f.commit, f.fault.key] for f in found
        )


def report(table: list[Found]) -> int:
    """Prints the score; 0 when 95 % are killed and every other fault is known to change nothing."""
    control = [f for f in table if f.fault.name == CONTROL]
    tried = [f for f in table if f.fault.name != CONTROL]
    bad = [f.fault.name for f in tried if f.outcome != "killed" and not (f.outcome == "survived" and f.fault.survives)]
    killed = sum(f.outcome == "killed" for f in tried)
    print(f"{killed} of {len(tried)} killed ({100 * killed / max(1, len(tried)):.1f} %)")
    if bad:
        print(f"not explained: {', '.join(bad)}")
    if any(f.outcome != "survived" for f in control):
        print("a change that changes nothing did not survive: the score means nothing")
        return 1
    return 1 if bad or killed < 0.95 * len(tried) else 0


if __name__ == "__main__":
    sys.exit(main())
