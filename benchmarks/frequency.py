"""How long reading a log, frequency responses and a state-space fit take."""

from __future__ import annotations

import contextlib
import io
import os
import resource
import time
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

from benchmarks.timing import Span
from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers.read import read
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.transfer_function_fit import TransferFunctionFit, fit_transfer_function
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure

SECONDS, RATE = 600.0, 100.0
READ_WITHIN, RESPOND_WITHIN, FIT_WITHIN = 1.0, 2.0, 15.0
X8_BAND, X8_WITHIN, FASTER = (0.25 / np.pi, 25.0 / np.pi), 1.0, 10.0
"""Hz: 0.5 to 50 rad/s, as in the example of AircraftIden for this record."""
X8_FORM, X8_FITTED = "2/4", (1.0 / np.pi, 10.0 / np.pi)
"""Form, and band of the fit [Hz]: 2 to 20 rad/s as there."""
ROOT = Path(__file__).resolve().parent.parent


def _data() -> Path:
    """The folder of real flights; it may be missing."""
    return Path(os.environ.get("SWASHPLATE_DATA", ROOT.parent / "shared" / "data"))


def _best(run, repeats: int) -> float:  # type: ignore[no-untyped-def]
    fastest = np.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        fastest = min(fastest, time.perf_counter() - begin)
    return fastest


def responses(*, repeats: int, length: float = SECONDS) -> Span:
    """Composite, conditioned responses of 4 inputs and 9 outputs, five windows, `length` [s] at 100 Hz."""
    random = np.random.default_rng(0)
    n = round(length * RATE)
    u = lfilter([0.2], [1.0, -0.8], random.standard_normal((n, 4)), axis=0)
    y = lfilter([0.1], [1.0, -0.9], u @ random.standard_normal((4, 9)), axis=0) + random.standard_normal((n, 9))
    columns = {f"in_{i}": u[:, i] for i in range(4)} | {f"out_{i}": y[:, i] for i in range(9)}
    flight = Flight({"uniform": stream(np.arange(n) / RATE, columns)})
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

    def run() -> None:
        measured = respond(
            flight,
            inputs=[f"in_{i}" for i in range(4)],
            outputs=[f"out_{i}" for i in range(9)],
            band=(0.1, 10.0),
            bystanders=(),
        )
        assert len(measured.windows) == 5

    run()
    seconds = _best(run, repeats)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - before
    note = f"{grown / 1e6:.0f} MB more at the peak, 1000 MB promised"
    return Span(f"responses 4 x 9, 5 windows, {length:g} s at 100 Hz", seconds, RESPOND_WITHIN, note)


def reading(*, repeats: int) -> list[Span]:
    """A real log of ArduPilot; nothing is measured where it is missing."""
    file = _data() / "ardupilot_sitl" / "heli_sid_roll_mix.BIN"
    if not file.is_file():
        return []
    read(file)  # imports are not counted
    seconds = _best(lambda: read(file), repeats)
    return [Span("a log of ArduPilot read", seconds, READ_WITHIN, f"{file.stat().st_size / 1e6:.1f} MB")]


def x8(*, repeats: int) -> list[Span]:
    """Responses and a transfer function of a real roll sweep (106 s at 100 Hz), beside AircraftIden where it is there.

    That package is on no index: put its folder AircraftIden from GitHub (responses: xuhao1/pyAircraftIden, the fit:
    bnsgeyer/pyAircraftIden) on the path, with sympy, and run again. Both get its windows and as many frequencies as it
    takes, and the fit is that of its own example. Nothing is measured where the record is missing.
    """
    file = _data() / "x8" / "x8roll.csv"
    if not file.is_file():
        return []
    time_, command, degrees = np.loadtxt(file, delimiter=",").T
    rate = np.radians(degrees)
    own = Flight({"uniform": stream(np.arange(time_.size) / RATE, {"command": command, "p": rate}, {"command": "1"})})
    asked = {"inputs": ["command"], "outputs": ["p"], "band": X8_BAND, "bystanders": ()}
    measured = respond(own, **asked)  # type: ignore[arg-type]
    seconds = _best(lambda: respond(own, **asked), repeats)  # type: ignore[arg-type]

    def fitted() -> TransferFunctionFit:
        return fit_transfer_function(measured, X8_FORM, input="command", band=X8_FITTED)

    cost = fitted().cost
    fitting = _best(fitted, repeats)
    names = "responses of the X8's roll sweep, 106 s", "transfer function of the X8, two zeros over four poles"
    if find_spec("AircraftIden") is None:
        missing = "AircraftIden is not installed: not compared"
        return [
            Span(names[0], seconds, X8_WITHIN, missing),
            Span(names[1], fitting, X8_WITHIN, f"J {cost:.1f}; {missing}"),
        ]
    theirs, peer = _peer_responses(time_, command, rate)
    windows = [each.per_win_time for each in peer.composes[0].specturmAnallist]
    count = len(peer.get_freq_iden(0)[0])
    lines = round(count / np.log10(X8_BAND[1] / X8_BAND[0]))
    alike = _best(lambda: respond(own, **asked, windows=windows, overlap=0.5, lines=lines), repeats)  # type: ignore[arg-type]
    told = f"AircraftIden takes {theirs:.2f} s, {theirs / alike:.1f} times as long; {FASTER:g} times promised"
    spans = [Span(f"{names[0]}, {len(windows)} windows and {count} lines", alike, theirs / FASTER, told)]
    one, reached = _peer_fit(peer)
    told = f"J {cost:.1f}; one random start of AircraftIden takes {one:.2f} s and ends at J {reached:.1f}"
    return [*spans, Span(names[1], fitting, one / FASTER, told)]


def _peer_responses(time_: Array, command: Array, rate: Array) -> tuple[float, Any]:
    """How long AircraftIden takes for its composite of five windows, and what it made."""
    package, made = import_module("AircraftIden"), []
    low, high = (2.0 * np.pi * f for f in X8_BAND)
    with contextlib.redirect_stdout(io.StringIO()):
        seconds = _best(
            lambda: made.append(package.FreqIdenSIMO(time_, low, high, command, rate, win_num=None)),
            1,
        )
    return seconds, made[0]


def _peer_fit(peer: Any) -> tuple[float, float]:
    """Seconds and cost of one of the random starts that AircraftIden's example makes up to 300 of."""
    package, sympy = import_module("AircraftIden"), import_module("sympy")
    a, b, c, d, e, f, tau, s = sympy.symbols("a b c d e f tau s")
    model = package.TransferFunctionParamModel(f * s * s, a * s**4 + b * s**3 + c * s * s + d * s + e, tau)
    np.random.seed(1)  # the package draws from the global generator
    with contextlib.redirect_stdout(io.StringIO()):
        fitter = package.TransferFunctionFit(*peer.get_freq_iden(0)[:3], model, nw=20)
        fitter.init_omg_list(*(2.0 * np.pi * f for f in X8_FITTED))
        begin = time.perf_counter()
        _, cost = fitter.solve()
    return time.perf_counter() - begin, float(cost)


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
    measured = _exact(true)
    random = np.random.default_rng(2)
    start = true.with_values({n: true.parameters[n].value * (1 + 0.3 * random.choice([-1, 1])) for n in true.free})
    # Twenty responses: the strongest ones.
    order = np.argsort(-np.median(np.abs(measured.response), axis=0), axis=None)[:20]
    keep = np.zeros(measured.coherence.shape[1:], dtype=bool)
    keep.flat[order] = True
    measured = replace(measured, coherence=np.where(keep, measured.coherence, 0.0))
    count = []

    def run() -> None:
        result = fit_state_space(start, measured)
        count[:] = [len(result.names), len(result.targets), result.cost]

    run()
    seconds = _best(run, repeats)
    note = f"{count[0]} parameters, {count[1]} responses, J_ave {count[2]:.1f}"
    return Span("13-state fit with accuracy figures, warm", seconds, FIT_WITHIN, note)
