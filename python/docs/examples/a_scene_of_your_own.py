# %% [markdown]
# # A scene of your own
#
# A rubber foot stands on a rough foundation. A lid is glued to its upper side. The lid moves down and then sideways, to and
# fro. While the foot sticks, it acts as a spring. When it slides, it dissipates energy of the drive. The plot of force against
# displacement is a loop, and the area of the loop is the energy lost in a cycle. This example writes the scene, prints what it
# will do, runs it, and finds that area in the terms of the energy balance.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import warmslip
from warmslip.scene import plan

Path("foot.toml").write_text("""\
title = "A rubber foot dragged to and fro"

[mesh]
shape = "square"
n = [24, 12]
lengths = [2.0, 1.0]

[time]
end = 2.5
steps = 200

[elasticity]
young = 100.0
poisson = 0.3
assumption = "plane_strain"

[supports]           # down until t = 0.5, then two cycles of length 1
displacement = { top = ["0.03 * sin(2 * pi * max(0, t - 0.5))", "-0.02 * min(t, 0.5)"] }

[contact]
part = "bottom"
stiffness = 1e4

[contact.friction]
coefficient = 0.3
""")
scene = warmslip.load("foot.toml")
print(plan.text(plan.plan(scene)))

# %% [markdown]
# Each table of the scene file adds one term of the model. This scene has no `[inertia]`, so every step is in equilibrium. It
# has no `[heat]`, so it has no temperature, no matrix for it and no linear solve. `warmslip explain foot.toml` prints the same
# text in a terminal, together with the cost on this machine. A misspelt key is rejected before anything is computed:

# %%
try:
    scene.override(**{"contact.friction.coeficient": 0.3})
except warmslip.SceneError as refused:
    message = str(refused)
print(message)
assert "did you mean 'coefficient'?" in message

# %% [markdown]
# ## The loop

# %%
simulation = warmslip.Simulation(scene)
steps = [
    (state.time, report.normal_force, report.friction_traction[0], report.balances)
    for state, report in simulation.steps()
]
time, normal, friction, balances = (np.array(column, dtype=object) for column in zip(*steps, strict=True))
time, normal, friction = (column.astype(float) for column in (time, normal, friction))
lid = 0.03 * np.sin(2 * np.pi * np.maximum(0, time - 0.5))
assert simulation.outcome == "completed"
figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.plot(lid, -friction)
ax.set(xlabel="displacement of the lid", ylabel="force of the drive")

# %% [markdown]
# On the flat parts, the whole foot slides, and by Coulomb's law the friction force is 0.3 times the normal force. On the
# slanted parts, the foot sticks and deforms elastically. It starts to slide point by point, so the corners of the loop are
# round.

# %%
ratio = np.abs(friction) / normal
print(f"largest friction over normal force: {ratio.max():.6f}")
assert np.isclose(ratio.max(), 0.3, rtol=1e-9)

# %% [markdown]
# ## The energy of a cycle
#
# The balances of every step contain the work of the supports, the energy stored in the body and in the foundation, the energy
# lost to friction, and the numerical dissipation of backward Euler. After the second cycle, from t = 1.5 to 2.5, the stored
# energy is the same as before it. The work of the lid is therefore friction plus numerical dissipation.
#
# The area of the loop by the trapezoidal rule is the energy lost to friction. Backward Euler multiplies each step of the lid
# by the force at the end of the step. The difference between these two rules is the numerical dissipation.

# %%
cycle = time > 1.5 + 1e-9
work, taken, damped = (
    sum(sum(getattr(terms, name) for name in names) for terms in balances[cycle])
    for names in (["support_work"], ["friction"], ["elastic_damping", "contact_damping"])
)
force, moved = -friction[time > 1.5 - 1e-9], lid[time > 1.5 - 1e-9]
area = np.sum((force[1:] + force[:-1]) / 2 * np.diff(moved))
print(f"work of the lid {work:.5f} = friction {taken:.5f} + damping {damped:.5f}; area of the loop {area:.5f}")
assert abs(work - taken - damped) < 1e-3 * work
assert abs(area - taken) < 5e-3 * taken
assert damped < 0.05 * taken

# %% [markdown]
# The numerical dissipation is proportional to the step size: half the step gives half the dissipation. A body with a table
# `[viscosity]` would also have a physical loss, the term `viscous`. With `[contact.friction_heating]` and `[heat]`, the energy
# lost to friction would warm the foot.

# %%
finer = warmslip.Simulation(scene.override(**{"time.steps": 400}))
less = sum(r.balances.elastic_damping + r.balances.contact_damping for s, r in finer.steps() if s.time > 1.5 + 1e-9)
print(f"damping with half the step: {less:.5f}, {less / damped:.2f} of what it was")
assert 0.45 < less / damped < 0.55
