"""What is left of the supply's influence once the commands are corrected for the voltage.

    Omega = const + k_left (U - U_norm);   with u corrected by -k_d,U (U - U_norm) / k_d, k_left = 0
    (Fankhauser et al., sec. IV-A7 and eq. 22)

A rest says that the factor of the correction is too small (or too large), or that the voltage it was corrected by is
not that at the motors. What spoils it: a battery that warms while it empties, and speeds read to a coarse step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve
from swashplate.bench.steady import steady_points
from swashplate.bench.supply import fit_supply
from swashplate.errors import BenchError

NAME = "supply_compensated"
TITLE = "Rotor speed against supply voltage, commands compensated"
SOURCE = "Fankhauser et al., sec. IV-A7 and eq. 22"
COLUMNS = ("point", "omega_lower", "omega_upper", "voltage")


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """What is left, per rotor, as findings; `k_drive_voltage` is held for the share.

    Raises:
        BenchError: where the voltage hardly varies.
    """
    findings, checks, curves = [], [], []
    factor = card["k_drive_voltage"]
    for record in records:
        steady = steady_points(record, COLUMNS[1:])
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
    return BenchResult.of((NAME, TITLE, SOURCE), records, checks, curves, findings=tuple(findings))
