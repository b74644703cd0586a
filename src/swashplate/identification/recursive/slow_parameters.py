"""Parameters of a vehicle that are estimated in flight: the observer of `swashplate.filtering`, with slow states.

The extended Kalman filter is the one that flies in controllers (`filtering.observer`): vehicle, gusts, the sensors'
biases, and here parameters that wander slowly (Jategaonkar 2015, ch. 7: state augmentation).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.engine.roots import require_casadi
from swashplate.errors import IdentificationError
from swashplate.filtering import observer
from swashplate.filtering.disturbances import Unrest, unrest_of
from swashplate.filtering.matrix_operations import Matrices
from swashplate.filtering.observer import Numbers, ObserverEstimate, ObserverPlan
from swashplate.filtering.sensor_suite import Suite
from swashplate.identification.recursive.fourier_regression import CLOCK, EARLY, GAP, LATE, NO_NUMBER
from swashplate.identification.time.equation_error import EquationError
from swashplate.models.surroundings import complete_delays, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim, trim


@dataclass(frozen=True)
class SlowPlan:
    """What a filter of slow parameters works with.

    Attributes:
        observer: the filter's plan, with the parameters in `slow`.
        numbers: its numbers.
        start: estimate before the first sample.
        trim: where states begin that no sensor reads.
    """

    observer: ObserverPlan
    numbers: Numbers
    start: ObserverEstimate
    trim: Trim

    @property
    def unknown(self) -> tuple[str, ...]:
        return self.observer.slow

    @property
    def places(self) -> slice:
        """Of the slow parameters among everything estimated."""
        return slice(self.observer.moves - len(self.unknown), self.observer.moves)

    @cached_property
    def graph(self) -> Any:
        """A CasADi function of (mean, covariance, driving, readings, due) to mean and covariance one sample later, and
        the innovations with their covariance."""
        casadi, plan, M = require_casadi(), self.observer, Matrices()
        N, inputs = len(plan.names), plan.inputs + 1
        sizes = {"mean": (N, 1), "covariance": (N, N), "driving": (inputs, 1), "readings": (len(plan.channels), 1)}
        mean, covariance, driving, y = (casadi.MX.sym(name, *size) for name, size in sizes.items())
        due = casadi.MX.sym("due", len(plan.sensors))
        flags, begun = M.scalars(due), ObserverEstimate(mean, covariance)
        before = observer.predicted(plan, self.numbers, begun, driving, flags, M)
        after, innovations, spread = observer.corrected(plan, self.numbers, before, y, flags, driving, M)
        given = [mean, covariance, driving, y, due]
        return casadi.Function("sample", given, [casadi.densify(part) for part in (*after, innovations, spread)])


def slow_plan(
    vehicle: Vehicle,
    unknown: Sequence[str],
    *,
    sensors: Suite,
    rate: float,
    spread: float = 0.2,
    wander: float = 0.02,
    delays: Mapping[str, float] | float | None = None,
    unrest: Unrest | None = None,
    voltage: float | None = None,
) -> SlowPlan:
    """A filter of slow parameters.

    Args:
        vehicle: its card gives where the parameters begin.
        unknown: parameters to estimate.
        sensors: what is read; delays of sensors are not for this filter.
        rate: samples per second [Hz]; every sensor is read at each.
        spread: standard deviation of each at the start, as a share of its value; of a number about zero, such as an
            angle, of what its fits take for a change that matters.
        wander: by how much of that each may wander in a second (standard deviation; grows with the root of time).
        delays: of the inputs [s]; the card's where None.
        unrest: what disturbs the vehicle; what the card's identification learnt where None.
        voltage: of the trim [V].

    Raises:
        IdentificationError: a parameter that the vehicle does not have, or that is zero; a sensor that is late.
        TrimError: where the vehicle has no hover.
    """
    values = dict(zip(vehicle.parameter_names, vehicle.values(), strict=True))
    size = _sizes(vehicle, unknown, values)
    if not unknown or len(set(unknown)) < len(unknown):
        raise IdentificationError(f"are {list(unknown)}, expected some, each once.", channel="unknown")
    if not (0.0 < spread < np.inf and 0.0 <= wander < np.inf):
        raise IdentificationError(f"are {spread:g} and {wander:g}, expected positive.", channel="spread, wander")
    if not sensors or any(s.delay or abs(s.rate - rate) > 1e-6 * rate for s in sensors):
        raise IdentificationError(f"are to be read at every sample ({rate:g} Hz) and at once.", channel="sensors")
    about = trim(vehicle, voltage=voltage)
    lags = complete_delays(vehicle, input_delays(vehicle) if delays is None else delays)
    plan = ObserverPlan(
        equations_of(vehicle), tuple(sensors), rate, tuple(round(d * rate) for d in lags.values()), slow=tuple(unknown)
    ).checked()
    chosen = unrest or unrest_of(vehicle.card)
    fade, process = observer.process_noise(plan, chosen)
    numbers = Numbers(parameter_row(vehicle, about.environment), fade, process, observer.measurement_noise(plan))
    mean, variance = np.zeros((len(plan.names), 1)), observer.start_variance(plan, chosen)
    mean[: plan.n, 0] = about.state
    slow = SlowPlan(plan, numbers, ObserverEstimate(mean, np.diag(variance)), about)
    mean[slow.places, 0] = [float(values[name]) for name in unknown]
    process[slow.places] = (wander * size) ** 2 * plan.dt
    variance[slow.places] = (spread * size) ** 2
    return SlowPlan(plan, numbers, ObserverEstimate(mean, np.diag(variance)), about)


def _sizes(vehicle: Vehicle, unknown: Sequence[str], values: Mapping[str, Any]) -> Array:
    """What a share of each parameter is a share of."""
    scale = {free.name: free.scale for choice in vehicle.choices.values() for free in choice.free}
    sizes = []
    for name in unknown:
        if name not in values:
            raise IdentificationError("is no parameter of it.", where=vehicle.name, channel=name)
        sizes.append(max(abs(float(values[name])), scale.get(name, 0.0)))
        if sizes[-1] == 0.0:
            raise IdentificationError("is zero: no share of it can be unknown.", where=vehicle.name, channel=name)
    return np.array(sizes)


@dataclass
class SlowParameters:
    """Slow parameters along a stream. Feed it with `step`; ask `estimate` at any time.

    A gap, a clock that jumped and an input that is no number freeze the parameters; the states then begin anew where
    the sensors say. A reading that is no number is left out.

    Attributes:
        plan: what it works with.
        frozen: why the last sample did not count; "" where it did, and for the first one of all.
        missing: readings that were left out.
        surprise: innovations of the last sample, squared, in units of what the filter expects, over their number.
    """

    plan: SlowPlan
    frozen: str = field(init=False, default="")
    missing: int = field(init=False, default=0)
    surprise: float = field(init=False, default=float("nan"))
    _estimate: ObserverEstimate = field(init=False)
    _given: list[Array] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        self._estimate = self.plan.start

    def step(self, elapsed: float, inputs: Sequence[float] | Array, readings: Sequence[float] | Array) -> bool:
        """Take one sample in.

        Args:
            elapsed: seconds since the sample before; anything for the first one.
            inputs: the vehicle's, as commanded from now on, and the battery's voltage.
            readings: of the plan's channels, now.

        Returns:
            Whether it counts.
        """
        plan = self.plan.observer
        w, y = np.asarray(inputs, dtype=np.float64), np.asarray(readings, dtype=np.float64)
        due = [float(np.all(np.isfinite(y[part]))) for _, part, _ in observer.pieces(plan)]
        self.missing += sum(1 for each in due if not each)
        if not np.all(np.isfinite(w)):
            self.frozen, self._given = NO_NUMBER, []
            return False
        if not self._given or not EARLY * plan.dt < elapsed < LATE * plan.dt:
            if self._given:
                self.frozen = GAP if elapsed >= LATE * plan.dt else CLOCK
            self._begin(w, y)
            return False
        self.frozen = ""
        acting = [self._given[-1 - delay][j] for j, delay in enumerate(plan.delays)]
        driving = np.array([*acting, self._given[-1][-1]])
        answer = self.plan.graph(*self._estimate, driving, np.nan_to_num(y), due)
        mean, covariance, innovations, spread = (np.asarray(part.full()) for part in answer)
        self._estimate = ObserverEstimate(mean, covariance)
        heard = sum(flag * len(sensor.channels) for flag, sensor in zip(due, plan.sensors, strict=True))
        self.surprise = float(np.vdot(innovations, np.linalg.solve(spread, innovations))) / max(heard, 1.0)
        self._given = [*self._given, w][-1 - max(plan.delays) :]
        return True

    def _begin(self, w: Array, y: Array) -> None:
        """States where the sensors say, and as unknown as at the start; the parameters as they are known."""
        plan, places = self.plan.observer, self.plan.places
        mean, covariance = (np.array(part) for part in self.plan.start)
        mean[places] = self._estimate.mean[places]
        covariance[places, places] = self._estimate.covariance[places, places]
        names = plan.equations.vehicle.state_names
        for channel, value in zip(plan.channels, y, strict=True):
            name = channel.partition(".")[2]
            if name in names and np.isfinite(value):
                mean[names.index(name), 0] = value
        self._estimate = ObserverEstimate(mean, covariance)
        self._given = [w] * (1 + max(plan.delays))

    def estimate(self) -> EquationError:
        """The parameters as they are known now; `noise` is the root of what the readings surprise by, 1 as promised."""
        places = self.plan.places
        covariance = self._estimate.covariance[places, places]
        return EquationError(
            self.plan.unknown,
            self._estimate.mean[places, 0].copy(),
            np.sqrt(np.diag(covariance)),
            float("nan"),
            float(np.sqrt(self.surprise)),
            covariance=covariance.copy(),
        )
