"""What an aircraft is told: sensors with their rates, delays, noise and biases, written "imu@200,flow@25+40ms".

A suite is data; the readings are one function of scalars, so that the observer, its C and the simulated sensors are the
same sensors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from swashplate.errors import ControllerError
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import RigidBody


class Kind(NamedTuple):
    """A kind of sensor.

    Attributes:
        channels: what one reading holds.
        sigma: standard deviation of its white noise, channel by channel [the channel's unit].
        rate, delay: usual samples per second [Hz] and age of a reading when it arrives [s].
        summary: what it is.
    """

    channels: tuple[str, ...]
    sigma: tuple[float, ...]
    rate: float
    delay: float
    summary: str


KINDS: Mapping[str, Kind] = {
    "gyro": Kind(("p", "q", "r"), (0.005,) * 3, 200.0, 0.0, "rate gyros"),
    "imu": Kind(
        ("p", "q", "r", "ax", "ay", "az"),
        (0.005,) * 3 + (0.05,) * 3,
        200.0,
        0.0,
        "rate gyros and accelerometers at the centre of gravity",
    ),
    "mocap": Kind(
        ("x", "y", "z", "phi", "theta", "psi"),
        (0.001,) * 3 + (0.002,) * 3,
        100.0,
        0.01,
        "motion capture: place and attitude",
    ),
    "sonar": Kind(("range",), (0.01,), 20.0, 0.0, "distance to the floor along the body's axis"),
    "pressure": Kind(("height",), (0.15,), 20.0, 0.0, "pressure height, with an offset that wanders"),
    "flow": Kind(("u", "v"), (0.05,) * 2, 25.0, 0.04, "body velocity by optical flow"),
    "compass": Kind(("psi",), (0.02,), 20.0, 0.0, "heading by magnetometer"),
}
"""Usual numbers; assumed, as of small aircraft's sensors."""

BIASED: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(("p", "q", "r"), (0.005, 1e-4)),
    **dict.fromkeys(("ax", "ay", "az"), (0.05, 1e-3)),
    "height": (0.3, 0.02),
}
"""Channels of gyros, accelerometers and pressure that have a bias: its sigma at the start and how it wanders (per
root of a second)."""


@dataclass(frozen=True)
class Sensor:
    """One sensor of a suite: its kind, samples per second [Hz], delay [s] and noise by channel."""

    kind: str
    rate: float
    delay: float
    sigma: tuple[float, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        return KINDS[self.kind].channels

    def __str__(self) -> str:
        delay = f"+{1e3 * self.delay:g}ms" if self.delay else ""
        return f"{self.kind}@{self.rate:g}{delay}"


Suite = tuple[Sensor, ...]

_WRITTEN = re.compile(r"(?P<kind>[a-z]+)(?:@(?P<rate>[\d.]+)(?:hz)?)?(?:\+(?P<delay>[\d.]+)ms)?")


def suite(text: str) -> Suite:
    """Sensors from their description, e.g. "imu@200,mocap@100+10ms,sonar,flow@25+40ms".

    Rates in Hz, delays in milliseconds; what is not said is usual (`KINDS`).

    Raises:
        ControllerError: naming the part that is no sensor, is there twice, or has an impossible rate or delay.
    """
    sensors: list[Sensor] = []
    for part in (piece.strip().lower() for piece in text.split(",")):
        match = _WRITTEN.fullmatch(part)
        if match is None or match["kind"] not in KINDS:
            raise ControllerError(
                f"'{part}' is no sensor.",
                channel="sensors",
                hint=f"Write KIND@RATE+DELAYms with {', '.join(KINDS)}; for example imu@200,flow@25+40ms.",
            )
        kind = KINDS[match["kind"]]
        try:
            rate = float(match["rate"] or kind.rate)
            delay = kind.delay if match["delay"] is None else float(match["delay"]) / 1e3
        except ValueError:
            rate = delay = math.nan
        if not (0.0 < rate <= 1e4 and 0.0 <= delay <= 1.0):
            raise ControllerError(f"'{part}': expected up to 10000 Hz and 1000 ms.", channel="sensors")
        sensors.append(Sensor(match["kind"], rate, delay, kind.sigma))
    kinds = [sensor.kind for sensor in sensors]
    doubled = sorted(
        {k for k in kinds if kinds.count(k) > 1} | ({"gyro", "imu"} if {"gyro", "imu"} <= {*kinds} else set())
    )
    if doubled:
        raise ControllerError(f"{' and '.join(doubled)} is there twice.", channel="sensors", hint="Give each once.")
    return tuple(sensors)


def biased(sensors: Suite) -> tuple[str, ...]:
    """Channels with a bias that the observer estimates, in the order of the suite."""
    return tuple(name for sensor in sensors for name in sensor.channels if _has_bias(sensor.kind, name))


def _has_bias(kind: str, channel: str) -> bool:
    return channel in BIASED and kind in ("gyro", "imu", "pressure")


def readings(
    sensor: Sensor, body: RigidBody, force: Vector, bias: Mapping[str, Scalar], xp: Backend
) -> dict[str, Scalar]:
    """What a sensor shows, without noise.

    Args:
        sensor: which.
        body: place, velocity, attitude, rates.
        force: specific force at the centre of gravity [m/s^2].
        bias: of the channels in `biased`.
        xp: the operations.
    """
    shown: dict[str, Scalar] = {
        **body._asdict(),
        "ax": force.x,
        "ay": force.y,
        "az": force.z,
        "height": -body.z,
    }
    if sensor.kind == "sonar":
        shown["range"] = -body.z / (xp.cos(body.phi) * xp.cos(body.theta))
    return {name: shown[name] + bias[name] if _has_bias(sensor.kind, name) else shown[name] for name in sensor.channels}
