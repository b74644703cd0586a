"""How long an identification takes: 15 parameters from 40 s of flight at 100 Hz, warm, cold, and by the paper's way.

python -m benchmarks.identifying METHOD    one identification in this process; prints its seconds as JSON
python -m benchmarks.identifying RIVAL     scipy: its row as JSON
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import swashplate as sp
from benchmarks.timing import Span
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.scoring import Solver, minimise
from swashplate.identification.time.output_error import OutputError
from swashplate.models.coax_choices import CHOICES

WARM = {"output-error": 5.0, "filter-error": 12.0}
COLD = 60.0
FIRST = {
    "identify, cold": 10.0,
    "identify, warm": 4.0,
    "validate, cold": 6.0,
    "validate, warm": 6.0,
    "identify helicopter, cold": 20.0,
    "identify helicopter, warm": 12.0,
    "control design, cold": 1.55,
    "control design, warm": 2.0,
    "control check, cold": 3.9,
    "control check, warm": 4.0,
}
"""Seconds of processor time of whole commands, from the start of the program to its report."""
FIRST_MEMORY = 0.8
REPORT = 1.0
START = {"tau_f_upper": 1.2, "o_zeta_upper": -0.1, "linkage_lower": 0.17}
"""Numbers that fits begin with."""
MEMORY = 2.0
RATIO = 20.0


def flight(seconds: float = 34.0) -> sp.Flight:
    """A maneuver of so long and 3 s on either side, usual sensors at 100 Hz.

    All four axes are excited: a sweep on one alone cannot tell 15 parameters.
    """
    vehicle = sp.vehicle("coax")
    maneuver = f"multisine:roll+pitch+yaw+heave,0.3-8Hz,{seconds:g}s"
    flown = sp.simulate(vehicle, maneuver, controller=sp.hover_hold)
    return sp.observe(flown, vehicle, seed=1, sensors=sp.Sensors()).condition(rate=100.0, cutoff=0.0)


def _start() -> sp.Vehicle:
    return sp.vehicle("coax").with_values(START)


def identify(method: str, logged: sp.Flight, *, iterations: int = 60) -> float:
    """Seconds of one identification of the 15 parameters."""
    begin = time.perf_counter()
    fit = sp.identify(_start(), logged, free="full", method=method, keep_unexcited=True, iterations=iterations)
    seconds = time.perf_counter() - begin
    assert len(fit.names) == len(CHOICES["full"].free)
    return seconds


def warm(method: str, logged: sp.Flight, *, iterations: int = 60) -> Span:
    """An identification in a process that has compiled what it needs."""
    identify(method, logged, iterations=1)
    seconds = identify(method, logged, iterations=iterations)
    return Span(f"{method}, 15 parameters, warm", seconds, WARM[method], "second call in a process")


def cold(method: str) -> Span:
    """A new process with an empty compilation cache, imports and simulated flight included."""
    with tempfile.TemporaryDirectory() as folder:
        used, _ = spent(["-m", "benchmarks.identifying", method], {**os.environ, "JAX_COMPILATION_CACHE_DIR": folder})
    seconds, memory = used["clock"], used["peak_gib"]
    note = f"new process, nothing compiled before; peak memory {memory:.2f} GiB (promised: {MEMORY:g})"
    return Span(f"{method}, 15 parameters, cold", seconds, COLD, note, kept=memory <= MEMORY)


def commands(folder: Path, own: Path) -> dict[str, list[str]]:
    """Words of commands about a folder's flight that read and write in `own`, each what later ones need."""
    seen = ["--flight", str(folder / "flight.parquet")]
    law = str(own / "law.toml")
    fit = ["--vehicle", str(own / "start.toml"), *seen, "--keep-unexcited", "--out", str(own / "fit")]
    return {
        "identify": ["identify", *fit],
        "validate": ["validate", "--vehicle", str(own / "fit" / "model.toml"), *seen, "--out", str(own / "judged")],
        "control design": ["control", "design", "coax", "--out", law],
        "control check": ["control", "check", "coax", "--controller", law, "--out", str(own / "check")],
    }


def first_answers(logged: sp.Flight) -> list[Span]:
    """`swash identify`, `validate`, `control design` and `check` as a user calls them, nothing compiled, then again.

    Of a CoaX, and `identify` of a helicopter (the docs' Raptor 50), whose equations find roots.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        logged.save(folder / "flight.parquet")
        _start().save(folder / "start.toml")
        fly = ["--maneuver", "multisine:roll+pitch,0.6-5Hz,20s,0.02", "--sensors", "clean"]
        flown = ["--vehicle", "raptor50", "--flight", str(folder / "heli.nc"), "--free", "rotor"]
        asked = {**commands(folder, folder), "identify helicopter": ["identify", *flown, "--out", str(folder / "heli")]}
        _swash(["simulate", "--vehicle", "raptor50", *fly, "--out", str(folder / "heli.nc")], folder / "flying")
        spans = []
        for what, words in asked.items():
            for state in ("cold", "warm"):  # a cache of its own: as if nothing had been compiled before
                used = _swash(words, folder / what.replace(" ", "-"))
                took, memory = used["processor"], used["peak_gib"]
                told_of = f"peak {memory:.2f} GiB (promised: {FIRST_MEMORY:g})"
                note = f"processor time, {used['clock']:.1f} s by the clock; {told_of}"
                told = f"{what}, {state}"
                spans.append(Span(f"swash {told}", took, FIRST[told], note, kept=memory <= FIRST_MEMORY))
    return spans


def _swash(words: list[str], cache: Path) -> dict[str, float]:
    """What a command of ours used, with its own cache."""
    environment = {k: v for k, v in os.environ.items() if k not in ("XLA_FLAGS", "JAX_COMPILATION_CACHE_DIR")}
    return spent(["-m", "swashplate", *words], {**environment, "XDG_CACHE_HOME": str(cache)})[0]


def spent(words: list[str], environment: dict[str, str]) -> tuple[dict[str, float], str]:
    """What Python with some arguments used (see benchmarks/used.py), and what it said."""
    measuring = [sys.executable, str(Path(__file__).with_name("used.py"))]
    command = [*measuring, sys.executable, *words]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, f"{' '.join(words[:4])} ended with {run.returncode}: {run.stderr[-2000:]}"
    return json.loads(run.stdout), run.stderr


def scipy_least_squares(logged: sp.Flight) -> Span:
    """SciPy's least squares with finite differences against output error: same simulator, entries and weights.

    It is stopped when it has had `RATIO` times as long, or has come as far down.
    """
    likelihood = OutputError(parameterize(_start(), "full"), records(logged, sp.vehicle("coax")))
    likelihood.refresh(likelihood.row.starts())
    minimise(likelihood, Solver(iterations=2, together=True))
    begin = time.process_time()
    best = minimise(likelihood, Solver(together=True))
    ours = time.process_time() - begin
    likelihood.refresh(best.row)  # both by the weights of the optimum
    white = np.linalg.inv(np.linalg.cholesky(likelihood.covariance)).T
    lowest, begin = [np.inf], time.process_time()

    def errors(row: np.ndarray) -> np.ndarray:
        whitened = (np.asarray(likelihood.residuals(row)[0]) @ white).ravel()
        lowest[0] = min(lowest[0], 0.5 * float(whitened @ whitened))
        if lowest[0] <= aim + 1.0 or time.process_time() - begin > RATIO * ours:
            raise StopIteration
        return whitened

    aim = -np.inf
    at_best = (np.asarray(likelihood.residuals(best.row)[0]) @ white).ravel()
    aim = 0.5 * float(at_best @ at_best)
    with suppress(StopIteration):
        least_squares(errors, likelihood.row.starts(), x_scale="jac", method="trf")
    theirs, above = time.process_time() - begin, lowest[0] - aim
    told_of = f"and was still {above:,.0f} above in half the sum of squares" if above > 1.0 else "to the same cost"
    note = f"processor time; output error took {ours:.2f} s, SciPy by finite differences took {theirs:.1f} s {told_of}"
    return Span("output error beside SciPy's least squares", ours, WARM["output-error"], note)


RIVALS = {"scipy": scipy_least_squares}
"""Each against output error: `python -m benchmarks.identifying NAME`."""


def beside(rival: str) -> Span:
    """A rival's row from a process of its own, for its peak memory."""
    used, said = spent(["-m", "benchmarks.identifying", rival], dict(os.environ))
    row = json.loads(said.splitlines()[-1])
    note = f"{row['note']}; peak of both in one process {used['peak_gib']:.2f} GiB"
    return Span(row["name"], row["seconds"], row["target"], note, row["kept"])


def reports(logged: sp.Flight) -> list[Span]:
    """The page of a fit and the page of a validation, by the clock, the first of their process."""
    fit = sp.identify(_start(), logged, free="full", method="filter-error", keep_unexcited=True)
    pages = {"an identification": fit, "a validation": sp.validate(fit.model, logged)}
    spans = []
    with tempfile.TemporaryDirectory() as folder:
        for what, result in pages.items():
            path, begin = Path(folder) / "report.html", time.perf_counter()
            sp.report(result, path=path)
            seconds = time.perf_counter() - begin
            spans.append(Span(f"report of {what}", seconds, REPORT, f"{path.stat().st_size / 1e6:.1f} MB"))
    return spans


def measure(*, short: bool) -> list[Span]:
    """The short form fits a short flight by filter error alone."""
    if short:
        return [warm("filter-error", flight(4.0), iterations=1)]
    logged = flight()
    return [
        *first_answers(logged),
        *(warm(method, logged) for method in WARM),
        *(cold(method) for method in WARM),
        *map(beside, RIVALS),
        *reports(logged),
    ]


if __name__ == "__main__":
    asked = sys.argv[1]
    print(json.dumps(RIVALS[asked](flight()).as_json() if asked in RIVALS else {"seconds": identify(asked, flight())}))
