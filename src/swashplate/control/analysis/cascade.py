"""An autopilot's cascade around a linear model in frequency: the plant behind its mixer, its loops, where they break.

The controllers are those of `swashplate.control.laws.ardupilot`, continuous, with the hold of its samples as half a
sample of delay. Every part takes gains as arrays of m sets at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.control.laws.ardupilot.filters import HARMONICS
from swashplate.control.laws.ardupilot.law import GRAVITY
from swashplate.control.laws.ardupilot.mixers import Mixer
from swashplate.control.laws.ardupilot.parameters import AXES
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim

COMMANDS = ("roll", "pitch", "yaw", "throttle")
OUTPUTS = ("p", "q", "r", "phi", "theta", "psi", "north", "east", "down", "x", "y", "z")
FREQUENCIES, COARSE = np.geomspace(0.05, 250.0, 400), np.geomspace(0.05, 250.0, 110)
"""rad/s: where loops are judged, and where gains are searched."""
_STEP = 1e-5
"""Of a command: how far mixers are moved to see what they do."""
_HALF_POWER = 10.0 ** (-3.0 / 20.0)
Sets = Mapping[str, Array | float]
"""Gains by ArduPilot's names, each a number or one for each of m sets."""


@dataclass(frozen=True)
class CascadePlant:
    """What the mixer's commands do.

    Attributes:
        omega: frequencies [rad/s], shape (n,).
        response: from `COMMANDS` to `OUTPUTS`, shape (n, 12, 4): delays, hold and actuators are in it.
        effect: inputs of the vehicle per command, shape (inputs, 4).
        period: of the controller [s].
        delay: that was added to the vehicle's own [s].
    """

    omega: Array
    response: Complex
    effect: Array
    period: float
    delay: Array


def cascade_plant(
    vehicle: Vehicle,
    trim: Trim,
    mixer: Mixer,
    parameters: Mapping[str, float],
    *,
    rate: float,
    delays: Array,
    omega: Array = FREQUENCIES,
) -> CascadePlant:
    """A vehicle in hover behind a mixer.

    Args:
        vehicle, trim: what flies, its hover.
        mixer, parameters: of the law.
        rate: of the controller [Hz].
        delays: from command to actuator, by input [s], shape (inputs,).
        omega: frequencies [rad/s].

    Raises:
        ControllerError: where a command moves nothing.
    """
    model, w = linearize(vehicle, trim), omega
    at = mixer.unmixed(trim.inputs, parameters)
    steps = _STEP * np.eye(len(COMMANDS))
    ends = (np.asarray(_mixed(mixer, at + sign * steps, dict(parameters))) for sign in (1.0, -1.0))
    effect = np.subtract(*ends).T[: len(vehicle.input_names)] / (2.0 * _STEP)
    lag = np.exp(-1j * w[:, None] * (delays[None, :] + 0.5 / rate))
    n = len(model.states)
    states = np.linalg.solve(1j * w[:, None, None] * np.eye(n) - model.A, (model.B[None] * lag[:, None, :]) @ effect)
    rows = [model.states.index(name) for name in ("p", "q", "r", "phi", "theta", "psi", "x", "y", "z")]
    outputs = states[:, rows]
    speeds = 1j * w[:, None, None] * outputs[:, 6:]
    response = np.concatenate([outputs[:, :6], speeds, outputs[:, 6:]], axis=1, dtype=np.complex128)
    for i, (command, output) in enumerate(zip(COMMANDS, ("p", "q", "r", "down"), strict=True)):
        if not np.max(np.abs(response[:, OUTPUTS.index(output), i])) > 1e-9:
            raise ControllerError(f"the {command} command moves no {output}.", where=vehicle.name, channel=command)
    return CascadePlant(w, response, effect, 1.0 / rate, delays)


def _mixed(mixer: Mixer, wanted: Array, parameters: dict[str, float]) -> Array:
    """Inputs of sets of commands, shape (sets, inputs)."""
    return np.stack([np.asarray(mixer.mix(commands, parameters, np).inputs) for commands in wanted])


def _one(s: Complex, hertz: Array | float) -> Complex:
    f = np.asarray(hertz, dtype=np.float64)[..., None]
    return np.asarray(np.where(f > 0.0, 1.0 / (1.0 + s / (2.0 * np.pi * np.maximum(f, 1e-9))), 1.0))


def _gyro(s: Complex, k: Sets) -> Complex:
    c = 2.0 * np.pi * float(np.max(k["INS_GYRO_FILTER"]))
    response = c**2 / (s**2 + np.sqrt(2.0) * c * s + c**2) if c > 0.0 else np.ones_like(s)
    if float(np.max(k["INS_HNTCH_ENABLE"])) > 0.5:
        deep = 10.0 ** (-float(np.max(k["INS_HNTCH_ATT"])) / 20.0)
        for harmonic in HARMONICS:
            centre, wide = (harmonic * float(np.max(k[f"INS_HNTCH_{n}"])) for n in ("FREQ", "BW"))
            octaves = 2.0 * np.log2(centre / max(centre - 0.5 * wide, 0.05 * centre))
            broad = 2.0 * np.pi * centre * (2.0**octaves - 1.0) / np.sqrt(2.0**octaves)
            turn = (2.0 * np.pi * centre) ** 2
            response = response * (s**2 + deep * broad * s + turn) / (s**2 + broad * s + turn)
    return np.asarray(response)


def feedback(omega: Array, k: Sets, *, height: bool = True, place: bool = True) -> Complex:
    """K of u = -K y with `COMMANDS` and `OUTPUTS`, shape (m, n, 4, 12); m is 1 where all gains are numbers.

    Args:
        omega: [rad/s], shape (n,).
        k: all parameters of the law.
        height, place: whether these loops are closed.
    """
    s: Complex = np.asarray(1j * np.asarray(omega), dtype=np.complex128)
    m = max(np.size(value) for value in k.values())
    at = {name: np.broadcast_to(np.asarray(value, float), (m,)) for name, value in k.items()}
    K = np.zeros((m, s.size, 4, 12), dtype=np.complex128)
    gyro, shape = _gyro(s, k), _shape(s, at)
    ahead = []
    for i, axis in enumerate(AXES):
        g = {name: at[f"ATC_RAT_{axis}_{name}"][:, None] for name in ("P", "I", "D", "FF")}
        filters = {name: _one(s, at[f"ATC_RAT_{axis}_{name}"]) for name in ("FLTT", "FLTE", "FLTD")}
        rate = (g["P"] + g["I"] / s + g["D"] * s * filters["FLTD"]) * filters["FLTE"]
        target, angle = filters["FLTT"] * (g["FF"] + rate), at[f"ATC_ANG_{axis}_P"][:, None]
        K[:, :, i, i] = rate * gyro
        K[:, :, i, 3 + i] = target * angle
        ahead.append(target * (angle * shape[0] + shape[1]))
    if place:
        e = _one(s, at["PSC_VELXY_FLTE"])
        p, sums, d = (at[f"PSC_VELXY_{n}"][:, None] for n in "PID")
        speed = e * (p + sums / s + d * s * _one(s, at["PSC_VELXY_FLTD"])) / GRAVITY
        for command, output, sign in ((0, 7, 1.0), (1, 6, -1.0)):
            K[:, :, command, output] = sign * speed * ahead[command]
            K[:, :, command, 3 + output] = K[:, :, command, output] * at["PSC_POSXY_P"][:, None]
    if height:
        c = 2.0 * np.pi * at["INS_ACCEL_FILTER"][:, None]
        felt = s * c**2 / (s**2 + np.sqrt(2.0) * c * s + c**2)
        climb = _one(s, at["PSC_VELZ_FLTE"]) * (at["PSC_VELZ_P"][:, None] + at["PSC_VELZ_I"][:, None] / s)
        lift = 0.1 * (at["PSC_ACCZ_P"][:, None] + at["PSC_ACCZ_I"][:, None] / s) * _one(s, at["PSC_ACCZ_FLTE"])
        lift = lift * _one(s, at["POSCONTROL_THROTTLE_CUTOFF_FREQ_HZ"])
        K[:, :, 3, 8] = -lift * (climb + felt)
        K[:, :, 3, 11] = -lift * climb * at["PSC_POSZ_P"][:, None]
    return K


def _shape(s: Complex, at: Mapping[str, Array]) -> tuple[Complex, Complex]:
    """From a demanded lean to the target, and to the target's rate that is fed forward."""
    shaped = at["ATC_RATE_FF_ENAB"][:, None] > 0.5
    slow = 1.0 / (1.0 + s * at["ATC_INPUT_TC"][:, None])
    return np.where(shaped, slow, 1.0), np.where(shaped, s * slow, 0.0)


@dataclass(frozen=True)
class BrokenLoops:
    """Loops broken at one signal each, the others closed, of m sets of gains and b signals.

    Attributes:
        omega: [rad/s], shape (n,). loop: shape (m, n, b).
        turns: by how much det(I + K G) turns over these frequencies, in half turns, shape (m,): sets of gains on the
            same plant that differ in it differ in their number of growing modes (Nyquist).
    """

    omega: Array
    loop: Complex
    turns: Array

    @property
    def phase(self) -> Array:
        """The least phase margin at every crossing [deg], shape (m, b); infinite without one."""
        size = np.abs(self.loop)
        crossing = (size[:, :-1] > 1.0) != (size[:, 1:] > 1.0)
        share = np.log(size[:, :-1]) / np.where(crossing, np.log(size[:, :-1]) - np.log(size[:, 1:]), 1.0)
        step = np.angle(self.loop[:, 1:] / self.loop[:, :-1])
        at = np.angle(self.loop[:, :-1] * np.exp(1j * np.clip(share, 0.0, 1.0) * step))
        return np.asarray(np.where(crossing, 180.0 - np.degrees(np.abs(at)), np.inf).min(axis=1))

    @property
    def gain(self) -> Array:
        """The least gain margin either way [dB], shape (m, b)."""
        imaginary, real = self.loop.imag, self.loop.real
        crossing = (imaginary[:, :-1] > 0.0) != (imaginary[:, 1:] > 0.0)
        share = imaginary[:, :-1] / np.where(crossing, imaginary[:, :-1] - imaginary[:, 1:], 1.0)
        where = real[:, :-1] + share * (real[:, 1:] - real[:, :-1])
        margins = np.abs(20.0 * np.log10(np.maximum(-where, 1e-12)))
        return np.asarray(np.where(crossing & (where < 0.0), margins, np.inf).min(axis=1))

    @property
    def crossover(self) -> Array:
        """The highest frequency with a gain of one [rad/s], shape (m, b); 0 without one."""
        above = np.abs(self.loop) > 1.0
        last = above.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)
        return np.asarray(np.where(above.any(axis=1), self.omega[last], 0.0))

    @property
    def delay(self) -> Array:
        """Phase over frequency, the least of every crossing [s], shape (m, b)."""
        size = np.abs(self.loop)
        crossing = (size[:, :-1] > 1.0) != (size[:, 1:] > 1.0)
        lag = np.mod(np.angle(self.loop[:, :-1]) + np.pi, 2.0 * np.pi) / self.omega[None, :-1, None]
        return np.asarray(np.where(crossing, lag, np.inf).min(axis=1))

    @property
    def peak(self) -> Array:
        """Largest sensitivity, shape (m, b)."""
        return np.asarray((1.0 / np.abs(1.0 + self.loop)).max(axis=1))

    @property
    def rejection(self) -> Array:
        """Up to where a disturbance is halved in power [rad/s], shape (m, b)."""
        left = 1.0 / np.abs(1.0 + self.loop) > _HALF_POWER
        return np.asarray(np.where(left.any(axis=1), self.omega[np.argmax(left, axis=1)], 0.0))

    def quiet(self, low: float, high: float) -> Array:
        """How far disturbances from low to high [rad/s] are held down: the mean of -log |S|, shape (m, b)."""
        band = (self.omega >= low) & (self.omega <= high)
        return np.asarray(np.log(np.abs(1.0 + self.loop[:, band])).mean(axis=1))

    @property
    def bandwidth(self) -> Array:
        """Where |L / (1 + L)| falls by 3 dB for good [rad/s], shape (m, b)."""
        above = np.abs(self.loop / (1.0 + self.loop)) > _HALF_POWER
        last = above.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)
        return np.asarray(np.where(above.any(axis=1), self.omega[last], 0.0))


def broken_at_commands(plant: CascadePlant, K: Complex, commands: tuple[int, ...]) -> BrokenLoops:
    """Broken at the mixer's commands, one at a time."""
    difference = np.eye(4) + K @ plant.response
    S = np.linalg.inv(difference)
    turned = np.unwrap(np.angle(np.linalg.det(difference)), axis=1)
    turns = np.round((turned[:, -1] - turned[:, 0]) / np.pi)
    loops = np.stack([1.0 / S[..., i, i] - 1.0 for i in commands], axis=-1, dtype=np.complex128)
    return BrokenLoops(plant.omega, loops, turns)


def broken_at_leans(plant: CascadePlant, inner: Complex, total: Complex) -> BrokenLoops:
    """The place loop, broken at the demanded roll and pitch: what it alone adds to the inner loops.

    Args:
        plant: behind the mixer.
        inner, total: `feedback` without and with the place.
    """
    closed = np.linalg.inv(np.eye(4) + inner @ plant.response)
    loop = ((total - inner) @ plant.response @ closed)[..., :2, :2]  # what leads from a demand to its command cancels
    S = np.linalg.inv(np.eye(2) + loop)
    turned = np.unwrap(np.angle(np.linalg.det(np.eye(2) + loop)), axis=1)
    turns = np.round((turned[:, -1] - turned[:, 0]) / np.pi)
    loops = np.stack([1.0 / S[..., i, i] - 1.0 for i in range(2)], axis=-1, dtype=np.complex128)
    return BrokenLoops(plant.omega, loops, turns)
