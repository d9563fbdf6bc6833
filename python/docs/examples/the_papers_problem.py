# %% [markdown]
# # The paper's problem
#
# A unit square is clamped at its top side. It is viscoelastic and conducts heat. Its weight pulls it down, and tractions push
# it to the right. Its bottom side touches a foundation, whose pressure grows with the penetration (normal compliance).
# Friction follows Coulomb's law, and heat flows between body and foundation. This is the test problem of Bouallala, Essoufi,
# Ouaanabi and Ouafik (2026). The library contains it in four readings. This example runs `paper_mixed` on a foundation as cold
# as the body, and on a hot one.

# %%
import matplotlib.pyplot as plt
import numpy as np

import warmslip

scene = warmslip.load("paper_mixed")
cold, hot = (
    warmslip.Simulation(scene.override(**{"contact.heat_exchange.foundation_temperature": temperature}))
    for temperature in (0.0, 10.0)
)
last = {}
for name, simulation in (("cold", cold), ("hot", hot)):
    for state, report in simulation.steps():
        last[name] = {"u": state.u, "theta": state.theta, "mises": state.mises, "report": report} | state.contact
    print(
        f"{name}: {simulation.outcome}, largest residuals of the balances {max(simulation.statistics.residuals.values()):.0e}"
    )

# %% [markdown]
# `Simulation.steps` yields a state and a report after every step. The arrays of the state must be read before the next step.
# Both runs end with the outcome `completed`: the balances of energy, heat and force and the contact law hold to round-off in
# every step.

# %%
assert cold.outcome == hot.outcome == "completed"
assert max(*cold.statistics.residuals.values(), *hot.statistics.residuals.values()) < 1e-11

nodes, cells = np.asarray(cold.discretisation.mesh.nodes), np.asarray(cold.discretisation.mesh.cells)
figure, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for ax, (name, found) in zip(axes, last.items(), strict=True):
    x, y = (nodes + found["u"]).T
    drawn = ax.tripcolor(x, y, cells, found["mises"])
    ax.set(title=f"von Mises stress, {name} foundation", aspect="equal")
    figure.colorbar(drawn)

# %% [markdown]
# ## What happens at the contact
#
# The contact points are the nodes of the bottom side. On the cold foundation, every touching point slips, and all of them slip
# to the same side. The resultant of friction is therefore the full coefficient 0.2 times the normal force.
#
# On the hot foundation, the body expands and presses harder. Some of its points are pushed to the left and others to the
# right, and two points between them stick. The resultant is therefore well inside the friction cone, and it even points in the
# opposite direction.

# %%
for name, found in last.items():
    report = found["report"]
    ratio = report.friction_traction[0] / report.normal_force
    print(f"{name}: normal force {report.normal_force:.3f}, friction over normal force {ratio:+.3f},", end=" ")
    print(f"open {report.open}, stick {report.stick}, slip {report.slip}")
one, other = last["cold"]["report"], last["hot"]["report"]
assert one.stick == 0 and np.isclose(one.friction_traction[0], -0.2 * one.normal_force, rtol=1e-12)
assert other.stick == 2 and 0 < other.friction_traction[0] < 0.18 * other.normal_force
assert other.normal_force > 1.5 * one.normal_force
pulled = {name: found["friction traction"][:, 0] for name, found in last.items()}
assert (pulled["cold"] <= 0).all()
assert pulled["hot"].min() < 0 < pulled["hot"].max()

# %%
points = np.asarray(cold.discretisation.surface.positions)[:, 0]
figure, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained", sharey=True)
for ax, (name, found) in zip(axes, last.items(), strict=True):
    bound = 0.2 * found["pressure"]
    ax.fill_between(points, -bound, bound, color="0.9", label="friction bound")
    ax.plot(points, found["friction traction"][:, 0], ".-", label="friction traction")
    ax.set(title=f"{name} foundation", xlabel="x")
    assert (np.abs(found["friction traction"][:, 0]) <= bound + 1e-12).all()
axes[0].legend()

# %% [markdown]
# ## How large is the error of the mesh?
#
# A picture does not show its error. A rough estimate is to halve h and k together and to compare the final values. For a
# method of first order, the difference between a run and the next finer one is about the error of the finer one.
# `warmslip study` measures the error properly, against one fine reference and over all times; see *Comparing readings*.

# %%
ends = []
for n in (8, 16, 32):
    run = warmslip.run(hot.scene.override(**{"mesh.n": n, "time.steps": n}))
    ends.append(run.summary["contact"]["normal_force"])
print("normal force at the end:", ", ".join(f"{force:.4f}" for force in ends))
assert abs(ends[2] - ends[1]) < 0.005 * ends[2]
assert 0.35 < (ends[2] - ends[1]) / (ends[1] - ends[0]) < 0.65

# %% [markdown]
# Each difference is about half of the previous one, and the last is below half a percent. The force at n = 32 is known to
# about that accuracy.
