"""The lever arm from the centre of gravity to the tracked point, from the flight itself.

The point at l (body axes) from the centre of gravity has the specific force (Jategaonkar 2015, ch. 10; Klein and
Morelli 2006, ch. 10)

    f_point = f_cg + omega_dot x l + omega x (omega x l).

Of a hovering rotorcraft f_cg is known well enough: across the body it is drag and a small tilt of the thrust, along it
the thrust. So two of the three equations hold each component, and whether they agree is a test of the whole idea:

    fx: lz with qdot, ly with -rdot     fy: lx with rdot, lz with -pdot     fz: ly with pdot, lx with -qdot

lz is confounded. What accelerates roll and pitch is the tilted rotor, and the tilted rotor's thrust T also pulls across
the body: with hub stiffness K, hub height h and inertia I, qdot = (K + T h) beta / I while fx = -(T / m) beta. The
regression therefore finds lz - g I / (K + T h) (T = m g): the distance to the centre of percussion. `percussion_offset`
computes the second part; the flight alone cannot separate the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import attitude_of, rotation
from swashplate.flights.conditioning.derive import GRAVITY, differentiate
from swashplate.flights.conditioning.filters import filtered, uniform_rate
from swashplate.flights.conditioning.regression import regress
from swashplate.flights.flight import Flight
from swashplate.flights.schema import POSITION, RATES, VELOCITY

_Equation = tuple[float, float, float, float]  # value [m], sigma [m], partial R^2, mean partial coherence
_FORCES = ("ax", "ay", "az")
# What else bends the specific force of the centre of gravity: drag, rotor damping and tilt across, thrust along.
_NUISANCE = (
    ("u", "v", "p", "q", "servo_roll", "servo_pitch"),
    ("u", "v", "p", "q", "servo_roll", "servo_pitch"),
    ("w", "motor_lower", "motor_upper"),
)
_SIGNIFICANT = 3.0  # standard errors
_PASSES = 4  # drag depends on the velocity of the centre of gravity, and with it on the arm
_CORRELATED = 1.0  # s: residual correlation beyond this is not counted


@dataclass(frozen=True)
class LeverComponent:
    """One component of the lever arm and its own test.

    Attributes:
        value: [m], the weighted mean of the equations.
        sigma: standard error [m], for coloured residuals, widened by the equations' disagreement.
        t: value / sigma.
        p_value: of a lever arm of zero giving this t (two-sided, normal).
        equations: per force channel (value [m], sigma [m], partial R^2, mean partial coherence in the band).
        spread: the equations' difference in standard errors; above 3 they disagree by more than noise.
    """

    value: float
    sigma: float
    t: float
    p_value: float
    equations: Mapping[str, tuple[float, float, float, float]]
    spread: float

    @property
    def significant(self) -> bool:
        return abs(self.t) > _SIGNIFICANT


@dataclass(frozen=True)
class LeverArm:
    """From the centre of gravity to the tracked point, body axes [m].

    `z.value` holds the centre of percussion's distance as it comes out of the flight; `vertical` adds `percussion`.
    """

    x: LeverComponent
    y: LeverComponent
    z: LeverComponent
    percussion: float
    band: tuple[float, float]
    samples: int

    @property
    def vertical(self) -> float:
        """lz [m] after the centre of percussion is taken off; as good as the inertia and stiffness it is based on."""
        return self.z.value + self.percussion

    @property
    def vector(self) -> tuple[float, float, float]:
        """(lx, ly, lz) [m], lz corrected, components that are not significant as zero (lz by its uncorrected test)."""
        parts = (self.x, self.y, self.z)
        raw = (self.x.value, self.y.value, self.vertical)
        keep = [part.significant for part in parts[:2]] + [self.percussion != 0.0 or self.z.significant]
        return tuple(v if k else 0.0 for v, k in zip(raw, keep, strict=True))  # pyrefly: ignore[bad-return]

    def __str__(self) -> str:
        lines = [f"lever arm from {self.samples} samples, {self.band[0]:g} to {self.band[1]:g} Hz"]
        for name, part in (("lx", self.x), ("ly", self.y), ("lz (apparent)", self.z)):
            verdict = "significant" if part.significant else "not significant"
            source = "; ".join(
                f"{f} {v:+.4f} ± {s:.4f} (partial R² {r:.2f}, coherence {c:.2f})"
                for f, (v, s, r, c) in part.equations.items()
            )
            lines.append(f"  {name} {part.value:+.4f} ± {part.sigma:.4f} m, t {part.t:.1f}, {verdict}: {source}")
        if self.percussion:
            lines.append(
                f"  lz {self.vertical:+.4f} m with the centre of percussion at {self.percussion:.4f} m taken off"
            )
        return "\n".join(lines)


def percussion_offset(*, inertia: float, hub_stiffness: float, thrust_moment: float, gravity: float = GRAVITY) -> float:
    """g I / (K + sum T h) [m]: by how much the apparent lz lies below (in value) the true one.

    Args:
        inertia: about the axis [kg m^2].
        hub_stiffness: of all rotors [N m/rad].
        thrust_moment: sum over the rotors of thrust times hub height above the centre of gravity [N m].
        gravity: [m/s^2].
    """
    return gravity * inertia / (hub_stiffness + thrust_moment)


def _cross_matrix(vector: Array) -> Array:
    """[v x] for rows of v, shape (n, 3, 3)."""
    x, y, z = vector.T
    zero = np.zeros_like(x)
    return np.stack([np.stack(row, -1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))], axis=-2)


def _partial_coherence(
    regressors: Array, response: Array, column: int, *, rate: float, band: tuple[float, float]
) -> float:
    """Mean coherence in the band of what the other regressors leave of the response and of one regressor."""
    from scipy.signal import coherence

    others = np.delete(regressors, column, axis=1)
    pair = np.column_stack([regressors[:, column], response])
    rest = pair - others @ np.linalg.lstsq(others, pair, rcond=None)[0]
    length = min(rest.shape[0] // 4, round(4.0 / band[0] * rate))
    if length < 8:
        return float("nan")
    frequency, gamma2 = coherence(rest[:, 0], rest[:, 1], fs=rate, nperseg=length)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    return float(np.mean(gamma2[inside])) if inside.any() else float("nan")


def _component(equations: Mapping[str, tuple[float, float, float, float]]) -> LeverComponent:
    """Equations of one component put together by their variances; where they disagree the bound grows (Birge 1932)."""
    from scipy.stats import norm

    values = np.array([v for v, _, _, _ in equations.values()])
    sigmas = np.array([s for _, s, _, _ in equations.values()])
    weight = sigmas**-2
    value = float(np.sum(weight * values) / np.sum(weight))
    spread = float(np.sqrt(np.sum(weight * (values - value) ** 2) / max(1, values.size - 1)))
    sigma = float(np.sqrt(1.0 / np.sum(weight)) * max(1.0, spread))
    t = value / sigma
    return LeverComponent(value, sigma, t, float(2.0 * norm.sf(abs(t))), dict(equations), spread)


def lever_arm(
    flight: Flight, *, band: tuple[float, float] = (0.3, 6.0), percussion: float = 0.0, nuisance: bool = True
) -> LeverArm:
    """The lever arm from the centre of gravity to the tracked point of a hovering rotorcraft, each component tested.

    Both sides of each equation pass the same zero-phase band-pass; the standard errors count the residual's colour.

    Args:
        flight: conditioned, with derived rates and specific force of the tracked point.
        band: [Hz]; below it gusts and drag move f_cg, above it the tracking noise of omega_dot biases towards zero.
        percussion: `percussion_offset` of the vehicle [m], 0 where unknown.
        nuisance: fit drag, rotor tilt and thrust along (channels that the flight has).

    Raises:
        FlightError: channels missing, or no segment long enough.
    """
    rate = uniform_rate(flight)
    missing = [name for name in (*RATES, *_FORCES) if name not in flight]
    if missing:
        raise FlightError(
            f"the flight lacks {', '.join(missing)}.",
            where=flight.provenance.source or None,
            hint="Condition it with derive=True.",
        )
    parts = [part for part in flight.split() if part.duration >= 2.0 / band[0]]
    if not parts:
        raise FlightError(
            f"no segment lasts {2.0 / band[0]:.1f} s, which the band from {band[0]:g} Hz needs.",
            where=flight.provenance.source or None,
            hint="Allow longer gaps or raise the lower corner.",
        )
    arm = np.zeros(3)
    for _ in range(_PASSES):
        pieces = [_equations(part, arm, rate=rate, band=band, nuisance=nuisance) for part in parts]
        components = [_component(equations) for equations in _solve(pieces, rate=rate, band=band)]
        arm = np.array([component.value for component in components])
    x, y, z = components
    return LeverArm(x, y, z, percussion, band, sum(force.shape[0] for force, _, _ in pieces))


_Piece = tuple[Array, Array, list[Array]]


def _equations(part: Flight, arm: Array, *, rate: float, band: tuple[float, float], nuisance: bool) -> _Piece:
    """Specific force (n, 3), the matrix that multiplies the arm (n, 3, 3) and each axis's nuisance, band-passed."""
    omega = part.array(RATES)
    cross = _cross_matrix(omega)
    kinematic = _cross_matrix(differentiate(omega, rate=rate)) + cross @ cross
    signals = {name: part.values(name) for names in _NUISANCE for name in names if nuisance and name in part}
    for k, name in enumerate(VELOCITY):
        if name in signals:  # drag goes with the velocity of the centre of gravity
            signals[name] = signals[name] - (cross @ arm)[:, k]
    extra = [[signals[name] for name in names if name in signals] for names in _NUISANCE]
    columns = np.column_stack([part.array(_FORCES), kinematic.reshape(-1, 9), *(c for group in extra for c in group)])
    edge = round(0.25 / band[0] * rate)  # the filter rings at the ends for part of the lowest frequency's period
    kept = filtered(columns, rate=rate, cutoff=band)[edge:-edge]
    ends = np.cumsum([len(group) for group in extra])
    return kept[:, :3], kept[:, 3:12].reshape(-1, 3, 3), np.split(kept[:, 12:], ends[:-1], axis=1)


def _solve(pieces: list[_Piece], *, rate: float, band: tuple[float, float]) -> list[dict[str, _Equation]]:
    """Per component of the arm what each force equation says of it."""
    by_component: list[dict[str, _Equation]] = [{}, {}, {}]
    for axis, name in enumerate(_FORCES):
        arms = [k for k in range(3) if k != axis]  # omega_dot x l has no part along its own axis's arm
        data = [
            (np.column_stack([matrix[:, axis, arms], group[axis]]), force[:, axis]) for force, matrix, group in pieces
        ]
        moving = np.any(np.concatenate([x for x, _ in data]) != 0.0, axis=0)  # constant inputs leave nothing
        data = [(x[:, moving], y) for x, y in data]
        fit = regress(data, lag=round(_CORRELATED * rate))
        longest = max(data, key=lambda piece: piece[1].size)
        for column, arm in enumerate(arms):
            gamma2 = _partial_coherence(*longest, column, rate=rate, band=band)
            by_component[arm][name] = (
                float(fit.values[column]),
                float(fit.sigma[column]),
                float(fit.partial[column]),
                gamma2,
            )
    return by_component


def move_to_cg(flight: Flight, lever_arm: ArrayLike) -> Flight:
    """The flight with x y z of the centre of gravity instead of the tracked point: p_cg = p_point - R l.

    Move before deriving velocities; a flight that has u v w or ax ay az already must be derived again.

    Args:
        flight: position and attitude in one stream.
        lever_arm: (lx, ly, lz) from the centre of gravity to the tracked point, body axes [m].

    Raises:
        FlightError: no attitude or position, or derived motion that would no longer fit.
    """
    arm = np.asarray(lever_arm, dtype=np.float64)
    if arm.shape != (3,) or not np.isfinite(arm).all():
        raise FlightError(f"the lever arm is {arm.tolist()}, expected three finite numbers [m].")
    stale = [name for name in ("u", "v", "w", "ax", "ay", "az") if name in flight]
    if stale:
        raise FlightError(
            f"the flight already has {', '.join(stale)} of the tracked point.",
            where=flight.provenance.source or None,
            hint="Condition with derive=False, move, then derive(flight).",
        )
    moved = flight.array(POSITION) - rotation(attitude_of(flight)).apply(arm)
    out = flight
    for name, values in zip(POSITION, moved.T, strict=True):
        out = out.with_channel(name, values, like=name)
    return out.done("move_to_cg", lever_arm=arm.tolist())
