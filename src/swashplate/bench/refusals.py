"""Records that no procedure may use: impossible values, a saturated sensor, a motor that did not reach its speed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.bench.record import COLUMNS, LOADS, BenchRecord
from swashplate.errors import BenchError
from swashplate.models.vehicle import Vehicle

COMMANDS = ("motor_lower", "motor_upper", "servo_roll", "servo_pitch")
"""What drives the aircraft on the bench."""
_CLIPPED = 8
"""So many samples in a row at exactly the largest value of a channel are a sensor at its range."""
_SLACK = 0.01
_RUNNING = 0.42
"""Motor commands above every dead zone."""
_CLEAR = 15.0
"""rad/s, in sum of both rotors: speed maps are not off by less than this for want of being the other's."""
_FOLLOWS = 0.25
"""Least share of a command's motion that a rotor's speed must show; a lag of 0.2 s leaves half at 2 Hz."""
_RANGES: Mapping[str, tuple[float, float]] = {
    "motor_lower": (0.0, 1.0),
    "motor_upper": (0.0, 1.0),
    "servo_roll": (-1.0, 1.0),
    "servo_pitch": (-1.0, 1.0),
    "voltage": (0.0, np.inf),
    "omega_lower": (0.0, np.inf),
    "omega_upper": (0.0, np.inf),
}
"""What commands, tachometers and the supply can give; tachometers give the size of a speed."""


def refuse_other_inputs(vehicle: Vehicle) -> None:
    """Raise for a vehicle that the bench does not measure.

    Raises:
        BenchError: naming the inputs.
    """
    if vehicle.input_names != COMMANDS:
        raise BenchError(
            f"has the inputs {', '.join(vehicle.input_names)}, expected {', '.join(COMMANDS)}.",
            where=vehicle.card.called,
            hint="The bench measures helicopters with two rotors and the equations of the CoaX.",
        )


def refuse_out_of_range(record: BenchRecord) -> None:
    """Raise where a command, a rotor speed or the voltage has a value that it cannot have.

    Raises:
        BenchError: naming the channel.
    """
    for channel, (low, high) in _RANGES.items():
        values = record.channels.get(channel)
        if values is None:
            continue
        # A tachometer's noise about zero is no sign; its mean is.
        lowest = float(np.median(values)) if channel.startswith("omega") else float(values.min())
        for value, beyond in (
            (lowest, lowest < low - _SLACK),
            (float(values.max()), float(values.max()) > high + _SLACK),
        ):
            if beyond:
                raise BenchError(
                    f"is {value:.4g} {COLUMNS[channel][0]}, expected {low:g} to {high:g}.",
                    where=record.name,
                    channel=channel,
                    hint=f"It is: {COLUMNS[channel][1]}. Correct its sign or its unit.",
                )


def refuse_saturated(record: BenchRecord) -> None:
    """Raise where a force or moment stands at its largest value for several samples: the sensor is at its range.

    Raises:
        BenchError: naming the channel.
    """
    for channel in LOADS if not record.averaged else ():
        values = record.channels.get(channel)
        if values is None or np.ptp(values) == 0.0:
            continue
        for limit in (values.max(), values.min()):
            at = np.r_[False, values == limit, False]
            edges = np.flatnonzero(np.diff(at.astype(int)))
            longest = int((edges[1::2] - edges[::2]).max())
            if longest >= _CLIPPED:
                time = record["time"][edges[::2][np.argmax(edges[1::2] - edges[::2])]]
                raise BenchError(
                    f"stands at {limit:.4g} for {longest} samples from {time:.2f} s on: the sensor is saturated.",
                    where=record.name,
                    channel=channel,
                    hint="Choose a larger range or smaller inputs, and damp vibration at the mount.",
                )


def refuse_stalled(record: BenchRecord, card: Mapping[str, float]) -> None:
    """Raise where a motor is told to turn and its rotor does not, or hardly.

    Raises:
        BenchError: naming the rotor and the time.
    """
    removed = record.header.get("rotor_removed", "")
    for rotor in ("upper", "lower"):
        if rotor == removed or not {f"motor_{rotor}", f"omega_{rotor}"} <= record.channels.keys():
            continue
        command, speed = record[f"motor_{rotor}"], record[f"omega_{rotor}"]
        expected = card[f"k_drive_{rotor}"] * command + card[f"o_drive_{rotor}"]
        if record.averaged:
            span, few = 1, 0.0
        else:  # settled for 1.5 s, eight of the slower drive train's time constants, and slow for longer than 0.2 s
            span, few = round(1.5 / record.dt), 0.2 / record.dt
        running = np.convolve(command > _RUNNING, np.ones(span), mode="full")[: command.size] >= span
        slow = running & (speed < 0.6 * expected)
        if slow.sum() > few:
            at = int(np.argmax(slow))
            when = f"point {at + 1}" if record.averaged else f"{record['time'][at]:.2f} s"
            raise BenchError(
                f"is {speed[at]:.0f} rad/s at {when} where motor_{rotor} = {command[at]:.2f} "
                f"should give about {expected[at]:.0f}: the motor did not reach its speed.",
                where=record.name,
                channel=f"omega_{rotor}",
                hint="Check supply, motor and tachometer (and that the rotors' columns are not exchanged).",
            )


def refuse_exchanged(record: BenchRecord, card: Mapping[str, float]) -> None:
    """Raise where both rotors' speeds are what the card's speed maps give for the other rotor.

    Raises:
        BenchError: where exchanging the two columns would leave less than a third of the difference.
    """
    needed = {f"{k}_{rotor}" for k in ("motor", "omega") for rotor in ("upper", "lower")}
    if not needed <= record.channels.keys() or "rotor_removed" in record.header:
        return
    running = np.minimum(record["motor_upper"], record["motor_lower"]) > _RUNNING
    if "point" in record.channels:
        running &= record["point"] > 0.0
    if not running.any():
        return
    volts = record.channels.get("voltage", np.full(running.size, card["voltage_nominal"]))
    above = card["k_drive_voltage"] * (volts[running] - card["voltage_nominal"])

    def off(rotor: str, channel: str) -> float:
        expected = card[f"k_drive_{rotor}"] * record[f"motor_{rotor}"][running] + card[f"o_drive_{rotor}"] + above
        return float(np.median(np.abs(record[channel][running] - expected)))

    as_named = off("upper", "omega_upper") + off("lower", "omega_lower")
    turned = off("upper", "omega_lower") + off("lower", "omega_upper")
    if as_named > _CLEAR and turned < as_named / 3.0:
        raise BenchError(
            f"the rotors' speeds are {as_named:.0f} rad/s from their speed maps in sum, exchanged {turned:.0f}.",
            where=record.name,
            channel="omega_upper, omega_lower",
            hint="Exchange the rotors' columns.",
        )


def refuse_idle(record: BenchRecord, rotor: str, card: Mapping[str, float]) -> None:
    """Raise where a rotor's speed does not move with its motor's command, as much as a lag would let it.

    Args:
        record: with the motor moving and not slower than its drive train's lag lets through.
        rotor: "upper" or "lower".
        card: `k_drive` of the rotor.

    Raises:
        BenchError: naming the rotor.
    """
    expected = card[f"k_drive_{rotor}"] * float(np.std(record[f"motor_{rotor}"]))
    spread = float(np.std(record[f"omega_{rotor}"]))
    if spread < _FOLLOWS * expected:
        raise BenchError(
            f"moves by {spread:.2g} rad/s (standard spread) where motor_{rotor} should move it by {expected:.2g}: "
            "the motor did not reach its speeds.",
            where=record.name,
            channel=f"omega_{rotor}",
            hint="Check motor and tachometer (and that the rotors' columns are not exchanged).",
        )
