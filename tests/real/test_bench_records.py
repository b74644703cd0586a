"""The real bench: the CoaX-56's speed maps and voltage sweeps, its bar without a time base, and the propeller rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.bench.bar_orientation import cone_of
from swashplate.bench.evaluate import Bench, evaluate
from swashplate.bench.record_files import read_bench, read_records
from swashplate.bench.record_tables import read_rig, read_table
from swashplate.bench.result import BenchFinding
from swashplate.bench.speed_map import fit_map
from swashplate.bench.supply import together
from swashplate.bench.thrust_loss import thrust_loss
from swashplate.errors import BenchError, FlightError

PUBLISHED = {"upper": (421.3723, -0.2555), "lower": (437.7036, -2.9047)}


@pytest.mark.parametrize("rotor", PUBLISHED)
def test_speed_map_without_dead_zone_and_saturation_is_the_published_one(shared_data: Path, rotor: str) -> None:
    table = read_table(shared_data / "coax56" / "bench_input_to_rpm.mat")
    values, covariance, kept, reasons = fit_map(table["motor_upper"], table[f"omega_{rotor}"], rotor=rotor)
    away = (values - np.array(PUBLISHED[rotor])) / np.sqrt(np.diag(covariance))
    assert np.all(np.abs(away) < 2.0)
    # The very points that were chosen by hand: 0.40 to 0.75.
    np.testing.assert_allclose(table["motor_upper"][kept], np.arange(0.4, 0.76, 0.05))
    np.testing.assert_allclose(values, PUBLISHED[rotor], atol=1e-4)
    assert [r.split(" (")[0] for r in reasons] == [
        f"{rotor} at 0.3: dead zone",
        f"{rotor} at 0.35: dead zone",
        f"{rotor} at 0.8: saturation",
    ]


def _bench(shared_data: Path, *files: str) -> tuple[Bench, dict[str, BenchFinding]]:
    records = read_records(*(shared_data / file for file in files))
    found = evaluate(records, sp.vehicle("coax"))
    return found, {f.name: f for result in found.details.results for f in result.findings}


def test_the_whole_command_gives_the_same_map_and_says_what_it_does_not_know(shared_data: Path) -> None:
    found, _ = _bench(shared_data, "coax56/bench_input_to_rpm.mat")
    for rotor, (slope, offset) in PUBLISHED.items():
        for name, value in ((f"k_drive_{rotor}", slope), (f"o_drive_{rotor}", offset)):
            entry = found.model.card.parameters[name]
            assert abs(entry.value - value) < 2.0 * (entry.sigma or 0.0)
    assert len(found.details.results[0].left_out) == 6
    doubts = [check.words for check in found.details.results[0].checks if not check.good]
    assert any("the voltage was not recorded" in words for words in doubts)


def test_speed_against_voltage(shared_data: Path) -> None:
    found, findings = _bench(shared_data, "coax56/bench_voltage_to_rpm.mat")
    slopes = [findings[f"k_drive_voltage of the {rotor} rotor by itself"] for rotor in ("upper", "lower")]
    for slope, expected in zip(slopes, (13.17, 14.06), strict=True):
        assert slope.value == pytest.approx(expected, abs=0.01)
        assert 0.2 < slope.sigma < 0.6
    mean, sigma, apart = together([s.value for s in slopes], [s.sigma for s in slopes])
    assert abs(apart) < 3.0  # one factor for both rotors is not contradicted
    assert abs(mean - 13.6) < 2.0 * sigma  # the card's
    entry = found.model.card.parameters["k_drive_voltage"]
    assert (entry.value, entry.sigma) == pytest.approx((mean, sigma))


def test_what_is_left_after_voltage_compensation(shared_data: Path) -> None:
    found, findings = _bench(shared_data, "coax56/bench_rpm_voltage_compensated.mat")
    assert found.names == ()  # what is left is no parameter: the card keeps its own
    for rotor, expected in (("upper", 2.07), ("lower", 3.83)):
        left = findings[f"speed of the {rotor} rotor left per volt"]
        assert left.value == pytest.approx(expected, abs=0.01)
        assert left.value > 3.0 * left.sigma  # a part remains ...
        assert findings[f"share of k_drive_voltage left, {rotor} rotor"].value < 0.4  # ... and most is gone


def test_the_bar_tells_how_far_it_leans_and_not_how_fast(shared_data: Path) -> None:
    record = read_bench(shared_data / "coax56" / "stabilizer_bar_orientation.mat")
    normals = np.column_stack([record[f"normal_{axis}"] for axis in "xyz"])
    assert normals.shape == (1000, 3)
    angles = cone_of(normals)
    assert 0.0 < angles.mean() < angles.max() < np.pi / 2
    order = np.random.default_rng(1).permutation(1000)
    np.testing.assert_allclose(cone_of(normals[order]), angles[order], atol=1e-12)  # the order tells nothing
    with pytest.raises(BenchError, match="has no time base"):
        _ = record.dt
    found, findings = _bench(shared_data, "coax56/stabilizer_bar_orientation.mat")
    assert found.names == ()
    assert findings["largest lean of the bar from its mean plane"].value == pytest.approx(angles.max())
    assert any("A time constant cannot be had" in check.words for check in found.details.results[0].checks)


def test_a_coaxial_pair_loses_thrust_against_two_single_propellers(shared_data: Path) -> None:
    rig = shared_data / "coax_rig"
    pairs = [read_rig(path) for path in sorted(rig.glob("Coax_pre_XOAR-18-160-6.5-18-160-6.5-#*.csv"))]
    singles = [read_rig(path) for path in sorted(rig.glob("Data_Single_prop_160_Xoar*.csv"))]
    assert len(pairs) == len(singles) == 3
    found = thrust_loss(pairs, singles)
    # Momentum theory at the same power: 0.21 for one stream tube; apart, the upper one is hardly disturbed.
    assert 0.05 < found.mean < 0.21
    assert 0.0 < found.mean_sigma < 0.02
    # By momentum theory the loss at equal power is the same at every power; so it is within its bounds.
    sure = np.isfinite(found.at_power)
    assert sure.sum() == 4
    assert np.all(np.abs(found.at_power[sure] - found.mean) < 3.0 * found.sigma[sure])
    assert np.all(np.diff(found.at_pwm) < 0.0)  # at the same pulse width the loss is mostly a loss of speed
    with pytest.raises(BenchError, match="wrong number of propellers"):
        thrust_loss(singles, singles)
    with pytest.raises(BenchError, match="expected two or more"):
        thrust_loss(pairs, singles[:1])


def test_the_whole_rig_by_its_files(shared_data: Path) -> None:
    found, findings = _bench(shared_data, "coax_rig")
    assert found.names == ()
    (loss,) = findings.values()  # the pair whose lower propeller is marked +2 has no run of that propeller alone
    assert loss.value == pytest.approx(0.154, abs=0.001)
    assert loss.sigma == pytest.approx(0.0044, abs=0.0003)
    (result,) = found.details.results
    assert len(result.tables) == 5  # four set-ups and the loss
    assert any("+2: no run of the same propellers alone" in check.words for check in result.checks)


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
    (tmp_path / "run.csv").write_text(
        "Time: now\nMotor PWM, Top Voltage (V), Top Current (A), Thrust (kg)\n1100,48,2,1\n1200,48,7,2,1\n"
    )
    with pytest.raises(BenchError, match="line 4 has 5 cells, expected 4"):
        read_rig(tmp_path / "run.csv")
    with pytest.raises(BenchError, match="no line of heads"):
        read_rig(shared_data / "coax56" / "parameters.csv")
