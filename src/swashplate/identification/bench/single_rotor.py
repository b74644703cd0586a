"""One rotor alone, the other taken off: what the coaxial set-up costs each rotor in thrust.

    T_alone / T_coaxial - 1 at the same speed = k_T,alone / k_T,coaxial - 1   (Fankhauser et al., sec. IV-A1, footnote)

The factors of the card are those of the coaxial set-up; the interference is a finding, not a parameter. What spoils it:
another height above the floor, another battery voltage, blades that were taken off and put back with another pitch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.errors import BenchError
from swashplate.flights.bench_record import BenchRecord
from swashplate.identification.bench.result import BenchResult, Check, Curve
from swashplate.identification.bench.steady import check_settled, check_structure, fit_line, nuisance, steady_points
from swashplate.simulation.bench import Schedule, points

NAME = "single_rotor"
TITLE = "Single rotors and the interference between the two"
SOURCE = "Fankhauser et al., sec. IV-A1 (footnote) and eq. 3"
COLUMNS = ("point", "omega_lower", "omega_upper", "motor_lower", "motor_upper", "Fz")


def schedules(hover: Mapping[str, float]) -> list[Schedule]:
    """Each rotor alone, its motor up and down."""
    made = []
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        levels = (0.4, 0.5, 0.6, 0.7)
        sweep = [{f"motor_{rotor}": u} for u in (0.0, *levels, *levels[::-1], 0.0)]
        words = f"{other} rotor taken off; {rotor} motor off, 0.4 to 0.7 and back, off"
        made.append(points(f"single_{rotor}", (NAME,), sweep, settle=1.5, removed=other, words=words))
    return made


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """The interference of each rotor that was measured alone, by the coaxial factors in `card`.

    Its bound is that of the single rotor; the coaxial factor's own is added when the bench is put together.

    Raises:
        BenchError: where the header does not say which rotor was taken off.
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
        found = steady_points(record, COLUMNS[1:])
        density = record.number("air_density", card["air_density"]) / card["air_density"]
        squared = density * found[f"omega_{rotor}"] ** 2
        line = fit_line([squared, *nuisance(found)], -found["Fz"], where=record.name)
        coaxial = card[f"k_thrust_{rotor}"]
        share, sigma = line.values[0] / coaxial - 1.0, float(np.sqrt(line.covariance[0, 0])) / coaxial
        findings.append((f"thrust of the {rotor} rotor alone over coaxial, less one", float(share), sigma, "1"))
        checks += [
            check_settled(found, "Fz"),
            *check_structure(line, found[f"motor_{rotor}"], what=f"{rotor} rotor alone, thrust [N]"),
        ]
        fitted = line.values[0] * squared
        order = np.argsort(squared)
        curves.append(
            Curve(
                f"Thrust of the {rotor} rotor alone",
                "rotor speed [rad/s]",
                "thrust [N]",
                found[f"omega_{rotor}"],
                fitted + line.residuals,
                found[f"omega_{rotor}"][order],
                fitted[order],
            )
        )
    checks.append(Check("The bound of the interference does not hold what remounting the blades changes."))
    return BenchResult(
        NAME,
        TITLE,
        SOURCE,
        (),
        np.zeros(0),
        np.zeros((0, 0)),
        tuple(record.name for record in records),
        tuple(checks),
        tuple(curves),
        findings=tuple(findings),
    )
