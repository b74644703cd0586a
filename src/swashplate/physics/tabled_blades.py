"""A rotor disc by blade elements with a tabled aerofoil: lift, drag and moment over angle, Mach and Reynolds number.

What `blade_element` integrates in closed form for a straight lift line, here by quadrature over radius (Gauss) and
azimuth (even steps) for any profile: full angles at the element, stall, reversed flow, compressibility. Each element
meets the flow as if it were alone and steady (no yawed flow, no dynamic stall). Symbols, axes and scales are those of
`blade_element`; velocities of the hub and the disc's flapping enter as there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.blade_element import Disc, FlapMoments
from swashplate.physics.inflow import momentum_inflow

_OUTER = 10.0
"""deg, steps of angle where nothing changes fast."""
RADIAL, AZIMUTHAL = 6, 10
"""Nodes over the blade and over a turn: thrust, torque and flap moments within 0.2 % of forty by ninety nodes, in-plane
forces within 1 % (tested on the packaged table, hover to an advance ratio of 0.3)."""
_OVER_TIP = 2
_THRUST_STEPS = 2
"""From the straight line's answer: 1e-7 of the tip speed left below stall, 1e-4 far beyond (tested)."""
_TINY = 1e-9
_DIVERGED = 0.1
"""Rise of drag per Mach number at which it is said to diverge (Hoerner 1965, ch. XV)."""
_INNER = 0.25
"""Radius within which hardly any lift is made, and angles are large on every rotor."""


@dataclass(frozen=True)
class AerofoilTable:
    """Lift, drag and moment of a profile as cubics (Hermite) of the angle, at Mach and Reynolds numbers.

    Attributes:
        digest: of its numbers: two tables with the same one are the same.
        name, source: for messages.
        mach, log_reynolds: knots, two at least each, rising; Reynolds numbers as natural logarithms.
        fine, step: angles [deg] up to which it is laid out in steps of `step`; beyond in steps of `_OUTER`.
        nodes: shape (mach * reynolds * (intervals + 1), 6): lift, its slope [1/deg], drag, its slope, moment about the
            quarter chord, its slope. Above some 0.2 MB compiled loops are three to four times slower (measured).
        stall: largest and smallest angle [rad] of lift that grows, shape (mach * reynolds, 2).
        measured: angles that the table itself holds [rad]; a flat plate beyond.
        span: Mach and Reynolds numbers that it holds: (low, high) of each.
    """

    digest: str
    name: str = field(compare=False)
    source: str = field(compare=False, repr=False)
    mach: tuple[float, ...] = field(compare=False, repr=False)
    log_reynolds: tuple[float, ...] = field(compare=False, repr=False)
    fine: float = field(compare=False, repr=False)
    step: float = field(compare=False, repr=False)
    nodes: NDArray[np.float64] = field(compare=False, repr=False)
    stall: NDArray[np.float64] = field(compare=False, repr=False)
    measured: tuple[float, float] = field(compare=False, repr=False)
    span: tuple[tuple[float, float], tuple[float, float]] = field(compare=False, repr=False)

    @property
    def outer(self) -> int:
        """Intervals on one side of the finely laid out angles."""
        return round((180.0 - self.fine) / _OUTER)

    @property
    def intervals(self) -> int:
        return 2 * self.outer + round(2.0 * self.fine / self.step)

    def angles(self) -> NDArray[np.float64]:
        """Where the cubics meet [deg]."""
        inner = np.linspace(-self.fine, self.fine, self.intervals - 2 * self.outer + 1)
        left = np.linspace(-180.0, -self.fine, self.outer + 1)
        return np.concatenate([left[:-1], inner, -left[-2::-1]])


class TabledBlades(NamedTuple):
    """The blades of a rotor and the flow at their tips.

    Attributes:
        table: of the profile.
        solidity: of the rotor.
        lift_slope: by which flap moments are divided, as `blade_element.flap_moments` are.
        chord: over the radius.
        tip_mach, tip_reynolds: of the rotor's turning alone.
        root, tip: of the part that lifts, over the radius; drag reaches from the root to 1.
    """

    table: AerofoilTable
    solidity: Scalar
    lift_slope: Scalar
    chord: Scalar
    tip_mach: Scalar
    tip_reynolds: Scalar
    root: Scalar
    tip: Scalar


class TabledLoads(NamedTuple):
    """What `blade_element` says of a disc, and slopes.

    Attributes:
        CT, CX, CY, CQ: as in `blade_element.DiscLoads`.
        roll, pitch: moments on the hub by the profile's own moment, by rho A (Omega R)^2 R.
        moments: as from `blade_element.flap_moments`.
        loss: fall of C_T by lam0.
        slopes: of the moments' cosine part by q and p, and of the sine part: 1/4, 0, 0, 1/4 of a whole straight line.
    """

    CT: Scalar
    CX: Scalar
    CY: Scalar
    CQ: Scalar
    roll: Scalar
    pitch: Scalar
    moments: FlapMoments
    loss: Scalar
    slopes: tuple[Scalar, Scalar, Scalar, Scalar]


class SectionCoefficients(NamedTuple):
    """Coefficients at elements, slopes of lift and drag by the angle [1/rad], drag's rise by Mach, stall angles."""

    lift: Any
    drag: Any
    moment: Any
    lift_slope: Any
    drag_slope: Any
    drag_by_mach: Any
    stall: Any


def section(table: AerofoilTable, angle: Any, mach: Any, reynolds: Any, xp: Any) -> SectionCoefficients:
    """A profile at angles [rad], Mach and Reynolds numbers: arrays of one shape.

    Cubic in the angle (once differentiable), linear in the Mach number and in the logarithm of the Reynolds number;
    constant beyond the table's Mach and Reynolds numbers.
    """
    degrees = angle * (180.0 / math.pi)
    degrees = degrees - 360.0 * xp.floor((degrees + 180.0) / 360.0)
    inside, last = xp.abs(degrees) <= table.fine, table.intervals - 1
    beyond = xp.where(degrees < 0.0, degrees + 180.0, degrees - table.fine) / _OUTER
    beyond = beyond + xp.where(degrees < 0.0, 0.0, table.intervals - table.outer)
    place = xp.where(inside, (degrees + table.fine) / table.step + table.outer, beyond)
    width = xp.where(inside, table.step, _OUTER)
    interval = xp.clip(xp.floor(place), 0, last).astype(int)
    t = place - interval
    i, above = _between(mach, table.mach, xp)
    j, right = _between(xp.log(reynolds + _TINY), table.log_reynolds, xp)
    nodes, stall, columns = xp.asarray(table.nodes), xp.asarray(table.stall), len(table.log_reynolds)
    # One gather for all corners.
    blocks = [(i + k) * columns + j + n for k in (0, 1) for n in (0, 1)]
    shares = [(1.0 - above, above)[k] * (1.0 - right, right)[n] for k in (0, 1) for n in (0, 1)]
    places = xp.stack([block * (table.intervals + 1) + interval + end for end in (0, 1) for block in blocks])
    corners = xp.take(nodes, places, axis=0, mode="clip")
    weights = xp.stack(shares)[..., None]
    first, second = xp.sum(weights * corners[:4], axis=0), xp.sum(weights * corners[4:], axis=0)

    def between(low: Any, high: Any, column: int) -> Any:
        y0, y1, s0, s1 = low[..., column], high[..., column], low[..., column + 1], high[..., column + 1]
        u = 1.0 - t
        return (1.0 + 2.0 * t) * u * u * y0 + (3.0 - 2.0 * t) * t * t * y1 + width * t * u * (u * s0 - t * s1)

    def slope(column: int) -> Any:
        y0, y1, s0, s1 = first[..., column], second[..., column], first[..., column + 1], second[..., column + 1]
        u = 1.0 - t
        per_degree = 6.0 * t * u * (y1 - y0) / width + u * (1.0 - 3.0 * t) * s0 - t * (2.0 - 3.0 * t) * s1
        return per_degree * (180.0 / math.pi)

    low, high = (
        corners[k::4] + right[..., None] * (corners[k + 1 :: 4] - corners[k::4]) for k in (0, 2)
    )  # drag at the two Mach numbers, of either end
    rise = between(high[0], high[1], 2) - between(low[0], low[1], 2)
    bounds = xp.take(stall, xp.stack(blocks), axis=0, mode="clip")
    return SectionCoefficients(
        between(first, second, 0),
        between(first, second, 2),
        between(first, second, 4),
        slope(0),
        slope(2),
        rise / xp.take(xp.asarray(np.diff(table.mach)), i),
        xp.sum(weights * bounds, axis=0),
    )


def _between(value: Any, knots: tuple[float, ...], xp: Any) -> tuple[Any, Any]:
    """The interval of rising knots in which a value lies, and its share of the way through."""
    low, widths = np.asarray(knots[:-1]), np.diff(knots)
    index = sum((xp.asarray(value >= knot).astype(int) for knot in knots[1:-1]), start=xp.zeros_like(value, dtype=int))
    share = (value - xp.take(xp.asarray(low), index)) / xp.take(xp.asarray(widths), index)
    return index, xp.clip(share, 0.0, 1.0)


class _Elements(NamedTuple):
    """Nodes of the quadrature with their weights, what each meets, and its profile."""

    x: Any
    cos: Any
    sin: Any
    weight: Any
    lifting: Any
    u_t: Any
    u_p: Any
    u: Any
    angle: Any
    mach: Any
    reynolds: Any
    profile: SectionCoefficients
    beta: Any


def _elements(d: Disc, blades: TabledBlades, xp: Any, radial: int, azimuthal: int) -> _Elements:
    """What every element meets; all arrays end in the axis of the elements, after those of the scalars."""
    scalars = xp.broadcast_arrays(*(xp.asarray(v) for v in (*d, *blades[3:])))
    d = Disc(*(v[..., None] for v in scalars[: len(d)]))
    _, tip_mach, tip_reynolds, root, tip = (v[..., None] for v in scalars[len(d) :])
    shape = (1,) * scalars[0].ndim + (-1,)

    def laid(values: Any) -> Any:
        return xp.asarray(np.reshape(values, shape))

    over = 0 if isinstance(blades.tip, float) and blades.tip == 1.0 else _OVER_TIP
    parts = [np.polynomial.legendre.leggauss(n) for n in (radial, over) if n]
    psi = 2.0 * np.pi * (np.arange(azimuthal) + 0.5) / azimuthal
    turn = np.tile(psi, radial + over)
    along = np.concatenate([np.repeat(0.5 * (n + 1.0), azimuthal) for n, _ in parts])
    share = np.concatenate([np.repeat(0.5 * w / azimuthal, azimuthal) for _, w in parts])
    lifts = np.repeat([1.0, 0.0], [radial * azimuthal, over * azimuthal])
    lifting, c, s = laid(lifts), laid(np.cos(turn)), laid(np.sin(turn))
    begin, length = xp.where(lifting > 0.0, root, tip), xp.where(lifting > 0.0, tip - root, 1.0 - tip)
    x, weight = begin + length * laid(along), length * laid(share)

    beta = d.a0 - d.a1 * c - d.b1 * s
    u_t = x + d.mu_x * s + d.mu_y * c
    u_p = d.mu_z - d.lam0 - beta * (d.mu_x * c - d.mu_y * s)
    u_p = u_p + x * ((d.q - d.lam_c + d.b1) * c + (d.p - d.lam_s - d.a1) * s)
    u = xp.sqrt(u_t * u_t + u_p * u_p + _TINY)
    angle = d.theta0 + d.twist * x - d.A1 * c - d.B1 * s + xp.arctan2(u_p, u_t)
    mach, reynolds = tip_mach * u, tip_reynolds * u
    profile = section(blades.table, angle, mach, reynolds, xp)
    return _Elements(x, c, s, weight, lifting, u_t, u_p, u, angle, mach, reynolds, profile, beta)


def tabled_loads(
    d: Disc, blades: TabledBlades, xp: Backend, *, radial: int = RADIAL, azimuthal: int = AZIMUTHAL
) -> TabledLoads:
    """Thrust, in-plane forces, torque, hub and flap moments of a disc, and slopes (Leishman 2006, ch. 3 and 14).

    An element at the air's speed U = (U_T, U_P) carries U (c_l U_T + c_d U_P) across the disc and
    U (c_d U_T - c_l U_P) along it, against its motion. Slopes leave out what Mach and Reynolds number change.

    Args:
        d: what the blades see.
        blades: the blades.
        xp: operations with `arrays`.
        radial, azimuthal: nodes.
    """
    np_ = xp.arrays
    e = _elements(d, blades, np_, radial, azimuthal)
    f = e.profile
    lift, moment = e.lifting * f.lift, e.lifting * f.moment
    up = e.u * (lift * e.u_t + f.drag * e.u_p)
    against = e.u * (f.drag * e.u_t - lift * e.u_p)
    turned = e.u_t / (e.u * e.u)  # of the angle, by U_P
    by_up = e.u_p / e.u * (lift * e.u_t + f.drag * e.u_p)
    by_up = by_up + e.u * (turned * (e.lifting * f.lift_slope * e.u_t + f.drag_slope * e.u_p) + f.drag)

    def mean(values: Any) -> Any:
        return np_.sum(e.weight * values, axis=-1)

    half, x2 = 0.5 * blades.solidity, e.x * e.x
    nose_up = e.u * e.u * moment
    first, slope = 1.0 / blades.lift_slope, 2.0 / blades.lift_slope
    return TabledLoads(
        half * mean(up),
        half * mean(up * e.beta * e.cos - against * e.sin),
        half * mean(-up * e.beta * e.sin - against * e.cos),
        half * mean(against * e.x),
        -half * blades.chord * mean(nose_up * e.cos),
        half * blades.chord * mean(nose_up * e.sin),
        FlapMoments(first * mean(e.x * up), slope * mean(e.x * up * e.cos), slope * mean(e.x * up * e.sin)),
        half * mean(by_up),
        (
            slope * mean(x2 * by_up * e.cos * e.cos),
            slope * mean(x2 * by_up * e.cos * e.sin),
            slope * mean(x2 * by_up * e.cos * e.sin),
            slope * mean(x2 * by_up * e.sin * e.sin),
        ),
    )


def tabled_inflow(d: Disc, blades: TabledBlades, start: Scalar, kept: Scalar, *, mu2: Scalar, xp: Backend) -> Scalar:
    """lam0 with which 2 V lam0 equals the blades' thrust: momentum theory with the thrust's tangent, taken anew.

    The tangent never rises: where stall makes thrust grow with the inflow, the search still ends, but slower.

    Args:
        d: what the blades see; its lam0 is replaced.
        blades: the blades.
        start: first guess of lam0.
        kept: share of lam0 that is there at the blades (ground effect).
        mu2: advance ratio squared.
        xp: the operations.
    """
    lam0 = start
    for _ in range(_THRUST_STEPS):
        at = tabled_loads(d._replace(lam0=kept * lam0), blades, xp)
        loss = kept * xp.maximum(0.0, at.loss)
        lam0 = momentum_inflow(at.CT + loss * lam0, loss, d.mu_z, mu2, xp)
    return lam0


class BladeDoubts(NamedTuple):
    """Shares of the disc's area outside `_INNER` of the radius (reversed flow apart), and what stands there.

    Attributes:
        stalled: beyond the angle of the largest lift. diverged: where drag rises by `_DIVERGED` per Mach number.
        reversed_flow: air from behind. beyond: outside the table's own angles, Mach or Reynolds numbers.
        mach: the largest Mach number. reynolds: smallest and largest Reynolds number.
    """

    stalled: float
    diverged: float
    reversed_flow: float
    beyond: float
    mach: float
    reynolds: tuple[float, float]


def blade_doubts(d: Disc, blades: TabledBlades) -> BladeDoubts:
    """How much of a disc is beyond stall or drag divergence, by floats on 24 by 48 elements."""
    e = _elements(Disc(*map(float, d)), TabledBlades(blades[0], *map(float, blades[1:])), np, 24, 48)
    outside = (e.x > _INNER) & (e.lifting > 0.0)
    area = np.where(outside, e.weight * e.x, 0.0)
    area = area / area.sum()
    ahead = e.u_t > 0.0
    angle = e.angle - 2.0 * np.pi * np.floor(e.angle / (2.0 * np.pi) + 0.5)
    high, low = e.profile.stall[..., 0], e.profile.stall[..., 1]
    stalled = ahead & ((angle > high) | (angle < low))
    diverged = ahead & ~stalled & (e.profile.drag_by_mach > _DIVERGED)
    (_, fastest), reynolds = blades.table.span
    first, last = blades.table.measured
    beyond = ahead & ((angle > last) | (angle < first) | (e.mach > fastest))
    beyond = beyond | (ahead & ((e.reynolds < reynolds[0]) | (e.reynolds > reynolds[1])))
    seen = e.reynolds[outside & ahead]
    stall, divergence, behind, outer = (float(np.sum(area[mask])) for mask in (stalled, diverged, ~ahead, beyond))
    return BladeDoubts(
        stall,
        divergence,
        behind,
        outer,
        float(np.max(e.mach[outside])),
        (float(seen.min()), float(seen.max())),
    )
