"""The real bench: the CoaX-56's speed maps and voltage sweeps, its bar without a time base, and the propeller rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swashplate.errors import BenchError, FlightError
from swashplate.flights.bench_tables import read_normals, read_rig, read_table
from swashplate.identification.bench.bar_motion import cone_of
from swashplate.identification.bench.speed_map import fit_map
from swashplate.identification.bench.supply import fit_supply, together
from swashplate.identification.bench.thrust_loss import thrust_loss

PUBLISHED = {"upper": (421.3723, -0.2555), "lower": (437.7036, -2.9047)}


@pytest.mark.parametrize("rotor", PUBLISHED)
def test_speed_map_without_dead_zone_and_saturation_is_the_published_one(shared_data: Path, rotor: str) -> None:
    table = read_table(shared_data / "coax56" / "bench_input_to_rpm.mat")
    values, covariance, kept, reasons = fit_map(table["input"], table[f"omega_{rotor}"], rotor=rotor)
    away = (values - np.array(PUBLISHED[rotor])) / np.sqrt(np.diag(covariance))
    assert np.all(np.abs(away) < 2.0)
    # The very points that were chosen by hand: 0.40 to 0.75.
    np.testing.assert_allclose(table["input"][kept], np.arange(0.4, 0.76, 0.05))
    np.testing.assert_allclose(values, PUBLISHED[rotor], atol=1e-4)
    assert [r.split(" (")[0] for r in reasons] == [
        f"{rotor} at 0.3: dead zone",
        f"{rotor} at 0.35: dead zone",
        f"{rotor} at 0.8: saturation",
    ]


def test_speed_against_voltage(shared_data: Path) -> None:
    table = read_table(shared_data / "coax56" / "bench_voltage_to_rpm.mat")
    slopes, sigmas = [], []
    for rotor, expected in (("upper", 13.17), ("lower", 14.06)):
        line = fit_supply(table["measVoltage"], table[f"omega_{rotor}"])
        slopes.append(float(line.values[0]))
        sigmas.append(float(np.sqrt(line.covariance[0, 0])))
        assert slopes[-1] == pytest.approx(expected, abs=0.01)
        assert 0.2 < sigmas[-1] < 0.6
    mean, sigma, apart = together(slopes, sigmas)
    assert abs(apart) < 3.0  # one factor for both rotors is not contradicted
    assert abs(mean - 13.6) < 2.0 * sigma  # the card's


def test_what_is_left_after_voltage_compensation(shared_data: Path) -> None:
    table = read_table(shared_data / "coax56" / "bench_rpm_voltage_compensated.mat")
    for rotor, uncompensated in (("upper", 13.17), ("lower", 14.06)):
        line = fit_supply(table["battState"], table[f"omega_{rotor}"])
        left, sigma = float(line.values[0]), float(np.sqrt(line.covariance[0, 0]))
        assert left > 3.0 * sigma  # a part remains ...
        assert left < 0.4 * uncompensated  # ... and most is gone


def test_the_bar_tells_how_far_it_leans_and_not_how_fast(shared_data: Path) -> None:
    normals = read_normals(shared_data / "coax56" / "stabilizer_bar_orientation.mat")
    assert normals.shape == (1000, 3)
    mean, largest = cone_of(normals)
    assert 0.0 < mean < largest < np.pi / 2
    assert cone_of(normals[np.random.default_rng(1).permutation(1000)]) == pytest.approx((mean, largest))


def test_a_coaxial_pair_loses_thrust_against_two_single_propellers(shared_data: Path) -> None:
    rig = shared_data / "coax_rig"
    pairs = [read_rig(path) for path in sorted(rig.glob("Coax_pre_XOAR-18-160-6.5-18-160-6.5-#*.csv"))]
    singles = [read_rig(path) for path in sorted(rig.glob("Data_Single_prop_160_Xoar*.csv"))]
    assert len(pairs) == len(singles) == 3
    found = thrust_loss(pairs, singles)
    # Momentum theory at the same power: 0.21 for one stream tube; apart, the upper one is hardly disturbed.
    assert 0.05 < found.mean < 0.21
    assert 0.0 < found.mean_sigma < 0.02
    assert np.all(np.diff(found.at_pwm) < 0.0)  # at the same pulse width the loss is mostly a loss of speed
    with pytest.raises(BenchError, match="wrong number of propellers"):
        thrust_loss(singles, singles)
    with pytest.raises(BenchError, match="expected two or more"):
        thrust_loss(pairs, singles[:1])


def test_other_files_are_refused(shared_data: Path, tmp_path: Path) -> None:
    with pytest.raises(BenchError, match="expected one struct of columns"):
        read_table(shared_data / "coax56" / "stabilizer_bar_orientation.mat")
    with pytest.raises(FlightError, match=r"parameters\.csv"):
        read_table(shared_data / "coax56" / "parameters.csv")
    (tmp_path / "run.csv").write_text(
        "Time: now\nMotor PWM, Top Voltage (V), Top Current (A), Thrust (kg)\n1100,48,,1\n"
    )
    with pytest.raises(BenchError, match=r"Top Current \(A\): line 3 is blank"):
        read_rig(tmp_path / "run.csv")
    with pytest.raises(BenchError, match="no line of heads"):
        read_rig(shared_data / "coax56" / "parameters.csv")
