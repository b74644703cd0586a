"""A helicopter hovered and swept over the ArduPilot link: its linear response comes back from the autopilot's logs."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import swashplate as sp
from heli_autopilot import HeliAutopilot
from link_bench import QUICK, bench
from swashplate.cli.app import app
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import START_DELAY, Chirp
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.catalogue import vehicle

pytestmark = pytest.mark.proof
"""The acceptance trial of `make test` flies over the link as well (tests/unit/api/test_accept_autopilot.py)."""

RATE = 200
BAND = (0.5, 6.0)
SWEEPS = tuple(Chirp.planned(axis, 0.08, (0.4, 8.0), record=30.0, fade=1.0) for axis in (10, 11))
"""SID_AXIS 10 and 11: roll and pitch behind the rate controllers."""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """From rest on the ground to a hover, a roll and a pitch sweep in System ID mode, and the log of each."""
    at = bench("raptor50", engine=QUICK)
    pilot = HeliAutopilot(at.send, rate=RATE)
    pilot.wait_for_ekf()
    assert pilot.arm() == ""
    pilot.interlock = True
    pilot.fly(8.0)
    pilot.height, pilot._lift = 3.0, 0.5
    pilot.fly(8.0)
    folder, found = tmp_path_factory.mktemp("logs"), []
    for chirp in SWEEPS:
        first = len(pilot.log)
        pilot.begin_sweep(chirp.axis - 10, lambda t, c=chirp: float(c.signal(np.array([t - START_DELAY]))[0]))
        pilot.fly(START_DELAY + chirp.record + 1.0)
        found.append(folder / f"axis-{chirp.axis}.BIN")
        found[-1].write_bytes(pilot.dataflash(first, chirp))
        pilot.sweep = None
        pilot.fly(2.0)
    assert not at.plant.broken
    return found


def responded(logs: list[Path], out: Path, *outputs: str) -> FrequencyResponse:
    """`swash respond` as the how-to says it."""
    channels = ["--inputs", "mixer_roll,mixer_pitch", "--outputs", ",".join(outputs)]
    band = ["--band", "-".join(f"{f:g}" for f in BAND)]
    arguments = ["respond", *map(str, logs), *channels, *band, "--rate", str(RATE), "--out", str(out), "--quiet"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    return FrequencyResponse.load(out / "responses.nc")


@pytest.fixture(scope="module")
def responses(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> FrequencyResponse:
    return responded(logs, tmp_path_factory.mktemp("out") / "responses", "p=p_sid", "q=q_sid")


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


@pytest.mark.proof
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


def test_rates_of_the_loop_come_late_by_the_gyro_filter(
    logs: list[Path], truth: Callable[[np.ndarray], np.ndarray], tmp_path: Path
) -> None:
    """RATE.R is what the loops see, behind INS_GYRO_FILTER: a second-order low-pass at 20 Hz, 22 degrees at 5 Hz."""
    found = responded(logs, tmp_path / "out", "p", "q")
    omega = found.omega
    s = 1j * omega / (2.0 * np.pi * 20.0)
    behind = truth(omega) / (1.0 + math.sqrt(2.0) * s + s * s)[:, None, None]
    fast = omega > 2.0 * np.pi
    for output, name in (("p", "mixer_roll"), ("q", "mixer_pitch")):
        o, i = found.place(output, name)
        ratio = (found.response[:, o, i] / behind[:, o, i])[fast]
        assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 0.3
        assert np.abs(np.degrees(np.angle(ratio))).max() < 3.0
        late = np.degrees(np.angle(found.response[:, o, i] / truth(omega)[:, o, i]))
        assert late[np.argmin(np.abs(omega - 10.0 * np.pi))] == pytest.approx(-20.7, abs=2.0)


def test_the_sweep_stays_about_hover(logs: list[Path]) -> None:
    """The sweep is one about hover: a linear model may be asked of it."""
    for log in logs:
        flight: Flight = sp.read(log)
        assert np.abs(flight.array(("p", "q", "r"))).max() < 1.5
        assert np.abs(flight.array(("mixer_roll", "mixer_pitch"))).max() < 0.5


def test_the_roll_mode_is_fitted(responses: FrequencyResponse, truth: Callable[[np.ndarray], np.ndarray]) -> None:
    """A second-order roll response: its slow pole is the roll subsidence of the linearised helicopter."""
    fit = sp.fit_transfer_function(responses.select(("p",), ("mixer_roll",)), "0/2", input="mixer_roll")
    values = fit.solution[0].values
    damping, natural = values["zeta_pole"], values["omega_pole"]
    slow = natural * (damping - math.sqrt(damping**2 - 1.0))
    free = vehicle("raptor50", rotor_speed="throttle")
    modes = np.linalg.eigvals(sp.linearize(free, sp.trim(free)).A)
    expected = min((-m.real for m in modes if abs(m.imag) < 1e-9 and m.real < -6.0), key=lambda r: abs(r - 10.0))
    assert fit.cost < 10.0
    assert slow == pytest.approx(expected, rel=0.05)
    ratio = fit.solution[0].response(responses.omega) / truth(responses.omega)[:, 0, 0]
    assert np.abs(20.0 * np.log10(np.abs(ratio[responses.omega > 2.0 * np.pi]))).max() < 0.5
