"""Many closed loops at once, gusts, and models drawn from what an identification does not know."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from made_results import result
from swashplate.control.draws.spread import spread
from swashplate.control.draws.variations import draw_models
from swashplate.control.laws.autopilot import autopilot
from swashplate.errors import CardError, DocumentError, SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.closed_loop_batch import simulate_closed_loops
from swashplate.simulation.record import quantum_of
from swashplate.simulation.trim import Trim, trim
from swashplate.simulation.wind import INDOOR, dryden, indoor, outdoor


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return sp.vehicle("coax")


@pytest.fixture(scope="module")
def hover(coax: Vehicle) -> Trim:
    return trim(coax)


@pytest.mark.proof
def test_a_batch_is_the_single_flight_many_times(coax: Vehicle, hover: Trim) -> None:
    controller = autopilot(coax, hover)
    mass = np.array([0.29, 0.302, 0.32])
    wind = np.linspace(0.0, 0.5, 201)
    many = simulate_closed_loops(
        coax,
        controller,
        duration=2.0,
        size=3,
        parameters={"mass": mass},
        reference={"x": 1.0},
        wind={"wind_east": wind},
    )
    for i, m in enumerate(mass):
        one = simulate_closed_loop(
            coax.with_values({"mass": m}),
            controller,
            duration=2.0,
            reference={"x": 1.0},
            wind={"wind_east": np.repeat(wind, 5)[:1001]},
            start=hover,
            rate=500.0,
        )
        for name in ("x", "z", "phi", "r", "omega_lower"):
            np.testing.assert_allclose(many[name][:, i], one.values(name)[:-1:5], atol=1e-11)
    alone = many.flight(2)
    assert alone.values("motor_lower")[0] == pytest.approx(hover.commands()["motor_lower"], rel=1e-3)


@pytest.mark.proof
def test_noise_has_its_size_its_seed_and_its_effect(coax: Vehicle, hover: Trim) -> None:
    controller = autopilot(coax, hover)
    ask = {"duration": 10.0, "size": 40, "keep": 5, "noise": {"p": 0.02, "z": 0.002}}
    a = simulate_closed_loops(coax, controller, seed=1, **ask)  # type: ignore[arg-type]
    b = simulate_closed_loops(coax, controller, seed=1, **ask)  # type: ignore[arg-type]
    c = simulate_closed_loops(coax, controller, seed=2, **ask)  # type: ignore[arg-type]
    np.testing.assert_array_equal(a.states, b.states)
    assert not np.array_equal(a.states, c.states)
    # In the first sample the roll servo sees lean_rate times the noise of p, turned by the lag.
    servo = np.hypot(a.rows[0, 2], a.rows[0, 3])
    assert np.sqrt(np.mean(servo**2)) == pytest.approx(0.25 * 0.02, rel=0.35)


def test_gusts_have_drydens_variance_and_spectrum() -> None:
    setting = outdoor(5.0, height=10.0)
    rate, samples = 50.0, 3000
    wind = dryden(setting, samples=samples, rate=rate, seed=3, count=200)
    frequencies = np.fft.rfftfreq(samples, 1.0 / rate)
    s = 2j * np.pi * frequencies
    for i, (name, series) in enumerate(wind.items()):
        sigma, T = setting.sigma[i], setting.length[i] / setting.speed
        assert series.std() == pytest.approx(sigma, rel=0.1)
        form = 1.0 / (1.0 + T * s) if i == 0 else (1.0 + np.sqrt(3.0) * T * s) / (1.0 + T * s) ** 2
        # One-sided density over frequency in Hz: 4 sigma^2 T |form|^2, half of it for the second-order forms.
        density = (4.0 if i == 0 else 2.0) * sigma**2 * T * np.abs(form) ** 2
        window = np.hanning(samples)[:, None]
        power = np.mean(np.abs(np.fft.rfft(series * window, axis=0)) ** 2, axis=1)
        power = 2.0 * power / (rate * np.sum(window**2))
        band = (frequencies > 0.2) & (frequencies < 5.0)
        assert np.mean(power[band] / density[band]) == pytest.approx(1.0, abs=0.1), name
    short, long = (dryden(setting, samples=n, rate=rate, seed=3)["wind_north"] for n in (130, 200))
    np.testing.assert_allclose(short, long[:130], atol=1e-12)  # whatever the blocks that it is made in
    with pytest.raises(SwashError, match="expected a wind above zero"):
        outdoor(0.0)


@pytest.mark.proof
def test_place_is_held_in_indoor_gusts(coax: Vehicle, hover: Trim) -> None:
    wind = dryden(INDOOR, samples=1000, rate=100.0, seed=0, count=40)
    noise = {"u": 0.02, "v": 0.02, "p": 0.02, "q": 0.02}
    many = simulate_closed_loops(coax, autopilot(coax, hover), duration=10.0, size=40, wind=wind, noise=noise, keep=5)
    found = spread(many, hover)
    assert found.lost == 0
    assert found.figures["place, rms [m]"][2] < 0.1
    assert found.figures["height, largest [m]"][3] < 0.01
    far = np.max(np.sqrt(many["x"] ** 2 + many["y"] ** 2 + many["z"] ** 2), axis=0)
    assert found.worst == int(np.argmax(far))


def fit_file(coax: Vehicle, folder: Path, sigma: float) -> Path:
    """A fit of two parameters and one tied to the first."""
    covariance = np.diag([sigma, 0.01]) @ np.array([[1.0, 0.8], [0.8, 1.0]]) @ np.diag([sigma, 0.01])
    values, tied = {"tau_f_upper": 1.5, "linkage_lower": 0.13}, {"k_zeta_lower": "linkage_lower"}
    return result(coax, values, 0.25 * covariance, corrected=covariance, ties=tied).save(folder / "fit.json")


def test_draws_follow_the_covariance_the_ties_and_the_bounds(coax: Vehicle, tmp_path: Path) -> None:
    drawn = draw_models(coax, fit_file(coax, tmp_path, 0.1), count=4000, seed=5)
    assert drawn["tau_f_upper"].std() == pytest.approx(0.1, rel=0.05)
    assert np.corrcoef(drawn["tau_f_upper"], drawn["linkage_lower"])[0, 1] == pytest.approx(0.8, abs=0.02)
    np.testing.assert_array_equal(drawn["k_zeta_lower"], drawn["linkage_lower"])
    wide = draw_models(coax, fit_file(coax, tmp_path, 1.5), count=1000, seed=5)
    bound = coax.card.parameters["tau_f_upper"].lower
    assert bound is not None
    assert wide["tau_f_upper"].min() >= bound
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(DocumentError, match=r"kind: is None, expected 'result'.*swash identify"):
        draw_models(coax, tmp_path / "other.json", count=1, seed=0)


def test_bad_input_is_named(coax: Vehicle, hover: Trim) -> None:
    controller = autopilot(coax, hover)
    with pytest.raises(SwashError, match="a multiple of the controller's 100"):
        simulate_closed_loops(coax, controller, duration=1.0, size=2, rate=250.0)
    with pytest.raises(CardError, match="weight: is not a parameter"):
        simulate_closed_loops(coax, controller, duration=1.0, size=2, parameters={"weight": [1.0, 2.0]})
    with pytest.raises(SwashError, match=r"wind_east: has shape \(7,\), expected \(100, 2\) or \(100,\)"):
        simulate_closed_loops(coax, controller, duration=1.0, size=2, wind={"wind_east": np.zeros(7)})


def test_what_the_actuators_get_is_a_whole_step(coax: Vehicle, hover: Trim) -> None:
    controller = autopilot(coax, hover)
    coarse, fine = (
        simulate_closed_loops(coax, controller, duration=1.0, size=1, start=hover, bits=bits, wind={"wind_east": 0.5})
        for bits in (8, None)
    )
    unit = 2.0 / 255.0
    told = coarse.rows[:, 2, 0] / unit
    np.testing.assert_allclose(told, np.rint(told), atol=1e-9)
    assert np.any(np.abs(fine.rows[:, 2, 0] / unit - np.rint(fine.rows[:, 2, 0] / unit)) > 1e-3)


def test_commands_in_bits_are_whole_steps_of_their_range() -> None:
    limits = np.array([[0.0, 1.0], [-1.0, 1.0]])
    np.testing.assert_allclose(quantum_of(limits, 8), [1.0 / 255.0, 2.0 / 255.0])
    np.testing.assert_array_equal(quantum_of(limits, None), 0.0)
    with pytest.raises(SwashError, match="is 2, expected 4 to 24"):
        quantum_of(limits, 2)


def test_gusts_of_a_room_have_the_strength_that_is_asked_for() -> None:
    assert indoor(0.15) == INDOOR
    assert indoor(0.3).sigma == pytest.approx((0.3, 0.3, 0.2))
    with pytest.raises(SwashError, match="expected more than 0"):
        indoor(0.0)
