"""Recursive estimators beside a flight while it is flown: what is known on board now, and how well.

The estimators are those of `swash track`: recursive Fourier regressions for equations of motion, the extended Kalman
filter for a vehicle's parameters. They read the flight through gyros and motion capture with noise, never the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.sensor_suite import suite
from swashplate.identification.recursive.equation import coefficient_unit, regression_equation
from swashplate.identification.recursive.fourier_regression import RecursiveRegression, regression_plan
from swashplate.identification.recursive.slow_parameters import SlowParameters, slow_plan
from swashplate.models.vehicle import Vehicle

LOOK = 0.2
"""Seconds between two looks at the estimates."""
_TOLD = 5.0
"""Seconds of flight between two lines."""
SPREAD, WANDER = 0.2, 0.02
"""Of a vehicle's parameters: possible relative error at the start, and relative change in a second."""


@dataclass(frozen=True)
class KnownNow:
    """One number as it is known now.

    Attributes:
        name, unit: of the number; the unit is "" where it is not known.
        model: what the model says; None for a coefficient of an equation.
        value, sigma: estimate and standard error; None while the flight does not tell it.
    """

    name: str
    unit: str
    model: float | None
    value: float | None = None
    sigma: float | None = None

    def __str__(self) -> str:
        if self.value is None or self.sigma is None:
            return f"{self.name} not told yet"
        return f"{self.name} {self.value:.4g} +- {self.sigma:.2g} {self.unit}".rstrip()


class Estimating:
    """Estimators beside a flight. Feed them with `step`; `known` is what they say.

    Args:
        model: what the pilot believes to fly.
        asked: equations such as "q_dot = Mq*q + Md*servo_pitch + bias", and names of the model's parameters, several
            separated by commas.
        rate: samples per second [Hz].
        delays: of inputs [s]; those left out act at once.
        seed: of the sensors' noise.
        say: told what is known, every few seconds of flight; None tells nobody.

    Attributes:
        model, dt: as given, and the time between samples [s].
        known: every number asked for, in order.
        frozen: why the last sample did not count; "" where it did.

    Raises:
        IdentificationError: an equation that is none, a channel or a parameter that the model does not have.
    """

    def __init__(
        self,
        model: Vehicle,
        asked: Sequence[str],
        *,
        rate: float,
        delays: Mapping[str, float] | None = None,
        seed: int = 0,
        say: Callable[[str], None] | None = None,
    ) -> None:
        self.model, self._say = model, say
        lags = {name: (delays or {}).get(name, 0.0) for name in model.input_names}
        sensors = suite(f"mocap@{rate:g}+0ms,gyro@{rate:g}+0ms")
        self._channels = (*model.state_names, *model.input_names, "voltage")
        self._sigma = np.zeros(len(self._channels))
        for sensor in sensors:
            for name, sigma in zip(sensor.channels, sensor.sigma, strict=True):
                if name in self._channels:
                    self._sigma[self._channels.index(name)] = sigma
        self._random = np.random.default_rng(seed)
        self.dt, self._paused, self._looked, self._silent = 1.0 / rate, True, np.inf, 0.0
        self._regressions: list[tuple[RecursiveRegression, list[int]]] = []
        self._filter: SlowParameters | None = None
        self.frozen, known, names = "", [], []
        for text in asked:
            if "=" not in text:
                names += [name.strip() for name in text.split(",") if name.strip()]
                continue
            bare = regression_equation(text)
            strange = [name for name in bare.channels if name not in self._channels]
            if strange:
                raise IdentificationError(
                    f"is no channel of {model.name}; there are {', '.join(self._channels)}.",
                    where=text,
                    channel=strange[0],
                )
            used = {name: lags[name] for name in bare.channels if lags.get(name) and name != bare.left}
            e = regression_equation(text, delays=used)
            plan = regression_plan(e, rate=rate, held=[name for name in model.input_names if name in e.channels])
            self._regressions.append((RecursiveRegression(plan), [self._channels.index(n) for n in e.channels]))
            known += [KnownNow(name, coefficient_unit(e, name, {}), None) for name in e.names]
        if names:
            plan_of = slow_plan(model, names, sensors=sensors, rate=rate, spread=SPREAD, wander=WANDER, delays=lags)
            self._filter = SlowParameters(plan_of)
            self._read = [self._channels.index(name) for sensor in sensors for name in sensor.channels]
            card = model.card.parameters
            known += [KnownNow(name, card[name].unit, card[name].value) for name in names]
            inputs = np.append(plan_of.trim.inputs, plan_of.trim.environment.voltage)
            for _ in range(2):  # traced before the flight
                self._filter.step(self.dt, inputs, np.zeros(len(self._read)))
            self._filter = SlowParameters(plan_of)
        if not known:
            raise IdentificationError("names nothing.", channel="estimate", hint="Give parameters or equations.")
        self.known: tuple[KnownNow, ...] = tuple(known)

    def pause(self) -> None:
        """What comes is another flight, or none that the equations describe: estimates stay, signals begin anew."""
        self._paused = True

    def step(self, elapsed: float, states: Sequence[float] | Array, inputs: Array, voltage: float) -> None:
        """Take one sample in.

        Args:
            elapsed: seconds since the sample before.
            states: of the model, as they are now; the sensors make noise of their own.
            inputs: as commanded from now on. voltage: of the battery [V].
        """
        row = np.concatenate([states, inputs, [voltage]])
        row = row + self._sigma * self._random.standard_normal(row.size)
        elapsed, self._paused = float("nan") if self._paused else elapsed, False
        frozen = ""
        for regression, places in self._regressions:
            regression.step(elapsed, row[places])
            frozen = frozen or regression.frozen
        if self._filter is not None:
            self._filter.step(elapsed, np.append(inputs, voltage), row[self._read])
            frozen = frozen or self._filter.frozen
        self.frozen = frozen
        self._looked += self.dt
        if self._looked >= LOOK:
            self._looked = 0.0
            self.known = self._look()
        self._silent += self.dt
        if self._silent >= _TOLD and self._say is not None:
            self._silent = 0.0
            self._say(f"estimated: {'; '.join(map(str, self.known))}.")

    def _look(self) -> tuple[KnownNow, ...]:
        runs: list[RecursiveRegression | SlowParameters] = [regression for regression, _ in self._regressions]
        runs += [] if self._filter is None else [self._filter]
        rows: list[tuple[float | None, float | None]] = []
        for run in runs:
            estimate = run.estimate()
            names = run.plan.equation.names if isinstance(run, RecursiveRegression) else run.plan.unknown
            rows += (
                [(None, None)] * len(names)
                if estimate is None
                else list(zip(estimate.values.tolist(), estimate.sigmas.tolist(), strict=True))
            )
        return tuple(
            KnownNow(k.name, k.unit, k.model, value, sigma) for k, (value, sigma) in zip(self.known, rows, strict=True)
        )
