"""Disturbed air: the accelerations that it adds, how strong they are in a fit, and in an observer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import numpy as np

from swashplate.arrays import Array, Values
from swashplate.models.card import Card

V = TypeVar("V")

DISTURBED = ("u", "v", "w", "p", "q", "r")
"""The states whose rates are disturbed, in the order of the disturbances."""


def on_axes(level: V, down: V, tilt: V, yaw: V) -> list[V]:
    """A number of each disturbance in the order of `DISTURBED`, from those of its four kinds."""
    return [level, level, down, tilt, tilt, yaw]


class Noise(NamedTuple):
    """Intensities of the process noise and standard deviations of the measurement noise.

    `white_*` [rad/s^2 or m/s^2 per sqrt(Hz)], `gust_*` and `drift_*` [rad/s^3 or m/s^3 per sqrt(Hz)], `wind`
    [m/s^2 per sqrt(Hz)], `tau_*` [s], `sensor_*` per sample [m, rad]. `speed`: root mean square of each horizontal
    velocity that is flown [m/s], for the filter's gain alone. `wind` 0: none, and slopes are those at hover.
    `tau_gust_yaw`, `drift_yaw`, `tau_gust_vertical`, `drift_vertical` 0: those of all moments and of all forces;
    `sensor_heading` 0: that of all angles.
    `sensor_rate` [rad/s]: of a gyroscope's readings, given and not estimated; 0: none is used.
    """

    white_tilt: Values = 0.5
    white_yaw: Values = 2.0
    white_horizontal: Values = 0.02
    white_vertical: Values = 0.02
    gust_tilt: Values = 3.0
    gust_yaw: Values = 15.0
    gust_horizontal: Values = 0.4
    gust_vertical: Values = 0.3
    tau_gust_moment: Values = 0.5
    tau_gust_force: Values = 0.5
    drift_moment: Values = 0.1
    drift_force: Values = 0.03
    sensor_position: Values = 3e-4
    sensor_angle: Values = 1.5e-3
    wind: Values = 0.0
    tau_wind: Values = 1.0
    speed: Values = 0.0
    tau_gust_yaw: Values = 0.0
    drift_yaw: Values = 0.0
    tau_gust_vertical: Values = 0.0
    drift_vertical: Values = 0.0
    sensor_heading: Values = 0.0
    sensor_rate: Values = 0.0


GYROSCOPE = 0.04
"""A gyroscope's noise [rad/s], given: what it shows above 8 Hz on real flights, most of it vibration."""

SEPARATE: Mapping[str, tuple[str, float, float]] = {
    "tau_gust_yaw": ("tau_gust_moment", 0.5, 0.5),
    "drift_yaw": ("drift_moment", 0.3, 1.0),
    "tau_gust_vertical": ("tau_gust_force", 0.5, 0.5),
    "drift_vertical": ("drift_force", 0.03, 0.5),
    "sensor_heading": ("sensor_angle", 1e-3, 2.0),
}
"""Numbers that yaw and heave may have for themselves: what else stands for each, a first guess, and the standard
deviation of its logarithm's prior."""


class Unrest(NamedTuple):
    """How far a vehicle strays from its equations.

    Attributes:
        force, force_down, moment, moment_yaw: standard deviation of the disturbing accelerations: level and down
            [m/s^2], of roll and pitch and of yaw [rad/s^2].
        force_time, moment_time: their time constants [s].
        jolt, twist, twist_yaw: white noise on velocity and body rates [m/s^2, rad/s^2 per root of Hz].
        flapping, bar: white noise on the tilt of rotors and of the bar [rad/s per root of Hz].
        speed: white noise on rotor speeds [rad/s^2 per root of Hz].
        other: white noise on every other inner state, per second and root of Hz.
    """

    force: float = 0.1
    force_down: float = 0.1
    moment: float = 0.5
    moment_yaw: float = 0.5
    force_time: float = 1.0
    moment_time: float = 0.5
    jolt: float = 0.02
    twist: float = 0.1
    twist_yaw: float = 0.1
    flapping: float = 0.02
    bar: float = 0.01
    speed: float = 3.0
    other: float = 0.01

    @property
    def spread(self) -> Array:
        """Standard deviations of the disturbances in the order of `DISTURBED`."""
        return np.array(on_axes(self.force, self.force_down, self.moment, self.moment_yaw))


def unrest_of(card: Card) -> Unrest:
    """What an identification learnt of the disturbances beside the parameters; the usual numbers where it did not.

    A gust that fades with T and is driven by white noise of intensity g has a standard deviation of g sqrt(T / 2).
    Where a wind was estimated, the gusts beside it are what the wind left, and say too little: the usual numbers again.
    """
    noise = card.observer.get("noise", {})
    if not noise or noise.get("wind", 0.0) > 0.0:
        return Unrest()
    rates = {name: noise.get(name, 0.0) or noise[shared] for name, (shared, *_) in SEPARATE.items() if "tau" in name}
    force, moment = np.sqrt(0.5 * noise["tau_gust_force"]), np.sqrt(0.5 * noise["tau_gust_moment"])
    return Unrest(
        force=float(force * noise["gust_horizontal"]),
        force_down=float(np.sqrt(0.5 * rates["tau_gust_vertical"]) * noise["gust_vertical"]),
        moment=float(moment * noise["gust_tilt"]),
        moment_yaw=float(np.sqrt(0.5 * rates["tau_gust_yaw"]) * noise["gust_yaw"]),
        force_time=noise["tau_gust_force"],
        moment_time=noise["tau_gust_moment"],
        jolt=max(noise["white_horizontal"], noise["white_vertical"]),
        twist=noise["white_tilt"],
        twist_yaw=noise["white_yaw"],
    )
