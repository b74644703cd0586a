"""Conditioned flights as arrays: order, voltage, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.core.records import POSE, records
from swashplate.models.catalogue import vehicle

COAX = vehicle("coax")
N = 301
TIME = np.arange(N) / 50.0


def _channels() -> dict[str, np.ndarray]:
    """Channels that can be told from each other, in an order of their own."""
    names = (*reversed(POSE), "servo_pitch", "motor_upper", "servo_roll", "motor_lower")
    return {name: 0.1 * i + 0.1 * np.sin((i + 1) * TIME) for i, name in enumerate(names)}


def _flight(time: np.ndarray = TIME, **changes: np.ndarray | None) -> Flight:
    channels = {name: values for name, values in {**_channels(), **changes}.items() if values is not None}
    return Flight({"uniform": stream(time, channels)}, Provenance(source="a.mat"))


def test_samples_on_a_bridge_over_a_gap_are_not_measured() -> None:
    (record,) = records(_flight(), COAX)
    assert record.bridged == ()
    assert record.measured.all()
    (record,) = records(_flight().done("resample", rate=50.0, bridged=[[1.0, 1.08], [2.99, 3.03]]), COAX)
    assert record.bridged == ((1.0, 1.08), (2.99, 3.03))
    np.testing.assert_allclose(record.time[~record.measured], [1.02, 1.04, 1.06, 3.0, 3.02])
    assert record.counts.all()


def test_columns_stand_in_the_vehicles_order() -> None:
    (record,) = records(_flight(), COAX)
    made = _channels()
    np.testing.assert_array_equal(record.inputs, np.stack([made[name] for name in COAX.input_names], axis=1))
    np.testing.assert_array_equal(record.outputs, np.stack([made[name] for name in POSE], axis=1))
    assert record.output_names == POSE
    assert record.dt == pytest.approx(0.02)
    assert record.name == "a.mat 0.00-6.00 s"
    (few,) = records(_flight(), COAX, outputs=("psi", "x"))
    np.testing.assert_array_equal(few.outputs, np.stack([made["psi"], made["x"]], axis=1))


def test_without_a_voltage_the_cards_nominal_stands_in() -> None:
    (record,) = records(_flight(), COAX)
    assert not record.voltage_known
    assert set(record.voltage) == {COAX.card.values()["voltage_nominal"]}


def test_a_logged_voltage_loses_its_noise_and_keeps_its_sag() -> None:
    """A least-squares line over two seconds: noise falls by the root of its samples, a straight sag stays as it is."""
    noise = 0.1 * np.random.default_rng(3).standard_normal(N)
    (straight,) = records(_flight(voltage=12.3 - 0.05 * TIME), COAX)
    assert straight.voltage_known
    np.testing.assert_allclose(straight.voltage, 12.3 - 0.05 * TIME, atol=1e-12)
    (noisy,) = records(_flight(voltage=12.3 - 0.05 * TIME + noise), COAX)
    middle = slice(50, -50)
    assert np.std((noisy.voltage - straight.voltage)[middle]) < 2.0 * 0.1 / np.sqrt(101)


def test_a_flight_in_pieces_is_as_many_records() -> None:
    broken = replace(_flight(), segments=((0.0, 2.0), (2.5, 6.0)))
    first, second = records([broken], COAX)
    assert (first.time[0], first.time[-1], second.time[0], second.time[-1]) == (0.0, 2.0, 2.5, 6.0)
    assert len(records([broken, _flight()], COAX)) == 3


def _holed() -> np.ndarray:
    values = np.sin(TIME)
    values[17] = np.nan
    return values


@pytest.mark.parametrize(
    ("flights", "message"),
    [
        ([], "there is no flight"),
        ([_flight(psi=None, servo_roll=None)], "a.mat: servo_roll, psi: lacks what 'coax' needs"),
        ([_flight(servo_roll=None, mixer_roll=TIME)], "asked of its mixer (mixer_roll), not what each motor and servo"),
        ([_flight(theta=_holed())], "a.mat: theta: holds values that are not finite"),
        ([_flight(theta=1.5 * np.sin(TIME))], "a.mat: theta: pitches to 86 degrees (1.20 to 5.08 s)"),
        ([_flight(TIME + 0.004 * np.sin(40.0 * TIME))], "a.mat: time steps vary from"),
        ([_flight(), _flight(TIME / 2.0)], "different rates (steps of [0.01, 0.02] s)"),
        (
            [_flight(**{name: np.full(N, 0.5) for name in COAX.input_names})],
            "a.mat 0.00-6.00 s: motor_lower, motor_upper, servo_roll, servo_pitch: no input ever moves",
        ),
    ],
)
def test_what_cannot_be_used_is_named(flights: list[Flight], message: str) -> None:
    with pytest.raises(FlightError) as caught:
        records(flights, COAX)
    assert message in str(caught.value)


def test_one_input_that_stands_still_is_no_reason_to_refuse_the_others() -> None:
    still = _flight(servo_roll=np.full(N, 0.1))
    assert len(records(still, COAX)) == 1
    dead = _flight(**{name: np.full(N, 0.5) for name in COAX.input_names})
    assert len(records([dead, still], COAX)) == 2
