"""The whole bench: simulate, evaluate, recover the truth, with bounds that hold."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import pytest

import swashplate as sp
from swashplate.flights.bench_record import BenchRecord
from swashplate.identification.bench.evaluate import MEASURED, Bench, evaluate, hover_commands, schedules
from swashplate.identification.bench.tilt import torques
from swashplate.simulation.bench import Setup, virtual_bench
from swashplate.vehicles.card import parse_card
from swashplate.vehicles.vehicle import Vehicle

TRUTH = {
    "k_drive_upper": 405.0,
    "o_drive_lower": 3.0,
    "k_drive_voltage": 12.5,
    "k_thrust_lower": 2.9e-5,
    "k_torque_upper": 9.2e-7,
    "tau_drive_upper": 0.16,
    "k_zeta_lower": 0.0011,
    "linkage_lower": 0.12,
    "hub_stiffness_lower": 0.5,
    "tau_f_lower": 0.06,
    "linkage_upper": 0.7,
    "hub_stiffness_upper": 0.13,
    "tau_f_upper": 1.2,
    "drag_x": 0.018,
}
"""What the aircraft on the bench has instead of the card's numbers."""


@pytest.fixture(scope="module")
def aircraft() -> Vehicle:
    return sp.vehicle("coax").with_values(TRUTH)


def _records(aircraft: Vehicle, seed: int, setup: Setup | None = None) -> tuple[BenchRecord, ...]:
    planned = schedules(hover_commands(sp.vehicle("coax").card.values()))
    return virtual_bench(aircraft, planned, setup=setup, seed=seed)


@pytest.fixture(scope="module")
def bench(aircraft: Vehicle) -> Bench:
    return evaluate(_records(aircraft, 1), sp.vehicle("coax"))


def _away(benches: Sequence[Bench], truth: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Errors and promised sigmas, shape (seeds, parameters)."""
    values = np.array([[b.card.parameters[n].value - truth[n] for n in MEASURED] for b in benches])
    return values, np.array([[b.card.parameters[n].sigma for n in MEASURED] for b in benches])


def _holds(aircraft: Vehicle, seeds: int, scatter: tuple[float, float]) -> None:
    found = [evaluate(_records(aircraft, seed), sp.vehicle("coax")) for seed in range(seeds)]
    errors, sigmas = _away(found, aircraft.card.values())
    inside = float(np.mean(np.abs(errors) < 2.0 * sigmas))
    assert 0.90 <= inside <= 0.99
    ratio = dict(zip(MEASURED, np.std(errors, axis=0, ddof=1) / np.mean(sigmas, axis=0), strict=True))
    assert all(scatter[0] < value < scatter[1] for value in ratio.values()), ratio


def test_every_parameter_comes_back_within_its_bounds(aircraft: Vehicle) -> None:
    """Eight seeds; scatter / sigma of each parameter is then known to 27 %, hence its limits (2.5 times that)."""
    _holds(aircraft, 8, (0.33, 1.67))


@pytest.mark.proof
def test_bounds_hold_over_a_hundred_seeds(aircraft: Vehicle) -> None:
    _holds(aircraft, 100, (0.7, 1.4))


def test_the_card_says_what_was_measured_and_how(bench: Bench, aircraft: Vehicle) -> None:
    assert bench.kept == ()
    assert set(bench.names) == set(MEASURED)
    entry = bench.card.parameters["k_drive_upper"]
    assert (entry.status, entry.source) == ("measured", "bench: speed_map from sweep_upper.csv, sweep_lower.csv")
    assert bench.card.parameters["mass"] == sp.vehicle("coax").card.parameters["mass"]
    assert bench.card.parameters["k_zeta_upper"].status == "derived"
    again = parse_card(bench.card.to_toml())
    np.testing.assert_allclose(again.covariance(bench.names), bench.covariance, rtol=1e-3, atol=1e-4 * 1e-12)
    # A steeper map needs a lower offset; a larger thrust factor makes the same force a smaller tilt.
    assert again.correlations["k_drive_upper"]["o_drive_upper"] < -0.9
    assert again.correlations["k_thrust_lower"]["linkage_lower"] < 0.0


def test_interference_is_found_and_dead_zone_and_saturation_are_left_out(bench: Bench) -> None:
    by_name = {result.procedure: result for result in bench.results}
    for _, share, sigma, _ in by_name["single_rotor"].findings:
        assert abs(share - 0.15) < 4.0 * sigma < 0.02
    ((_, cross, sigma, _),) = by_name["thrust"].findings
    assert abs(cross) < 4.0 * sigma
    reasons = [reason.split(" (")[0] for reason in by_name["speed_map"].left_out]
    assert {"upper at 0.3: dead zone", "upper at 0.8: saturation", "lower at 0.85: saturation"} <= set(reasons)
    assert not any("0.4:" in reason or "0.75:" in reason for reason in reasons)


def test_a_bench_of_thin_air_gives_the_factors_at_the_card_s_density(aircraft: Vehicle) -> None:
    found = evaluate(_records(aircraft, 2, Setup(air_density=0.95)), sp.vehicle("coax"))
    for name in ("k_thrust_lower", "drag_x", "hub_stiffness_lower"):
        entry = found.card.parameters[name]
        assert abs(entry.value - aircraft.card.values()[name]) < 4.0 * entry.sigma


def test_figure_6_from_a_bench_of_the_published_aircraft() -> None:
    coax = sp.vehicle("coax")
    card = evaluate(_records(coax, 3), coax).card.values()
    hover = card["k_thrust_lower"] * 238.97**2
    total, flapping, tilting = (
        1e3 * float(curve[0])
        for curve in torques(
            np.radians([6.0]),
            stiffness=card["hub_stiffness_lower"],
            thrust=hover,
            hub_height=card["hub_height_lower"],
        )
    )
    assert total == pytest.approx(64.2, abs=0.5)  # N mm; PHYSICS: 44.8 + 19.4
    assert flapping == pytest.approx(44.8, abs=0.5)
    assert tilting == pytest.approx(19.4, abs=0.2)


def test_the_whole_bench_is_evaluated_in_seconds(aircraft: Vehicle) -> None:
    records = _records(aircraft, 4)
    begun = time.perf_counter()
    evaluate(records, sp.vehicle("coax"))
    assert time.perf_counter() - begun < 10.0
