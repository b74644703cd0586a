"""Thrust and torque factors of both rotors in the coaxial set-up, from total thrust and torque only.

    -Fz = k_T,up Omega_up^2 + k_T,lw Omega_lw^2,    Mz = k_Q,up Omega_up^2 - k_Q,lw Omega_lw^2
    (Fankhauser et al., sec. IV-A1, eqs 1 to 4; k_T = c_T pi rho R^4, k_Q = c_Q pi rho R^5)

Each rotor is varied while the other holds hover. A term in Omega_up Omega_lw is fitted beside them: the part of the
interference that changes with the speeds, which the formula lacks. What spoils it: ground effect (stay a metre and more
above the floor), air that comes back in a closed room, vibration that saturates the sensor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.bench.checks import (
    check_ground,
    check_line_drift,
    check_settled,
    check_structure,
    check_vibration,
)
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve
from swashplate.bench.steady import SteadyLine, fit_line, nuisance, stacked, steady_points
from swashplate.errors import BenchError

NAME = "thrust"
TITLE = "Thrust and torque factors, coaxial"
SOURCE = "Fankhauser et al., sec. IV-A1 and eqs 1 to 4"
COLUMNS = ("point", "omega_lower", "omega_upper", "motor_lower", "motor_upper", "Fz", "Mz")

NAMES = ("k_thrust_upper", "k_thrust_lower", "k_torque_upper", "k_torque_lower")


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """Both rotors' `k_thrust` and `k_torque` at the card's air density.

    Args:
        records: sweeps of either motor; `air_density` in the header where it is not the card's.
        card: `air_density`.

    Raises:
        BenchError: for signs that physics forbids, or rotors that the records do not vary.
    """
    means = [steady_points(record, COLUMNS[1:]) for record in records]
    where = ", ".join(record.name for record in records)
    density = np.concatenate(
        [
            np.full(len(p), r.number("air_density", card["air_density"]) / card["air_density"])
            for p, r in zip(means, records, strict=True)
        ]
    )
    upper, lower = (density * np.concatenate([p[f"omega_{rotor}"] for p in means]) ** 2 for rotor in ("upper", "lower"))
    both = density * np.concatenate([p["omega_upper"] * p["omega_lower"] for p in means])
    unknown = stacked([nuisance(p) for p in means])
    lift, turn = -np.concatenate([p["Fz"] for p in means]), np.concatenate([p["Mz"] for p in means])
    thrust = fit_line([upper, lower, *unknown], lift, where=where)
    torque = fit_line([upper, -lower, *unknown], turn, where=where)
    _refuse_signs(thrust, torque, where)
    checks: list[BenchCheck] = []
    for place, (points, record) in enumerate(zip(means, records, strict=True)):
        checks += [check_settled(points, "Fz"), check_vibration(points, "Fz"), check_vibration(points, "Mz")]
        checks.append(check_ground(record, card))
        for line, what in ((thrust, "-Fz [N]"), (torque, "Mz [N m]")):
            checks.append(check_line_drift(points, line, 3 + 2 * place, what=what))
    level = np.concatenate(
        [1e6 * i + 1e3 * p["motor_lower"] + p["motor_upper"] for i, p in enumerate(means)]  # equal for repeats only
    )
    checks += [*check_structure(thrust, level, what="thrust [N]"), *check_structure(torque, level, what="torque [N m]")]
    cross = fit_line([upper, lower, both, *unknown], lift, where=where)
    at_hover = np.median(both[both > 0.0]) if np.any(both > 0.0) else 0.0
    share = float(cross.values[2] * at_hover / np.median(lift[both > 0.0])) if at_hover else float("nan")
    share_sigma = abs(share / cross.values[2]) * float(np.sqrt(cross.covariance[2, 2])) if at_hover else float("nan")
    covariance = np.zeros((4, 4))
    covariance[:2, :2], covariance[2:, 2:] = thrust.covariance[:2, :2], torque.covariance[:2, :2]
    curves = (
        _curve("Total thrust", "thrust [N]", upper, lower, thrust, 1.0),
        _curve("Total torque", "torque [N mm]", upper, -lower, torque, 1000.0),
    )
    interference = BenchFinding("thrust in Omega_up Omega_lw, share at hover", share, share_sigma)
    values = np.r_[thrust.values[:2], torque.values[:2]]
    return BenchResult.of(
        (NAME, TITLE, SOURCE),
        records,
        checks,
        curves,
        names=NAMES,
        values=values,
        covariance=covariance,
        findings=(interference,),
    )


def _curve(title: str, unit: str, upper: object, lower: object, line: SteadyLine, factor: float) -> Curve:
    """Measured against fitted total, bias and drift taken out."""
    fitted = factor * (line.values[0] * np.asarray(upper) + line.values[1] * np.asarray(lower))
    ends = np.array([fitted.min(), fitted.max()])
    return Curve(f"{title}: measured against fitted", f"fitted {unit}", f"measured {unit}", fitted,
                 fitted + factor * line.residuals, ends, ends)  # fmt: skip


def _refuse_signs(thrust: SteadyLine, torque: SteadyLine, where: str) -> None:
    """Thrust lifts, and each rotor's drag turns the fuselage against the rotor: what else is found is a wrong sign."""

    def against(line: SteadyLine, place: int) -> bool:
        return bool(line.values[place] < -3.0 * np.sqrt(line.covariance[place, place]))

    if against(thrust, 0) or against(thrust, 1):
        raise BenchError(
            "grows with rotor speed, but thrust points up: in body axes (z down) it is a negative Fz.",
            where=where,
            channel="Fz",
            hint="Turn the sign of Fz (and check the sensor's other axes).",
        )
    if against(torque, 0) or against(torque, 1):
        raise BenchError(
            "falls with the upper rotor's speed or grows with the lower's: the upper rotor turns counter-clockwise "
            "from above and its drag pushes the nose right (Mz > 0), the lower one's left.",
            where=where,
            channel="Mz",
            hint="Turn the sign of Mz, or exchange the rotors' columns.",
        )
