"""Simulate a flight with known parameters, identify them from its noisy log, predict another flight, write a report.

python examples/recover_the_truth.py
"""

import swashplate as sp
from swashplate.simulation.sensors import QUIET

TRUTH = {"tau_f_upper": 1.3, "linkage_lower": 0.12}  # s, rad; the card says 1.6 and 0.1355


def log(maneuver: str, *, seed: int) -> sp.Flight:
    """What motion capture and the flight computer record, at one rate."""
    flown = sp.simulate(aircraft, maneuver, lead=1.0, tail=1.0)
    return sp.observe(flown, aircraft, sensors=QUIET, seed=seed).condition(rate=100, cutoff=0)


coax = sp.vehicle("coax")
aircraft = coax.with_values(TRUTH, status="assumed", source="this example")

fit = sp.identify(
    coax,
    log("multisine:roll+pitch,0.4-4Hz,8s,0.1", seed=1),
    free=list(TRUTH),
    method="output-error",  # nothing disturbs this flight; flights in real air take the default, "filter-error"
)
for name, truth in TRUTH.items():
    e = fit[name]
    print(f"{name}: card {e.start:g}, true {truth:g}, found {e.value:.4f} +- {2 * e.sigma_corrected:.4f} {e.unit}")

validation = sp.validate(fit, log("multisine:roll+pitch,0.5-4Hz,8s,0.1", seed=2), horizons=(0.5, 1.0), every=0.5)
for predictor in ("model", "published card"):
    print(f"pitch 1 s ahead, {predictor}: {validation.score('theta', 1.0, predictor).fit:.0f} %")

print("report:", sp.report(fit, validation, path="report.html"))
