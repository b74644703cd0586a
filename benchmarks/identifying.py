"""How long an identification takes: 15 parameters from 40 s of flight at 100 Hz, warm, cold, and by the paper's way.

python -m benchmarks.identifying METHOD    one identification in this process; prints seconds and peak memory as JSON
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

import numpy as np

import swashplate as sp
from benchmarks.timing import Span
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.scoring import minimise
from swashplate.identification.time.nelder_mead import minimise_squares
from swashplate.identification.time.output_error import OutputError

WARM = {"output-error": 5.0, "prediction-error": 20.0}
COLD = 60.0
MEMORY = 2.0
RATIO = 20.0


def flight() -> sp.Flight:
    """40 s with the usual sensors at 100 Hz, all four axes excited: a sweep on one alone cannot tell 15 parameters."""
    vehicle = sp.vehicle("coax")
    flown = sp.simulate_maneuver(vehicle, "multisine:roll+pitch+yaw+heave,0.3-8Hz,34s", controller=sp.hover_hold)
    return sp.observe(flown, vehicle, seed=1, sensors=sp.Sensors()).condition(rate=100.0, cutoff=0.0)


def _start() -> sp.Vehicle:
    vehicle = sp.vehicle("coax")
    return vehicle.with_values({"tau_f_upper": 1.2, "o_zeta_upper": -0.1, "linkage_lower": 0.17})


def identify(method: str, logged: sp.Flight, *, iterations: int = 60) -> float:
    """Seconds of one identification of the 15 parameters."""
    begin = time.perf_counter()
    fit = sp.identify(_start(), logged, free="full", method=method, keep_unexcited=True, iterations=iterations)
    seconds = time.perf_counter() - begin
    assert len(fit.names) == len(sp.CHOICES["full"].free)
    return seconds


def warm(method: str, logged: sp.Flight) -> Span:
    """An identification in a process that has compiled what it needs."""
    identify(method, logged, iterations=1)
    return Span(f"{method}, 15 parameters, warm", identify(method, logged), WARM[method], "second call in a process")


def cold(method: str) -> Span:
    """A new process with an empty compilation cache, imports and simulated flight included."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": folder}
        begin = time.perf_counter()
        answer = subprocess.run(
            [sys.executable, "-m", "benchmarks.identifying", method],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        )
        seconds = time.perf_counter() - begin
    memory = json.loads(answer.stdout)["peak_gib"]
    note = f"new process, nothing compiled before; peak memory {memory:.2f} GiB (promised: {MEMORY:g})"
    return Span(f"{method}, 15 parameters, cold", seconds, COLD, note, kept=memory <= MEMORY)


@dataclass
class _ParametersOnly:
    """A likelihood in which only the parameters move: what Nelder and Mead's simplex can still handle."""

    whole: OutputError

    def __post_init__(self) -> None:
        self.places = self.whole.row.places("parameter")
        self.row = type(self.whole.row)(tuple(self.whole.row.entries[i] for i in self.places))

    def _full(self, row: np.ndarray) -> np.ndarray:
        full = self.whole.row.starts()
        full[self.places] = row
        return full

    def cost(self, row: np.ndarray) -> float:
        return self.whole.cost(self._full(row))

    def refresh(self, row: np.ndarray) -> None:
        """The weights stay those of the start, as the simplex has them."""

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        cost, gradient, information = self.whole.scores(self._full(row))
        return cost, gradient[self.places], information[np.ix_(self.places, self.places)]


def nelder_mead(logged: sp.Flight) -> Span:
    """Nelder and Mead's simplex against output error: same simulator, same entries, down to the same cost.

    The simplex is stopped when it has had `RATIO` times as long, or has come as far down.
    """
    likelihood = OutputError(parameterize(_start(), "full"), records(logged, sp.vehicle("coax")))
    likelihood.refresh(likelihood.row.starts())
    only = _ParametersOnly(likelihood)
    minimise(only, iterations=2, together=True)
    begin = time.perf_counter()
    best = minimise(only, together=True)
    ours = time.perf_counter() - begin
    lowest = [np.inf]

    def told(_: int, cost: float) -> None:
        lowest[0] = cost
        if cost <= best.cost + 1.0 or time.perf_counter() - begin > RATIO * ours:
            raise StopIteration

    begin = time.perf_counter()
    minimise_squares(likelihood, progress=told)
    theirs = time.perf_counter() - begin
    above = lowest[0] - best.cost
    told_of = f"and was still {above:,.0f} above in log-likelihood" if above > 1.0 else "to the same cost"
    note = f"output error took {ours:.2f} s; the simplex took {theirs:.1f} s {told_of}"
    kept = above > 1.0 or theirs >= RATIO * ours
    return Span(f"output error to where the simplex is after {RATIO:g} times as long", ours, theirs / RATIO, note, kept)


def measure(*, short: bool) -> list[Span]:
    """The short form leaves out cold processes, the simplex, and prediction error, which compiles for half a minute."""
    logged = flight()
    if short:
        return [warm("output-error", logged)]
    return [*(warm(method, logged) for method in WARM), *(cold(method) for method in WARM), nelder_mead(logged)]


if __name__ == "__main__":
    taken = identify(sys.argv[1], flight())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(json.dumps({"seconds": taken, "peak_gib": peak}))
