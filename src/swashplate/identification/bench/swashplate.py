"""The swashplate: linkage of the servos and stiffness of the lower hub, from forces and moments under steady commands.

    M_flap = sqrt(Mx^2 + My^2) - z_lw sqrt(Fx^2 + Fy^2)     (Fankhauser et al., sec. IV-A4, eq. 18 and Fig. 6)

What spoils it: a CG other than the one that the moments refer to, an airframe that bends, a trim that is not zero (it
is taken out as a bias as long as it does not change), and a sensor near its range.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.errors import BenchError
from swashplate.flights.bench_record import BenchRecord
from swashplate.identification.bench.result import BenchResult
from swashplate.identification.bench.steady import steady_points
from swashplate.identification.bench.tilt import CHANNELS, XP, figure_6, fit_tilt, tilt_checks
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.swashplate import swashplate_tilt
from swashplate.simulation.bench import Schedule, points

NAME = "swashplate"
TITLE = "Swashplate: tilt and flapping of the lower rotor"
SOURCE = "Fankhauser et al., sec. IV-A4, eqs 6, 13, 14 and 18, Fig. 6"
COLUMNS = ("point", "motor_lower", "servo_roll", "servo_pitch", "omega_lower", *CHANNELS)


def schedules(hover: Mapping[str, float]) -> list[Schedule]:
    """Servos through +-0.75 (6 degrees) on both axes, at hover."""
    levels = (0.15, 0.3, 0.45, 0.6, 0.75)
    settings = [{**hover, axis: sign * s} for axis in ("servo_pitch", "servo_roll") for s in levels for sign in (1, -1)]
    words = "hover; pitch then roll servo at +-0.15 to +-0.75 in steps of 0.15; back through the same points"
    return [points("swashplate", (NAME,), [hover, *settings, *settings[::-1], hover], settle=1.0, words=words)]


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`linkage_lower` and `hub_stiffness_lower`; the lag at hover is a finding.

    Args:
        records: one; more than one would need the lag at each speed.
        card: `k_thrust_lower`, `hub_height_lower`, `air_density` are taken as known.
    """
    if len(records) != 1:
        raise BenchError(
            f"{len(records)} records, expected one.", where=", ".join(r.name for r in records), hint="Join them."
        )
    record = records[0]
    found = steady_points(record, COLUMNS[1:])
    density = record.number("air_density", card["air_density"]) / card["air_density"]
    thrust = card["k_thrust_lower"] * density * found["omega_lower"] ** 2
    roll, pitch = found["servo_roll"], found["servo_pitch"]

    def steering(i: int, linkage: float, lag: float) -> TipPathPlane:
        return swashplate_tilt(float(roll[i]), float(pitch[i]), linkage=linkage, lag=lag, mixing="rotation", xp=XP)

    height = card["hub_height_lower"]
    lag = card["k_zeta_lower"] * float(found["omega_lower"].mean()) + card["o_zeta_lower"]
    start = np.array([card["linkage_lower"], lag, card["hub_stiffness_lower"]])
    fit = fit_tilt(found, steering, thrust, hub_height=height, start=start)
    kept = {name: card[name] for name in ("k_thrust_lower", "hub_height_lower")}
    pair = [0, 2]
    return BenchResult(
        NAME,
        TITLE,
        SOURCE,
        ("linkage_lower", "hub_stiffness_lower"),
        fit.values[pair],
        fit.covariance[np.ix_(pair, pair)],
        (record.name,),
        tuple(tilt_checks(found, fit, kept)),
        tuple(figure_6(fit, float(thrust.mean()), hub_height=height, rotor_name="lower")),
        leans_on={"k_thrust_lower": fit.by_thrust[pair] / card["k_thrust_lower"]},
        findings=(("phase lag offset at hover", float(fit.values[1]), float(np.sqrt(fit.covariance[1, 1])), "rad"),),
    )
