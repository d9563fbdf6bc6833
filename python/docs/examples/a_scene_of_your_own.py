# %% [markdown]
# # A scene of your own
#
# A rubber foot stands on a rough floor. Its upper side is glued to a lid that goes down, and then to and fro. While it sticks it
# is a spring; once it slides it takes energy out of the drive. The plot of force over displacement is a loop, its area is what a
# cycle costs. We write the scene, ask what it will do, run it, and find that area in the ledger.

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
# Every table is a block of the problem. There is no `[inertia]`, so every step is in equilibrium; no `[heat]`, so there is no
# temperature, no matrix for it and no solve. `warmslip explain foot.toml` says the same in a terminal, with the cost on this
# machine. A key that is misspelt is refused before anything is computed:

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
time, normal, friction, ledgers = (np.array(column, dtype=object) for column in zip(*steps, strict=True))
time, normal, friction = (column.astype(float) for column in (time, normal, friction))
lid = 0.03 * np.sin(2 * np.pi * np.maximum(0, time - 0.5))
assert simulation.outcome == "completed"
figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.plot(lid, -friction)
ax.set(xlabel="displacement of the lid", ylabel="force of the drive")

# %% [markdown]
# The flat parts are Coulomb's: there the whole foot slides and friction is 0.3 times the normal force. The
# slanted ones are the elastic foot while it sticks; it lets go point by point, so the corners are round.

# %%
ratio = np.abs(friction) / normal
print(f"largest friction over normal force: {ratio.max():.6f}")
assert np.isclose(ratio.max(), 0.3, rtol=1e-9)

# %% [markdown]
# ## What a cycle costs
#
# The ledger of every step holds the work of the supports, what the body and the foundation have stored, what friction took, and
# what backward Euler itself damps. Over the second cycle, from t = 1.5 to 2.5, what is stored comes back, so the work of
# the lid is friction and damping. The area of the loop, by the trapezoidal rule, is what friction took: backward Euler
# multiplies a step of the lid with the force at its end, and the difference between the two rules is its damping.

# %%
cycle = time > 1.5 + 1e-9
work, taken, damped = (
    sum(sum(getattr(ledger, name) for name in names) for ledger in ledgers[cycle])
    for names in (["support_work"], ["friction"], ["elastic_damping", "contact_damping"])
)
force, moved = -friction[time > 1.5 - 1e-9], lid[time > 1.5 - 1e-9]
area = np.sum((force[1:] + force[:-1]) / 2 * np.diff(moved))
print(f"work of the lid {work:.5f} = friction {taken:.5f} + damping {damped:.5f}; area of the loop {area:.5f}")
assert abs(work - taken - damped) < 1e-3 * work
assert abs(area - taken) < 5e-3 * taken
assert damped < 0.05 * taken

# %% [markdown]
# The damping is of the order of the step: halve the step, and it halves. A body with a `[viscosity]` would have a loss of its own
# beside it, in the ledger's line `viscous`; with `[contact.friction_heating]` and `[heat]`, what friction takes
# would warm the foot.

# %%
finer = warmslip.Simulation(scene.override(**{"time.steps": 400}))
less = sum(r.balances.elastic_damping + r.balances.contact_damping for s, r in finer.steps() if s.time > 1.5 + 1e-9)
print(f"damping with half the step: {less:.5f}, {less / damped:.2f} of what it was")
assert 0.45 < less / damped < 0.55
