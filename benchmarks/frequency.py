"""How long frequency responses and a state-space fit take."""

from __future__ import annotations

import os
import resource
import time
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from benchmarks.timing import Span
from swashplate.flights.flight import Flight, stream
from swashplate.identification.frequency_response import FrequencyResponse
from swashplate.identification.respond import respond
from swashplate.identification.state_space import StateSpaceModel
from swashplate.identification.state_space_file import structure
from swashplate.identification.state_space_fit import fit_state_space

SECONDS, RATE = 600.0, 100.0
RESPOND_WITHIN, FIT_WITHIN = 2.0, 15.0
X8_BAND, X8_WITHIN, FASTER = (0.1, 10.0), 1.0, 10.0
ROOT = Path(__file__).resolve().parent.parent


def _best(run, repeats: int) -> float:  # type: ignore[no-untyped-def]
    fastest = np.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        fastest = min(fastest, time.perf_counter() - begin)
    return fastest


def responses(*, repeats: int) -> Span:
    """Composite, conditioned responses of 4 inputs and 9 outputs, five windows, 600 s at 100 Hz."""
    random = np.random.default_rng(0)
    n = round(SECONDS * RATE)
    u = lfilter([0.2], [1.0, -0.8], random.standard_normal((n, 4)), axis=0)
    y = lfilter([0.1], [1.0, -0.9], u @ random.standard_normal((4, 9)), axis=0) + random.standard_normal((n, 9))
    columns = {f"in_{i}": u[:, i] for i in range(4)} | {f"out_{i}": y[:, i] for i in range(9)}
    flight = Flight({"uniform": stream(np.arange(n) / RATE, columns)})
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

    def run() -> None:
        found = respond(
            flight,
            inputs=[f"in_{i}" for i in range(4)],
            outputs=[f"out_{i}" for i in range(9)],
            band=(0.1, 10.0),
            bystanders=(),
        )
        assert len(found.windows) == 5

    run()
    seconds = _best(run, repeats)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - before
    note = f"{grown / 1e6:.0f} MB more at the peak, 1000 MB promised"
    return Span("responses 4 x 9, 5 windows, 600 s at 100 Hz", seconds, RESPOND_WITHIN, note)


def x8(*, repeats: int) -> list[Span]:
    """Responses of a real roll sweep (106 s at 100 Hz), and those of the package AircraftIden where it is installed.

    The package is on no index: install it from its repository (bnsgeyer/pyAircraftIden on GitHub) and run again.
    Nothing is measured where the record is missing.
    """
    file = Path(os.environ.get("SWASHPLATE_DATA", ROOT.parent / "shared" / "data")) / "x8" / "x8roll.csv"
    if not file.is_file():
        return []
    time_, command, rate = np.loadtxt(file, delimiter=",").T
    columns = {"command": command, "p": np.radians(rate)}
    flight = Flight({"uniform": stream(np.arange(time_.size) / RATE, columns, {"command": "1"})})

    def run() -> None:
        respond(flight, inputs=["command"], outputs=["p"], band=X8_BAND, bystanders=())

    run()
    seconds = _best(run, repeats)
    name = "responses of the X8's roll sweep, 106 s"
    if find_spec("AircraftIden") is None:
        return [Span(name, seconds, X8_WITHIN, "AircraftIden is not installed: not compared")]
    package = import_module("AircraftIden")
    low, high = (2.0 * np.pi * f for f in X8_BAND)
    theirs = _best(lambda: package.FreqIdenSIMO(time_, low, high, command, np.radians(rate), win_num=None), 1)
    return [
        Span(name, seconds, theirs / FASTER, f"AircraftIden takes {theirs:.2f} s; {FASTER:g} times faster promised")
    ]


def _exact(model: StateSpaceModel) -> FrequencyResponse:
    omega = 2.0 * np.pi * np.geomspace(0.05, 6.0, 100)
    random = np.random.default_rng(1)
    h = model.response(omega)
    h = h * np.exp(0.05 * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    one = np.ones(h.shape)
    return FrequencyResponse(
        omega, model.inputs, model.outputs, h, 0.9 * one, one[:, :, 0], 0.05 * one, one[:, 0], one[:, :, 0], one
    )


def fit(*, repeats: int) -> Span:
    """A 13-state fit of 40 parameters to 20 and more responses, start values 30 % off, accuracy figures included."""
    true = structure("thirteen_state")
    true = true.with_values({n: 0.1 * p.unit.count("/") or 0.05 for n, p in true.parameters.items() if not p.value})
    found = _exact(true)
    random = np.random.default_rng(2)
    start = true.with_values({n: true.parameters[n].value * (1 + 0.3 * random.choice([-1, 1])) for n in true.free})
    # Twenty responses: the strongest ones.
    order = np.argsort(-np.median(np.abs(found.response), axis=0), axis=None)[:20]
    keep = np.zeros(found.coherence.shape[1:], dtype=bool)
    keep.flat[order] = True
    found = replace(found, coherence=np.where(keep, found.coherence, 0.0))
    count = []

    def run() -> None:
        result = fit_state_space(start, found)
        count[:] = [len(result.free), len(result.targets), result.cost]

    run()
    seconds = _best(run, repeats)
    note = f"{count[0]} parameters, {count[1]} responses, J_ave {count[2]:.1f}"
    return Span("13-state fit with accuracy figures, warm", seconds, FIT_WITHIN, note)
