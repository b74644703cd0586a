"""Linkage of the stabilizer bar to the upper rotor, and that hub's stiffness, from a bar that a magnet holds deflected.

    (alpha, beta)_up = l_up R (alpha, beta)_bar             (Fankhauser et al., sec. IV-A5, eqs 10, 11 and Fig. 7)

Forces and moments are split as for the lower rotor (eq. 18). What spoils it: vibration (told by the samples' scatter),
ground effect on the thrust that is held, a magnet that lets the bar wobble, a deflection that is read off with the
rotor at rest, and the downwash on the magnet's arm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchResult
from swashplate.bench.steady import SteadyPoints
from swashplate.bench.tilt import CHANNELS, XP, Steering, tilt_result
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.physics.frames import Euler
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.stabilizer_bar import StabilizerBar, upper_tip_path_plane

NAME = "bar_linkage"
TITLE = "Stabilizer bar: linkage to the upper rotor"
SOURCE = "Fankhauser et al., sec. IV-A5, eqs 6, 10, 11 and 18, Fig. 7"
COLUMNS = ("point", "motor_upper", "omega_upper", "bar_alpha", "bar_beta", *CHANNELS)

_LEVEL = Euler(0.0, 0.0, 0.0)


def schedules(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """The bar held at up to 0.2 rad about both axes, at hover."""
    angles = [(axis, sign * a) for axis in ("bar_alpha", "bar_beta") for a in (0.1, 0.2) for sign in (1.0, -1.0)]
    settings = [{**hover, axis: angle} for axis, angle in angles]
    about = "hover; bar held at +-0.1 and +-0.2 rad about x, then about y; back through the same points"
    return [points("bar_linkage", (NAME,), [hover, *settings, *settings[::-1], hover], settle=1.0, about=about)]


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`linkage_upper` and `hub_stiffness_upper`; the lag is a finding.

    Args:
        records: one.
        card: `k_thrust_upper`, `hub_height_upper`, `air_density` are held.
    """
    return tilt_result(
        (NAME, TITLE, SOURCE),
        records,
        card,
        _deflections,
        rotor_name="upper",
        channels=COLUMNS[1 : -len(CHANNELS)],
        settings=("bar_alpha", "bar_beta"),
    )


def _deflections(steady: SteadyPoints) -> Steering:
    alpha, beta = steady["bar_alpha"], steady["bar_beta"]

    def steering(i: int, linkage: float, lag: float) -> TipPathPlane:
        bar = StabilizerBar(float(alpha[i]), float(beta[i]))
        return upper_tip_path_plane(bar, _LEVEL, linkage=linkage, lag=lag, mixing="rotation", xp=XP)

    return steering
