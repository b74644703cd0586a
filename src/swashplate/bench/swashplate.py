"""The swashplate: linkage of the servos and stiffness of the lower hub, from forces and moments under steady commands.

    M_flap = sqrt(Mx^2 + My^2) - z_lw sqrt(Fx^2 + Fy^2)     (Fankhauser et al., sec. IV-A4, eq. 18 and Fig. 6)

What spoils it: vibration (told by the samples' scatter), ground effect on the thrust that is held, a CG other than
the one that the moments refer to, an airframe that bends, a trim that is not zero (it is taken out as a bias as long as
it does not change), and a sensor near its range.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchResult
from swashplate.bench.steady import SteadyPoints
from swashplate.bench.tilt import CHANNELS, XP, Steering, tilt_result
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.swashplate import swashplate_tilt

NAME = "swashplate"
TITLE = "Swashplate: tilt and flapping of the lower rotor"
SOURCE = "Fankhauser et al., sec. IV-A4, eqs 6, 13, 14 and 18, Fig. 6"
COLUMNS = ("point", "motor_lower", "servo_roll", "servo_pitch", "omega_lower", *CHANNELS)


def schedules(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Servos through +-0.75 (6 degrees) on both axes, at hover."""
    levels = (0.15, 0.3, 0.45, 0.6, 0.75)
    settings = [{**hover, axis: sign * s} for axis in ("servo_pitch", "servo_roll") for s in levels for sign in (1, -1)]
    about = "hover; pitch then roll servo at +-0.15 to +-0.75 in steps of 0.15; back through the same points"
    return [points("swashplate", (NAME,), [hover, *settings, *settings[::-1], hover], settle=1.0, about=about)]


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`linkage_lower` and `hub_stiffness_lower`; the lag at hover is a finding.

    Args:
        records: one.
        card: `k_thrust_lower`, `hub_height_lower`, `air_density` are held.
    """
    return tilt_result(
        (NAME, TITLE, SOURCE),
        records,
        card,
        _deflections,
        rotor_name="lower",
        channels=COLUMNS[1 : -len(CHANNELS)],
        settings=("servo_roll", "servo_pitch"),
    )


def _deflections(steady: SteadyPoints) -> Steering:
    roll, pitch = steady["servo_roll"], steady["servo_pitch"]

    def steering(i: int, linkage: float, lag: float) -> TipPathPlane:
        return swashplate_tilt(float(roll[i]), float(pitch[i]), linkage=linkage, lag=lag, mixing="rotation", xp=XP)

    return steering
