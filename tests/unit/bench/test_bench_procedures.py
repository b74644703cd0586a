"""Single procedures of the bench on records whose answer is known, and records that contradict what they measure."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.bench import checks, lag, speed_map, steady, supply
from swashplate.bench.drive_frequency import DRIVE_FREQUENCY
from swashplate.bench.evaluate import PROCEDURES, Bench, evaluate, hover_commands, schedules
from swashplate.bench.joint import Joint
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Procedure
from swashplate.bench.virtual_bench import Setup, virtual_bench
from swashplate.errors import BenchError, CardError
from swashplate.models.card import parse_card
from swashplate.models.vehicle import Vehicle

Records = dict[str, BenchRecord]


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return sp.vehicle("coax")


@pytest.fixture(scope="module")
def records(coax: Vehicle) -> Records:
    made = virtual_bench(coax, schedules(hover_commands(coax.card.values())), seed=5)
    return {record.name.removesuffix(".csv"): record for record in made}


def _changed(record: BenchRecord, **channels: np.ndarray) -> BenchRecord:
    return replace(record, channels={**record.channels, **channels})


def test_hover_commands_are_the_published_ones(coax: Vehicle) -> None:
    assert hover_commands(coax.card.values()) == {"motor_lower": 0.5526, "motor_upper": 0.5386}


def test_first_order_is_exact_for_held_commands() -> None:
    command = np.r_[0.0, np.ones(50)]
    found = lag.first_order(command, 0.2, 0.01)
    np.testing.assert_allclose(found[1:], 1.0 - np.exp(-np.arange(50) * 0.01 / 0.2), atol=1e-12)
    np.testing.assert_allclose(lag.first_order(np.full(9, 3.0), 0.2, 0.01), 3.0)


def test_a_lag_is_found_exactly_and_one_that_is_not_there_is_refused() -> None:
    command = np.repeat([0.0, 1.0, 0.0, 1.0], 100)

    def response(tau: float) -> tuple[np.ndarray, list[np.ndarray]]:
        return np.zeros(400), [lag.first_order(command, tau, 0.01), np.ones(400)]

    measured = 3.0 * lag.first_order(command, 0.137, 0.01) + 0.5
    fit = lag.fit_lag(response, measured, dt=0.01, bounds=(0.01, 2.0), where="r.csv")
    assert fit.tau == pytest.approx(0.137, rel=1e-6)
    np.testing.assert_allclose(fit.linear, [3.0, 0.5], rtol=1e-6)
    with pytest.raises(BenchError, match=r"r\.csv: shows no first-order response"):
        lag.fit_lag(response, 3.0 * command, dt=0.01, bounds=(0.05, 2.0), where="r.csv")


def test_a_straight_line_has_the_textbook_covariance() -> None:
    x, e = np.arange(6.0), np.array([0.1, -0.2, 0.15, -0.1, 0.2, -0.15])
    line = steady.fit_line([x, np.ones(6)], 2.0 * x + 1.0 + e, where="r")
    values, covariance = np.polyfit(x, 2.0 * x + 1.0 + e, 1, cov=True)
    np.testing.assert_allclose(line.values, values)
    np.testing.assert_allclose(line.covariance, covariance)
    with pytest.raises(BenchError, match="has 3 points for 2 unknowns"):
        steady.fit_line([x[:3], np.ones(3)], x[:3], where="r")
    with pytest.raises(BenchError, match="do not tell the unknowns apart"):
        steady.fit_line([np.ones(6), np.ones(6)], x, where="r")


def test_a_bend_and_a_point_that_still_moves_are_told() -> None:
    level = np.repeat(np.linspace(0.0, 1.0, 8), 2)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(16)
    straight, bent = (
        checks.check_structure(
            steady.fit_line([level, np.ones(16)], level + c * level**2 + noise, where="r"), level, what="y"
        )
        for c in (0.0, 0.1)
    )
    assert all(check.good for check in straight)
    assert any("structure beyond the repeats" in check.text and not check.good for check in bent)
    time = np.arange(400) / 100
    still, moving = (
        steady.steady_points(
            BenchRecord("r", ("x",), {"time": time, "point": 1.0 + time // 1, "y": noise_of + c * time}), ["y"]
        )
        for noise_of in [0.1 * np.random.default_rng(2).standard_normal(400)]
        for c in (0.0, 0.5)
    )
    assert checks.check_settled(still, "y").good
    assert not checks.check_settled(moving, "y").good


@pytest.mark.parametrize(
    ("speed", "message"),
    [
        (np.arange(4.0), "has 4 levels of motor_upper, expected at least 5"),
        (-np.arange(9.0), "omega_upper does not rise with motor_upper"),
    ],
)
def test_a_speed_map_that_is_none(speed: np.ndarray, message: str) -> None:
    with pytest.raises(BenchError) as error:
        speed_map.linear_part(np.linspace(0.4, 0.8, speed.size), speed, where="r.csv", rotor="upper")
    assert message in str(error.value)


def test_two_slopes_that_disagree_widen_their_mean() -> None:
    mean, sigma, apart = supply.together([13.0, 14.0], [0.5, 0.5])
    assert (mean, sigma) == pytest.approx((13.5, 0.5 / 2**0.5))
    assert apart == pytest.approx(-(2**0.5))
    assert supply.together([10.0, 14.0], [0.5, 0.5])[1] == pytest.approx(2.0)  # half the difference


def test_a_result_is_asked_by_name() -> None:
    result = BenchResult("p", "t", "s", ("a", "b"), np.array([1.0, 2.0]), np.diag([4.0, 9.0]), ())
    assert result["b"] == (2.0, 3.0)


def _result(procedure: str, values: dict[str, float], variance: float, **leans: float) -> BenchResult:
    size = len(values)
    return BenchResult(
        procedure,
        "t",
        "s",
        tuple(values),
        np.array(list(values.values())),
        variance * np.eye(size),
        ("r.csv",),
        leans_on={name: np.full(size, slope) for name, slope in leans.items()},
        findings=(BenchFinding("f", 1.0, 0.3, "1", leans),),
    )


def test_what_is_held_carries_its_error_and_a_second_measurement_moves_what_leant_on_it(coax: Vehicle) -> None:
    card = coax.card.with_values({"hub_height_lower": 0.103}, sigma=0.5)
    joint = Joint(card)
    joint.add(_result("one", {"drag_x": 1.0}, 1.0))
    second, _ = joint.add(_result("two", {"drag_y": 5.0}, 0.1, drag_x=2.0, hub_height_lower=3.0))
    assert joint.measured == ("drag_x", "drag_y")
    assert joint.held == ["hub_height_lower"]
    np.testing.assert_allclose(joint.among(("drag_x", "drag_y")), [[1.0, 2.0], [2.0, 0.1 + 4.0 + 9.0 * 0.25]])
    assert joint.among(("hub_height_lower", "drag_y"))[0, 1] == pytest.approx(3.0 * 0.25)
    assert second.findings[0].sigma == pytest.approx((0.09 + 4.0 + 9.0 * 0.25) ** 0.5)
    # Measured again, 1 higher and as well: the mean moves by a half, and what leant on it by twice that.
    (told,) = joint.add(_result("three", {"drag_x": 2.0}, 1.0))[1]
    assert (joint.values["drag_x"], joint.values["drag_y"]) == pytest.approx((1.5, 6.0))
    np.testing.assert_allclose(joint.among(("drag_x", "drag_y")), [[0.5, 1.0], [1.0, 0.1 + 2.0 + 9.0 * 0.25]])
    assert told.text == f"drag_x: three and one are {0.5**0.5:+.1f} sigmas apart."


def _clip(record: BenchRecord) -> BenchRecord:
    return _changed(record, Fz=np.maximum(record["Fz"], -3.0))


def _weak(record: BenchRecord) -> BenchRecord:
    return _changed(record, Mx=0.2 * record["Mx"], My=0.2 * record["My"])


def _stall(record: BenchRecord) -> BenchRecord:
    return _changed(record, omega_lower=0.3 * record["omega_lower"])


def _flip(*names: str) -> Callable[[BenchRecord], BenchRecord]:
    return lambda record: _changed(record, **{name: -record[name] for name in names})


def _swap_speeds(record: BenchRecord) -> BenchRecord:
    return _changed(record, omega_lower=record["omega_upper"], omega_upper=record["omega_lower"])


def _swap(*pairs: tuple[str, str]) -> Callable[[BenchRecord], BenchRecord]:
    return lambda record: _changed(record, **{a: record[b] for one in pairs for a, b in (one, one[::-1])})


def _without(name: str) -> Callable[[BenchRecord], BenchRecord]:
    return lambda record: replace(record, channels={k: v for k, v in record.channels.items() if k != name})


def _short(record: BenchRecord) -> BenchRecord:
    return replace(record, channels={name: values[:1000] for name, values in record.channels.items()})


def _no_points(record: BenchRecord) -> BenchRecord:
    return _changed(record, point=np.zeros_like(record["point"]))


def _for_another(record: BenchRecord) -> BenchRecord:
    return replace(record, procedures=("weighing",))


def _not_removed(record: BenchRecord) -> BenchRecord:
    return replace(record, header={})


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("sweep_upper", _clip, "Fz: stands at -3 for"),
        ("sweep_upper", _stall, "omega_lower: is"),
        ("sweep_upper", _flip("Fz"), "Fz: grows with rotor speed, but thrust points up"),
        ("sweep_upper", _flip("Mz"), "Mz: falls with the upper rotor's speed"),
        ("sweep_upper", _swap_speeds, "omega_"),
        ("sweep_upper", _without("Mz"), "Mz: the column is missing"),
        ("sweep_upper", _no_points, "point: no sample belongs to a measuring point"),
        ("sweep_upper", _for_another, "procedure 'weighing' is not known"),
        ("sweep_upper", _short, "levels of motor_upper, expected at least 5"),
        ("phase_lag", _flip("My"), "My: grows with servo_pitch"),
        ("phase_lag", _short, "points for"),
        ("swashplate", _flip("Fx", "Fy"), "Fx, Fy: forces lean against the deflection"),
        ("swashplate", _flip("Mx", "My"), "Mx, My: moments point against the deflection"),
        ("swashplate", _flip("Fy"), "Fy: forces lean against the deflection"),
        ("swashplate", _flip("servo_pitch"), "against the deflection"),
        ("swashplate", _swap(("Mx", "My")), "My: does not follow the deflection"),
        ("bar_linkage", _flip("Fy"), "Fy: forces lean against the deflection"),
        ("bar_linkage", _flip("bar_alpha"), "against the deflection"),
        ("bar_linkage", _swap_speeds, "omega_upper, omega_lower: the rotors' speeds are"),
        ("swashplate", _weak, "Mx, My: moments are smaller than the tilted thrust"),
        ("swashplate", _short, "expected at least 8"),
        ("fan_front", _flip("Fx"), "Fx: grows with airspeed_x"),
        ("fan_front", _swap(("Fx", "Fy")), "Fx: grows with airspeed_x less than Fy does"),
        ("fan_front", lambda r: _changed(r, omega_lower=r["omega_lower"] + 100.0), "a rotor turns"),
        ("fan_front", lambda r: _changed(r, airspeed_x=0.0 * r["time"]), "varies no single stream"),
        ("single_upper", _not_removed, "rotor_removed"),
        ("supply", lambda r: _changed(r, voltage=12.0 + 0.0 * r["time"]), "vary the supply"),
        ("steps_upper", lambda r: _changed(r, motor_upper=0.5 + 0.0 * r["time"]), "steps no motor, expected one"),
        ("steps_upper", _swap_speeds, "the rotors' speeds are"),
        ("steps_upper", _flip("omega_upper"), "omega_upper: is -"),
        ("steps_upper", _flip("motor_upper"), "motor_upper: is -"),
        ("steps_upper", lambda r: _changed(r, omega_upper=200.0 + r["motor_upper"]), "omega_upper: moves by"),
        ("steps_upper", lambda r: _changed(r, omega_upper=421.0 * r["motor_upper"]), "no first-order response"),
        ("multisine_upper", _swap_speeds, "the rotors' speeds are"),
        ("multisine_upper", _short, "whole periods"),
        ("servo_steps_pitch", lambda r: _changed(r, servo_pitch=0.0 * r["time"]), "steps no servo"),
        ("bar_motion", lambda r: _changed(r, phi=0.0 * r["time"]), "phi: moves by 0 rad"),
    ],
)
def test_a_record_that_contradicts_what_it_measures_is_refused(
    coax: Vehicle, records: Records, name: str, change: Callable[[BenchRecord], BenchRecord], message: str
) -> None:
    with pytest.raises(BenchError) as error:
        evaluate([change(records[name])], coax)
    assert f"{name}.csv" in str(error.value)
    assert message in str(error.value)


def _thrust_checks(coax: Vehicle, setup: Setup) -> tuple[Bench, list[BenchCheck]]:
    wanted = [s for s in schedules(hover_commands(coax.card.values())) if s.name.startswith("sweep")]
    made = virtual_bench(coax, [replace(s, procedures=("thrust",)) for s in wanted], setup=setup, seed=2)
    found = evaluate(made, coax)
    return found, [check for check in found.details.results[0].checks if not check.good]


def test_ground_effect_is_told_by_the_height_and_by_nothing_else(coax: Vehicle) -> None:
    """At one height it scales thrust alike: residuals stay straight, the factor is too large by what is told."""
    found, doubts = _thrust_checks(coax, Setup(height=0.2))
    assert len(doubts) == 2
    assert all("0.2 m above the floor, ground effect adds 4.8 % to the thrust" in check.text for check in doubts)
    gained = found.model.card.values()["k_thrust_lower"] / coax.card.values()["k_thrust_lower"]
    assert gained == pytest.approx(1.0 / (1.0 - (0.171 / 0.8) ** 2), abs=2e-3)
    assert _thrust_checks(coax, Setup(height=2.0))[1] == []
    free, doubts = _thrust_checks(coax, Setup())
    assert doubts == []
    assert any("does not say how high" in check.text for check in free.details.results[0].checks)


def test_vibration_is_told(coax: Vehicle) -> None:
    assert _thrust_checks(coax, Setup())[1] == []
    found = _thrust_checks(coax, Setup())[0].details.results[0].checks
    assert any("with the rotors off: the rest is vibration" in check.text for check in found)
    strong = _thrust_checks(coax, Setup(force_vibration=4.0))[1]
    assert any("as much as what is measured" in check.text for check in strong)


def test_a_moment_that_bends_with_the_tilt_is_told(coax: Vehicle, records: Records) -> None:
    """A hub that stiffens by a tenth at the largest deflection: no straight line of eq. 18 fits it."""
    record = records["swashplate"]
    stiffer = 1.0 + 0.1 * (np.hypot(record["servo_roll"], record["servo_pitch"]) / 0.75) ** 2
    for change, good in ((1.0 + 0.0 * stiffer, True), (stiffer, False)):
        found = evaluate([_changed(record, Mx=change * record["Mx"], My=change * record["My"])], coax)
        doubts = [check.text for check in found.details.results[0].checks if not check.good]
        assert (doubts == []) == good
    assert any("My [N m]: the residuals have a structure beyond the repeats" in words for words in doubts)


def test_a_drift_of_the_sensor_is_told(coax: Vehicle, records: Records) -> None:
    record = records["swashplate"]
    found = evaluate([_changed(record, Fx=record["Fx"] + 0.3 / 60.0 * record["time"])], coax)
    words = [check.text for check in found.details.results[0].checks]
    assert any("Fx [N] drifted by 0.3" in told and "takes a steady drift out" in told for told in words)
    entry, truth = found.model.card.parameters["linkage_lower"], coax.card.values()["linkage_lower"]
    assert abs(entry.value - truth) < 4.0 * (entry.sigma or 0.0)


def test_a_rotor_at_a_multiple_of_the_sample_rate_is_told(coax: Vehicle) -> None:
    number = np.repeat([1.0, 2.0], 200)
    time = np.arange(400) / 100.0
    for speed, good in ((2.0 * np.pi * 100.1, False), (240.0, True)):
        noise = np.random.default_rng(1).standard_normal(400)
        channels = {"time": time, "point": number, "Fz": 10.0 * number + noise, "omega_upper": speed + 0.0 * time}
        found = steady.steady_points(BenchRecord("r", ("thrust",), channels), ("Fz", "omega_upper"))
        check = checks.check_vibration(found, "Fz")
        assert check.good == good
        assert ("looks like a steady load" in check.text) != good


def test_what_has_no_record_keeps_the_published_value(coax: Vehicle, records: Records, tmp_path: Path) -> None:
    found = evaluate([records["fan_front"], records["supply"]], coax)
    assert set(found.names) == {"drag_x", "k_drive_voltage"}
    assert "tau_f_lower" in found.details.kept
    kept, published = (card.parameters["tau_f_lower"] for card in (found.model.card, coax.card))
    assert replace(kept, note="") == replace(published, note="")
    assert kept.note.endswith("kept as published: the bench has no record of it")
    assert list(found.model.card.parameters) == list(coax.card.parameters)
    assert "k_drive_voltage" in repr(found)
    again = sp.load(found.save(tmp_path / "bench.json"))
    assert repr(again) == repr(found)
    assert again.model.card.to_toml() == found.model.card.to_toml()
    curves = [[c.line_y for r in one.details.results for c in r.curves] for one in (found, again)]
    for one, other in zip(*curves, strict=True):
        np.testing.assert_array_equal(one, other)
    page = sp.report(again, path=tmp_path / "bench.html").read_text(encoding="utf-8")
    assert "drag_x" in page
    drawn = found.draw_values(300, seed=1)["drag_x"]
    assert drawn.std() == pytest.approx(found.model.card.parameters["drag_x"].sigma, rel=0.15)


def test_a_number_that_physics_forbids_is_refused(coax: Vehicle, records: Records) -> None:
    strong = _changed(records["fan_front"], Fx=1e6 * records["fan_front"]["Fx"])
    with pytest.raises(BenchError, match=r"drag_x: comes out as .* physics allows"):
        evaluate([strong], coax)


def test_every_procedure_names_its_source_and_what_spoils_it() -> None:
    by_module: dict[str, list[Procedure]] = {}
    for name, procedure in PROCEDURES.items():
        assert "eq" in procedure.source, name
        by_module.setdefault(procedure.estimate.__module__, []).append(procedure)
    for module, procedures in by_module.items():
        told = [sys.modules[module].__doc__, *(one.estimate.__doc__ for one in procedures)]
        spoilt = sum("spoils" in (text or "") for text in told)
        assert spoilt == len(procedures) or procedures == [DRIVE_FREQUENCY], module
    assert len(PROCEDURES) == 13


def test_correlations_of_a_card_are_kept_checked_and_dropped_with_their_number(coax: Vehicle) -> None:
    card = coax.card.with_values({"mass": 0.3}, sigma=0.01).with_values({"drag_x": 0.01}, sigma=0.002)
    card = parse_card(replace(card, correlations={"mass": {"drag_x": -0.5}}).to_toml())
    np.testing.assert_allclose(card.covariance(["drag_x", "mass"]), [[4e-6, -1e-5], [-1e-5, 1e-4]])
    assert card.with_values({"drag_x": 0.02}).correlations == {}
    for row in ({"mass": {"drag_x": 1.5}}, {"mass": {"wings": 0.1}}, {"mass": {"mass": 1.0}}):
        with pytest.raises(CardError, match="correlations: "):
            parse_card(replace(card, correlations=row).to_toml())
