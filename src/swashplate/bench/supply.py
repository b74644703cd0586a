"""Rotor speed against supply voltage at fixed commands.

    Omega = k_d u + o_d + k_d,U (U - U_norm)                (Fankhauser et al., sec. IV-A7, eq. 22)

The card has one factor for both rotors: it is their weighted mean, and how far the two are apart is told. What spoils
it: the voltage at the plug instead of at the motors, and a battery that warms while it empties.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import stats

from swashplate.arrays import Array
from swashplate.bench.checks import check_settled, check_structure
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve, Procedure, weigh
from swashplate.bench.steady import SteadyLine, fit_line, steady_points
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError


def schedule_supply(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """The supply from 10.5 to 12.5 V and back at hover's commands."""
    levels = np.linspace(10.5, 12.5, 9)
    settings = [{**hover, "voltage": float(v)} for v in (*levels, *levels[::-1])]
    about = "commands of hover; supply 10.5 to 12.5 V in steps of 0.25 V and back"
    return [points("supply", (SUPPLY.name,), settings, settle=1.5, about=about)]


def fit_supply(voltage: Array, speed: Array, *, where: str = "") -> SteadyLine:
    """Slope [rad/s/V] and speed at the mean voltage [rad/s]."""
    return fit_line([voltage - voltage.mean(), np.ones(voltage.size)], speed, where=where)


def together(slopes: Sequence[float], sigmas: Sequence[float]) -> tuple[float, float, float]:
    """Weighted mean of both rotors' slopes, its standard deviation and how many sigmas they are apart.

    Where they are apart by more than chance allows (1 %), the bound grows by the scale factor of the Particle Data
    Group (2022, sec. 5.2.2): one number cannot be better than the difference of what it stands for.
    """
    mean, variance = weigh(slopes, sigmas)
    square = float(np.sum((np.array(slopes) - mean) ** 2 / np.array(sigmas) ** 2))
    wider = square / (len(slopes) - 1) if stats.chi2.sf(square, len(slopes) - 1) < 0.01 else 1.0
    return mean, float(np.sqrt(wider * variance)), float((slopes[0] - slopes[1]) / np.hypot(sigmas[0], sigmas[1]))


def estimate_supply(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`k_drive_voltage`.

    Raises:
        BenchError: where the commands change or the voltage hardly does.
    """
    slopes: list[float] = []
    sigmas: list[float] = []
    checks, curves, findings = [], [], []
    for record in records:
        steady = steady_points(record, SUPPLY.columns[1:])
        command_range = max(np.ptp(steady["motor_lower"]), np.ptp(steady["motor_upper"]))
        if command_range > 1e-3 or np.ptp(steady["voltage"]) < 0.5:
            raise BenchError(
                f"motor commands move by {command_range:.3g} and the supply by {np.ptp(steady['voltage']):.2g} V.",
                where=record.name,
                hint="Hold the commands and vary the supply by a volt or more.",
            )
        for rotor in ("upper", "lower"):
            speed = steady[f"omega_{rotor}"]
            line = fit_supply(steady["voltage"], speed, where=record.name)
            slopes.append(float(line.values[0]))
            sigmas.append(float(np.sqrt(line.covariance[0, 0])))
            findings.append(
                BenchFinding(f"k_drive_voltage of the {rotor} rotor by itself", slopes[-1], sigmas[-1], "rad/s/V")
            )
            level = np.round(steady["voltage"] * 8.0) / 8.0
            checks += [
                check_settled(steady, f"omega_{rotor}"),
                *check_structure(line, level, what=f"{rotor} rotor speed [rad/s]"),
            ]
            ends = np.array([steady["voltage"].min(), steady["voltage"].max()])
            at = line.values[1] + line.values[0] * (ends - steady["voltage"].mean())
            curves.append(
                Curve(f"Speed of the {rotor} rotor against the supply", "supply voltage [V]", "rotor speed [rad/s]",
                      steady["voltage"], speed, ends, at)
            )  # fmt: skip
    mean, sigma, apart = together(slopes, sigmas)
    checks.append(
        BenchCheck(
            f"Upper and lower rotor give {slopes[0]:.2f} and {slopes[1]:.2f} rad/s/V, {apart:+.1f} sigmas apart.",
            good=abs(apart) < 3.0,
        )
    )
    return BenchResult.of(
        SUPPLY,
        records,
        checks,
        curves,
        names=("k_drive_voltage",),
        values=(mean,),
        covariance=(sigma**2,),
        findings=tuple(findings),
    )


SUPPLY = Procedure(
    "supply",
    "Rotor speed against supply voltage",
    "Fankhauser et al., sec. IV-A7 and eq. 22",
    ("point", "motor_lower", "motor_upper", "omega_lower", "omega_upper", "voltage"),
    estimate_supply,
    schedule_supply,
)


def estimate_compensated(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """What is left of the supply's influence on each rotor once the commands are corrected for the voltage.

    Omega = const + k_left (U - U_norm);   with u corrected by -k_d,U (U - U_norm) / k_d, k_left = 0

    Findings; `k_drive_voltage` is held for the share. A rest says that the factor of the correction is too small (or
    too large), or that the voltage it was corrected by is not that at the motors. What spoils it: a battery that warms
    while it empties, and speeds read to a coarse step.

    Raises:
        BenchError: where the voltage hardly varies.
    """
    findings, checks, curves = [], [], []
    factor = card["k_drive_voltage"]
    for record in records:
        steady = steady_points(record, COMPENSATED.columns[1:])
        volts = steady["voltage"]
        if np.ptp(volts) < 0.5:
            raise BenchError(
                f"moves by {np.ptp(volts):.2g} V.",
                where=record.name,
                channel="voltage",
                hint="Vary the supply by a volt or more.",
            )
        for rotor in ("upper", "lower"):
            line = fit_supply(volts, steady[f"omega_{rotor}"], where=record.name)
            left, sigma = float(line.values[0]), float(np.sqrt(line.covariance[0, 0]))
            findings += [
                BenchFinding(f"speed of the {rotor} rotor left per volt", left, sigma, "rad/s/V"),
                BenchFinding(f"share of k_drive_voltage left, {rotor} rotor", left / factor, sigma / factor, "1",
                        {"k_drive_voltage": -left / factor**2}),
            ]  # fmt: skip
            sure = abs(left) > 3.0 * sigma
            checks.append(
                BenchCheck(
                    f"{record.name}: the compensation leaves {left:+.2f} +- {sigma:.2f} rad/s/V of the {rotor} rotor's "
                    f"{factor:.1f}"
                    + (f" ({left / sigma:+.1f} sigmas): its factor is too {'small' if left > 0 else 'large'}, or "
                       "the voltage that it uses is not that at the motors." if sure else ", nothing for sure."),
                    good=not sure,
                )
            )  # fmt: skip
            ends = np.array([volts.min(), volts.max()])
            curves.append(
                Curve(f"Speed of the {rotor} rotor, compensated", "supply voltage [V]", "rotor speed [rad/s]", volts,
                      steady[f"omega_{rotor}"], ends, line.values[1] + left * (ends - volts.mean()))
            )  # fmt: skip
    return BenchResult.of(COMPENSATED, records, checks, curves, findings=tuple(findings))


COMPENSATED = Procedure(
    "supply_compensated",
    "Rotor speed against supply voltage, commands compensated",
    "Fankhauser et al., sec. IV-A7 and eq. 22",
    ("point", "omega_lower", "omega_upper", "voltage"),
    estimate_compensated,
)
