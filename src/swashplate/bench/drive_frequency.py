"""Time constants of the drive trains by frequency response: a periodic multisine on one motor.

    H(z) = g (1 - a) / (z - a), a = exp(-dt / T_d)  (Fankhauser et al., eq. 15, for a command held between samples)

Fourier coefficients over whole periods have no leakage; the noise is told by how the periods differ. Against the steps
(`drive_steps`) this separates a lag from a pure delay: a delay turns the phase and leaves the gain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import least_squares

from swashplate.arrays import Array, Complex
from swashplate.bench.record import BenchRecord
from swashplate.bench.refusals import refuse_idle
from swashplate.bench.result import BenchCheck, BenchResult, Curve, Procedure
from swashplate.bench.virtual_bench import RecordSchedule
from swashplate.errors import BenchError

HARMONICS = (1, 2, 3, 5, 8, 13, 21)
PERIOD = 10.0
"""Seconds; with the harmonics this covers 0.1 to 2.1 Hz."""
_AMPLITUDE = 0.06


def schedule_response(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Four periods of a multisine on each motor around 0.55, the other at hover; the first period settles."""
    rate, records = 100.0, []
    time = np.arange(round(4 * PERIOD * rate)) / rate
    phases = -np.pi * np.arange(len(HARMONICS)) * np.arange(1, len(HARMONICS) + 1) / len(HARMONICS)  # Schroeder 1970
    wave = sum(np.cos(2.0 * np.pi * k / PERIOD * time + phase) for k, phase in zip(HARMONICS, phases, strict=True))
    wave = _AMPLITUDE * wave / np.abs(wave).max()
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        driving = {f"motor_{rotor}": 0.55 + wave, f"motor_{other}": np.full(time.size, hover[f"motor_{other}"])}
        about = f"multisine on the {rotor} motor, 0.1 to 2.1 Hz, +-0.06 around 0.55, 4 periods of 10 s"
        records.append(
            RecordSchedule(
                f"multisine_{rotor}", (DRIVE_FREQUENCY.name,), driving, np.ones(time.size), rate, about=about
            )
        )
    return records


def estimate_response(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`tau_drive` of the rotors whose motors the records excite.

    Raises:
        BenchError: where a record has fewer than three whole periods, or the speed does not follow.
    """
    names, values, variances, checks, curves = [], [], [], [], []
    for record in records:
        rotor = "upper" if np.std(record["motor_upper"]) > np.std(record["motor_lower"]) else "lower"
        refuse_idle(record, rotor, card)
        u, y = _coefficients(record, f"motor_{rotor}"), _coefficients(record, f"omega_{rotor}")
        periods = y.shape[0]
        frequency = np.array(HARMONICS) / PERIOD
        mean_u, mean_y = u.mean(axis=0), y.mean(axis=0)
        z = np.exp(2j * np.pi * frequency * record.dt)

        def left(x: Array, z: Array = z, u: Array = mean_u, y: Array = mean_y, dt: float = record.dt) -> Array:
            a = np.exp(-dt / np.exp(x[1]))
            off = y - x[0] * (1.0 - a) / (z - a) * u
            return np.asarray(np.r_[off.real, off.imag])

        start = np.array([abs(mean_y[0] / mean_u[0]), np.log(0.15)])
        solution = least_squares(left, start, x_scale=np.abs(start), xtol=1e-12)
        tau = float(np.exp(solution.x[1]))
        noise = float(np.sum(np.var(np.r_[y.real, y.imag].reshape(2, periods, -1), axis=1, ddof=1)) / periods)
        variance = max(noise / (2 * frequency.size), 2.0 * solution.cost / (2 * frequency.size - 2))
        covariance = variance * np.linalg.inv(solution.jac.T @ solution.jac)
        if not (solution.success and 0.005 < tau < 5.0 and solution.x[0] > 0.0):
            raise BenchError(
                f"omega_{rotor} does not follow motor_{rotor} as a first-order lag does.",
                where=record.name,
                hint="Are the rotors' columns exchanged, or is the excitation too small?",
            )
        names.append(f"tau_drive_{rotor}")
        values.append(tau)
        variances.append(covariance[1, 1] * tau**2)
        excess = 2.0 * solution.cost / (2 * frequency.size - 2) / (noise / (2 * frequency.size))
        checks.append(
            BenchCheck(
                f"{record.name}: the response departs from a first-order lag by {np.sqrt(excess):.1f} times the noise"
                + ("; a delay or a second lag is in it." if excess > 6.0 else "."),
                good=excess <= 6.0,
            )
        )
        dense = np.geomspace(frequency[0], frequency[-1], 60)
        a = np.exp(-record.dt / tau)
        line = solution.x[0] * (1.0 - a) / (np.exp(2j * np.pi * dense * record.dt) - a)
        measured = mean_y / mean_u
        curves += [
            Curve(f"{what.capitalize()} of the {rotor} drive train", "frequency [Hz]", f"{what} [{unit}]",
                  frequency, of(measured), dense, of(line))
            for what, unit, of in (("gain", "rad/s", np.abs), ("phase", "deg", lambda h: np.degrees(np.angle(h))))
        ]  # fmt: skip
    if len(set(names)) < len(names):
        raise BenchError(
            "two records excite the same motor.",
            where=", ".join(r.name for r in records),
            hint="Keep one of them, or record one longer.",
        )
    files = {name: (record.name,) for name, record in zip(names, records, strict=True)}
    return BenchResult.of(
        DRIVE_FREQUENCY, records, checks, curves, names=names, values=values, covariance=variances, records_of=files
    )


def _coefficients(record: BenchRecord, channel: str) -> Complex:
    """Fourier coefficients at the harmonics in every period but the first, shape (periods, harmonics)."""
    values = record[channel]
    length = round(PERIOD / record.dt)
    periods = values.size // length
    if periods < 3:
        raise BenchError(
            f"has {periods} whole periods of {PERIOD:g} s, expected at least 3.",
            where=record.name,
            hint="The first period settles, the others are measured.",
        )
    parts = values[length : periods * length].reshape(periods - 1, length)
    return np.asarray(np.fft.rfft(parts, axis=1)[:, list(HARMONICS)] / length)


DRIVE_FREQUENCY = Procedure(
    "drive_frequency",
    "Drive trains by frequency response",
    "Fankhauser et al., eq. 15; periodic excitation as Pintelon and Schoukens (2012), ch. 2",
    ("motor_lower", "motor_upper", "omega_lower", "omega_upper"),
    estimate_response,
    schedule_response,
    in_time=True,
)
