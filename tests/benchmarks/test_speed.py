"""Speed, each measurement with its answer asserted; ratios are printed and kept, never asserted. Run by `make bench`."""

from __future__ import annotations

import os
import resource
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from reference import scipy_scheme

import warmslip
from warmslip import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

Benchmark = Any
NORMS = ("u_V", "u_L2", "w_L2", "theta_L2")
# final norms of paper_mixed, theta_F = 10, h = k = 1/n
STORED: dict[int, tuple[float, ...]] = {
    64: (0.10629999930235373, 0.04535980125189616, 0.04513417186685138, 0.9144362466309993),
    256: (0.10742560231868278, 0.045867139584967236, 0.04518083967351374, 0.9145996006246181),
}


def scene(n: int, steps: int | None = None, **keys: Any) -> Scene:
    values = {"mesh.n": n, "time.steps": steps or n, "contact.heat_exchange.foundation_temperature": 10.0}
    return warmslip.load("paper_mixed").override(**values | {k.replace("__", "."): v for k, v in keys.items()})


def norms(simulation: Simulation) -> dict[str, float]:
    found = summary(simulation)["norms"]
    return {name: found[name] for name in NORMS}


@pytest.fixture(name="say")
def _say(benchmark: Benchmark, capsys: pytest.CaptureFixture[str]) -> Callable[..., None]:
    """Keeps facts with the benchmark and prints them past pytest's capture."""

    def warn(**facts: Any) -> None:
        benchmark.extra_info.update(facts)
        with capsys.disabled():
            for key, value in facts.items():
                print(f"\n    {key.replace('_', ' ')}: {value:.4g}", end="")

    return warn


def step_to(simulation: Simulation) -> None:
    for _ in simulation.steps():
        pass
    assert simulation.outcome == "completed"
    assert max(simulation.statistics.residuals.values()) <= 1e-11


def test_reference_run(benchmark: Benchmark, say: Callable[..., None]) -> None:
    """h = k = 1/n, n = 256 unless WARMSLIP_BENCH_N says otherwise: a step against one substitution with both factors."""
    n = int(os.environ.get("WARMSLIP_BENCH_N", "256"))
    pairs: list[float] = []

    def reference() -> Simulation:
        start = time.process_time()
        simulation = Simulation(scene(n))
        s, d = simulation.stepper, simulation.discretisation
        right, heat = d.layout.vector(2), d.layout.vector(1)
        x, theta = right.duplicate(), heat.duplicate()
        right.setRandom()
        heat.setRandom()
        every = max(1, n // 32)
        substituting = 0.0
        for number, _ in enumerate(simulation.steps()):
            if number % every == 0:
                clock = time.process_time()
                s.momentum_factor.solve(right, x)
                s.heat_factor.solve(heat, theta)
                pairs.append(time.process_time() - clock)
                substituting += pairs[-1]
        assert simulation.outcome == "completed"
        benchmark.extra_info["cpu_seconds"] = time.process_time() - start - substituting
        return simulation

    simulation = benchmark.pedantic(reference, rounds=1, iterations=1)
    cost = simulation.stepper.cost
    substitution = statistics.median(pairs)
    say(
        unknowns=simulation.discretisation.unknowns,
        milliseconds_a_step=1e3 * cost.step_seconds / cost.steps,
        milliseconds_a_substitution=1e3 * substitution,
        step_over_substitution=cost.step_seconds / cost.steps / substitution,
        target_step_over_substitution=2.5,
        setup_seconds=cost.setup_seconds,
        cpu_seconds_of_the_run=benchmark.extra_info["cpu_seconds"],
        peak_memory_MiB=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        factor_MiB=cost.factor_bytes / 2**20,
        newton_iterations=cost.newton_iterations,
    )
    assert max(simulation.statistics.residuals.values()) <= 1e-11
    if n in STORED:
        assert list(norms(simulation).values()) == pytest.approx(STORED[n], rel=1e-9)
    else:
        pytest.skip(f"no stored norms for n = {n}: {tuple(norms(simulation).values())}")


def test_step_against_scipy(benchmark: Benchmark, say: Callable[..., None]) -> None:
    """The time loops of this core and of the SciPy scheme at h = 1/128, interleaved; the same answer.

    SciPy's loop is written twice: plainly (factored once, two solves a step with K), and with K^-1 P stored as a dense
    matrix, the fastest variant found. Ours closes the balances of every step, theirs do not.
    """
    n = steps = 128
    seconds: dict[str, list[float]] = {"ours": [], "plain": [], "stored": []}

    def alternate() -> tuple[Simulation, list[Any]]:
        simulation = Simulation(scene(n, steps))
        step_to(simulation)
        seconds["ours"].append(simulation.stepper.cost.step_seconds)
        results = [scipy_scheme.simulate("mixed", 10.0, n, steps, keep="final", store=store) for store in (False, True)]
        for name, result in zip(("plain", "stored"), results, strict=True):
            seconds[name].append(result.seconds_loop)
        return simulation, results

    simulation, results = benchmark.pedantic(alternate, rounds=3, iterations=1)
    for result in results:
        expected = scipy_scheme.norms(n, result.u[-1], result.w[-1], result.theta[-1])
        assert norms(simulation) == pytest.approx(expected, rel=1e-9)

    def faster(than: str) -> float:
        return statistics.median(b / a for a, b in zip(seconds["ours"], seconds[than], strict=True))

    say(
        milliseconds_a_step=1e3 * statistics.median(seconds["ours"]) / steps,
        milliseconds_a_step_with_SciPy=1e3 * statistics.median(seconds["plain"]) / steps,
        milliseconds_a_step_with_SciPy_and_a_stored_matrix=1e3 * statistics.median(seconds["stored"]) / steps,
        times_faster_than_SciPy=faster("plain"),
        times_faster_than_SciPy_with_a_stored_matrix=faster("stored"),
        target_times_faster=2.0,
    )


@pytest.mark.parametrize(
    ("base", "other"),
    [({}, {"contact__quadrature": "gauss-2"}), ({}, {"time__coupling": "monolithic"})],
    ids=["nodal, gauss-2", "staggered, monolithic"],
)
def test_choices(benchmark: Benchmark, say: Callable[..., None], base: dict[str, Any], other: dict[str, Any]) -> None:
    """What a choice costs a step at h = k = 1/64."""
    seconds: tuple[list[float], list[float]] = ([], [])

    def alternate() -> list[Simulation]:
        simulations = [Simulation(scene(64, **keys)) for keys in (base, other)]
        for simulation, times in zip(simulations, seconds, strict=True):
            step_to(simulation)
            times.append(simulation.stepper.cost.step_seconds / simulation.stepper.cost.steps)
        return simulations

    simulations = benchmark.pedantic(alternate, rounds=3, iterations=1)
    assert list(norms(simulations[0]).values()) == pytest.approx(STORED[64], rel=1e-9)
    near = np.array(list(norms(simulations[1]).values())) / np.array(STORED[64])
    assert np.abs(near - 1).max() < 0.05  # another scheme, the same problem
    assert (near != 1).any()
    first, second = (statistics.median(times) for times in seconds)
    say(milliseconds_a_step=1e3 * first, milliseconds_a_step_of_the_other=1e3 * second, ratio=second / first)


def test_sweep(benchmark: Benchmark, say: Callable[..., None]) -> None:
    """A sweep of fifty foundation temperatures at h = k = 1/64, everything included, against the steps of such runs alone."""
    temperatures = [float(t) for t in np.linspace(0, 20, 50)]
    one, key = scene(64), "contact.heat_exchange.foundation_temperature"
    seconds: dict[str, list[float]] = {"sweep": [], "steps": []}

    def alternate() -> tuple[list[dict[str, Any]], list[Simulation]]:
        start = time.process_time()
        rows = warmslip.sweep(one, {key: temperatures})
        seconds["sweep"].append(time.process_time() - start)
        simulations = [Simulation(one.override(**{key: t})) for t in temperatures]
        for simulation in simulations:
            step_to(simulation)
        seconds["steps"].append(sum(simulation.stepper.cost.step_seconds for simulation in simulations))
        return rows, simulations

    rows, simulations = benchmark.pedantic(alternate, rounds=3, iterations=1)
    for row, simulation in zip(rows, simulations, strict=True):
        assert [row[f"norm_{name}"] for name in NORMS] == pytest.approx(list(norms(simulation).values()), rel=1e-9)
    ratios = [a / b for a, b in zip(seconds["sweep"], seconds["steps"], strict=True)]
    say(sweep_over_its_steps=statistics.median(ratios), target_sweep_over_its_steps=1.3)
