# %% [markdown]
# # A quarter of a block
#
# Two rough plates squeeze a block of rubber. The block and its loads are symmetric about two planes, and a quarter of it is
# enough. On a plane of symmetry nothing moves across, and everything is free to move along: a support by component. This example
# runs the quarter and the whole block, and compares them with probes: the history of a point, the stress along a line, and the
# pressure under the block.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import warmslip
from warmslip.records import tables

Path("quarter.toml").write_text("""\
title = "A quarter of a block between two plates"

[mesh]
shape = "square"
n = 12
diagonal = "crisscross"

[time]
steps = 10

[elasticity]
young = 100.0
poisson = 0.45
assumption = "plane_strain"

[supports.displacement]   # planes of symmetry: zero across, free along
left = [0.0, "free"]
top = ["free", 0.0]

[contact]                 # the lower plate rises
part = "bottom"
stiffness = "rigid"
gap = "-0.05 * t"

[contact.friction]
coefficient = 0.2

[output.probes.bulge]     # a point, in every step
at = [1.0, 1.0]
fields = ["displacement"]

[output.probes.axis]      # a line along the plane of symmetry, at the end
line = [[0.0, 0.0], [0.0, 1.0]]
count = 25
fields = ["stress"]
every = 10

[output.probes.plate]     # the contact points, in every second step
part = "bottom"
fields = ["pressure", "friction traction", "status"]
every = 2
""")
quarter = warmslip.load("quarter.toml")

# %% [markdown]
# The whole block occupies four times the area. Nothing but the plates holds it. Its probes are the same places, moved by one
# in x, because the plane of symmetry lies at x = 1.

# %%
plate = {"stiffness": "rigid", "gap": "-0.05 * t", "friction": {"coefficient": 0.2}}
whole = quarter.override(
    **{
        "mesh.n": 24,
        "mesh.lengths": [2.0, 2.0],
        "supports": None,
        "contact": [plate | {"part": "bottom"}, plate | {"part": "top"}],
        "output.probes.bulge.at": [2.0, 1.0],
        "output.probes.axis.line": [[1.0, 0.0], [1.0, 1.0]],
    }
)
results = {name: warmslip.run(scene, out=name) for name, scene in (("quarter", quarter), ("whole", whole))}
assert all(result.completed for result in results.values())
forces = {name: result.summary["contact"]["parts"]["normal_force bottom"] for name, result in results.items()}
print(f"force on the lower plate: whole {forces['whole']:.6f}, quarter {forces['quarter']:.6f}")
assert np.isclose(forces["whole"], 2 * forces["quarter"], rtol=1e-10)

# %% [markdown]
# ## What the probes saw
#
# A probe writes a CSV file while the run goes on. Its first row is the initial state.


# %%
def probe(run: str, name: str) -> dict[str, np.ndarray]:
    rows = tables.read(Path(run) / "probes" / f"{name}.csv")
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


one, other = ({name: probe(run, name) for name in ("bulge", "axis", "plate")} for run in ("quarter", "whole"))
assert np.array_equal(one["bulge"]["step"], np.arange(11)) and one["bulge"]["time"][0] == 0
assert np.allclose(one["bulge"]["displacement_x"], other["bulge"]["displacement_x"], rtol=1e-9)
last = one["axis"]["step"] == 10
assert np.allclose(one["axis"]["stress_yy"][last], other["axis"]["stress_yy"][last], rtol=1e-9)

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.3), layout="constrained")
for found, style, label in ((other, "-", "whole"), (one, "o", "quarter")):
    left.plot(found["bulge"]["time"], found["bulge"]["displacement_x"], style, label=label)
    end = found["axis"]["step"] == 10
    middle.plot(found["axis"]["length"][end], -found["axis"]["stress_yy"][end], style, ms=3)
    end = found["plate"]["step"] == 10
    right.plot(found["plate"]["x"][end] - (label == "whole"), found["plate"]["pressure"][end], style, ms=4)
left.legend()
left.set(xlabel="t", ylabel="bulge of the side")
middle.set(xlabel="distance from the plate", ylabel="compressive stress on the axis")
_ = right.set(xlabel="distance from the axis", ylabel="pressure on the plate")

# %% [markdown]
# The edge of the block slides outwards, and the middle sticks. The contact point on the axis is held across the plane of
# symmetry. Its traction along the plate is zero, as in the whole block.

# %%
end = one["plate"]["step"] == 10
assert one["plate"]["status"][end][-1] == 2 and 1 in one["plate"]["status"][end]
assert abs(one["plate"]["friction_traction_x"][end][0]) < 1e-9 * one["plate"]["pressure"][end][0]
_ = results["quarter"].plot.body("mises")
