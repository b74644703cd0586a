"""Flight-path reconstruction: do rates, accelerations, attitude and position tell the same flight?

Measured rates and specific forces are integrated and held against attitude and position (Klein and Morelli 2006,
ch. 10; Jategaonkar 2015, ch. 10). With measured = (1 + scale) * true + bias the integrals are linear in 1 / (1 + scale)
and bias / (1 + scale), and the noise stays in the response: one regression, over windows with free initial values.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import attitude_of, euler_from_quaternion, rotation
from swashplate.flights.conditioning.derive import GRAVITY
from swashplate.flights.conditioning.filters import uniform_rate
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION, QUATERNION, RATES, channel
from swashplate.shown import Shown
from swashplate.text_table import text_table


def coloured_covariance(pieces: Sequence[tuple[Array, Array]], *, lag: int) -> Array:
    """Covariance of a least-squares estimate whose residuals are correlated in time, shape (k, k).

    Klein and Morelli (2006, sec. 6.1; Morelli and Klein 1997) with the weights of Newey and West (1987), which keep the
    sum positive definite: M^-1 (sum_ij s_i R(i-j) s_j^T) M^-1.

    Args:
        pieces: per unbroken piece the sensitivities (n, k) and the residuals (n,).
        lag: furthest correlation that is counted [samples].
    """
    inverse = np.linalg.inv(np.asarray(sum(s.T @ s for s, _ in pieces)))
    middle = np.zeros_like(inverse)
    for sensitivity, residual in pieces:
        score = sensitivity * residual[:, None]
        middle += score.T @ score
        for k in range(1, min(lag, score.shape[0] - 1) + 1):
            cross = score[k:].T @ score[:-k]
            middle += (1.0 - k / (lag + 1.0)) * (cross + cross.T)
    return np.asarray(inverse @ middle @ inverse)


def regress(pieces: Sequence[tuple[Array, Array]], *, lag: int) -> tuple[Array, Array]:
    """Ordinary least squares over unbroken pieces: estimates (k,) and their covariance (k, k) for coloured residuals.

    Args:
        pieces: per piece the regressors (n, k) and the response (n,), zero-mean or with a constant among them.
        lag: furthest residual correlation that is counted [samples].

    Raises:
        FlightError: fewer samples than regressors, or regressors that are multiples of each other.
    """
    x = np.concatenate([regressors for regressors, _ in pieces])
    y = np.concatenate([response for _, response in pieces])
    scale = np.sqrt(np.mean(x**2, axis=0))
    if x.shape[0] <= x.shape[1] or np.any(scale <= 0) or np.linalg.cond(x / np.where(scale > 0, scale, 1.0)) > 1e8:
        raise FlightError(
            f"{x.shape[0]} samples cannot tell {x.shape[1]} regressors apart: one is constant or a multiple.",
            hint="Use a record in which every axis is excited.",
        )
    inverse = np.linalg.inv(x.T @ x)
    values = inverse @ x.T @ y
    return values, coloured_covariance([(a, b - a @ values) for a, b in pieces], lag=lag)


_FORCES = ("ax", "ay", "az")
_SIGNIFICANT = 3.0
_LEFT_OUT = (
    "The standard errors leave out the noise of the attitude that turns the rates: a bias of only a few of them "
    "may be none."
)
_HEAD = ("channel", "unit", "bias", "sigma", "scale - 1", "sigma", "significant")


@dataclass(frozen=True)
class SensorErrorEstimate:
    """A number with its standard error, in which the noise of the attitude is left out."""

    value: float
    sigma: float

    @property
    def t(self) -> float:
        return self.value / self.sigma

    @property
    def significant(self) -> bool:
        return abs(self.t) > _SIGNIFICANT


@dataclass(frozen=True)
class Reconstruction(Shown):
    """What flight-path reconstruction found.

    Attributes:
        biases: per measured channel, in its unit.
        scales: per measured channel, dimensionless (0 is perfect).
        notes: in words what could not be told and why.
    """

    biases: Mapping[str, SensorErrorEstimate] = field(default_factory=dict)
    scales: Mapping[str, SensorErrorEstimate] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def corrected(self, flight: Flight) -> Flight:
        """The flight with every channel's significant bias and scale factor taken out; its history says so.

        A scale factor of a half or more is no sensor's error but a channel that hardly moved, and stays.

        Raises:
            FlightError: where it lacks a channel that was judged.
        """
        bias = {name: e.value if e.significant else 0.0 for name, e in self.biases.items()}
        scale = {n: e.value if e.significant and abs(e.value) < 0.5 else 0.0 for n, e in self.scales.items()}
        return correct_sensors(flight, biases=bias, scales=scale)

    def to_document(self) -> dict[str, object]:
        """As JSON types: values and standard errors by channel."""
        return {
            "biases": {name: [e.value, e.sigma] for name, e in self.biases.items()},
            "scales": {name: [e.value, e.sigma] for name, e in self.scales.items()},
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        rows = []
        for name, s in self.scales.items():
            b = self.biases.get(name)
            errors = [word for word, e in (("bias", b), ("scale", s)) if e is not None and e.significant]
            both = [(f"{e.value:+.4g}", f"{e.sigma:.2g}") if e is not None else ("-", "-") for e in (b, s)]
            rows.append([name, channel(name).unit, *both[0], *both[1], " and ".join(errors)])
        lines = [text_table(_HEAD, rows, left=(0, 1, 6)), _LEFT_OUT] if rows else []
        return "\n".join([*lines, *self.notes])


def correct_sensors(flight: Flight, *, biases: Mapping[str, float], scales: Mapping[str, float]) -> Flight:
    """The flight with (measured - bias) / (1 + scale) in place of what was measured.

    Args:
        flight: as logged or conditioned.
        biases: by channel, in its unit. scales: by channel, 0 for none.

    Raises:
        FlightError: for a channel that the flight does not have.
    """
    out = flight
    for name in dict.fromkeys((*biases, *scales)):
        true = (flight.values(name) - biases.get(name, 0.0)) / (1.0 + scales.get(name, 0.0))
        out = out.with_channel(name, true, like=name)
    return out.done("correct_sensors", biases=dict(biases), scales=dict(scales))


def _windows(flight: Flight, length: float) -> list[Flight]:
    """The segments cut into windows of about `length` seconds."""
    pieces: list[Flight] = []
    for part in flight.split():
        count = max(1, int(part.duration // length))
        edges = np.linspace(part.start, part.stop, count + 1)
        pieces += [part.between(a, b) for a, b in pairwise(edges.tolist())]
    return [piece for piece in pieces if piece.duration > 0.5 * length or len(pieces) == 1]


def _integral(values: Array, rate: float) -> Array:
    from scipy.integrate import cumulative_trapezoid  # dear to import, and every conditioning imports this module

    return np.asarray(cumulative_trapezoid(values, dx=1.0 / rate, axis=0, initial=0.0), dtype=np.float64)


def _euler_matrix(euler: Array) -> Array:
    """Body rates to Euler-angle rates, shape (n, 3, 3) (Stevens and Lewis 2003, eq. 1.3-22)."""
    phi, theta, _ = euler.T
    s, c, tan, sec = np.sin(phi), np.cos(phi), np.tan(theta), 1.0 / np.cos(theta)
    one, zero = np.ones_like(phi), np.zeros_like(phi)
    rows = ((one, s * tan, c * tan), (zero, c, -s), (zero, s * sec, c * sec))
    return np.stack([np.stack(row, -1) for row in rows], axis=-2)


def _estimates(
    pieces: list[tuple[Array, Array, Array]], names: Iterable[str], rate: float
) -> tuple[dict[str, SensorErrorEstimate], dict[str, SensorErrorEstimate]]:
    """Biases and scales from (integrals (n, 3, 6), initial-value columns (n, 3, k), response (n, 3)) per window.

    The initial values of a window are regressed out of it first (Frisch and Waugh 1933).
    """
    data = []
    for integrals, initial, response in pieces:
        x = integrals.reshape(-1, 6)
        free = initial.reshape(-1, initial.shape[-1])
        both = np.column_stack([x, response.reshape(-1)])
        rest = both - free @ np.linalg.lstsq(free, both, rcond=None)[0]
        data.append((rest[:, :6], rest[:, 6]))
    lag = round(3 * rate)  # the three axes lie next to each other: one second of samples
    values, covariance = regress(data, lag=lag)
    biases, scales = {}, {}
    for k, name in enumerate(names):
        gain, offset = values[k], values[3 + k]
        block = covariance[np.ix_([k, 3 + k], [k, 3 + k])]
        slope = np.array([-offset / gain**2, 1.0 / gain])  # bias = offset / gain
        biases[name] = SensorErrorEstimate(float(offset / gain), float(np.sqrt(slope @ block @ slope)))
        scales[name] = SensorErrorEstimate(float(1.0 / gain - 1.0), float(np.sqrt(block[0, 0]) / gain**2))
    return biases, scales


def rate_errors(
    flight: Flight, *, window: float = 10.0
) -> tuple[dict[str, SensorErrorEstimate], dict[str, SensorErrorEstimate]]:
    """Biases [rad/s] and scale factors of measured p q r against the attitude.

    Args:
        flight: one uniform stream with measured rates and attitude.
        window: length [s] over which rates are integrated with free initial attitude.
    """
    rate = uniform_rate(flight)
    pieces = []
    for part in _windows(flight, window):
        euler = euler_from_quaternion(attitude_of(part))
        matrix = _euler_matrix(euler)
        integrals = np.concatenate(
            [_integral(matrix * part.array(RATES)[:, None, :], rate), -_integral(matrix, rate)], axis=-1
        )
        initial = np.broadcast_to(np.eye(3), (euler.shape[0], 3, 3))
        pieces.append((integrals, np.array(initial), euler))
    return _estimates(pieces, RATES, rate)


def acceleration_errors(
    flight: Flight, *, window: float = 5.0, gravity: float | None = None
) -> tuple[dict[str, SensorErrorEstimate], dict[str, SensorErrorEstimate]]:
    """Biases [m/s^2] and scale factors of measured specific force ax ay az against position and attitude.

    Args:
        flight: one uniform stream with measured specific force at the tracked point, position and attitude.
        window: length [s] over which forces are integrated twice with free initial position and velocity.
        gravity: [m/s^2]; the flight's own where None, and standard gravity where that is not known.
    """
    rate = uniform_rate(flight)
    taken = next((one for one in (gravity, flight.gravity) if one is not None), GRAVITY)
    pieces = []
    for part in _windows(flight, window):
        matrix = rotation(attitude_of(part)).as_matrix()
        twice = np.concatenate([matrix * part.array(_FORCES)[:, None, :], -matrix], axis=-1)
        time = part.time(POSITION[0]) - part.start
        integrals = _integral(_integral(twice, rate), rate)
        fall = np.zeros((time.size, 3))
        fall[:, 2] = 0.5 * taken * time**2
        initial = np.concatenate(
            [np.broadcast_to(np.eye(3), (time.size, 3, 3)), time[:, None, None] * np.eye(3)], axis=-1
        )
        pieces.append((integrals, initial, part.array(POSITION) - fall))
    return _estimates(pieces, _FORCES, rate)


def _derived(flight: Flight) -> set[str]:
    """Channels that conditioning made, which therefore tell nothing about sensors."""
    return {name for step in flight.history if step.operation == "derive" for name in step.details.get("derived", ())}


def reconstruct(flight: Flight) -> Reconstruction:
    """Everything that the flight can tell about its own sensors: each estimate with its bound, each gap in words.

    Args:
        flight: conditioned.
    """
    derived = _derived(flight)
    notes: list[str] = []
    biases: dict[str, SensorErrorEstimate] = {}
    scales: dict[str, SensorErrorEstimate] = {}
    has_attitude = any(all(name in flight for name in names) for names in (QUATERNION, ATTITUDE))
    for names, label, needs, estimate in (
        (RATES, "rates", has_attitude, rate_errors),
        (_FORCES, "accelerations", has_attitude and all(n in flight for n in POSITION), acceleration_errors),
    ):
        measured = all(name in flight and name not in derived for name in names)
        if not measured:
            notes.append(f"{label}: not measured in this flight, so they have no bias or scale factor to find")
        elif not needs:
            notes.append(f"{label}: nothing in this flight to hold them against")
        else:
            b, s = estimate(flight)
            biases.update(b)
            scales.update(s)
    return Reconstruction(biases, scales, tuple(notes))
