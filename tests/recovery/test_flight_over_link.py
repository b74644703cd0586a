"""A helicopter hovered and swept over the ArduPilot link: its linear response comes back from the flight."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import swashplate as sp
from heli_autopilot import HeliAutopilot
from link_bench import bench
from swashplate.flights.flight import Flight, Provenance, stream
from swashplate.identification.frequency_response import FrequencyResponse
from swashplate.identification.respond import respond
from swashplate.vehicles.catalogue import vehicle

RATE = 200
BAND = (0.5, 6.0)
SECONDS = 25.0
COLUMNS = ("p", "q", "r", "mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective", "sweep")


def chirp(seconds: float, low: float, high: float, size: float) -> Callable[[float], float]:
    """An exponential chirp with a second of fading at both ends, as ArduPilot's system identification mode flies."""
    growth = math.log(high / low)

    def value(t: float) -> float:
        if not 0.0 <= t <= seconds:
            return 0.0
        phase = 2.0 * math.pi * low * seconds / growth * (math.exp(growth * t / seconds) - 1.0)
        return size * min(1.0, t, seconds - t) * math.sin(phase)

    return value


@pytest.fixture(scope="module")
def sweeps() -> list[Flight]:
    """From rest on the ground to a hover, a roll and a pitch sweep, and what the autopilot logged of them."""
    at = bench("raptor50")
    pilot = HeliAutopilot(at.send, rate=RATE)
    pilot.fly(0.2)
    pilot.armed = pilot.interlock = True
    pilot.fly(8.0)
    pilot.height, pilot._lift = 3.0, 0.5
    pilot.fly(8.0)
    flights = []
    for axis in (0, 1):
        first = len(pilot.log)
        pilot.begin_sweep(axis, chirp(SECONDS, 0.4, 8.0, 0.08))
        pilot.fly(SECONDS + 1.0)
        rows = np.array(pilot.log[first:])
        columns = dict(zip(COLUMNS, rows[:, 1:].T, strict=True))
        units = dict.fromkeys(COLUMNS[3:], "1")
        flights.append(Flight({"rates": stream(rows[:, 0], columns, units)}, Provenance(source=f"sweep {axis}")))
        pilot.sweep = None
        pilot.fly(2.0)
    assert not at.plant.broken
    return flights


@pytest.fixture(scope="module")
def responses(sweeps: list[Flight]) -> FrequencyResponse:
    return respond(sweeps, inputs=("mixer_roll", "mixer_pitch"), outputs=("p", "q"), references=["sweep"], band=BAND)


@pytest.fixture(scope="module")
def truth() -> Callable[[np.ndarray], np.ndarray]:
    """Rates per mixer command of the linearised helicopter in free flight, with the link's half frame of hold."""
    free = vehicle("raptor50", rotor_speed="throttle")
    model = sp.linearize(free, sp.trim(free))
    full = math.radians(8.0) * 0.9  # blade pitch per mixer command: the mapping's travel, ArduPilot's 2 x 0.45
    into = np.zeros((len(model.inputs), 2))
    into[model.inputs.index("A1"), 0], into[model.inputs.index("B1"), 1] = full, -full
    seen = [model.states.index(name) for name in ("p", "q")]

    def response(omega: np.ndarray) -> np.ndarray:
        eye = np.eye(len(model.states))
        return np.array(
            [np.linalg.solve(1j * w * eye - model.A, model.B @ into)[seen] * np.exp(-0.5j * w / RATE) for w in omega]
        )

    return response


def test_the_linear_response_comes_back(
    responses: FrequencyResponse, truth: Callable[[np.ndarray], np.ndarray]
) -> None:
    expected = truth(responses.omega)
    for output, name in (("p", "mixer_roll"), ("q", "mixer_pitch")):
        o, i = responses.place(output, name)
        ratio, coherence = responses.response[:, o, i] / expected[:, o, i], responses.coherence[:, o, i]
        gain, phase = 20.0 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio))
        fast = responses.omega > 2.0 * np.pi
        assert np.median(coherence) > 0.95
        assert np.abs(gain).max() < 1.0
        assert np.abs(phase).max() < 6.0
        # Above 1 Hz loops and trim hardly mix in any more.
        assert np.abs(gain[fast]).max() < 0.2
        assert np.abs(phase[fast]).max() < 2.0


def test_the_sweep_stays_about_hover(sweeps: list[Flight]) -> None:
    """The sweep is one about hover: a linear model may be asked of it."""
    for flight in sweeps:
        assert np.abs(flight.array(("p", "q", "r"))).max() < 1.5
        assert np.abs(flight.array(("mixer_roll", "mixer_pitch"))).max() < 0.5


def test_the_roll_mode_is_fitted(responses: FrequencyResponse, truth: Callable[[np.ndarray], np.ndarray]) -> None:
    """A second-order roll response: its slow pole is the roll subsidence of the linearised helicopter."""
    fit = sp.fit_transfer_function(responses.select(("p",), ("mixer_roll",)), "0/2", input="mixer_roll")
    values = fit.models[0].values
    damping, natural = values["zeta_pole"], values["omega_pole"]
    slow = natural * (damping - math.sqrt(damping**2 - 1.0))
    free = vehicle("raptor50", rotor_speed="throttle")
    modes = np.linalg.eigvals(sp.linearize(free, sp.trim(free)).A)
    expected = min((-m.real for m in modes if abs(m.imag) < 1e-9 and m.real < -6.0), key=lambda r: abs(r - 10.0))
    assert fit.cost < 10.0
    assert slow == pytest.approx(expected, rel=0.05)
    ratio = fit.models[0].response(responses.omega) / truth(responses.omega)[:, 0, 0]
    assert np.abs(20.0 * np.log10(np.abs(ratio[responses.omega > 2.0 * np.pi]))).max() < 0.5
