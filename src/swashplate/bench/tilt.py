"""Tilt of a rotor from lateral forces and moments: how far it tilts, in which direction, and how stiff its hub is.

    M_flap = sqrt(Mx^2 + My^2) - z sqrt(Fx^2 + Fy^2)        (Fankhauser et al., sec. IV-A4, eq. 18)

The force gives the tilt, F = T sin(tilt); what the moment has beyond z F is the flapping of the elastic blades. Instead
of the magnitudes, whose noise has a mean, all four signed components are fitted at once by the equations of flight,
with a bias and a drift each; the magnitudes of eq. 18 are for the plot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from swashplate.arrays import Array
from swashplate.bench.checks import check_drift, check_settled, check_structure, check_vibration
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve, Procedure
from swashplate.bench.steady import SteadyLine, SteadyPoints, nuisance, steady_points
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError
from swashplate.physics import rotor
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Euler
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.stabilizer_bar import StabilizerBar, upper_tip_path_plane
from swashplate.physics.swashplate import swashplate_tilt

_UNLIKE = 0.25
"""Largest share of a channel's square that the fitted tilt may leave."""
CHANNELS = ("Fx", "Fy", "Mx", "My")
XP = FloatBackend()

Steering = Callable[[int, float, float], TipPathPlane]
"""The tilt at a point for a linkage and a lag."""
Deflections = Callable[[SteadyPoints], Steering]
"""The steering that the points of a record make."""


@dataclass(frozen=True)
class TiltFit:
    """What the tilt of one rotor tells.

    Attributes:
        values: linkage, lag [rad] and hub stiffness [N m/rad].
        covariance: shape (3, 3), thrust and hub height taken as exact.
        by_thrust, by_height: derivatives of `values` by the logarithms of the thrust factor and of the hub height,
            shape (3,).
        corrected: measured channels with bias and drift taken out, shape (n, 4).
        residuals: shape (n, 4), bias and drift taken out.
        drift: of each channel, per minute, and its standard deviation, shape (2, 4).
        tilt: size of the fitted tilt at each point [rad].
    """

    values: Array
    covariance: Array
    by_thrust: Array
    by_height: Array
    corrected: Array
    residuals: Array
    drift: Array
    tilt: Array


def fit_tilt(points: SteadyPoints, steering: Steering, thrust: Array, *, hub_height: float, start: Array) -> TiltFit:
    """Linkage, lag and hub stiffness of one rotor.

    Args:
        points: steady points with `CHANNELS`.
        steering: how linkage and lag tilt the disc at each point.
        thrust: of this rotor at each point [N], shape (n,).
        hub_height: above the CG [m].
        start: first guess of the three.

    Raises:
        BenchError: too few points, nothing steered, or signs that physics forbids.
    """
    n = len(points)
    if n < 8:
        raise BenchError(f"has {n} points, expected at least 8.", where=points.where, hint="See `swash bench plan`.")
    measured = np.column_stack([points[name] for name in CHANNELS])
    basis = np.linalg.qr(np.column_stack(nuisance(points)))[0]

    def without(columns: Array) -> Array:
        return np.asarray(columns - basis @ (basis.T @ columns))

    def model(x: Array, *, lift: float = 1.0, raised: float = 1.0) -> Array:
        planes = (steering(i, x[0], x[1]) for i in range(n))
        return np.array([_loads(p, lift * t, raised * hub_height, x[2]) for p, t in zip(planes, thrust, strict=True)])

    if np.ptp([abs(complex(*steering(i, 1.0, 0.0))) for i in range(n)]) == 0.0:
        raise BenchError("steers nothing.", where=points.where, hint="Deflect servos or bar between the points.")
    _refuse_against(without(measured), without(model(start)), points.where)
    scale = np.abs(start) + np.array([0.0, 0.1, 0.0])
    spread = np.array([1e-3, 1e-3, 1e-4, 1e-4])

    values = start
    for _ in range(3):

        def off(x: Array, by: Array = spread) -> Array:
            return np.asarray((without(measured - model(x)) / by).ravel())

        solution = least_squares(off, values, x_scale=scale, xtol=1e-12)
        values, used = solution.x, spread
        left = solution.fun.reshape(n, 4) * used
        spread = np.sqrt(np.sum(left**2, axis=0) / (n - 2.75))
    _refuse_unlike(without(measured), left, points.where)
    _refuse(values, points.where)
    covariance = np.linalg.inv(solution.jac.T @ solution.jac)

    def by_held(**shift: float) -> Array:
        """How the estimate moves with what it holds: what a wrong lift or height adds to the model, fitted back."""
        added = (model(values, **{k: 1.0 + s for k, s in shift.items()}) - model(values)) / sum(shift.values())
        return np.asarray(-covariance @ solution.jac.T @ (-without(added) / used).ravel())

    fitted = model(values)
    tilt = np.array([abs(complex(*steering(i, values[0], values[1]))) for i in range(n)])
    corrected = without(measured) + (fitted - without(fitted))
    columns = np.column_stack(nuisance(points))
    unbiased = np.linalg.lstsq(columns, measured - fitted, rcond=None)[0]
    sure = spread * float(np.sqrt(np.linalg.inv(columns.T @ columns)[1, 1]))
    drift = np.array([unbiased[1], sure])
    return TiltFit(
        values, np.asarray(covariance), by_held(lift=1e-4), by_held(raised=1e-4), corrected, left, drift, tilt
    )


def _loads(plane: TipPathPlane, thrust: float, hub_height: float, stiffness: float) -> tuple[float, ...]:
    force = rotor.thrust_direction(plane, XP).scaled(thrust)
    moment = rotor.thrust_moment(force, hub_height) + rotor.flapping_moment(stiffness, plane)
    return force.x, force.y, moment.x, moment.y


def _refuse_against(measured: Array, expected: Array, where: str) -> None:
    """Raise where forces or moments point against the commanded deflection, on one axis or on both."""
    for pair, what, hint in (
        ([0, 1], "forces lean", "Turn the sign of the lateral forces, or that of servos or bar"),
        ([2, 3], "moments point", "Turn the sign of the moments"),
    ):
        along = np.sum(measured * expected, axis=0)
        against = [CHANNELS[i] for i in pair if along[i] < 0.0]
        if along[pair].sum() < 0.0 or against:
            raise BenchError(
                f"{what} against the deflection that was commanded.",
                where=where,
                channel=", ".join(against or [CHANNELS[i] for i in pair]),
                hint=f"{hint}; axes are forward-right-down.",
            )


def _refuse_unlike(measured: Array, left: Array, where: str) -> None:
    """Raise where a channel does not follow the deflection at all: exchanged columns, or another axis' sensor."""
    share = np.sum(left**2, axis=0) / np.sum(measured**2, axis=0)
    if share.max() > _UNLIKE:
        raise BenchError(
            f"does not follow the deflection: {100 * share.max():.0f} % of its square is left.",
            where=where,
            channel=CHANNELS[int(share.argmax())],
            hint="Are two columns exchanged, or do they refer to other axes than forward-right-down?",
        )


def _refuse(values: Array, where: str) -> None:
    if values[2] < 0.0:
        raise BenchError(
            "moments are smaller than the tilted thrust alone makes.",
            where=where,
            channel="Mx, My",
            hint="Do they refer to the CG, and not to the sensor? Is the thrust factor right?",
        )


def figure_6(fit: TiltFit, thrust: float, *, hub_height: float, rotor_name: str) -> list[Curve]:
    """Total, flapping and tilt torque against the tilt (Fankhauser et al., Fig. 6)."""
    force = np.hypot(fit.corrected[:, 0], fit.corrected[:, 1])
    moment = np.hypot(fit.corrected[:, 2], fit.corrected[:, 3])
    angle = np.linspace(0.0, fit.tilt.max(), 40)
    lines = torques(angle, stiffness=float(fit.values[2]), thrust=thrust, hub_height=hub_height)
    measured = (moment, moment - hub_height * force, hub_height * force)
    title = f"Torque against the tilt of the {rotor_name} rotor (the paper's Fig. 6)"
    return [
        Curve(title, "tilt [deg]", "torque [N mm]", np.degrees(fit.tilt), 1e3 * points, np.degrees(angle), 1e3 * line,
              name=name)
        for name, points, line in zip(("total", "flapping", "tilt of the thrust"), measured, lines, strict=True)
    ]  # fmt: skip


def torques(tilt: Array, *, stiffness: float, thrust: float, hub_height: float) -> tuple[Array, Array, Array]:
    """Total, flapping and tilt torque [N m] for tilts [rad] (Fankhauser et al., Fig. 6 and eqs 2, 6)."""
    flapping, tilting = stiffness * tilt, hub_height * thrust * np.sin(tilt)
    return flapping + tilting, flapping, tilting


def _checks(points: SteadyPoints, fit: TiltFit, setting: Array) -> list[BenchCheck]:
    """Settling, vibration, drift, repeats, and the residuals against what the sensor's own noise could leave.

    Args:
        setting: what was set at each point, equal for repeats, shape (n,).
    """
    checks = [check(points, name) for name in ("Fx", "Mx") for check in (check_settled, check_vibration)]
    span, freedom = float(np.ptp(points.time)), len(points) - 3
    for i, (name, unit) in enumerate(zip(CHANNELS, ("N", "N", "N m", "N m"), strict=True)):
        value, sigma = (float(number) for number in fit.drift[:, i])
        what, left = f"{points.where}: {name} [{unit}]", fit.residuals[:, i]
        checks.append(check_drift(value, sigma, span=span, what=what))
        line = SteadyLine(np.zeros(0), np.zeros((0, 0)), left, float(left.std()), freedom)
        checks += check_structure(line, setting, what=what)
    force, moment = (np.sqrt(np.mean(fit.residuals[:, pair] ** 2)) for pair in ([0, 1], [2, 3]))
    checks.append(BenchCheck(f"{points.where}: residuals {1e3 * force:.2g} mN and {1e3 * moment:.2g} N mm."))
    curvature = np.polyfit(fit.tilt, np.sum(fit.residuals[:, 2:] * np.sign(fit.corrected[:, 2:]), axis=1), 2)[0]
    bent = abs(curvature) * np.ptp(fit.tilt) ** 2 / 4.0 > max(3.0 * moment, 0.02 * np.abs(fit.corrected[:, 2:]).max())
    checks.append(
        BenchCheck(
            f"{points.where}: the moment against the tilt is "
            + ("bent: blades or airframe give way." if bent else "straight."),
            good=not bent,
        )
    )
    return checks


def _tilt_result(
    procedure: Procedure,
    records: Sequence[BenchRecord],
    card: Mapping[str, float],
    deflections: Deflections,
    *,
    rotor_name: str,
    settings: tuple[str, str],
) -> BenchResult:
    """Linkage and hub stiffness of one rotor from its record; the phase lag is a finding.

    Args:
        records: one; more than one would need the lag at each speed.
        card: `k_thrust`, `hub_height` of the rotor and `air_density` are held.
        deflections: what steers the rotor.
        rotor_name: "upper" or "lower".
        settings: the two columns that are set.

    Raises:
        BenchError: as `fit_tilt`, or for more than one record.
    """
    if len(records) != 1:
        raise BenchError(
            f"{len(records)} records, expected one.", where=", ".join(r.name for r in records), hint="Join them."
        )
    (record,) = records
    points = steady_points(record, procedure.columns[1:])
    names = (f"linkage_{rotor_name}", f"hub_stiffness_{rotor_name}")
    factor, height = f"k_thrust_{rotor_name}", f"hub_height_{rotor_name}"
    density = record.number("air_density", card["air_density"]) / card["air_density"]
    speed = points[f"omega_{rotor_name}"]
    thrust = card[factor] * density * speed**2
    lag = card[f"k_zeta_{rotor_name}"] * float(speed.mean()) + card[f"o_zeta_{rotor_name}"]
    start = np.array([card[names[0]], lag, card[names[1]]])
    fit = fit_tilt(points, deflections(points), thrust, hub_height=card[height], start=start)
    setting = np.round(points[settings[0]], 3) + 1e3 * np.round(points[settings[1]], 3)
    pair, leans = [0, 2], {factor: fit.by_thrust / card[factor], height: fit.by_height / card[height]}
    return BenchResult(
        procedure.name,
        procedure.title,
        procedure.source,
        names,
        fit.values[pair],
        fit.covariance[np.ix_(pair, pair)],
        (record.name,),
        tuple(_checks(points, fit, setting)),
        tuple(figure_6(fit, float(thrust.mean()), hub_height=card[height], rotor_name=rotor_name)),
        leans_on={name: slope[pair] for name, slope in leans.items()},
        findings=(
            BenchFinding(
                f"phase lag offset of the {rotor_name} rotor at {speed.mean():.0f} rad/s",
                float(fit.values[1]),
                float(np.sqrt(fit.covariance[1, 1])),
                "rad",
                {name: float(slope[1]) for name, slope in leans.items()},
            ),
        ),
    )


def schedule_swashplate(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Servos through +-0.75 (6 degrees) on both axes, at hover."""
    levels = (0.15, 0.3, 0.45, 0.6, 0.75)
    settings = [{**hover, axis: sign * s} for axis in ("servo_pitch", "servo_roll") for s in levels for sign in (1, -1)]
    about = "hover; pitch then roll servo at +-0.15 to +-0.75 in steps of 0.15; back through the same points"
    return [
        points("swashplate", (SWASHPLATE.name,), [hover, *settings, *settings[::-1], hover], settle=1.0, about=about)
    ]


def estimate_swashplate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`linkage_lower` and `hub_stiffness_lower` from steady commands of the servos; the lag at hover is a finding.

    What spoils it: vibration (told by the samples' scatter), ground effect on the thrust that is held, a CG other than
    the one that the moments refer to, an airframe that bends, a trim that is not zero (it is taken out as a bias as
    long as it does not change), and a sensor near its range.

    Args:
        records: one.
        card: `k_thrust_lower`, `hub_height_lower`, `air_density` are held.
    """
    return _tilt_result(
        SWASHPLATE, records, card, _by_servos, rotor_name="lower", settings=("servo_roll", "servo_pitch")
    )


def _by_servos(steady: SteadyPoints) -> Steering:
    roll, pitch = steady["servo_roll"], steady["servo_pitch"]

    def steering(i: int, linkage: float, lag: float) -> TipPathPlane:
        return swashplate_tilt(float(roll[i]), float(pitch[i]), linkage=linkage, lag=lag, mixing="rotation", xp=XP)

    return steering


SWASHPLATE = Procedure(
    "swashplate",
    "Swashplate: tilt and flapping of the lower rotor",
    "Fankhauser et al., sec. IV-A4, eqs 6, 13, 14 and 18, Fig. 6",
    ("point", "motor_lower", "servo_roll", "servo_pitch", "omega_lower", *CHANNELS),
    estimate_swashplate,
    schedule_swashplate,
)


_LEVEL = Euler(0.0, 0.0, 0.0)


def schedule_bar_linkage(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """The bar held at up to 0.2 rad about both axes, at hover."""
    angles = [(axis, sign * a) for axis in ("bar_alpha", "bar_beta") for a in (0.1, 0.2) for sign in (1.0, -1.0)]
    settings = [{**hover, axis: angle} for axis, angle in angles]
    about = "hover; bar held at +-0.1 and +-0.2 rad about x, then about y; back through the same points"
    return [
        points("bar_linkage", (BAR_LINKAGE.name,), [hover, *settings, *settings[::-1], hover], settle=1.0, about=about)
    ]


def estimate_bar_linkage(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`linkage_upper` and `hub_stiffness_upper` from a bar that a magnet holds deflected; the lag is a finding.

    (alpha, beta)_up = l_up R (alpha, beta)_bar             (Fankhauser et al., sec. IV-A5, eqs 10, 11 and Fig. 7)

    What spoils it: vibration, ground effect, a magnet that lets the bar wobble, a deflection that is read off with the
    rotor at rest, and the downwash on the magnet's arm.

    Args:
        records: one.
        card: `k_thrust_upper`, `hub_height_upper`, `air_density` are held.
    """
    return _tilt_result(BAR_LINKAGE, records, card, _by_bar, rotor_name="upper", settings=("bar_alpha", "bar_beta"))


def _by_bar(steady: SteadyPoints) -> Steering:
    alpha, beta = steady["bar_alpha"], steady["bar_beta"]

    def steering(i: int, linkage: float, lag: float) -> TipPathPlane:
        bar = StabilizerBar(float(alpha[i]), float(beta[i]))
        return upper_tip_path_plane(bar, _LEVEL, linkage=linkage, lag=lag, mixing="rotation", xp=XP)

    return steering


BAR_LINKAGE = Procedure(
    "bar_linkage",
    "Stabilizer bar: linkage to the upper rotor",
    "Fankhauser et al., sec. IV-A5, eqs 6, 10, 11 and 18, Fig. 7",
    ("point", "motor_upper", "omega_upper", "bar_alpha", "bar_beta", *CHANNELS),
    estimate_bar_linkage,
    schedule_bar_linkage,
)
