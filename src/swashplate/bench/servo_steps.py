"""Time constant of the lower rotor behind its swashplate, from steps of a servo.

    tau_f,lw tilt_dot = -tilt + l_lw s                      (Fankhauser et al., sec. IV-A4, eqs 13, 14)

The moments follow the tilt; their main direction carries the step and is fitted, with a bias and a drift. What spoils
it: the servo's own travel time, which adds to the time constant (measure it with the rotors off), and vibration, which
the bound allows for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.lag import check_order, first_order, fit_lag, held_levels
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchResult, Curve, weigh
from swashplate.bench.virtual_bench import RecordSchedule, points
from swashplate.errors import BenchError

NAME = "servo_steps"
TITLE = "Lower rotor behind its swashplate, from servo steps"
SOURCE = "Fankhauser et al., sec. IV-A4 and eqs 13, 14"
COLUMNS = ("motor_lower", "servo_roll", "servo_pitch", "Mx", "My")

_STEP = 0.1


def schedules(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """Steps of each servo between -0.4 and 0.4, 0.8 s each, at hover."""
    records = []
    for axis in ("pitch", "roll"):
        steps = [hover, *({**hover, f"servo_{axis}": s} for s in (0.4, -0.4) * 10)]
        about = f"hover; {axis} servo 0.4, -0.4, ten times, 0.8 s each"
        records.append(points(f"servo_steps_{axis}", (NAME,), steps, settle=0.0, hold=0.8, about=about))
    return records


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`tau_f_lower` from every record together.

    Raises:
        BenchError: where no single servo steps, or the moments do not follow.
    """
    taus, sigmas, checks, curves = [], [], [], []
    for record in records:
        stepped = [name for name in COLUMNS[1:3] if np.abs(np.diff(record[name])).max() > _STEP]
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
        (NAME, TITLE, SOURCE), records, checks, curves, names=("tau_f_lower",), values=(tau,), covariance=(variance,)
    )
