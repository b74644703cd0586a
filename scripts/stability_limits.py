"""Table and picture of what delay a CoaX stands with and without its bar, for the how-to on observers (minutes).

python scripts/stability_limits.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import swashplate as sp
from swashplate.control.analysis.stability_limit import Limit, limit
from swashplate.errors import ControllerError

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "stability-limit.png"
RATES = (20.0, 40.0, 60.0, 100.0)
SERVOS = (0.0, 0.02, 0.05, 0.1)


def found(bar: bool) -> dict[tuple[float, float], Limit | None]:
    aircraft = sp.vehicle("coax", bar=bar)
    limits: dict[tuple[float, float], Limit | None] = {}
    for rate in RATES:
        for servo in SERVOS:
            try:
                limits[rate, servo] = limit(aircraft, rate=rate, servo=servo)
            except ControllerError:
                limits[rate, servo] = None
    return limits


def main() -> None:
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained", sharey=True)
    for bar, ax in ((True, axes[0]), (False, axes[1])):
        limits = found(bar)
        for servo in SERVOS:
            known = [entry for rate in RATES if (entry := limits[rate, servo]) is not None]
            rates = [entry.rate for entry in known]
            ax.plot(rates, [1e3 * entry.aware for entry in known], "o-", label=f"servo {1e3 * servo:g} ms")
            print(f"| {'with' if bar else 'without'} | {1e3 * servo:g} ms |", end="")
            for rate in RATES:
                entry = limits[rate, servo]
                cell = (
                    "too slow"
                    if entry is None
                    else f"{1e3 * entry.unaware:.0f} / "
                    + ("none" if np.isnan(entry.aware) else f"{1e3 * entry.aware:.0f}")
                )
                print(f" {cell} |", end="")
            print(flush=True)
        unaware = [1e3 * entry.unaware for entry in limits.values() if entry is not None]
        ax.axhspan(min(unaware), max(unaware), color="0.85", label="unstable, if nobody told the controller")
        ax.set(title=f"{'with' if bar else 'without'} the bar", xlabel="sensors and controller [Hz]")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("delay that keeps a disc of 0.5 [ms]")
    axes[1].legend(fontsize=8)
    figure.savefig(PICTURE, dpi=100)
    print("written", PICTURE)


if __name__ == "__main__":
    main()
