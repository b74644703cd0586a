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
from swashplate.bench.lag import LagFit, check_order, first_order, fit_lag, held_levels
from swashplate.bench.record import BenchRecord
from swashplate.bench.refusals import refuse_idle
from swashplate.bench.result import BenchCheck, BenchResult, Curve, weigh
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
    records = []
    for rotor, other in (("upper", "lower"), ("lower", "upper")):
        held = {f"motor_{other}": hover[f"motor_{other}"]}
        steps = [{**held, f"motor_{rotor}": u} for u in (0.5, 0.65) * 5]
        about = f"{rotor} motor 0.50, 0.65, five times, 2 s each; {other} at hover"
        records.append(points(f"steps_{rotor}", (NAME,), steps, settle=0.0, hold=2.0, about=about))
    return records


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
        checks += [_check_both_ways(record.name, rotor, fit, levels, record.dt), check_order(record.name, fit, size)]
        shown = slice(0, min(speed.size, round(8.0 / record.dt)))
        at = record["time"][shown]
        title = f"Steps of the {rotor} motor"
        curves.append(Curve(title, "time [s]", "rotor speed [rad/s]", at, speed[shown], at, fit.model[shown]))
    weighed = [weigh([fit.tau for fit in group], [fit.sigma for fit in group]) for group in fits.values()]
    return BenchResult.of(
        (NAME, TITLE, SOURCE),
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
