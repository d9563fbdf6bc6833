# %% [markdown]
# # Writing a contact law
#
# The scene's own laws are a power of the penetration and Coulomb's cone with its relatives. Real surfaces have others. Two of
# them are written here as Python functions: the exponential compliance of rough surfaces, and friction that grows with the
# logarithm of the slip speed, as in rate-and-state laws.
#
# A law gives three numbers. A compliance `p(r)` gives the pressure, its derivative, and the energy per area, the integral of `p`
# from 0 to `r`: the ledger needs it. A friction bound `s(p, v)` gives the bound and its derivatives by pressure and slip speed:
# Newton needs them.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np

import warmslip
from warmslip import Law

SCALE, LENGTH = 20.0, 5e-4  # pressure, and the height of the asperities


def rough(r):
    grown = math.expm1(r / LENGTH)
    return SCALE * grown, SCALE * (grown + 1) / LENGTH, SCALE * (LENGTH * grown - r)


def quickening(pressure, speed):
    mu = 0.3 + 0.05 * math.log1p(speed / 1e-3)
    return mu * pressure, mu, 0.05 * pressure / (1e-3 + speed)


# %% [markdown]
# ## A law is tried before it is used
#
# Derivatives are where one errs. Before a run, each function is called on a ladder of penetrations, pressures and
# speeds, and compared with difference quotients; the energy is compared with the rectangles under the pressure. Here is a
# compliance whose energy lacks the factor one half.

# %%
scene = warmslip.load("quasistatic_punch")  # a body pressed down by its lid, then pulled sideways
try:
    warmslip.run(scene, laws={"bottom": Law(compliance=lambda r: (1e4 * r, 1e4, 1e4 * r**2))})
except ValueError as refused:
    message = str(refused)
print(message)
assert "the third value is the integral of the first" in message

# %% [markdown]
# ## First the law that is already there
#
# The cheapest test of a way to write laws is a law with a known answer: the scene's own, in Python.


# %%
def marched(**laws):
    simulation = warmslip.Simulation(scene, laws={"bottom": Law(**laws)} if laws else None)
    rows = [(s.time, r.normal_force, -r.friction_traction[0], r.max_penetration, r.slip) for s, r in simulation.steps()]
    assert simulation.outcome == "completed"
    return simulation, np.array(rows).T


ordinary, output = marched()
again, same = marched(compliance=lambda r: (1e4 * r, 1e4, 5e3 * r**2), friction=lambda p, v: (0.3 * p, 0.3, 0.0))
print(f"largest difference of all forces: {np.abs(same - output).max():.0e}")
assert np.abs(same - output).max() < 1e-12

# %% [markdown]
# ## Rough surfaces
#
# The exponential law stiffens as asperities are flattened. Same lid, nearly the same force, since the body is far softer than
# either contact; but the deepest penetration is a quarter, and the books close with the energy we wrote.

# %%
simulation, stiffening = marched(compliance=rough)
print(
    f"normal force {output[1, -1]:.3f} and {stiffening[1, -1]:.3f}, deepest {output[3, -1]:.2e} and {stiffening[3, -1]:.2e}"
)
print(f"worst residual of the energy {simulation.statistics.residuals['energy']:.0e}")
assert abs(stiffening[1, -1] / output[1, -1] - 1) < 0.02
assert 0.2 < stiffening[3, -1] / output[3, -1] < 0.3
assert max(simulation.statistics.residuals.values()) < 1e-11

# %% [markdown]
# ## Friction that grows with speed
#
# The lid moves sideways at 0.02 from t = 0.3 on. With Coulomb's law all points that touch slip at the end. With the other one the
# bound of a point rises as it slips: fewer points slip, slower than the lid moves, and the force lies above Coulomb's
# but well below what the speed of the lid would allow.

# %%
simulation, slowed = marched(friction=quickening)
reached, allowed = (slowed[2] / slowed[1]).max(), 0.3 + 0.05 * math.log1p(0.02 / 1e-3)
print(f"Coulomb reaches {(output[2] / output[1]).max():.3f}; the new law {reached:.3f} of at most {allowed:.3f}")
assert np.isclose((output[2] / output[1]).max(), 0.3) and 0.31 < reached < 0.8 * allowed
assert slowed[4, -1] < output[4, -1] == 16
figure, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
for label, rows in (("Coulomb", output), ("growing with speed", slowed), ("rough", stiffening)):
    ax.plot(rows[0], rows[2] / rows[1], label=label)
ax.set(xlabel="t", ylabel="friction over normal force")
ax.legend()

# %% [markdown]
# What it costs: a law that is not piecewise linear has its Newton factor made in every iteration, and Python is called at every
# point. Newton's method still needs few iterations, which the summary counts.

# %%
iterations = {
    name: run.stepper.cost.newton_iterations for name, run in (("Coulomb", ordinary), ("growing", simulation))
}
print(iterations, simulation.statistics.stages)
assert iterations["growing"] < 3 * iterations["Coulomb"]
