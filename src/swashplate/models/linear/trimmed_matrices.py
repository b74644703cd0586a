"""A linear model about a steady level flight: without its kinematics, and how its trim changes with speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import CardError
from swashplate.models.linear.card_vehicle import NEEDED
from swashplate.models.linear.stitched import RATES, STILL, gravity_slope
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Euler, Vector, body_to_local, local_to_body

TRIMMED = tuple(name for name in NEEDED if name not in STILL)
"""States of the rigid body that a trim tells."""
_GRAVITY_OFF = 0.5
"""m/s^2 per rad by which a point's gravity terms may miss those of its attitude."""
_ROUNDING = 1e-6
_KINEMATIC_OFF = 0.1
"""By which the rows of roll and pitch may miss kinematics, beside what small angles leave out."""
_FLOATS = FloatBackend()
_AT = {name: k for k, name in enumerate(NEEDED)}


@dataclass(frozen=True)
class TrimmedMatrices:
    """dx/dt = A (x - x0) + B (u - u0) about a steady level flight.

    Attributes:
        name: what messages call it.
        inner, inputs: names of the states beside the rigid body's, and of the inputs.
        A, B: over (NEEDED, inner) and inputs.
        trim: values of TRIMMED, inner and inputs.
    """

    name: str
    inner: tuple[str, ...]
    inputs: tuple[str, ...]
    A: Array
    B: Array
    trim: Mapping[str, float]

    @property
    def speed(self) -> float:
        """Ahead [m/s]."""
        return self.trim["u"]

    @property
    def rows(self) -> list[int]:
        """Places of RATES and inner states."""
        return [*(_AT[name] for name in RATES), *range(len(NEEDED), self.A.shape[0])]

    @property
    def attitude(self) -> Euler:
        return Euler(self.trim["phi"], self.trim["theta"], 0.0)

    def course(self) -> Vector:
        """Velocity ahead, right and down [m/s]."""
        return body_to_local(Vector(*(self.trim[s] for s in ("u", "v", "w"))), self.attitude, _FLOATS)


def without_kinematics(point: TrimmedMatrices, *, fitted: bool) -> Array:
    """The rows of RATES and inner states by (NEEDED, inner), without gravity and Coriolis terms.

    Args:
        point: the model.
        fitted: its gravity terms are those of a structure for small angles: what differs little from gravity is it.

    Raises:
        CardError: where the gravity that goes out is not that of the trim's attitude, and no inner state that keeps
            its own makes the difference; or the rows of roll and pitch are not those of kinematics.
    """
    tan, (sf, cf) = np.tan(point.attitude.theta), (np.sin(point.attitude.phi), np.cos(point.attitude.phi))
    turned = np.zeros((2, point.A.shape[1]))
    turned[:, [_AT[s] for s in STILL]] = [[1.0, sf * tan, cf * tan], [0.0, cf, -sf]]
    for angle, wanted in zip(("phi", "theta"), turned, strict=True):
        off = np.abs(point.A[_AT[angle]] - wanted)
        if off.max() > _KINEMATIC_OFF + abs(tan) + abs(sf):
            column = (*NEEDED, *point.inner)[int(off.argmax())]
            raise CardError(
                f"moves with {column} by {point.A[_AT[angle], int(off.argmax())]:.3g}, kinematics say "
                f"{wanted[int(off.argmax())]:.3g}.",
                where=point.name,
                channel=angle,
            )
    left = point.A[point.rows].copy()
    u, v, w = (point.trim[s] for s in ("u", "v", "w"))
    left[np.ix_(range(3), [_AT[s] for s in STILL])] -= np.array([[0.0, -w, v], [w, 0.0, -u], [-v, u, 0.0]])
    angles = [_AT["phi"], _AT["theta"]]
    rest = left[np.ix_(range(3), angles)] - gravity_slope(point.trim)
    # A bar that keeps its own attitude leaves two equal effects with opposite signs: of the attitude and of the bar's.
    with_inner = left[:3, None, len(NEEDED) :] + rest[:, :, None]
    unexplained = np.min(np.abs(np.concatenate([rest[:, :, None], with_inner], axis=2)), axis=2)
    if np.max(unexplained) > _GRAVITY_OFF:
        row, k = divmod(int(np.argmax(unexplained)), 2)
        raise CardError(
            f"d{RATES[row]}/dt by {('phi', 'theta')[k]} differs by {abs(rest[row, k]):.3g} m/s^2 per rad "
            "from the gravity at its trim's attitude.",
            where=point.name,
            channel="trim",
            hint="Is the attitude in rad, and of the flight that the model was made of?",
        )
    small = _GRAVITY_OFF if fitted else _ROUNDING
    left[np.ix_(range(3), angles)] = 0.0 if np.max(np.abs(rest)) <= small else rest
    return left


def own_gradients(point: TrimmedMatrices, free: Sequence[str]) -> dict[str, float]:
    """Change of the trim with the speed ahead that the point's derivatives say: A x' + B u' = 0 along level flight.

    The velocity over ground changes ahead only, and turns with the attitude in body axes.

    Args:
        point: the model.
        free: inputs that a trim moves.

    Raises:
        CardError: where the derivatives leave it open.
    """
    n, m = point.A.shape[0], len(NEEDED)
    ahead = np.zeros(n)
    ahead[:3] = local_to_body(Vector(1.0, 0.0, 0.0), point.attitude, _FLOATS)
    moves = np.zeros((n, 2 + n - m))
    moves[[_AT["phi"], _AT["theta"]], [0, 1]] = 1.0
    moves[:3, :2] = _turned(point.course(), point.attitude)
    moves[m:, 2:] = np.eye(n - m)
    columns = [point.inputs.index(name) for name in free]
    system = np.hstack([point.A @ moves, point.B[:, columns]])[point.rows]
    if np.linalg.matrix_rank(system / np.linalg.norm(system, axis=0).clip(1e-30)) < system.shape[1]:
        raise CardError(
            "leaves open how its trim changes with speed.",
            where=point.name,
            channel="derivatives",
            hint='Take the differences of the trims: gradients="trims" (--gradients trims).',
        )
    solution = np.linalg.lstsq(system, -(point.A @ ahead)[point.rows], rcond=None)[0]
    x = ahead + moves @ solution[: moves.shape[1]]
    slopes = {name: float(x[k] / x[0]) for k, name in enumerate((*NEEDED, *point.inner))}
    slopes |= dict.fromkeys(point.inputs, 0.0)
    slopes |= {name: float(value / x[0]) for name, value in zip(free, solution[moves.shape[1] :], strict=True)}
    return {name: value for name, value in slopes.items() if name not in ("u", *STILL)}


def _turned(local: Vector, attitude: Euler) -> Array:
    """Derivative of a local vector's body components by roll and pitch, shape (3, 2)."""
    step = 1e-30j
    steps = (attitude._replace(phi=attitude.phi + step), attitude._replace(theta=attitude.theta + step))
    return np.array([[np.imag(c) / step.imag for c in local_to_body(local, a, np)] for a in steps]).T  # pyrefly: ignore[bad-argument-type]


def differences(points: Sequence[TrimmedMatrices]) -> list[dict[str, float]]:
    """Gradients of the trims: slopes of the parabola through a point and its neighbours, secants where two are all."""
    speeds = np.array([point.speed for point in points])
    names = [name for name in points[0].trim if name != "u"]
    values = np.array([[point.trim[name] for name in names] for point in points])
    slopes = np.asarray(np.gradient(values, speeds, axis=0, edge_order=1 if len(points) == 2 else 2))
    return [dict(zip(names, map(float, row), strict=True)) for row in slopes]
