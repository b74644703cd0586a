"""Phase lag of the lower rotor against its speed, from the direction of the moment that the pitch servo makes.

    Delta zeta = atan(Mx / My), Delta zeta = k_zeta Omega + o_zeta      (Fankhauser et al., sec. IV-A3, eq. 21)

With this project's signs (a lag turns the tilt in the rotor's sense) a pitch command s2 gives alpha = l s2 sin(D) and
beta = -l s2 cos(D), so D = atan2(dMx/ds2, -dMy/ds2). Slopes over +-s2 at each speed take out trim and bias. What
spoils it: vibration as large as the moments (told), and a helicopter that is not aligned with the sensor or bends under
load. These turn the offset o_zeta, which is therefore not put on the card (the paper takes it from flight for that
reason).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import stats

from swashplate.arrays import Array
from swashplate.bench.checks import check_line_drift, check_settled, check_structure, check_vibration
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve, Procedure
from swashplate.bench.steady import fit_line, nuisance, steady_points
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError


def schedule_phase_lag(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Pitch servo at +-0.4 at seven speeds of the lower rotor."""
    settings = [
        {"motor_lower": u, "motor_upper": hover["motor_upper"], "servo_pitch": s}
        for u in (0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75)
        for s in (0.4, -0.4, -0.4, 0.4)
    ]
    about = "lower motor 0.45 to 0.75 in steps of 0.05; at each the pitch servo at 0.4, -0.4, -0.4, 0.4; upper at hover"
    return [points("phase_lag", (PHASE_LAG.name,), settings, settle=1.2, about=about)]


def estimate_phase_lag(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`k_zeta_lower`, and the offset as a finding.

    Raises:
        BenchError: where My grows with the pitch servo (positive pitches the nose down), or speeds or servo stood
            still.
    """
    speeds: list[float] = []
    lags: list[float] = []
    sigmas: list[float] = []
    checks: list[BenchCheck] = []
    for record in records:
        steady = steady_points(record, PHASE_LAG.columns[1:])
        levels = np.unique(np.round(steady["motor_lower"], 6))
        inside = (np.abs(steady["motor_lower"][:, None] - levels) < 1e-5).astype(np.float64)
        slopes = [*(inside * steady["servo_pitch"][:, None]).T]
        columns = [*slopes, *inside.T, nuisance(steady)[1]]
        roll, pitch = (fit_line(columns, steady[name], where=record.name) for name in ("Mx", "My"))
        k = levels.size
        across, along = roll.values[:k], -pitch.values[:k]
        if np.median(along) < 0.0:
            raise BenchError(
                "grows with servo_pitch; a positive pitch command turns the nose down (My < 0).",
                where=record.name,
                channel="My",
                hint="Turn the sign of My, or that of the servo.",
            )
        lags += list(np.arctan2(across, along))
        size = across**2 + along**2
        noise = (along**2 * np.diag(roll.covariance)[:k] + across**2 * np.diag(pitch.covariance)[:k]) / size**2
        sigmas += list(np.sqrt(noise))
        speeds += [float(steady["omega_lower"][column > 0.5].mean()) for column in inside.T]
        checks += [check(steady, name) for name in ("Mx", "My") for check in (check_settled, check_vibration)]
        level = 1e3 * steady["motor_lower"] + np.round(steady["servo_pitch"], 3)
        for fitted, name in ((roll, "Mx [N m]"), (pitch, "My [N m]")):
            checks.append(check_line_drift(steady, fitted, 2 * k, what=name))
            checks += check_structure(fitted, level, what=f"{record.name}: {name}")
        if np.any(sigmas[-k:] > np.radians(3.0)):
            checks.append(
                BenchCheck(f"{record.name}: the lag is uncertain by more than 3 deg at some speed.", good=False)
            )
    omega, lag, sigma = np.array(speeds), np.array(lags), np.array(sigmas)
    where = ", ".join(record.name for record in records)
    line = fit_line([omega, np.ones(omega.size)], lag, where=where, weights=1.0 / sigma)
    covariance = _promised(omega, sigma, line.residuals)
    bend = fit_line([(omega - omega.mean()) ** 2, omega, np.ones(omega.size)], lag, where=where, weights=1.0 / sigma)
    t = float(bend.values[0] / np.sqrt(bend.covariance[0, 0])) * bend.spread  # by the lags' own bounds
    checks.append(
        BenchCheck(f"The lag against speed bends by {t:+.1f} standard deviations of its curvature.", good=abs(t) < 4.5)
    )
    checks.append(
        BenchCheck(
            "The offset is not put on the card: trim and bending under load turn it; the flight tells it (o_zeta)."
        )
    )
    ends = np.array([omega.min(), omega.max()])
    fitted = np.degrees(line.values[0] * ends + line.values[1])
    axes = ("rotor speed [rad/s]", "phase lag offset [deg]")
    curve = Curve("Phase lag of the lower rotor", *axes, omega, np.degrees(lag), ends, fitted)
    offset = BenchFinding("o_zeta_lower on the bench", float(line.values[1]), float(np.sqrt(covariance[1, 1])), "rad")
    return BenchResult.of(
        PHASE_LAG,
        records,
        checks,
        (curve,),
        names=("k_zeta_lower",),
        values=line.values[:1],
        covariance=covariance[:1, :1],
        findings=(offset,),
    )


def _promised(omega: Array, sigma: Array, residuals: Array) -> Array:
    """Covariance of slope and offset from the lags' own bounds, widened where they scatter more about the line."""
    matrix = np.column_stack([omega, np.ones(omega.size)]) / sigma[:, None]
    freedom = omega.size - 2
    square = float(np.sum((residuals / sigma) ** 2))
    wider = square / freedom if stats.chi2.sf(square, freedom) < 0.01 else 1.0
    return np.asarray(wider * np.linalg.inv(matrix.T @ matrix), dtype=np.float64)


PHASE_LAG = Procedure(
    "phase_lag",
    "Phase lag against rotor speed",
    "Fankhauser et al., sec. IV-A3 and eq. 21",
    ("point", "motor_lower", "servo_pitch", "omega_lower", "Mx", "My"),
    estimate_phase_lag,
    schedule_phase_lag,
)
