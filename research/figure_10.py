"""The paper's Fig. 10 (a step of the pitch command over 6 m) for the model of the August flight, as it would be flown.

    python research/figure_10.py [MODELS]

The model is that of the tutorial "first model", with its identified delays. It and MODELS (60) drawn from the fit's
covariance fly the step with three laws (none, the paper's, ours), each in gusts of its own, and once in still air. The
tables are those of docs/howto/decouple-and-hold.md; about a minute.
"""

from __future__ import annotations

import sys

import numpy as np
from flights import FLIGHTS

import swashplate as sp
from swashplate.api.decouple import FlownStep
from swashplate.models.surroundings import input_delays
from swashplate.simulation.wind import INDOOR

SPEED = 1.8


def table(step: FlownStep) -> str:
    """Drift at 6 m by law: of the model itself, and of all that were drawn."""
    lines = ["| law | the model | drawn, median | drawn, 5 to 95 % | 1 sigma |", "| --- | --- | --- | --- | --- |"]
    for name, run in step.runs.items():
        drawn = run.drawn.drift
        low, middle, high = np.nanpercentile(drawn, [5, 50, 95])
        own = f"{run.path.drift[0]:+.2f} m"
        lines.append(f"| {name} | {own} | {middle:+.2f} m | {low:+.2f} to {high:+.2f} m | {np.nanstd(drawn):.2f} m |")
    return "\n".join(lines)


def main(models: int) -> None:
    august = sp.read(FLIGHTS["august"]).condition(rate=100.0, cutoff=0.0)
    fit = sp.identify(sp.vehicle("coax"), august, free="full")
    print("delays [ms]:", {name: round(1e3 * value) for name, value in input_delays(fit.model).items()})
    for air, gusts in (("still air", None), ("gusts of 0.15 m/s", INDOOR)):
        result = sp.decouple(fit.model, to_speed=SPEED, fit=fit, gusts=gusts, draws=models)
        assert result.step is not None
        print(f"\n{air}\n{table(result.step)}")
        for other, (wins, of) in result.step.nearer_than().items():
            print(f"nearer to straight ahead than {other}: {wins} of {of}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
