"""Do the bounds of a real flight's fit cover the truth? Its model flown in simulation, and identified again.

    python research/simulated_counterpart.py august|july [SEEDS]

18 s under a hover hold with small multisines in all axes, in still air and in gusts of wind (0.1 m/s per axis), without
and with the line of the upper rotor in height and attitude that the cameras see. By likelihood, by errors ahead as
on the page of the real flights, and by likelihood with a wind. What it says is in docs/explanation/what-to-trust.md and
real-flights.md. Ten seconds a fit, three quarters of a minute with a wind.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from flights import CHOICE, FLIGHTS, HORIZON
from scipy.signal import lfilter

import swashplate as sp
from swashplate.models.vehicle import Vehicle

SEEN = {"phi": (1.4e-3, 0.0), "theta": (1.4e-3, 0.5 * np.pi), "z": (2e-4, 1.0)}
"""The upper rotor's line in what is measured: rms [rad, m] and phase [rad]; roll + i pitch turns as the rotor does."""
CRITERIA: dict[str, dict[str, Any]] = {"likelihood": {}, "ahead": {"horizon": HORIZON}, "with a wind": {"wind": True}}
FLOWN = "multisine:roll+pitch+yaw+heave,0.3-4Hz,18s,0.05"


def flight(aircraft: Vehicle, *, gusts: float, line: bool, seed: int) -> sp.Flight:
    """Twenty seconds as motion capture logs them, conditioned."""
    wind = lfilter([1.0], [1.0, -0.99], gusts * np.random.default_rng(100 + seed).standard_normal((2, 2001)))
    flown = sp.simulate(aircraft, FLOWN, controller=sp.hover_hold, lead=1, tail=1, wind=(*wind, 0.0))
    seen = sp.observe(flown, aircraft, sensors=sp.QUIET, seed=seed).condition(rate=100.0, cutoff=0.0)
    streams, turning = dict(seen.streams), flown.time("omega_upper")
    turned = np.cumsum(flown.values("omega_upper")) * float(np.median(np.diff(turning)))
    for name, (rms, phase) in SEEN.items() if line else ():
        at = seen.stream_of(name)
        wave = rms * np.sqrt(2.0) * np.sin(np.interp(seen.time(name), turning, turned) + phase)
        streams[at] = streams[at].assign({name: streams[at][name] + wave})
    return replace(seen, streams=streams)


def main(name: str, seeds: int) -> int:
    coax = sp.vehicle("coax")
    how = {"free": CHOICE, "keep_unexcited": True}
    real = sp.read(FLIGHTS[name]).condition(rate=100.0, cutoff=0.0)
    learnt = sp.identify(coax, real, horizon=HORIZON, **how).model.card.values()
    aircraft = coax.with_values({name: value for name, value in learnt.items() if name in coax.card.parameters})
    print("| wind | rotor line | criterion | within 2 sigmas | of | farthest |\n| --- | --- | --- | --- | --- | --- |")
    for gusts, line in ((0.0, False), (0.0, True), (0.015, False), (0.015, True)):
        seen = [flight(aircraft, gusts=gusts, line=line, seed=seed) for seed in range(1, seeds + 1)]
        for criterion, asked in CRITERIA.items():
            apart: dict[str, list[float]] = {}
            for one in seen:
                for e in sp.identify(coax, one, **asked, **how).estimates:
                    if not e.tie:
                        apart.setdefault(e.name, []).append((e.value - learnt[e.name]) / e.sigma_corrected)
            share = 100.0 * float(np.mean(np.abs(list(apart.values())) < 2.0))
            worst = sorted(apart, key=lambda name: -float(np.mean(np.abs(apart[name]))))[:3]
            told = ", ".join(f"`{name}` {np.mean(apart[name]):+.1f}" for name in worst)
            words = ("gusts" if gusts else "none", "yes" if line else "no", criterion)
            print(f"| {' | '.join(words)} | {share:.0f} % | {len(apart) * seeds} | {told} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 2))
