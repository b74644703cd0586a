"""The paper's Fig. 6 from bench records: torque of the lower rotor against its tilt, split into its two parts."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

import swashplate as sp
from swashplate.bench.evaluate import evaluate
from swashplate.bench.plan import planned
from swashplate.bench.tilt import torques
from swashplate.bench.virtual_bench import virtual_bench

coax = sp.vehicle("coax")
records = virtual_bench(coax, planned(coax, ["thrust", "swashplate"]), seed=1)
bench = evaluate(records, coax)
card = bench.model.card.values()
measured = next(result for result in bench.details.results if result.procedure == "swashplate")

tilt = np.radians(np.linspace(-6.0, 6.0, 61))
lines = torques(
    np.abs(tilt),
    stiffness=card["hub_stiffness_lower"],
    thrust=card["k_thrust_lower"] * 238.97**2,  # at hover
    hub_height=card["hub_height_lower"],
)
figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
names = ("total torque", "rotor flapping torque", "tilting of the thrust vector")
for line, name, curve, style in zip(lines, names, measured.curves, ("-", "--", ":"), strict=True):
    (drawn,) = axes.plot(np.degrees(tilt), 1e3 * line, style, label=name)
    axes.plot(curve.x, curve.y, "o", color=drawn.get_color(), markersize=3)
axes.set(xlabel="tilt of the lower tip-path plane [deg]", ylabel="torque [N mm]", xlim=(-6.5, 6.5), ylim=(0.0, 80.0))
axes.grid(color="0.9")
axes.legend(frameon=False)
figure.savefig("bench-figure-6.png", dpi=110)
