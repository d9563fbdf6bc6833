# %% [markdown]
# # A belt, and what follows
#
# A block lies on a belt that starts to move. Friction accelerates the block until it travels along. A run ends at its
# `time.end`, and there are two ways to go on. `--resume` continues the same scene to a later end. `initial.from` begins another
# scene with the state of this one. This example does both: the block travels on, and then the belt is stopped.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import warmslip
from warmslip.records import tables

MU, GRAVITY, SPEED = 0.3, 2.0, 0.4
probes = {"centre": {"at": [0.5, 0.25], "fields": ["velocity", "temperature"]}, "sole": {"part": "bottom", "every": 10}}
scene = warmslip.load("belt").override(**{"mesh.n": [10, 5], "output.probes": probes, "output.every": 100})
print(scene.contacts[0].velocity, "is the velocity of the belt")
first = warmslip.run(scene, out="belt")
assert first.completed


def speed(run: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and velocities of the centre, from its probe."""
    rows = tables.read(Path(run) / "probes/centre.csv")
    return np.array([row["time"] for row in rows]), np.array([row["velocity_x"] for row in rows])


# %% [markdown]
# While the whole sole slips, the friction coefficient times the gravity is the acceleration.

# %%
time, velocity = speed("belt")
slipping = (time > 0.1) & (time < 0.6)
acceleration = np.polyfit(time[slipping], velocity[slipping], 1)[0]
print(f"acceleration {acceleration:.4f}, mu g = {MU * GRAVITY}")
assert np.isclose(acceleration, MU * GRAVITY, rtol=0.01)
assert np.isclose(velocity[-1], SPEED, rtol=0.02)

# %% [markdown]
# ## The same scene to a later end
#
# With twice the end and twice the steps, the step size stays, and the run goes on from its last state. On the command line, this
# is the same `warmslip run` with `--set time.end=2 --set time.steps=200 --resume`. Trajectory and probes grow in their folder. On
# one process, they are bitwise those of one long run.

# %%
longer = scene.override(**{"time.end": 2.0, "time.steps": 200})
second = warmslip.run(longer, out="belt", resume=True)
at_once = warmslip.run(longer, out="at_once")
assert second.summary["steps"] == 200
assert np.array_equal(second.u, at_once.u) and np.array_equal(second.theta, at_once.theta)
for name in probes:
    assert Path(f"belt/probes/{name}.csv").read_bytes() == Path(f"at_once/probes/{name}.csv").read_bytes()

# %% [markdown]
# ## Another scene from there
#
# The belt stops at once. That is another scene: its belt has no velocity, and its clock begins at zero. It takes displacement,
# velocity and temperature from the last state of the run before. Friction now brakes the block, which stops after the time
# v / (mu g).

# %%
stopped = scene.override(
    **{"contact.velocity": None, "initial": {"from": "belt/trajectory.h5"}, "title": "The belt has stopped"}
)
third = warmslip.run(stopped, out="stopped")
braking, slower = speed("stopped")
assert braking[0] == 0 and np.isclose(slower[0], speed("belt")[1][-1], rtol=1e-12)
rest = braking[np.argmax(slower < 0.02 * SPEED)]
print(f"the block rests after {rest:.2f}, v / (mu g) = {SPEED / (MU * GRAVITY):.2f}")
assert np.isclose(rest, SPEED / (MU * GRAVITY), rtol=0.05)

figure, ax = plt.subplots(figsize=(7, 3), layout="constrained")
time, velocity = speed("belt")
ax.plot(time, SPEED * np.minimum(1, 10 * time), ":", color="grey", label="belt")
ax.plot(time, velocity, label="block, run and resumed")
ax.plot(2 + braking, slower, label="block, from that state")
ax.axvline(1, color="lightgrey")
ax.axvline(2, color="lightgrey")
ax.set(xlabel="t", ylabel="velocity of the centre")
_ = ax.legend()

# %% [markdown]
# ## When it slipped
#
# The contact points of the probe `sole` show when the block slipped. Half of the heat of friction goes into the block, and
# braking has warmed it further.

# %%
sole = tables.read(Path("stopped/probes/sole.csv"))
slips = {row["time"]: 0 for row in sole if row["step"] > 0}
for row in sole:
    if row["step"] > 0:
        slips[row["time"]] += row["status"] == 2
print("slipping points over time:", {f"{t:.1f}": count for t, count in slips.items()})
assert slips[0.5] == 11 and third.theta.mean() > second.theta.mean() > 0
