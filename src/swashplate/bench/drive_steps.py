"""Time constants of the drive trains from steps of one motor.

    T_d Omegadot = -Omega + Omega_steady            (Fankhauser et al., sec. IV-A2, eq. 15)

The steady speed of every step is an unknown of its own, so that neither the speed map nor a motor's repeatability
enters. What spoils it: a supply that sags under the step, steps into saturation, and a tachometer that averages over
a time comparable with the time constant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.lag import LagFit, first_order, fit_lag
from swashplate.bench.record import BenchRecord
from swashplate.bench.refusals import refuse_idle
from swashplate.bench.result import BenchCheck, BenchResult, Curve
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError

NAME = "drive_steps"
TITLE = "Drive trains from steps"
SOURCE = "Fankhauser et al., sec. IV-A2 and eq. 15"
COLUMNS = ("motor_lower", "motor_upper", "omega_lower", "omega_upper")

_STEP = 0.05  # of a motor command: what counts as a step of this procedure
_BOUNDS = (0.01, 2.0)


def schedules(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Steps of each motor between 0.5 and 0.65, 2 s each, the other at hover."""
    made = []
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        held = {f"motor_{other}": hover[f"motor_{other}"]}
        steps = [{**held, f"motor_{rotor}": u} for u in (0.5, 0.65) * 5]
        words = f"{rotor} motor 0.50, 0.65, five times, 2 s each; {other} at hover"
        made.append(points(f"steps_{rotor}", (NAME,), steps, settle=0.0, hold=2.0, words=words))
    return made


def held_levels(command: Array) -> Array:
    """Indicator columns of the stretches over which a command stands still, shape (n, stretches)."""
    stretch = np.cumsum(np.diff(command, prepend=command[0]) != 0.0)
    return np.asarray(stretch[:, None] == np.arange(stretch[-1] + 1), dtype=np.float64)


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`tau_drive` of every rotor whose motor was stepped.

    Raises:
        BenchError: where no motor was stepped, or a speed does not follow its steps.
    """
    fits: dict[str, list[LagFit]] = {}
    files: dict[str, tuple[str, ...]] = {}
    curves: list[Curve] = []
    checks: list[BenchCheck] = []
    for record in records:
        stepped = [r for r in ("upper", "lower") if np.abs(np.diff(record[f"motor_{r}"])).max() > _STEP]
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
        checks += [_check_both_ways(record.name, rotor, fit, levels, record.dt), _check_order(record.name, fit, size)]
        shown = slice(0, min(speed.size, round(8.0 / record.dt)))
        curves.append(
            Curve(
                f"Steps of the {rotor} motor",
                "time [s]",
                "rotor speed [rad/s]",
                record["time"][shown],
                speed[shown],
                record["time"][shown],
                fit.model[shown],
            )
        )
    names = tuple(f"tau_drive_{rotor}" for rotor in fits)
    weights = [np.array([fit.sigma**-2 for fit in group]) for group in fits.values()]
    values = [float(w @ [fit.tau for fit in group] / w.sum()) for w, group in zip(weights, fits.values(), strict=True)]
    return BenchResult(
        NAME,
        TITLE,
        SOURCE,
        names,
        np.array(values),
        np.diag([1.0 / w.sum() for w in weights]),
        tuple(record.name for record in records),
        tuple(checks),
        tuple(curves),
        records_of=files,
    )


def _check_both_ways(where: str, rotor: str, fit: LagFit, levels: Array, dt: float) -> BenchCheck:
    """Whether a rotor speeds up as fast as it slows down: residuals after rising against those after falling steps."""
    stretch = np.argmax(levels, axis=1)
    begins = np.searchsorted(stretch, np.arange(1, levels.shape[1]))
    window = round(2.0 * fit.tau / dt)
    rising = np.diff(fit.linear) > 0.0
    late = np.array([fit.residuals[b : b + window].mean() for b in begins]) * np.where(rising, 1.0, -1.0)
    size = float(np.mean(np.abs(np.diff(fit.linear))))
    up, down = late[rising].mean(), late[~rising].mean()
    differs = abs(up - down) > 0.02 * size
    return BenchCheck(
        f"{where}: the {rotor} rotor's residuals after steps up and down differ by {100 * (up - down) / size:+.1f} % "
        "of the step" + ("; one time constant does not hold for both ways." if differs else "."),
        good=not differs,
    )


def _check_order(where: str, fit: LagFit, size: float) -> BenchCheck:
    """Whether one lag is enough, by what is left after it."""
    left = float(np.sqrt(np.mean(np.convolve(fit.residuals, np.ones(10) / 10.0, mode="valid") ** 2)))
    bad = left > 0.02 * size
    return BenchCheck(
        f"{where}: the smoothed residual is {100 * left / size:.1f} % of the steps"
        + ("; a first-order lag does not describe them." if bad else "."),
        good=not bad,
    )
