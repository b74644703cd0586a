"""One rotor alone, the other taken off: what the coaxial set-up costs each rotor in thrust and in torque.

    T_alone / T_coaxial - 1 at the same speed = k_T,alone / k_T,coaxial - 1, and so for the torques
    (Fankhauser et al., sec. IV-A1, footnote, and eqs 3, 4)

The factors of the card are those of the coaxial set-up; the factors of the rotor alone and the interference are
findings. What spoils it: another height above the floor (ground effect), vibration of a hub that is out of balance with
one rotor off, another battery voltage, blades that were taken off and put back with another pitch.
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
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve
from swashplate.bench.steady import fit_line, nuisance, steady_points
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError

NAME = "single_rotor"
TITLE = "Single rotors and the interference between the two"
SOURCE = "Fankhauser et al., sec. IV-A1 (footnote) and eqs 3, 4"
COLUMNS = ("point", "omega_lower", "omega_upper", "motor_lower", "motor_upper", "Fz", "Mz")


def schedules(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Each rotor alone, its motor up and down."""
    records = []
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        levels = (0.4, 0.5, 0.6, 0.7)
        sweep = [{f"motor_{rotor}": u} for u in (0.0, *levels, *levels[::-1], 0.0)]
        about = f"{other} rotor taken off; {rotor} motor off, 0.4 to 0.7 and back, off"
        records.append(points(f"single_{rotor}", (NAME,), sweep, settle=1.5, removed=other, about=about))
    return records


_LOADS = (("thrust", "Fz", "N s^2/rad^2", {"upper": -1.0, "lower": -1.0}),
          ("torque", "Mz", "N m s^2/rad^2", {"upper": 1.0, "lower": -1.0}))  # fmt: skip
"""What is measured, its channel, the factor's unit, and the channel's sign for each rotor."""


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """Factors of each rotor that was measured alone, and its interference by the coaxial factors, as findings.

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
        steady = steady_points(record, COLUMNS[1:])
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
    return BenchResult.of((NAME, TITLE, SOURCE), records, checks, curves, findings=tuple(findings))
