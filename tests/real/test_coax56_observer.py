"""The observer on the CoaX's real flights, open loop: near-white innovations, rates better predicted than by the model.

Model, delays, lever arm and disturbances are what the August flight taught (docs/real-flights.md; the disturbing forces
by the likelihood of its innovations, which slower and larger ones explain better than the fit's 0.38 s); the July
flight is seen by that model for the first time, with its own delays and lever arm.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.control.lqg.design import design
from swashplate.control.lqg.observer_log import Along, along, at_centre
from swashplate.filtering.disturbances import Unrest
from swashplate.filtering.sensor_suite import suite
from swashplate.validation.innovations import check

LEARNT = {
    "inertia_zz": 0.00029446,
    "hub_stiffness_upper": 0.175423,
    "linkage_lower": 0.207457,
    "tau_f_upper": 1.14014,
    "tau_f_lower": 0.02,
    "o_zeta_upper": -0.313976,
    "o_zeta_lower": 0.260943,
    "a_alpha_u_linear": 0.014877,
    "a_alpha_v_linear": 0.0347884,
    "a_alpha_p_linear": 0.0163857,
    "a_beta_u_linear": 0.0347884,
    "a_beta_v_linear": 0.014877,
    "a_beta_q_linear": 0.0163857,
    "tau_drive_upper": 0.20087,
    "tau_drive_lower": 0.109363,
    "damping_w": 0.229359,
    "damping_r": 0.00338003,
    "gyroscopic": 0.364268,
    "bar_heading_transport": 1.0,
}
DISTURBED = Unrest(
    force=0.4,
    force_down=0.2,
    moment=3.0,
    moment_yaw=15.6,
    force_time=1.0,
    moment_time=0.698,
    jolt=0.019,
    twist=0.30,
    twist_yaw=0.64,
)


def observed(path: Path, *, servo: float, motor: float, lever: tuple[float, float, float], heading: float) -> Along:
    flight = sp.read(path).condition(rate=100.0, cutoff=0.0)
    piece = max(flight.split(), key=lambda part: part.duration)
    camera = replace(suite("mocap@33.3333333333+0ms")[0], sigma=(7e-5, 7e-5, 1.5e-4, 5e-4, 5e-4, 5e-4))
    delays = {"servo_roll": servo, "servo_pitch": servo, "motor_lower": motor, "motor_upper": motor}
    model = sp.vehicle("coax").with_values(LEARNT)
    observer = design(model, sensors=(camera,), rate=100.0, delays=delays, unrest=DISTURBED)
    return along(observer, piece, at_centre(piece, lever=lever, heading=heading))


@pytest.fixture(scope="module")
def august(flight_august: Path) -> Along:
    return observed(flight_august, servo=0.03, motor=0.06, lever=(-0.001, 0.190, 0.013), heading=-0.105)


@pytest.fixture(scope="module")
def july(flight_july: Path) -> Along:
    return observed(flight_july, servo=0.07, motor=0.09, lever=(0.005, 0.165, 0.009), heading=-0.076)


@pytest.mark.parametrize("name", ["august", pytest.param("july", marks=pytest.mark.proof)])
def test_rates_are_predicted_better_than_by_the_raw_model(name: str, request: pytest.FixtureRequest) -> None:
    """A tenth of a second ahead; roll and pitch rate also far better than calling them zero."""
    found: Along = request.getfixturevalue(name)
    for axis, (by_observer, by_model, size) in found.rms().items():
        assert by_observer < 0.8 * by_model, (axis, found.rms())
        if axis != "r":
            assert by_observer < 0.7 * size, (axis, found.rms())


@pytest.mark.parametrize(
    ("name", "tilt", "height"), [("august", 0.18, 0.3), pytest.param("july", 0.30, 0.65, marks=pytest.mark.proof)]
)
def test_innovations_are_near_white(name: str, tilt: float, height: float, request: pytest.FixtureRequest) -> None:
    """Largest correlation over 20 lags (white: 0.08 and 0.11) and sizes.

    Roll and pitch are near white in both; July's height is not. That is no noise: the height loop rings at 2.8 Hz
    (coherent with both motors' commands by 0.87 there, 0.17 in August), and July's rotors answer more than August's
    model says; the battery's voltage was not logged.
    """
    along_it: Along = request.getfixturevalue(name)
    names = ("x", "y", "z", "phi", "theta", "psi")
    found = {entry.channel: entry for entry in check(along_it.innovations, along_it.covariance, names)}
    for axis in ("phi", "theta"):
        assert found[axis].whiteness < tilt, found[axis]
        assert 0.3 < found[axis].consistency < 1.5, found[axis]
    assert found["z"].whiteness < height, found["z"]
    assert 0.5 < found["z"].consistency < 1.0, found["z"]
    assert all(entry.whiteness < 0.4 for axis, entry in found.items() if axis != "z"), found
    assert all(0.1 < entry.consistency < 2.0 for entry in found.values()), found
    assert np.all(np.isfinite(along_it.estimates))
