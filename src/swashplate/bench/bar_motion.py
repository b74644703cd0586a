"""Time constant of the stabilizer bar, from motion capture of bar and fuselage in flight.

    tau_f,up etadot = phi - eta,  tau_f,up zetadot = theta - zeta       (Fankhauser et al., eq. 8)

The bar's angles are simulated from the fuselage's measured ones and compared; misalignment of the markers is a bias.
What spoils it: a heading that turns (the bar keeps its plane in space, see `bar_heading_transport`), attitudes that
hardly move, and records without a time base: directions alone tell how far the bar moved, never how fast.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.lag import first_order, fit_lag
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchResult, Curve, weigh
from swashplate.bench.virtual_bench import RecordSchedule
from swashplate.errors import BenchError

NAME = "bar_motion"
TITLE = "Stabilizer bar in flight"
SOURCE = "Fankhauser et al., sec. IV-A5 and eq. 8"
COLUMNS = ("phi", "theta", "eta_bar", "zeta_bar")

_LEAST_MOTION = 0.02  # rad


def schedules(hover: Mapping[str, float]) -> list[RecordSchedule]:
    """A minute of roll and pitch between 0.05 and 1 Hz, by motion capture in flight."""
    rate, seconds = 100.0, 60.0
    time = np.arange(round(seconds * rate)) / rate
    driving = {}
    for name, harmonics in (("phi", (3, 8, 14, 29, 55)), ("theta", (4, 9, 16, 31, 58))):
        waves = [np.sin(2.0 * np.pi * k / seconds * time + 2.4 * k * k) for k in harmonics]
        driving[name] = 0.05 * np.sum(waves, axis=0)
    about = "in flight, by motion capture: fuselage and bar over a minute, roll and pitch to 6 deg, 0.05 to 1 Hz"
    return [RecordSchedule("bar_motion", (NAME,), driving, np.ones(time.size), rate, bar="free", about=about)]


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """`tau_f_upper` from every record and both axes together.

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
        (NAME, TITLE, SOURCE), records, checks, curves, names=("tau_f_upper",), values=(tau,), covariance=(variance,)
    )
