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
from swashplate.bench.record import COLUMNS as RECORD_COLUMNS
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve, Procedure
from swashplate.bench.steady import SteadyLine, fit_line, nuisance, stacked, steady_points
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError

NAMES = ("k_thrust_upper", "k_thrust_lower", "k_torque_upper", "k_torque_lower")


def estimate_thrust(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """Both rotors' `k_thrust` and `k_torque` at the card's air density.

    Args:
        records: sweeps of either motor; `air_density` in the header where it is not the card's.
        card: `air_density`.

    Raises:
        BenchError: for signs that physics forbids, or rotors that the records do not vary.
    """
    means = [steady_points(record, THRUST.columns[1:]) for record in records]
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
    for place, (steady, record) in enumerate(zip(means, records, strict=True)):
        checks += [check_settled(steady, "Fz"), check_vibration(steady, "Fz"), check_vibration(steady, "Mz")]
        checks.append(check_ground(record, card))
        for line, what in ((thrust, "-Fz [N]"), (torque, "Mz [N m]")):
            checks.append(check_line_drift(steady, line, 3 + 2 * place, what=what))
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
        _against_fitted("Total thrust", "thrust [N]", upper, lower, thrust, 1.0),
        _against_fitted("Total torque", "torque [N mm]", upper, -lower, torque, 1000.0),
    )
    interference = BenchFinding("thrust in Omega_up Omega_lw, share at hover", share, share_sigma)
    values = np.r_[thrust.values[:2], torque.values[:2]]
    return BenchResult.of(
        THRUST, records, checks, curves, names=NAMES, values=values, covariance=covariance, findings=(interference,)
    )


def _against_fitted(title: str, unit: str, upper: object, lower: object, line: SteadyLine, factor: float) -> Curve:
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


THRUST = Procedure(
    "thrust",
    "Thrust and torque factors, coaxial",
    "Fankhauser et al., sec. IV-A1 and eqs 1 to 4",
    ("point", "omega_lower", "omega_upper", "motor_lower", "motor_upper", "Fz", "Mz"),
    estimate_thrust,
)


def schedule_alone(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Each rotor alone, its motor up and down."""
    records = []
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        levels = (0.4, 0.5, 0.6, 0.7)
        sweep = [{f"motor_{rotor}": u} for u in (0.0, *levels, *levels[::-1], 0.0)]
        about = f"{other} rotor taken off; {rotor} motor off, 0.4 to 0.7 and back, off"
        records.append(points(f"single_{rotor}", (SINGLE_ROTOR.name,), sweep, settle=1.5, removed=other, about=about))
    return records


_LOADS = (("thrust", "Fz", "N s^2/rad^2", {"upper": -1.0, "lower": -1.0}),
          ("torque", "Mz", "N m s^2/rad^2", {"upper": 1.0, "lower": -1.0}))  # fmt: skip
"""What is measured, its channel, the factor's unit, and the channel's sign for each rotor."""


def estimate_alone(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """Factors of each rotor that was measured alone, and its interference by the coaxial factors, as findings.

    T_alone / T_coaxial - 1 at the same speed = k_T,alone / k_T,coaxial - 1, and so for the torques
    (Fankhauser et al., sec. IV-A1, footnote, and eqs 3, 4)

    What spoils it: another height above the floor (ground effect), vibration of a hub that is out of balance with one
    rotor off, another battery voltage, blades that were taken off and put back with another pitch.

    Args:
        records: one for each rotor; `rotor_removed` in the header.
        card: `k_thrust`, `k_torque` of the rotors (coaxial) are held; `evaluate` adds what their uncertainty makes of
            the interference. `air_density`.

    Raises:
        BenchError: where the header does not say which rotor was taken off, or a factor comes out with a wrong sign.
    """
    findings, checks, curves = [], [], []
    for record in records:
        removed = record.header.get("rotor_removed", "")
        if removed not in ("upper", "lower"):
            raise BenchError(
                f"rotor_removed is '{removed}', expected upper or lower.",
                where=record.name,
                channel="rotor_removed",
                hint="Add '# rotor_removed: upper' to the header.",
            )
        rotor = "lower" if removed == "upper" else "upper"
        steady = steady_points(record, SINGLE_ROTOR.columns[1:])
        density = record.number("air_density", card["air_density"]) / card["air_density"]
        squared = density * steady[f"omega_{rotor}"] ** 2
        checks += [check_settled(steady, "Fz"), check_vibration(steady, "Fz"), check_ground(record, card)]
        for name, channel, unit, signs in _LOADS:
            channel_unit = RECORD_COLUMNS[channel][0]
            line = fit_line([squared, *nuisance(steady)], signs[rotor] * steady[channel], where=record.name)
            alone, sigma = float(line.values[0]), float(np.sqrt(line.covariance[0, 0]))
            if alone < 0.0:
                raise BenchError(
                    f"comes out with the wrong sign for the {name} of the {rotor} rotor alone.",
                    where=record.name,
                    channel=channel,
                    hint="Turn its sign (axes are forward-right-down), or correct rotor_removed.",
                )
            coaxial = card[f"k_{name}_{rotor}"]
            findings += [
                BenchFinding(f"k_{name}_{rotor} alone", alone, sigma, unit),
                BenchFinding(
                    f"{name} of the {rotor} rotor alone over coaxial, less one",
                    alone / coaxial - 1.0,
                    sigma / coaxial,
                    leans_on={f"k_{name}_{rotor}": -alone / coaxial**2},
                ),
            ]
            checks.append(check_line_drift(steady, line, 2, what=f"{channel} [{channel_unit}]"))
            checks += check_structure(
                line, steady[f"motor_{rotor}"], what=f"{rotor} rotor alone, {name} [{channel_unit}]"
            )
            turning = np.linspace(0.0, steady[f"omega_{rotor}"].max(), 60)
            size, shown = (1.0, "N") if name == "thrust" else (1e3, "N mm")
            fitted = size * alone * squared
            title, axes = (
                f"{name.capitalize()} of the {rotor} rotor alone",
                ("rotor speed [rad/s]", f"{name} [{shown}]"),
            )
            measured, line_y = fitted + size * line.residuals, size * alone * density * turning**2
            curves.append(Curve(title, *axes, steady[f"omega_{rotor}"], measured, turning, line_y))
    checks.append(BenchCheck("The bound of the interference does not hold what remounting the blades changes."))
    return BenchResult.of(SINGLE_ROTOR, records, checks, curves, findings=tuple(findings))


SINGLE_ROTOR = Procedure(
    "single_rotor",
    "Single rotors and the interference between the two",
    "Fankhauser et al., sec. IV-A1 (footnote) and eqs 3, 4",
    ("point", "omega_lower", "omega_upper", "motor_lower", "motor_upper", "Fz", "Mz"),
    estimate_alone,
    schedule_alone,
)
