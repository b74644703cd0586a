"""The real bench: the CoaX-56's speed maps and voltage sweeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.bench.evaluate import Bench, evaluate
from swashplate.bench.record_files import read_records, read_table
from swashplate.bench.result import BenchFinding
from swashplate.bench.speed_map import fit_map
from swashplate.bench.supply import together
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
    doubts = [check.text for check in found.details.results[0].checks if not check.good]
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


def test_other_files_are_refused(shared_data: Path) -> None:
    with pytest.raises(BenchError, match="expected one struct of columns"):
        read_table(shared_data / "coax56" / "stabilizer_bar_orientation.mat")
    with pytest.raises(FlightError, match=r"parameters\.csv"):
        read_table(shared_data / "coax56" / "parameters.csv")
