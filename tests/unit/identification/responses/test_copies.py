"""Copies of channels are found, whatever their size and delay, and noise-free motion is never taken for one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.responses.copies import Copy, copies_of
from swashplate.identification.responses.respond import respond
from swashplate.identification.responses.spectra import signals

RATE, SECONDS = 100.0, 40.0
TIME = np.arange(round(SECONDS * RATE)) / RATE


def excited(kind: str, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    if kind == "sweep":
        return np.asarray(signal.chirp(TIME, 0.2, SECONDS, 8.0, method="log"))
    if kind == "doublet":
        return np.where((TIME > 5) & (TIME < 6), 1.0, 0.0) - np.where((TIME > 6) & (TIME < 7), 1.0, 0.0)
    low, high = {"hand": (0.1, 0.6), "quick hand": (0.3, 3.0)}[kind]
    band = signal.butter(2, [low, high], "band", fs=RATE, output="sos")
    return np.asarray(signal.sosfiltfilt(band, random.standard_normal(TIME.size)))


def late(u: np.ndarray, delay: float) -> np.ndarray:
    spectrum = np.fft.rfft(np.pad(u, (0, u.size)))
    turned = spectrum * np.exp(-2j * np.pi * np.fft.rfftfreq(2 * u.size, 1.0 / RATE) * delay)
    return np.asarray(np.fft.irfft(turned)[: u.size])


def found(u: np.ndarray, y: np.ndarray) -> Copy | None:
    flight = Flight({"uniform": stream(TIME, {"u": u, "y": y})}, Provenance())
    copies = copies_of(signals([flight], ["u", "y"]), {"u": 0}, {"y": 1})
    return copies[0] if copies else None


@pytest.mark.parametrize("kind", ["sweep", "doublet", "hand", "quick hand"])
@pytest.mark.parametrize("factor", [1.0, -0.37, 250.0])
def test_a_multiple_is_a_copy_even_in_single_precision(kind: str, factor: float) -> None:
    u = excited(kind, 1).astype(np.float32).astype(np.float64)
    copy = found(u, (factor * u).astype(np.float32).astype(np.float64) + 7.0)
    assert copy is not None
    assert (copy.factor, copy.delay) == (pytest.approx(factor, rel=1e-5), 0.0)


@pytest.mark.parametrize("delay", [0.01, 0.0025, 0.033, -0.1])
@pytest.mark.parametrize("kind", ["sweep", "quick hand"])
def test_a_late_multiple_is_a_copy(kind: str, delay: float) -> None:
    u = excited(kind, 2) * signal.windows.tukey(TIME.size, 0.2)
    copy = found(u, 0.5 * late(u, delay))
    assert copy is not None
    assert copy.factor == pytest.approx(0.5, rel=1e-3)
    assert copy.delay == pytest.approx(delay, abs=1e-4)


@pytest.mark.parametrize("share", [1e-3, 1e-4])
def test_what_has_something_of_its_own_is_none(share: float) -> None:
    u = excited("sweep", 3)
    own = np.random.default_rng(3).standard_normal(u.size) * share * np.std(u)
    assert found(u, u + own) is None
    assert found(u, late(u, 0.01) + own) is None


def lag(*corners: float) -> tuple[np.ndarray, np.ndarray]:
    """First-order lags of unit gain one behind the other, on the sample grid."""
    system = signal.ZerosPolesGain([], [-c for c in corners], np.prod(corners))
    made = signal.cont2discrete((system.to_tf().num, system.to_tf().den), 1.0 / RATE, method="foh")
    return made[0].ravel(), made[1]


@pytest.mark.parametrize("kind", ["sweep", "doublet", "hand", "quick hand"])
def test_noise_free_motion_is_no_copy(kind: str) -> None:
    """Fifty stable systems from 0.5 to 60 rad/s and servos down to 5 ms, without any noise: no false alarm."""
    random = np.random.default_rng(4)
    alarms = []
    u = excited(kind, 5)
    for tau in (0.005, 0.01, 0.02, 0.05):
        alarms += [tau] if found(u, signal.lfilter(*lag(1.0 / tau), u)) else []
    for _ in range(50):
        order = int(random.integers(1, 5))
        corners = np.exp(random.uniform(np.log(0.5), np.log(60.0), order))
        y = signal.lfilter(*lag(*corners), u)
        alarms += [tuple(corners)] if found(u, np.gradient(y) if random.random() < 0.3 else y) else []
    assert alarms == []


def test_what_never_moves_is_no_copy() -> None:
    assert found(excited("sweep", 6), np.zeros(TIME.size)) is None
    assert found(np.zeros(TIME.size), np.zeros(TIME.size)) is None


def flight(**channels: np.ndarray) -> Flight:
    return Flight({"uniform": stream(TIME, channels, dict.fromkeys(channels, "1"))}, Provenance(source="log"))


def test_a_reference_that_is_an_input_or_an_output_is_refused() -> None:
    u, other = excited("sweep", 7), excited("quick hand", 8)
    y = signal.lfilter(*lag(3.0), u) + 0.001 * other
    log = flight(stick=u, out=y, sweep=2.0 * u, target=-late(y, 0.02), free=0.3 * u + other)
    ask = {"inputs": ["stick"], "outputs": ["out"], "band": (0.3, 6.0)}
    for name, words in (("sweep", "'stick' is a copy of 'sweep' times 0.5"), ("target", "'out' is a copy of 'target'")):
        with pytest.raises(FlightError, match=words):
            respond(log, references=[name], **ask)
    assert respond(log, references=["free"], **ask).method == "joint"


def test_an_output_that_is_a_copy_has_no_number_and_the_others_keep_theirs() -> None:
    u = excited("sweep", 9)
    out = signal.lfilter(*lag(3.0), u)
    # A lag of first order without noise tells its input, as a controller's answer does (decision 155, known misses).
    out = out + 0.1 * out.std() * np.random.default_rng(1).standard_normal(u.size)
    log = flight(stick=u, echo=0.8 * u, out=out)
    found = respond(log, inputs=["stick"], outputs=["echo", "out"], band=(0.3, 6.0))
    assert np.isnan(found.response[:, 0]).all()
    assert found.band("out", "stick") is not None
    assert found.problems == ()
    assert any("echo / stick: 'echo' is a copy of 'stick' times 0.8" in text for text in found.warnings)
    alone = respond(log, inputs=["stick"], outputs=["echo"], band=(0.3, 6.0))
    assert any("'echo' is a copy of 'stick'" in text for text in alone.problems)
