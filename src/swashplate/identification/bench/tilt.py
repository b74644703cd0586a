"""Tilt of a rotor from lateral forces and moments: how far it tilts, in which direction, and how stiff its hub is.

    M_flap = sqrt(Mx^2 + My^2) - z sqrt(Fx^2 + Fy^2)        (Fankhauser et al., sec. IV-A4, eq. 18)

The force gives the tilt, F = T sin(tilt); what the moment has beyond z F is the flapping of the elastic blades. Instead
of the magnitudes, whose noise has a mean, all four signed components are fitted at once by the equations of flight,
with a bias and a drift each; the magnitudes of eq. 18 are for the plot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from swashplate.errors import BenchError
from swashplate.flights.flight import Array
from swashplate.identification.bench.result import Check, Curve
from swashplate.identification.bench.steady import Points, check_settled, nuisance
from swashplate.physics import rotor
from swashplate.physics.backend import FloatBackend
from swashplate.physics.rotor import TipPathPlane

CHANNELS = ("Fx", "Fy", "Mx", "My")
XP = FloatBackend()

Steering = Callable[[int, float, float], TipPathPlane]
"""The tilt at a point for a linkage and a lag."""


@dataclass(frozen=True)
class TiltFit:
    """What the tilt of one rotor tells.

    Attributes:
        values: linkage, lag [rad] and hub stiffness [N m/rad].
        covariance: shape (3, 3).
        by_thrust: derivatives of `values` by the logarithm of the thrust factor, shape (3,).
        corrected: measured channels with bias and drift taken out, shape (n, 4).
        residuals: shape (n, 4), bias and drift taken out.
        tilt: size of the fitted tilt at each point [rad].
    """

    values: Array
    covariance: Array
    by_thrust: Array
    corrected: Array
    residuals: Array
    tilt: Array


def fit_tilt(points: Points, steering: Steering, thrust: Array, *, hub_height: float, start: Array) -> TiltFit:
    """Linkage, lag and hub stiffness of one rotor.

    Args:
        points: steady points with `CHANNELS`.
        steering: how linkage and lag tilt the disc at each point.
        thrust: of this rotor at each point [N], shape (n,).
        hub_height: above the CG [m].
        start: first guess of the three.

    Raises:
        BenchError: too few points, nothing steered, or signs that physics forbids.
    """
    n = len(points)
    if n < 8:
        raise BenchError(f"has {n} points, expected at least 8.", where=points.where, hint="See `swash bench plan`.")
    measured = np.column_stack([points[name] for name in CHANNELS])
    basis = np.linalg.qr(np.column_stack(nuisance(points)))[0]

    def without(columns: Array) -> Array:
        return np.asarray(columns - basis @ (basis.T @ columns))

    def model(x: Array, lifted: Array) -> Array:
        return np.array([_loads(steering(i, x[0], x[1]), lifted[i], hub_height, x[2]) for i in range(n)])

    if np.ptp([abs(complex(*steering(i, 1.0, 0.0))) for i in range(n)]) == 0.0:
        raise BenchError("steers nothing.", where=points.where, hint="Deflect servos or bar between the points.")
    _refuse_against(without(measured), without(model(start, thrust)), points.where)
    scale = np.abs(start) + np.array([0.0, 0.1, 0.0])
    spread = np.array([1e-3, 1e-3, 1e-4, 1e-4])

    def solved(lifted: Array, begin: Array) -> tuple[Array, Array, Array]:
        nonlocal spread
        for _ in range(3):

            def off(x: Array, by: Array = spread) -> Array:
                return np.asarray((without(measured - model(x, lifted)) / by).ravel())

            found = least_squares(off, begin, x_scale=scale, xtol=1e-12)
            left = found.fun.reshape(n, 4) * spread
            spread, begin = np.sqrt(np.sum(left**2, axis=0) / (n - 2.75)), found.x
        return found.x, found.jac, left

    values, jacobian, left = solved(thrust, start)
    _refuse(values, points.where)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    step = 1e-3
    higher, lower = (solved(thrust * (1.0 + s), values)[0] for s in (step, -step))
    fitted = model(values, thrust)
    tilt = np.array([abs(complex(*steering(i, values[0], values[1]))) for i in range(n)])
    by_thrust = np.asarray((higher - lower) / (2.0 * step))
    corrected = without(measured) + (fitted - without(fitted))
    return TiltFit(values, np.asarray(covariance), by_thrust, corrected, left, tilt)


def _loads(plane: TipPathPlane, thrust: float, hub_height: float, stiffness: float) -> tuple[float, ...]:
    force = rotor.thrust_direction(plane, XP).scaled(thrust)
    moment = rotor.thrust_moment(force, hub_height) + rotor.flapping_moment(stiffness, plane)
    return force.x, force.y, moment.x, moment.y


def _refuse_against(measured: Array, expected: Array, where: str) -> None:
    """Raise where forces point against the deflection that was commanded."""
    if np.sum(measured[:, :2] * expected[:, :2]) < 0.0:
        raise BenchError(
            "forces lean against the deflection that was commanded.",
            where=where,
            channel="Fx, Fy",
            hint="Turn the sign of the lateral forces, or that of servos or bar; axes are forward-right-down.",
        )
    if np.sum(measured[:, 2:] * expected[:, 2:]) < 0.0:
        raise BenchError(
            "moments point against the deflection that was commanded.",
            where=where,
            channel="Mx, My",
            hint="Turn the sign of the moments; axes are forward-right-down.",
        )


def _refuse(values: Array, where: str) -> None:
    if values[2] < 0.0:
        raise BenchError(
            "moments are smaller than the tilted thrust alone makes.",
            where=where,
            channel="Mx, My",
            hint="Do they refer to the CG, and not to the sensor? Is the thrust factor right?",
        )


def figure_6(fit: TiltFit, thrust: float, *, hub_height: float, rotor_name: str) -> list[Curve]:
    """Total, flapping and tilt torque against the tilt (Fankhauser et al., Fig. 6)."""
    force = np.hypot(fit.corrected[:, 0], fit.corrected[:, 1])
    moment = np.hypot(fit.corrected[:, 2], fit.corrected[:, 3])
    angle = np.linspace(0.0, fit.tilt.max(), 40)
    lines = torques(angle, stiffness=float(fit.values[2]), thrust=thrust, hub_height=hub_height)
    measured = (moment, moment - hub_height * force, hub_height * force)
    title = f"Torque against the tilt of the {rotor_name} rotor (the paper's Fig. 6)"
    return [
        Curve(title, "tilt [deg]", "torque [N mm]", np.degrees(fit.tilt), 1e3 * points, np.degrees(angle), 1e3 * line,
              name=name)
        for name, points, line in zip(("total", "flapping", "tilt of the thrust"), measured, lines, strict=True)
    ]  # fmt: skip


def torques(tilt: Array, *, stiffness: float, thrust: float, hub_height: float) -> tuple[Array, Array, Array]:
    """Total, flapping and tilt torque [N m] for tilts [rad] (Fankhauser et al., Fig. 6 and eqs 2, 6)."""
    flapping, tilting = stiffness * tilt, hub_height * thrust * np.sin(tilt)
    return flapping + tilting, flapping, tilting


def tilt_checks(points: Points, fit: TiltFit, kept: Mapping[str, float]) -> list[Check]:
    """Settling, and the residuals against what the sensor's own noise could leave."""
    checks = [check_settled(points, name) for name in ("Fx", "Mx")]
    force, moment = (np.sqrt(np.mean(fit.residuals[:, pair] ** 2)) for pair in ([0, 1], [2, 3]))
    checks.append(Check(f"{points.where}: residuals {1e3 * force:.2g} mN and {1e3 * moment:.2g} N mm."))
    curvature = np.polyfit(fit.tilt, np.sum(fit.residuals[:, 2:] * np.sign(fit.corrected[:, 2:]), axis=1), 2)[0]
    bent = abs(curvature) * np.ptp(fit.tilt) ** 2 / 4.0 > max(3.0 * moment, 0.02 * np.abs(fit.corrected[:, 2:]).max())
    checks.append(
        Check(
            f"{points.where}: the moment against the tilt is "
            + ("bent: blades or airframe give way." if bent else "straight."),
            good=not bent,
        )
    )
    known = ", ".join(f"{name} = {value:.4g}" for name, value in kept.items())
    checks.append(Check(f"Taken as known: {known}."))
    return checks
