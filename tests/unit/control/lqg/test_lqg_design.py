"""Regulators, filters, delays and margins from linear algebra, and what cannot be held or seen said by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swashplate.control.analysis.margins import promised_disc
from swashplate.control.analysis.stability import loop_modes
from swashplate.control.kinds import load_controller, save_controller
from swashplate.control.lqg.analysis import analyse
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.design import design
from swashplate.control.lqg.file import lqg_document, lqg_from
from swashplate.control.lqg.optimal import DISC, regulator, steady_filter, total_delays, unreached, unseen
from swashplate.control.lqg.steady_loop import Watched, crossovers, response
from swashplate.errors import ControllerError
from swashplate.filtering.sensor_suite import suite
from swashplate.models.catalogue import vehicle
from swashplate.simulation.discretisation import with_late_inputs, zero_order_hold
from swashplate.simulation.linearize import linearize

SENSORS = "gyro@100,mocap@50+20ms"


@pytest.fixture(scope="module")
def made() -> Lqg:
    return design(vehicle("coax"), sensors=suite(SENSORS), rate=100.0, delays=0.02)


# ---- linear algebra ------------------------------------------------------------------------------------------------
def test_a_scalar_regulator_and_filter_have_their_closed_forms() -> None:
    """x+ = a x + u: P = q + a^2 P r / (P + r), K = a P / (P + r); the filter is its dual."""
    a, q, r = 1.2, 0.7, 0.3
    b = a * a * r - r + q
    P = 0.5 * (b + np.sqrt(b * b + 4.0 * q * r))
    one = np.ones((1, 1))
    K = regulator(a * one, one, q * one, r * one, ["x"], scale=np.ones(1), where="toy")
    assert K[0, 0] == pytest.approx(a * P / (P + r), rel=1e-12)
    L, found = steady_filter(a * one, one, q * one, r * one, ["x"], scale=np.array([3.0]), where="toy")
    assert found[0, 0] == pytest.approx(P, rel=1e-9)
    assert L[0, 0] == pytest.approx(P / (P + r), rel=1e-9)


def test_a_response_is_that_of_its_matrices_and_none_at_a_pole() -> None:
    rng = np.random.default_rng(3)
    A, B, C, D = (rng.standard_normal(shape) for shape in ((6, 6), (6, 2), (3, 6), (3, 2)))
    z = np.exp(1j * np.array([0.1, 1.0, 3.0]))
    expected = [C @ np.linalg.solve(value * np.eye(6) - A, B) + D for value in z]
    np.testing.assert_allclose(response(z, A, B, C, D), expected, rtol=1e-12)
    with pytest.raises(np.linalg.LinAlgError, match="pole"):
        response(np.array([1.0 + 0j]), np.diag([1.0, 0.5]), np.eye(2), np.eye(2), None)


def test_late_inputs_are_states() -> None:
    """A simulation with a queue gives what the larger model gives."""
    F, G = zero_order_hold(np.array([[0.0, 1.0], [-4.0, -0.3]]), np.array([[0.0, 0.2], [1.0, 0.0]]), 0.05)
    larger, entering, added = with_late_inputs(F, G, (3, 0))
    assert added == ((0, 1), (0, 2), (0, 3))
    commands = np.random.default_rng(0).standard_normal((30, 2))
    x, whole = np.zeros(2), np.zeros(5)
    for k, now in enumerate(commands):
        late = commands[k - 3, 0] if k >= 3 else 0.0
        x = F @ x + G @ np.array([late, now[1]])
        whole = larger @ whole + entering @ now
        np.testing.assert_allclose(whole[:2], x, atol=1e-12)


def test_directions_that_nothing_reaches_or_sees_are_named() -> None:
    F = np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.1]])
    scale = np.array([2.0, 1.0, 5.0])
    assert not unseen(F, np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), "abc", scale=scale)
    (hidden,) = unseen(F, np.array([[1.0, 0.0, 0.0]]), "abc", scale=scale)
    assert str(hidden) == "c"
    assert hidden.mode == pytest.approx(1.1)
    (lost,) = unreached(F, np.array([[0.0], [1.0], [0.0]]), "abc", scale=scale)
    assert str(lost) == "c"
    with pytest.raises(ControllerError, match=r"toy: no input moves c \(mode z = 1.1000\): it cannot be stabilised"):
        regulator(F, np.array([[0.0], [1.0], [0.0]]), np.eye(3), np.eye(1), "abc", scale=scale, where="toy")
    with pytest.raises(ControllerError, match="state weights: have shape"):
        regulator(F, np.eye(3), np.eye(2), np.eye(3), "abc", scale=scale, where="toy")


# ---- design --------------------------------------------------------------------------------------------------------
def test_the_linear_loop_is_the_nonlinear_ones_slope(made: Lqg) -> None:
    """Modes from linear algebra against the differentiated map of the flying loop, delays and all."""
    coax = vehicle("coax")
    fed = design(coax, rate=100.0, delays=0.02)
    modes = analyse(fed).modes
    flown = loop_modes(coax, fed, fed.start)
    for mode in modes:
        assert np.min(np.abs(np.exp(flown / 100.0) - np.exp(mode / 100.0))) < 1e-4


def test_margins_and_spread(made: Lqg) -> None:
    found = analyse(made)
    assert found.modes[0].real < -0.01
    assert found.margins.together.alpha > 0.4
    assert {a.name for a in found.margins.axes} == set(made.vehicle.input_names)
    assert all(np.degrees(a.phase) > 35.0 for a in found.margins.axes)
    assert 0.02 < found.spread["x"] < 0.1
    assert found.uncertainty["eta_bar"] == pytest.approx(0.0064, rel=0.1)


def test_a_place_is_held_as_tightly_as_delays_and_margins_allow(made: Lqg) -> None:
    """One step tighter would cross too high or stand less than 45 degrees; what was said is not changed."""
    share = float(made.feedback.reach) / float(made.feedback.reach_down)
    assert 0.1 < share < 1.0
    kept = {name: share * allowed for name, allowed in (("x", 0.3), ("y", 0.3))}
    found = analyse(made).margins
    assert found.together.alpha >= DISC - 0.01
    loop = Watched(made.plan, made.numbers, linearize(made.vehicle, made.start), place=True)
    wide = design(made.vehicle, sensors=suite(SENSORS), rate=100.0, delays=0.02, allowed={"x": 0.3, "y": 0.3})
    assert float(wide.feedback.reach) == float(wide.feedback.reach_down)
    (w, S), (_, S_wide) = (loop.sensitivities(np.asarray(c.feedback.gains)[0]) for c in (made, wide))
    most = np.maximum(1.0 / (3.0 * total_delays(made.plan)), 1.02 * crossovers(w, S_wide))
    assert np.all(crossovers(w, S) <= most)
    assert promised_disc(S) >= DISC
    said = {name: 0.84 * value for name, value in kept.items()}
    sums = dict.fromkeys(("sum_ahead", "sum_right"), 0.84 * share * 0.6)
    tighter = design(made.vehicle, sensors=suite(SENSORS), rate=100.0, delays=0.02, allowed={**said, **sums})
    w, S = loop.sensitivities(np.asarray(tighter.feedback.gains)[0])
    assert promised_disc(S) < DISC or np.any(crossovers(w, S) > most)
    strays, strayed = (analyse(controller).spread["x"] for controller in (made, wide))
    assert strays < 0.85 * strayed


def test_a_controller_comes_back_from_its_file(made: Lqg, tmp_path: Path) -> None:
    path = tmp_path / "lqg.toml"
    save_controller(made, path)
    again = load_controller(path)
    assert isinstance(again, Lqg)
    assert again.plan == made.plan
    np.testing.assert_allclose(again.memory_of_law(), made.memory_of_law(), atol=1e-15)
    text = path.read_text()
    for change, said in (
        (('kind = "gyro"', 'kind = "nose"'), "'nose' is no sensor"),
        (("battery = [", "battery = [\n    1.0,"), r"feedback.battery: has shape \(5,\), expected \(4,\)"),
        (("jolt = ", "jilt = "), r"unrest\.jilt: is not known here"),
    ):
        assert change[0] in text
        path.write_text(text.replace(*change, 1))
        with pytest.raises(ControllerError, match=said):
            load_controller(path)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"sensors": suite("mocap@10"), "rate": 20.0}, r"20 Hz is too slow for the mode -0.872 \+- 9.99j 1/s \(phi"),
        ({"sensors": suite("imu@70")}, "imu: gives 70 readings per second; the controller's 100 Hz is no whole"),
        ({"Q": np.eye(3)}, "state weights: are for 3 of 22: x, y, z"),
        ({"R": [1.0, 2.0]}, "input weights: are for 2 of 4: motor_lower"),
        ({"allowed": {"q": 0.0}}, "must be above zero"),
        ({"allowed": {"foo": 1.0}}, "is not a state: foo"),
        ({"delays": {"rudder": 0.1}}, "rudder: expected motor_lower"),
        ({"speeds": (0.0, 1.0)}, "a place is held in hover only"),
    ],
)
def test_bad_designs_are_named(options: dict[str, object], said: str) -> None:
    with pytest.raises(ControllerError, match=said):
        design(vehicle("coax"), **options)  # type: ignore[arg-type]


def test_a_place_that_nothing_sees_cannot_be_held() -> None:
    unplaced = design(vehicle("coax"), sensors=suite("imu@100"))
    with pytest.raises(ControllerError, match=r"sensors: no sensor sees x \(mode an integrator\)"):
        analyse(unplaced)


@pytest.mark.parametrize("text", ["radar", "imu@fast", "imu,gyro", "mocap,mocap", "imu@0", "flow+2000ms", ""])
def test_suites_that_are_none(text: str) -> None:
    with pytest.raises(ControllerError, match="sensors: "):
        suite(text)


@pytest.mark.parametrize("change", [{"rate": 1e-90}, {"rate": 0.0}, {"delay": 1e9}, {"delay": -1.0}])
def test_a_file_whose_clocks_no_observer_has_is_refused(change: dict[str, float], made: Lqg) -> None:
    document = lqg_document(made)
    with pytest.raises(ControllerError, match=r"a\.toml: delays: is not within 0 to 1000 steps"):
        lqg_from(document | {"delays": dict.fromkeys(document["delays"], 1e9)}, "a.toml")
    document["sensors"][0] |= change
    with pytest.raises(ControllerError, match=r"a\.toml: sensors: a rate is not above zero, or a delay"):
        lqg_from(document, "a.toml")
