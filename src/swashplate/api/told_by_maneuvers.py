"""What maneuvers would tell when flown in the closed loop, and how large they may be within limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from swashplate.api.designed_maneuver import LEAD, Offer, sample_times
from swashplate.arrays import Array, Complex
from swashplate.errors import ManeuverError, SwashError
from swashplate.filtering.disturbances import Noise
from swashplate.flights.maneuvers.composed import ComposedMultisine, composed
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.identification.design.information import DELAY_SIGMA, Sensed, bounds_from, line_information
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_maneuver
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim

_PROBE = 0.2
"""Share of the largest deflection at which the closed loop is probed: where it is still linear."""
_TRIES = 6
_SMALLEST = 0.02


@dataclass(frozen=True)
class DesignDraws:
    """The draws of the prior, and what lines of a maneuver tell in each."""

    models: Sequence[Vehicle]
    sensed: Sequence[Sensed]
    unknown: tuple[str, ...]
    noise: Noise
    rate: float
    controller: Callable[[Vehicle, Trim], Controller]
    values: Array

    @property
    def scale(self) -> Array:
        """What makes information relative to the unknowns' values (p + 1, p + 1)."""
        return np.outer(*[np.append(self.values, DELAY_SIGMA)] * 2)

    def bounds(self, information: Sequence[Array]) -> dict[str, float]:
        """Standard deviations of the unknowns, the worst of the draws."""
        worst = np.max([bounds_from(one) for one in information], axis=0)
        return dict(zip(self.unknown, map(float, worst), strict=True))

    def lines(self, draw: int, frequency: Array, inputs: Complex) -> Array:
        return line_information(self.sensed[draw], frequency, inputs, self.noise, rate=self.rate)

    def fly(self, draw: int, maneuver: Maneuver) -> tuple[Array, Array, Array]:
        """Time from the maneuver's start, states and inputs; a flight that is lost is none."""
        vehicle = self.models[draw]
        flown = simulate_maneuver(vehicle, maneuver, controller=self.controller, lead=LEAD, tail=LEAD, rate=self.rate)
        time = flown.time(vehicle.state_names[0]) - LEAD
        return time, flown.array(vehicle.state_names), flown.array(vehicle.input_names)

    def probe(
        self, axes: Sequence[str], lines: Sequence[NDArray[np.int64]], seconds: float, peak: Mapping[str, float]
    ) -> list[Complex]:
        """What every input does in the closed loop at each line per unit of its axis' own, (lines, m), of each draw.

        Two periods are flown and the second is taken: what begins the first has died away.
        """
        small = {axis: _PROBE * peak[axis] for axis in axes}
        twice = {a: {2 * int(n): 1.0 for n in own} for a, own in zip(axes, lines, strict=True)}
        maneuver = composed(twice, duration=2.0 * seconds, peak=small)
        responses: list[Complex] = []
        for draw in range(len(self.models)):
            time, _, inputs = self.fly(draw, maneuver)
            inside = (time >= seconds - 1e-9) & (time < 2.0 * seconds - 0.5 / self.rate)
            rows = []
            for axis, own in zip(axes, lines, strict=True):
                asked = maneuver.signals(time[inside])[axis]
                turning = np.exp(-2j * np.pi * np.multiply.outer(own / seconds, time[inside]))
                rows.append((turning @ inputs[inside]) / (turning @ asked)[:, None])
            responses.append(np.asarray(np.concatenate(rows), dtype=np.complex128))
        return responses

    def information(
        self, draw: int, pieces: Sequence[Maneuver], table: Mapping[str, tuple[Array, list[Complex]]]
    ) -> Array:
        """Information (p + 1, p + 1) of maneuvers that are flown one after the other."""
        total = np.zeros((len(self.unknown) + 1,) * 2)
        for piece in pieces:
            time = sample_times(piece, self.rate)
            length = time.size / self.rate
            for axis, signal in piece.signals(time).items():
                amplitude = 2.0 * np.abs(np.fft.rfft(signal)) / time.size
                frequency = np.fft.rfftfreq(time.size, 1.0 / self.rate)
                known, responses = table[axis]
                # Beyond the probed band nothing is counted.
                seen = (frequency >= known[0] - 1e-9) & (frequency <= known[-1] + 1e-9) & (amplitude > 1e-9)
                if not seen.any():
                    continue
                response = _between(frequency[seen], known, responses[draw])
                own = self.lines(draw, frequency[seen], response)
                total += length * np.einsum("f,fpq->pq", amplitude[seen] ** 2, own)
        return total


def _between(frequency: Array, known: Array, response: Complex) -> Complex:
    """Responses (f, m) at other frequencies, straight between the known ones."""
    columns = [np.interp(frequency, known, c.real) + 1j * np.interp(frequency, known, c.imag) for c in response.T]
    return np.stack(columns, axis=1)


def offer_of(
    kind: str,
    pieces: Sequence[Maneuver],
    told: DesignDraws,
    table: Mapping[str, tuple[Array, list[Complex]]],
    limits: Mapping[str, float],
) -> Offer:
    """A way to fly, made smaller until it keeps the limits in every draw."""
    fitted, peaks = [], dict.fromkeys(("attitude", "rate", "place"), 0.0)
    for piece in pieces:
        small, reached = _fitted(piece, told, limits)
        fitted.append(small)
        peaks = {name: max(peaks[name], reached[name]) for name in peaks}
    total = [told.information(draw, fitted, table) for draw in range(len(told.models))]
    return Offer(kind, tuple(fitted), sum(p.duration for p in fitted), told.bounds(total), peaks)


def _fitted(piece: Maneuver, told: DesignDraws, limits: Mapping[str, float]) -> tuple[Maneuver, dict[str, float]]:
    share, lost, first = 1.0, "", ""
    for _ in range(_TRIES):
        tried = _smaller(piece, share)
        try:
            every = [_peaks(told, draw, tried) for draw in range(len(told.models))]
        except SwashError as trouble:  # lost in flight
            share, lost = 0.4 * share, f" The last flight that was lost: {trouble.problem}"
            continue
        reached = {name: max(one[name] for one in every) for name in every[0]}
        first = max(reached, key=lambda name: reached[name] / limits[name])
        over = reached[first] / limits[first]
        if over <= 1.0:
            return tried, reached
        share *= 0.95 / over
        if share < _SMALLEST:
            break
    raise ManeuverError(
        f"not even {100.0 * share:.2g} % of the usual deflection keeps "
        f"{limits['attitude']:g} deg, {limits['rate']:g} deg/s and {limits['place']:g} m"
        f"{f' (its {first} is the first to go beyond)' if first else ''}.{lost}",
        hint="Widen the limits, or fly a controller that holds better.",
    )


def _smaller(piece: Maneuver, share: float) -> Maneuver:
    if isinstance(piece, ComposedMultisine):
        return piece.scaled(share)
    return replace(piece, amplitude=share * piece.amplitude)


def _peaks(told: DesignDraws, draw: int, piece: Maneuver) -> dict[str, float]:
    """Largest attitude from trim [deg], rate [deg/s] and distance from the start [m]."""
    vehicle = told.models[draw]
    time, states, _ = told.fly(draw, piece)
    start = states[np.searchsorted(time, -1e-9)]

    def away(*names: str) -> Array:
        return np.array([states[:, vehicle.index(name)] - start[vehicle.index(name)] for name in names])

    return {
        "attitude": float(np.degrees(np.max(np.abs(away("phi", "theta"))))),
        "rate": float(np.degrees(np.max(np.abs(away("p", "q", "r"))))),
        "place": float(np.max(np.linalg.norm(away("x", "y", "z"), axis=0))),
    }
