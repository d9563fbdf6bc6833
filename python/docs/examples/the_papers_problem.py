# %% [markdown]
# # The paper's problem
#
# A unit square hangs clamped from its top side. It is viscoelastic, it conducts heat, its own weight pulls it down, tractions
# push it to the right, and its bottom side touches a foundation: the more it penetrates the harder the foundation presses back
# (normal compliance), friction is Coulomb's, and heat flows between the two. That is the test problem of Bouallala, Essoufi,
# Ouaanabi and Ouafik (2026), and the library holds it in four readings. Here is `paper_mixed` on a foundation as cold as the
# body, and on a hot one.

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
# `Simulation.steps` yields after every step a state, whose arrays are read while it lasts, and a report. Both runs end
# `completed`: energy, heat, forces and the contact law closed in every step, to round-off.

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
# ## What the foot does
#
# The contact points are the nodes of the bottom side. Over the cold foundation every point that touches slips, and all of them
# to the same side: the resultant of friction is the coefficient 0.2 times the normal force, no less. The hot foundation makes
# the foot swell. It presses harder, parts of it are pushed to either side, and two points between stick; so
# the resultant is well inside the cone, and it even points the other way.

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
# ## How much of this is the mesh?
#
# A picture says nothing of its error. Halving h and k together and comparing the end does, roughly: where the method is of first
# order, the difference to the next finer run is about the error of the finer one. `warmslip study` does it properly, against one
# fine reference and over all times; see *Comparing readings*.

# %%
ends = []
for n in (8, 16, 32):
    run = warmslip.run(hot.scene.override(**{"mesh.n": n, "time.steps": n}))
    ends.append(run.summary["contact"]["normal_force"])
print("normal force at the end:", ", ".join(f"{force:.4f}" for force in ends))
assert abs(ends[2] - ends[1]) < 0.005 * ends[2]
assert 0.35 < (ends[2] - ends[1]) / (ends[1] - ends[0]) < 0.65

# %% [markdown]
# The differences fall by about half, and the last one is below half a percent: the force at n = 32 is known to about that.
