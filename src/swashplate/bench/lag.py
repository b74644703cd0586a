"""First-order lags from time histories: one time constant, everything else in the response linear and eliminated.

Variable projection (Golub and Pereyra 1973): for each time constant the linear unknowns follow by least squares, so
that only one number is searched. Bounds allow for coloured residuals (vibration) as those of the flight fits do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.bench.refusals import refuse_idle
from swashplate.bench.result import BenchCheck, BenchResult, Curve, Procedure, weigh
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError
from swashplate.identification.core import accuracy

_CORRELATED = 0.3
"""Seconds of residual correlation that the bounds allow for."""


def first_order(command: Array, tau: float, dt: float) -> Array:
    """Response of `tau xdot + x = command` to a command held between samples, settled at the start; shape as command.

    Exact for held inputs: x[i+1] = a x[i] + (1 - a) u[i], a = exp(-dt / tau). Works along the first axis.
    """
    a = float(np.exp(-dt / tau))
    return np.asarray(lfilter([0.0, 1.0 - a], [1.0, -a], command - command[:1], axis=0) + command[:1])


@dataclass(frozen=True)
class LagFit:
    """A fitted time constant.

    Attributes:
        tau, sigma: [s], bound corrected for coloured residuals.
        linear: the linear unknowns.
        model, residuals: shape (n,).
    """

    tau: float
    sigma: float
    linear: Array
    model: Array
    residuals: Array


def fit_lag(
    response: Callable[[float], tuple[Array, Sequence[Array]]],
    measured: Array,
    *,
    dt: float,
    bounds: tuple[float, float],
    where: str,
) -> LagFit:
    """The time constant whose response fits best.

    Args:
        response: for a time constant, what has no unknown factor (n,) and the columns that have one.
        measured: shape (n,).
        dt: sample interval [s].
        bounds: what the time constant may be [s].
        where: the record, for errors.

    Raises:
        BenchError: where the best lies on a bound: the record holds no such response.
    """

    def solved(tau: float) -> tuple[Array, Array, Array]:
        known, columns = response(tau)
        matrix = np.column_stack(list(columns))
        # The normal equations: few, well-scaled columns, and a hundred times faster than a decomposition of all rows.
        linear = np.linalg.lstsq(matrix.T @ matrix, matrix.T @ (measured - known), rcond=None)[0]
        return matrix, np.asarray(linear, dtype=np.float64), known + matrix @ linear

    def cost(log_tau: float) -> float:
        left = measured - solved(float(np.exp(log_tau)))[2]
        return float(left @ left)

    low, high = np.log(bounds)
    grid = np.linspace(low, high, 25)
    best = int(np.argmin([cost(x) for x in grid]))
    if best in (0, grid.size - 1):
        raise BenchError(
            f"shows no first-order response with a time constant between {bounds[0]:g} and {bounds[1]:g} s.",
            where=where,
            hint="Does the column follow its command at all? Are the steps long enough, and not too small?",
        )
    minimum = minimize_scalar(cost, bracket=(grid[best - 1], grid[best], grid[best + 1]), options={"xtol": 1e-7})
    tau = float(np.exp(minimum.x))
    matrix, linear, model = solved(tau)
    step = 1e-4 * tau
    slope = (_at(response, tau + step, linear) - _at(response, tau - step, linear)) / (2.0 * step)
    jacobian = np.column_stack([slope, matrix])
    residuals = measured - model
    spread = float(np.sqrt(residuals @ residuals / (measured.size - jacobian.shape[1])))
    scale = np.linalg.norm(jacobian, axis=0) / spread
    sensitivities = (jacobian / (scale * spread)).T[:, :, None]
    information = np.linalg.inv(sensitivities[:, :, 0] @ sensitivities[:, :, 0].T)
    corrected = accuracy.corrected_covariance(
        information,
        np.zeros_like(information),
        [residuals[:, None] / spread],
        [sensitivities],
        lags=round(_CORRELATED / dt),
    )
    return LagFit(tau, float(np.sqrt(corrected[0, 0])) / float(scale[0]), linear, model, residuals)


def _at(response: Callable[[float], tuple[Array, Sequence[Array]]], tau: float, linear: Array) -> Array:
    known, columns = response(tau)
    return np.asarray(known + np.column_stack(list(columns)) @ linear)


def held_levels(command: Array) -> Array:
    """Indicator columns of the stretches over which a command stands still, shape (n, stretches)."""
    stretch = np.cumsum(np.diff(command, prepend=command[0]) != 0.0)
    return np.asarray(stretch[:, None] == np.arange(stretch[-1] + 1), dtype=np.float64)


def check_order(where: str, fit: LagFit, size: float, *, most: float = 0.02) -> BenchCheck:
    """Whether one lag is enough, by what is left after it: at most this share of the steps."""
    share = float(np.sqrt(np.mean(np.convolve(fit.residuals, np.ones(10) / 10.0, mode="valid") ** 2))) / size
    return BenchCheck(
        f"{where}: the smoothed residual is {100 * share:.1f} % of the steps"
        + ("; a first-order lag does not describe them." if share > most else "."),
        good=share <= most,
    )


_MOTOR_STEP = 0.05  # of a motor command: what counts as a step of this procedure
_BOUNDS = (0.01, 2.0)


def schedule_drive_steps(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Steps of each motor between 0.5 and 0.65, 2 s each, the other at hover."""
    records = []
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        held = {f"motor_{other}": hover[f"motor_{other}"]}
        steps = [{**held, f"motor_{rotor}": u} for u in (0.5, 0.65) * 5]
        about = f"{rotor} motor 0.50, 0.65, five times, 2 s each; {other} at hover"
        records.append(points(f"steps_{rotor}", (DRIVE_STEPS.name,), steps, settle=0.0, hold=2.0, about=about))
    return records


def estimate_drive_steps(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`tau_drive` of every rotor whose motor was stepped.

    T_d Omegadot = -Omega + Omega_steady            (Fankhauser et al., sec. IV-A2, eq. 15)

    The steady speed of every step is an unknown of its own, so that neither the speed map nor a motor's repeatability
    enters. What spoils it: a supply that sags under the step, steps into saturation, and a tachometer that averages
    over a time comparable with the time constant.

    Raises:
        BenchError: where no motor was stepped, or a speed does not follow its steps.
    """
    fits: dict[str, list[LagFit]] = {}
    files: dict[str, tuple[str, ...]] = {}
    curves: list[Curve] = []
    checks: list[BenchCheck] = []
    for record in records:
        stepped = [r for r in ("upper", "lower") if np.abs(np.diff(record[f"motor_{r}"])).max() > _MOTOR_STEP]
        if len(stepped) != 1:
            raise BenchError(
                f"steps {' and '.join(stepped) or 'no motor'}, expected one motor.",
                where=record.name,
                hint="Step one motor by 0.1 or more while the other holds hover.",
            )
        rotor = stepped[0]
        levels, speed = held_levels(record[f"motor_{rotor}"]), record[f"omega_{rotor}"]
        if levels.shape[1] < 3:
            raise BenchError("has fewer than two steps.", where=record.name, hint="Step up and down, several times.")
        refuse_idle(record, rotor, card)

        def response(tau: float, levels: Array = levels, dt: float = record.dt) -> tuple[Array, list[Array]]:
            return np.zeros(len(levels)), [*first_order(levels, tau, dt).T]

        fit = fit_lag(response, speed, dt=record.dt, bounds=_BOUNDS, where=record.name)
        fits.setdefault(rotor, []).append(fit)
        files[f"tau_drive_{rotor}"] = (*files.get(f"tau_drive_{rotor}", ()), record.name)
        size = np.ptp(fit.linear)
        checks += [_check_both_ways(record.name, rotor, fit, levels, record.dt), check_order(record.name, fit, size)]
        shown = slice(0, min(speed.size, round(8.0 / record.dt)))
        at = record["time"][shown]
        title = f"Steps of the {rotor} motor"
        curves.append(Curve(title, "time [s]", "rotor speed [rad/s]", at, speed[shown], at, fit.model[shown]))
    weighed = [weigh([fit.tau for fit in group], [fit.sigma for fit in group]) for group in fits.values()]
    return BenchResult.of(
        DRIVE_STEPS,
        records,
        checks,
        curves,
        names=[f"tau_drive_{rotor}" for rotor in fits],
        values=[tau for tau, _ in weighed],
        covariance=[variance for _, variance in weighed],
        records_of=files,
    )


def _check_both_ways(where: str, rotor: str, fit: LagFit, levels: Array, dt: float) -> BenchCheck:
    """Whether a rotor speeds up as fast as it slows down: residuals after rising against those after falling steps."""
    stretch = np.argmax(levels, axis=1)
    begins = np.searchsorted(stretch, np.arange(1, levels.shape[1]))
    window = round(2.0 * fit.tau / dt)
    rising = np.diff(fit.linear) > 0.0
    residual_after = np.array([fit.residuals[b : b + window].mean() for b in begins]) * np.where(rising, 1.0, -1.0)
    size = float(np.mean(np.abs(np.diff(fit.linear))))
    up, down = residual_after[rising].mean(), residual_after[~rising].mean()
    differs = abs(up - down) > 0.02 * size
    return BenchCheck(
        f"{where}: the {rotor} rotor's residuals after steps up and down differ by {100 * (up - down) / size:+.1f} % "
        "of the step" + ("; one time constant does not hold for both ways." if differs else "."),
        good=not differs,
    )


DRIVE_STEPS = Procedure(
    "drive_steps",
    "Drive trains from steps",
    "Fankhauser et al., sec. IV-A2 and eq. 15",
    ("motor_lower", "motor_upper", "omega_lower", "omega_upper"),
    estimate_drive_steps,
    schedule_drive_steps,
    in_time=True,
)


_SERVO_STEP = 0.1


def schedule_servo_steps(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Steps of each servo between -0.4 and 0.4, 0.8 s each, at hover."""
    records = []
    for axis in ("pitch", "roll"):
        steps = [hover, *({**hover, f"servo_{axis}": s} for s in (0.4, -0.4) * 10)]
        about = f"hover; {axis} servo 0.4, -0.4, ten times, 0.8 s each"
        records.append(points(f"servo_steps_{axis}", (SERVO_STEPS.name,), steps, settle=0.0, hold=0.8, about=about))
    return records


def estimate_servo_steps(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`tau_f_lower`, of the lower rotor behind its swashplate, from every record together.

    tau_f,lw tilt_dot = -tilt + l_lw s                      (Fankhauser et al., sec. IV-A4, eqs 13, 14)

    The moments follow the tilt; their main direction carries the step and is fitted, with a bias and a drift. What
    spoils it: the servo's own travel time, which adds to the time constant (measure it with the rotors off), and
    vibration, which the bound allows for.

    Raises:
        BenchError: where no single servo steps, or the moments do not follow.
    """
    taus, sigmas, checks, curves = [], [], [], []
    for record in records:
        stepped = [name for name in SERVO_STEPS.columns[1:3] if np.abs(np.diff(record[name])).max() > _SERVO_STEP]
        if len(stepped) != 1:
            raise BenchError(
                f"steps {' and '.join(stepped) or 'no servo'}, expected one servo.",
                where=record.name,
                hint="Step one servo by 0.2 or more, rotors at hover.",
            )
        command = record[stepped[0]]
        moment = np.column_stack([record["Mx"], record["My"]])
        moment = moment - moment.mean(axis=0)
        direction = np.linalg.svd(moment.T @ command[:, None] / command.size, full_matrices=False)[0][:, 0]
        main = moment @ direction
        shape, time = held_levels(command), record["time"]
        steps = (shape * command[:, None]).sum(axis=1)

        def response(
            tau: float, steps: Array = steps, time: Array = time, dt: float = record.dt
        ) -> tuple[Array, list[Array]]:
            return np.zeros(steps.size), [first_order(steps, tau, dt), np.ones(steps.size), time - time.mean()]

        fit = fit_lag(response, main, dt=record.dt, bounds=(0.008, 1.0), where=record.name)
        taus.append(fit.tau)
        sigmas.append(fit.sigma)
        checks.append(check_order(record.name, fit, float(np.ptp(fit.model)), most=0.04))
        shown = slice(0, min(time.size, round(5.0 / record.dt)))
        curves.append(
            Curve(f"Moment after steps of the {stepped[0].removeprefix('servo_')} servo", "time [s]", "moment [N mm]",
                  time[shown], 1e3 * main[shown], time[shown], 1e3 * fit.model[shown])
        )  # fmt: skip
    if len(taus) > 1:
        apart = (taus[0] - taus[1]) / np.hypot(sigmas[0], sigmas[1])
        checks.append(
            BenchCheck(f"The two servos' time constants are {apart:+.1f} sigmas apart.", good=abs(apart) < 3.5)
        )
    tau, variance = weigh(taus, sigmas)
    return BenchResult.of(
        SERVO_STEPS, records, checks, curves, names=("tau_f_lower",), values=(tau,), covariance=(variance,)
    )


SERVO_STEPS = Procedure(
    "servo_steps",
    "Lower rotor behind its swashplate, from servo steps",
    "Fankhauser et al., sec. IV-A4 and eqs 13, 14",
    ("motor_lower", "servo_roll", "servo_pitch", "Mx", "My"),
    estimate_servo_steps,
    schedule_servo_steps,
    in_time=True,
)


_LEAST_MOTION = 0.02  # rad


def schedule_bar_motion(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """A minute of roll and pitch between 0.05 and 1 Hz, by motion capture in flight."""
    rate, seconds = 100.0, 60.0
    time = np.arange(round(seconds * rate)) / rate
    driving = {}
    for name, harmonics in (("phi", (3, 8, 14, 29, 55)), ("theta", (4, 9, 16, 31, 58))):
        waves = [np.sin(2.0 * np.pi * k / seconds * time + 2.4 * k * k) for k in harmonics]
        driving[name] = 0.05 * np.sum(waves, axis=0)
    about = "in flight, by motion capture: fuselage and bar over a minute, roll and pitch to 6 deg, 0.05 to 1 Hz"
    return [
        RecordSchedule("bar_motion", (BAR_MOTION.name,), driving, np.ones(time.size), rate, bar="free", about=about)
    ]


def estimate_bar_motion(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`tau_f_upper`, of the stabilizer bar in flight, from every record and both axes together.

    tau_f,up etadot = phi - eta,  tau_f,up zetadot = theta - zeta       (Fankhauser et al., eq. 8)

    The bar's angles are simulated from the fuselage's measured ones and compared; misalignment of the markers is a
    bias. What spoils it: a heading that turns (the bar keeps its plane in space, see `bar_heading_transport`),
    attitudes that hardly move, and records without a time base: directions tell how far the bar moved, never how fast.

    Raises:
        BenchError: where the fuselage hardly moves or the bar does not follow it.
    """
    taus, sigmas, curves = [], [], []
    for record in records:
        for angle, bar in (("phi", "eta_bar"), ("theta", "zeta_bar")):
            driving, time = record[angle], record["time"]
            if np.std(driving) < _LEAST_MOTION:
                raise BenchError(
                    f"moves by {np.std(driving):.2g} rad (standard deviation), expected {_LEAST_MOTION}.",
                    where=record.name,
                    channel=angle,
                    hint="Fly slow rolls and pitches of some degrees.",
                )

            def response(
                tau: float, driving: Array = driving, time: Array = time, dt: float = record.dt
            ) -> tuple[Array, list[Array]]:
                held = 0.5 * (driving + np.r_[driving[1:], driving[-1]])  # an attitude does not jump between samples
                return first_order(held, tau, dt), [np.ones(time.size), np.exp(-(time - time[0]) / tau)]

            fit = fit_lag(response, record[bar], dt=record.dt, bounds=(0.1, 20.0), where=record.name)
            taus.append(fit.tau)
            sigmas.append(fit.sigma)
            curves.append(
                Curve(f"Bar angle {bar} in flight", "time [s]", "angle [deg]", time[::5],
                      np.degrees(record[bar][::5]), time[::5], np.degrees(fit.model[::5]))
            )  # fmt: skip
    apart = (taus[0] - taus[1]) / np.hypot(sigmas[0], sigmas[1])
    tau, variance = weigh(taus, sigmas)
    checks = [BenchCheck(f"Roll and pitch give time constants {apart:+.1f} sigmas apart.", good=abs(apart) < 3.5)]
    return BenchResult.of(
        BAR_MOTION, records, checks, curves, names=("tau_f_upper",), values=(tau,), covariance=(variance,)
    )


BAR_MOTION = Procedure(
    "bar_motion",
    "Stabilizer bar in flight",
    "Fankhauser et al., sec. IV-A5 and eq. 8",
    ("phi", "theta", "eta_bar", "zeta_bar"),
    estimate_bar_motion,
    schedule_bar_motion,
    in_time=True,
)
