"""Sensor models: from a true flight to a log such as motion capture and an on-board computer write it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row, unpack_rows
from swashplate.errors import SwashError
from swashplate.flights.conditioning.resample import values_at
from swashplate.flights.flight import Flight, stream
from swashplate.flights.schema import POSITION, QUATERNION, RATES
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.environment import Environment


@dataclass(frozen=True)
class MotionCapture:
    """A camera system that gives position and quaternion.

    Attributes:
        rate: frames per second [Hz].
        position_noise: standard deviation [m].
        attitude_noise: standard deviation of the rotation about each axis [rad].
        stamp_jitter: standard deviation of the time stamps [s]; clipped so that time keeps going forward.
        gaps_per_minute, gap_length: how often frames go missing, and for how long on average [s].
        outlier_share, outlier_size: part of the frames where markers are swapped, and by how much [m].
        flips_per_minute: how often the quaternion changes its sign (which is no rotation).
    """

    rate: float = 200.0
    position_noise: float = 5e-4
    attitude_noise: float = 2e-3
    stamp_jitter: float = 2e-4
    gaps_per_minute: float = 6.0
    gap_length: float = 0.05
    outlier_share: float = 5e-4
    outlier_size: float = 0.3
    flips_per_minute: float = 4.0


@dataclass(frozen=True)
class InertialUnit:
    """Rate gyros and accelerometers at the centre of gravity.

    Attributes:
        rate: samples per second [Hz].
        rate_noise, rate_bias: standard deviations of noise and of the constant bias [rad/s].
        force_noise, force_bias: the same for specific force [m/s^2].
    """

    rate: float = 200.0
    rate_noise: float = 5e-3
    rate_bias: float = 5e-3
    force_noise: float = 0.05
    force_bias: float = 0.05


@dataclass(frozen=True)
class Sensors:
    """What is on board and around; None leaves a sensor out.

    Attributes:
        motion: motion capture (stream "motion": x y z qw qx qy qz).
        imu: inertial unit (stream "imu": p q r ax ay az).
        input_rate: of the recorded inputs [Hz] (stream "inputs").
        voltage_rate, voltage_noise: of the battery voltage [Hz], [V] (stream "battery"); rate None leaves it out.
    """

    motion: MotionCapture | None = MotionCapture()
    imu: InertialUnit | None = None
    input_rate: float = 100.0
    voltage_rate: float | None = 10.0
    voltage_noise: float = 0.02


QUIET = Sensors(motion=MotionCapture(gaps_per_minute=0.0, outlier_share=0.0, flips_per_minute=0.0, stamp_jitter=0.0))
"""Motion capture with noise only: nothing for the conditioning to find."""


def observe(flight: Flight, vehicle: Vehicle, *, sensors: Sensors | None = None, seed: int) -> Flight:
    """What the sensors record of a simulated flight: several streams, each at its native times.

    Args:
        flight: from `sp.simulate`, with every state in one stream.
        vehicle: the one that flew (its specific force is what accelerometers feel).
        sensors: which sensors; motion capture, inputs and battery by default.
        seed: of the noise; the same seed gives the same bits.

    Returns:
        A flight with streams "motion", "imu", "inputs" and "battery" (those that the sensors have).
    """
    chosen = sensors or Sensors()
    fastest = [chosen.input_rate, *(s.rate for s in (chosen.motion, chosen.imu) if s is not None)]
    if min(fastest) <= 0.0:
        raise SwashError(f"sensor rates are {fastest}, expected positive numbers of samples per second.")
    # One independent generator per sensor: leaving one out does not change the others' noise.
    for_motion, for_imu, for_battery = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3))
    streams: dict[str, xr.Dataset] = {}
    if chosen.motion is not None:
        streams["motion"] = _motion(flight, chosen.motion, for_motion)
    if chosen.imu is not None:
        streams["imu"] = _inertial(flight, vehicle, chosen.imu, for_imu)
    time = _times(flight, chosen.input_rate)
    streams["inputs"] = stream(time, {name: _held(flight, name, time) for name in vehicle.input_names})
    if chosen.voltage_rate is not None and "voltage" in flight:
        time = _times(flight, chosen.voltage_rate)
        noise = chosen.voltage_noise * for_battery.standard_normal(time.size)
        streams["battery"] = stream(
            time, {"voltage": np.interp(time, flight.time("voltage"), flight.values("voltage")) + noise}
        )
    provenance = replace(flight.provenance, notes=(*flight.provenance.notes, "simulated sensors"))
    return Flight(streams, provenance, flight.history).done("observe", seed=seed)


def _times(flight: Flight, rate: float) -> Array:
    return flight.start + np.arange(int(np.floor(flight.duration * rate + 1e-6)) + 1) / rate


def _held(flight: Flight, name: str, time: Array) -> Array:
    latest = np.searchsorted(flight.time(name), time + 1e-9, side="right") - 1
    return flight.values(name)[np.maximum(latest, 0)]


def _smooth(flight: Flight, name: str, values: Array, time: Array) -> Array:
    """A motion between the simulation's samples: lines would lose 1.6 % of one of 8 Hz (100 samples a second)."""
    return values_at(flight.time(name), values, time, "spline")


def _motion(flight: Flight, camera: MotionCapture, random: np.random.Generator) -> xr.Dataset:
    true_time = _times(flight, camera.rate)
    n = true_time.size
    columns = {name: _smooth(flight, name, flight.values(name), true_time) for name in (*POSITION, "phi", "theta")}
    heading = _smooth(flight, "psi", np.unwrap(flight.values("psi")), true_time)
    attitude = Rotation.from_euler("ZYX", np.stack([heading, columns["theta"], columns["phi"]], axis=1))
    shaken = attitude * Rotation.from_rotvec(camera.attitude_noise * random.standard_normal((n, 3)))
    position = np.stack([columns[name] for name in POSITION], axis=1)
    position = position + camera.position_noise * random.standard_normal((n, 3))

    outliers = random.random(n) < camera.outlier_share
    position[outliers] += camera.outlier_size * random.standard_normal((n, 3))[outliers]
    swapped = Rotation.from_rotvec(random.uniform(-1.0, 1.0, (n, 3)))
    quaternion = np.where(outliers[:, None], (shaken * swapped).as_quat(), shaken.as_quat())

    # The quaternion keeps its sign from frame to frame, but for the flips.
    continuous = np.sign(np.sum(quaternion[1:] * quaternion[:-1], axis=1))
    flips = np.where(random.random(n - 1) < camera.flips_per_minute / 60.0 / camera.rate, -1.0, 1.0)
    quaternion *= np.concatenate([[1.0], np.cumprod(np.where(continuous == 0.0, 1.0, continuous) * flips)])[:, None]

    jitter = np.clip(camera.stamp_jitter * random.standard_normal(n), -0.4 / camera.rate, 0.4 / camera.rate)
    kept = np.ones(n, dtype=bool)
    starts = np.flatnonzero(random.random(n) < camera.gaps_per_minute / 60.0 / camera.rate)
    for start, length in zip(starts, random.exponential(camera.gap_length, starts.size), strict=True):
        kept[start : start + max(1, round(length * camera.rate))] = False
    kept[[0, -1]] = True
    channels = dict(
        zip((*POSITION, *QUATERNION), np.column_stack([position, np.roll(quaternion, 1, axis=1)])[kept].T, strict=True)
    )
    return stream((true_time + jitter)[kept], channels)


def _inertial(flight: Flight, vehicle: Vehicle, unit: InertialUnit, random: np.random.Generator) -> xr.Dataset:
    time = _times(flight, unit.rate)
    force = specific_forces(flight, vehicle)
    truth = np.column_stack([*(flight.values(name) for name in RATES), force])
    sampled = np.column_stack([np.interp(time, flight.time("p"), column) for column in truth.T])
    noise = np.repeat([unit.rate_noise, unit.force_noise], 3)
    bias = np.repeat([unit.rate_bias, unit.force_bias], 3) * random.standard_normal(6)
    sampled = sampled + bias + noise * random.standard_normal(sampled.shape)
    return stream(time, dict(zip((*RATES, "ax", "ay", "az"), sampled.T, strict=True)))


def specific_forces(flight: Flight, vehicle: Vehicle, *, environment: Environment | None = None) -> Array:
    """What accelerometers at the centre of gravity read along a simulated flight [m/s^2], shape (n, 3)."""
    states = flight.array(vehicle.state_names)
    rows = flight.array((*vehicle.input_names, *SURROUNDINGS))
    numbers = parameter_row(vehicle, environment or Environment())
    u, parameters, around = unpack_rows(equations_of(vehicle), rows.T, numbers)
    state = rebuild(vehicle.state, list(states.T))
    felt = vehicle.specific_force(state, vehicle.inputs(*u), parameters, around, ArrayBackend())
    return np.stack([np.broadcast_to(part, len(states)) for part in felt], axis=1)
