"""What a sensor suite can see of a vehicle, and what it cannot, with the directions in words.

Two questions about the linear model of `sampled_observer_model`, each state in units of what is typical of it and each
reading in units of its noise. Which directions leave no trace at all: the test of Popov, Belevitch and Hautus at every
eigenvalue. How well is the rest known: the Gramian of some seconds without disturbance says by how much a reading
changes, so 1 / sqrt of its eigenvalue is to how much of the typical size a direction could be told; and the covariance
of the filter after these seconds, disturbances included, says what is really known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array
from swashplate.control.lqg.optimal import UnreachedDirection, plain, shares, unseen
from swashplate.control.lqg.weights import typical
from swashplate.engine.equations import equations_of, parameter_row
from swashplate.filtering import disturbances, observer
from swashplate.filtering.disturbances import DISTURBED, Unrest
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.filtering.riccati import gain_at
from swashplate.filtering.sampled_observer_model import SampledObserverModel, sampled_observer_model
from swashplate.filtering.sensor_suite import BIASED, Suite
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim

WORDS: Mapping[str, str] = {
    "x": "place to the north",
    "y": "place to the east",
    "z": "height",
    "u": "speed ahead",
    "v": "speed to the right",
    "w": "speed down",
    "phi": "roll angle",
    "theta": "pitch angle",
    "psi": "heading",
    "p": "roll rate",
    "q": "pitch rate",
    "r": "yaw rate",
    "alpha_lower": "lower rotor's tilt to the right",
    "beta_lower": "lower rotor's tilt aft",
    "eta_bar": "bar's roll angle",
    "zeta_bar": "bar's pitch angle",
    "omega_lower": "lower rotor's speed",
    "omega_upper": "upper rotor's speed",
    "a1": "rotor's tilt aft",
    "b1": "rotor's tilt to the right",
    "c": "bar's tilt aft",
    "d": "bar's tilt to the right",
    "r_gyro": "yaw gyro's filter",
    "bias ax": "accelerometer's offset ahead",
    "bias ay": "accelerometer's offset to the right",
    "bias az": "accelerometer's offset down",
    "bias p": "roll gyro's offset",
    "bias q": "pitch gyro's offset",
    "bias r": "yaw gyro's offset",
    "bias height": "pressure height's offset",
    **{
        f"disturbance {name}": f"{what} that the model does not know"
        for name, what in zip(
            DISTURBED,
            (
                "acceleration ahead",
                "acceleration to the right",
                "acceleration down",
                "roll acceleration",
                "pitch acceleration",
                "yaw acceleration",
            ),
            strict=True,
        )
    },
}


@dataclass(frozen=True)
class Known:
    """How well one state is known after the seconds of the study.

    Attributes:
        name: of the state.
        sigma: standard deviation [its unit].
        before: what was known without any reading.
    """

    name: str
    sigma: float
    before: float


@dataclass(frozen=True)
class Observability:
    """What a suite sees of a vehicle about a trim.

    Attributes:
        sensors: the suite.
        hidden: directions that leave no trace and do not fade: their error stays or grows.
        faint: directions that some readings depend on, but by less than their noise within the seconds.
        known: every state, disturbance and bias.
        seconds: of the study.
    """

    sensors: Suite
    hidden: tuple[UnreachedDirection, ...]
    faint: tuple[UnreachedDirection, ...]
    known: tuple[Known, ...]
    seconds: float

    def __repr__(self) -> str:
        lines = [f"Sensors: {', '.join(map(str, self.sensors))}", ""]
        if self.hidden:
            lines.append("Not seen at all, and it does not fade:")
            lines += [f"  {in_words(direction)}" for direction in self.hidden]
        else:
            lines.append("Nothing that lasts stays unseen.")
        if self.faint:
            lines.append(f"Told from the noise only after more than {self.seconds:g} s, if at all:")
            lines += [f"  {in_words(direction)}" for direction in self.faint]
        lines += ["", f"{'known after ' + format(self.seconds, 'g') + ' s':<22}{'+- 1 sigma':>12}{'unseen':>12}"]
        lines += [f"{known.name:<22}{known.sigma:>12.3g}{known.before:>12.3g}" for known in self.known]
        return "\n".join(lines)


def in_words(direction: UnreachedDirection) -> str:
    """A direction as a sentence: one state, or states that only show together."""
    named = [(WORDS.get(name, name), value) for name, value in direction.shares]
    if len(named) == 1:
        return named[0][0]
    (first, size), *rest = named
    others = ", ".join(
        f"{abs(value / size):.2g} of {what} {'with' if value * size > 0 else 'against'} it" for what, value in rest
    )
    return f"{first}, together with {others}"


def observability(
    vehicle: Vehicle,
    trim: Trim,
    sensors: Suite,
    *,
    rate: float = 100.0,
    seconds: float = 10.0,
    unrest: Unrest | None = None,
) -> Observability:
    """What a suite sees about a trim.

    Args:
        vehicle, trim: as in `linearize`.
        sensors: the suite; delays do not matter to this question and are left out.
        rate: samples per second of the model [Hz].
        seconds: how long is watched.
        unrest: what disturbs the vehicle.
    """
    prompt = tuple(replace(sensor, delay=0.0) for sensor in sensors)
    plan = ObserverPlan(equations_of(vehicle), prompt, rate, (0,) * len(vehicle.input_names)).checked()
    chosen = unrest or disturbances.unrest_of(vehicle.card)
    fade, process = observer.process_noise(plan, chosen)
    numbers = Numbers(parameter_row(vehicle, trim.environment), fade, process, observer.measurement_noise(plan))
    model = sampled_observer_model(plan, numbers, linearize(vehicle, trim))
    scale = np.array([_scale(name) for name in model.names])
    readings = model.H / np.sqrt(np.diag(model.noise))[:, None]
    hidden = unseen(model.F, readings, model.names, scale=scale)
    lasting = len(model.names)
    return Observability(
        sensors,
        hidden,
        _faint(model, readings, scale, hidden, samples=round(seconds * rate)),
        _known(model, scale, samples=round(seconds * rate), count=lasting),
        seconds,
    )


def _scale(name: str) -> float:
    if name.startswith("bias "):
        return BIASED[name.removeprefix("bias ")][0]
    if name.startswith("disturbance "):
        return 0.1 if name[-1] in "uvw" else 0.5
    return typical(name)


def _gramian(F: Array, H: Array, samples: int) -> Array:
    """Sum of F'^k H'H F^k for k below a power of two near `samples`."""
    W, power = H.T @ H, F
    for _ in range(max(1, round(np.log2(samples)))):
        W = W + power.T @ W @ power
        power = power @ power
    return np.asarray(0.5 * (W + W.T))


def _faint(
    model: SampledObserverModel, readings: Array, scale: Array, hidden: tuple[UnreachedDirection, ...], *, samples: int
) -> tuple[UnreachedDirection, ...]:
    """Directions of states and biases that change the readings by less than their noise, but for hidden ones."""
    kept = [i for i, name in enumerate(model.names) if not name.startswith("disturbance ")]
    F = (model.F * scale[None, :] / scale[:, None])[np.ix_(kept, kept)]
    W = _gramian(F, readings[:, kept] * scale[None, kept], samples)
    values, vectors = np.linalg.eigh(W)
    names = [model.names[i] for i in kept]
    gone = np.zeros((len(kept), 0))
    for direction in hidden:
        column = np.array([dict(direction.shares).get(name, 0.0) for name in names])
        if np.any(column):
            gone = np.column_stack([gone, column / np.linalg.norm(column)])
    basis = np.linalg.qr(gone)[0] if gone.size else gone
    weak = vectors[:, values < 1.0]
    left, sizes, _ = np.linalg.svd(weak - basis @ (basis.T @ weak), full_matrices=False)
    rest = left[:, sizes > 0.7]
    if not rest.size:
        return ()
    sizes = np.array([float(v @ W @ v) for v in plain(rest).T])
    return tuple(
        UnreachedDirection(1.0 + 0.0j, shares(vector, names), float(np.sqrt(max(size, 0.0))))
        for vector, size in zip(plain(rest).T, sizes, strict=True)
    )


def _known(model: SampledObserverModel, scale: Array, *, samples: int, count: int) -> tuple[Known, ...]:
    """Standard deviations after so many samples, and what they would be without a reading."""
    F = model.F * scale[None, :] / scale[:, None]
    H = model.H * scale[None, :] / np.sqrt(np.diag(model.noise))[:, None]
    Q = model.process / np.outer(scale, scale)
    P = blind = np.eye(count)
    for _ in range(samples):
        P, blind = F @ P @ F.T + Q, F @ blind @ F.T + Q
        P = P - gain_at(P, H, np.eye(len(H))) @ H @ P
        P = 0.5 * (P + P.T)
    sigma, before = (np.sqrt(np.maximum(np.diag(part), 0.0)) * scale for part in (P, blind))
    return tuple(Known(n, float(s), float(b)) for n, s, b in zip(model.names, sigma, before, strict=True))
