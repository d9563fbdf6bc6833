# %% [markdown]
# # Writing a contact law
#
# The scene file has a power law of the penetration, Coulomb friction and some variants of it. Real surfaces follow other laws
# too. This example writes two of them as Python functions: the exponential compliance of rough surfaces, and friction that
# grows with the logarithm of the slip speed, as in rate-and-state laws.
#
# A law returns three numbers. A compliance `p(r)` returns the pressure, its derivative, and the energy per area, which is the
# integral of `p` from 0 to `r`. The energy balance needs this integral. A friction bound `s(p, v)` returns the bound and its
# derivatives with respect to pressure and slip speed. Newton's method needs these derivatives.

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
# ## A law is tested before it is used
#
# Errors are most likely in the derivatives. Before a run, warmslip evaluates each function at a sequence of penetrations,
# pressures and speeds. It compares the derivatives with difference quotients, and the energy with a sum of rectangles under
# the pressure. In this example, the energy of the compliance lacks the factor one half:

# %%
scene = warmslip.load("quasistatic_punch")  # a body pressed down by its lid, then pulled sideways
try:
    warmslip.run(scene, laws={"bottom": Law(compliance=lambda r: (1e4 * r, 1e4, 1e4 * r**2))})
except ValueError as refused:
    message = str(refused)
print(message)
assert "the third value is the integral of the first" in message

# %% [markdown]
# ## A law with a known answer
#
# The simplest test of a user-defined law is a law with a known answer: the law of the scene file, written in Python.


# %%
def simulate(**laws):
    simulation = warmslip.Simulation(scene, laws={"bottom": Law(**laws)} if laws else None)
    rows = [(s.time, r.normal_force, -r.friction_traction[0], r.max_penetration, r.slip) for s, r in simulation.steps()]
    assert simulation.outcome == "completed"
    return simulation, np.array(rows).T


ordinary, output = simulate()
again, same = simulate(compliance=lambda r: (1e4 * r, 1e4, 5e3 * r**2), friction=lambda p, v: (0.3 * p, 0.3, 0.0))
print(f"largest difference of all forces: {np.abs(same - output).max():.0e}")
assert np.abs(same - output).max() < 1e-12

# %% [markdown]
# ## Rough surfaces
#
# The exponential law stiffens as the asperities are flattened. The lid is the same, and the normal force is nearly the same,
# because the body is far softer than either contact. The largest penetration is only a quarter. The energy balance holds with
# the energy of the law above.

# %%
simulation, stiffening = simulate(compliance=rough)
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
# From t = 0.3 on, the lid moves sideways with the speed 0.02. With Coulomb's law, all touching points slip at the end. With
# the other law, the bound of a point rises as the point slips. Fewer points slip, and they slip more slowly than the lid
# moves. The friction force lies above that of Coulomb's law, but well below the value for the speed of the lid.

# %%
simulation, slowed = simulate(friction=quickening)
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
# The cost: for a law that is not piecewise linear, the Newton factor is recomputed in every iteration, and Python is called at
# every contact point. Newton's method still needs few iterations. The summary counts them.

# %%
iterations = {
    name: run.stepper.cost.newton_iterations for name, run in (("Coulomb", ordinary), ("growing", simulation))
}
print(iterations, simulation.statistics.stages)
assert iterations["growing"] < 3 * iterations["Coulomb"]
