"""`review`: what an ordinary flight, without a sweep, tells of its rate loops, filters, noise and incidents.

It never gives a response of the vehicle: in a loop that nobody excites, command and motion are each other's cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep, sweeps
from swashplate.flights.review.filters import Filter, filters
from swashplate.flights.review.incidents import Incident, incidents
from swashplate.flights.review.next_sweep import NextSweep, next_sweeps
from swashplate.flights.review.noise import GyroNoise, gyro_noise
from swashplate.flights.review.step_response import FASTEST, StepResponse, StepResponseError, step_response
from swashplate.flights.review.stretches import AXES, Interval, LoopAxis, pieces
from swashplate.flights.review.tracking import Octave, tracking
from swashplate.shown import Shown

NO_LOOP = "the log has neither a rate's target nor an autopilot's parameters"
_ASKED = np.radians(0.5)
"""rad/s: the rms target of an octave from which on an error says something; below it nobody asks for anything."""
_SHORTEST = 4.1  # s: a window, and what is looked at before and behind it


@dataclass(frozen=True)
class LoopReview:
    """One rate loop.

    Attributes:
        axis: "roll", "pitch" or "yaw".
        step: its step response; None where it cannot be had, and `why` in words.
        octaves: how well it follows by frequency. coherent: up to where target and motion belong together [Hz].
    """

    axis: str
    step: StepResponse | None
    why: str
    octaves: tuple[Octave, ...]
    coherent: float

    def __str__(self) -> str:
        lines = [f"{self.axis}: {self.step if self.step is not None else f'no step response: {self.why}'}"]
        worst = [
            f"{o.low:g}-{o.high:g} Hz {100.0 * o.error / o.target:.0f} %"
            for o in self.octaves
            if o.high <= self.coherent and o.target >= _ASKED
        ]
        return "; ".join([*lines, *([f"tracking error {', '.join(worst)} of the target"] if worst else [])])


@dataclass(frozen=True)
class FlightReview(Shown):
    """What a flight without a sweep tells.

    Attributes:
        source: of the flight. vehicle: what it is, as far as the log says.
        loops: by axis that the log has a rate of.
        filters: that its parameters configure; untold: those whose frequency the log does not say.
        noise: spectra by axis; no_noise: why there are none.
        incidents: what happened, in order of time.
        next: sweeps to fly; about_next: what to set beside them, or why there are none.
    """

    source: str
    vehicle: str
    loops: tuple[LoopReview, ...]
    filters: tuple[Filter, ...]
    untold: tuple[str, ...]
    noise: tuple[GyroNoise, ...]
    no_noise: str
    incidents: tuple[Incident, ...]
    next: tuple[NextSweep, ...]
    about_next: str

    def lists(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Headings and lines, as they are printed."""
        yield "incidents", tuple(map(str, self.incidents))
        if self.loops:
            yield "rate loops (target to motion)", tuple(map(str, self.loops))
        if self.filters or self.untold:
            gyro = sum(each.delay for each in self.filters if each.place == "gyro")
            total = (f"all of the gyro together: {1e3 * gyro:.2f} ms",) if gyro else ()
            yield "filters and the delay that each costs", (*map(str, self.filters), *total, *self.untold)
        if self.loops:
            notches = tuple(f"{each.channel}: {each.notch}" for each in self.noise if each.notch is not None)
            yield "noise", (*map(str, self.noise), *notches, *([self.no_noise] if self.no_noise else []))
            yield "what to fly next", (*map(str, self.next), *([self.about_next] if self.about_next else []))

    @property
    def tells(self) -> bool:
        """Whether there is anything to tell: a rate with its target, or an incident."""
        return bool(self.incidents) or any(loop.octaves or loop.step is not None for loop in self.loops)

    @property
    def body_text(self) -> str:
        """All of it in lines, without a title."""
        parts = [
            "\n".join([f"{heading}:{'' if texts else ' none'}", *(f"  - {text}" for text in texts)])
            for heading, texts in self.lists()
        ]
        return "\n\n".join(parts)

    def __str__(self) -> str:
        return f"{self.source or '(unnamed)'}: {self.vehicle or 'an aircraft'}\n\n{self.body_text}"

    def to_document(self) -> dict[str, object]:
        """The same as plain JSON types; NaN becomes None."""
        return {key: _json_value(value) for key, value in asdict(self).items()} | {
            "filters": [{**dict(asdict(each)), "delay": each.delay} for each in self.filters]
        }


def _plain_dict(entries: dict[str, object]) -> dict[str, object]:
    return {key: _json_value(value) for key, value in entries.items()}


def _json_value(value: object) -> object:
    if isinstance(value, np.ndarray):
        return _json_value(value.tolist())
    if isinstance(value, dict):
        return _plain_dict(value)
    if isinstance(value, list | tuple):
        return [_json_value(each) for each in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def review(flight: Flight, *, swept: Sequence[Sweep] | None = None) -> FlightReview:
    """What an ordinary flight tells: step response, tracking, filters, noise, incidents, and what to fly next.

    Args:
        flight: as it was read, at its native rates.
        swept: its sweeps, where they are known already; looked for where None. What is flown in them counts nowhere.
    """
    apart = [(each.start, each.stop) for each in (sweeps(flight) if swept is None else swept)]
    loops = tuple(_loop(flight, axis, apart) for axis in AXES if axis.motion in flight)
    chosen, untold = filters(flight)
    noise, no_noise = gyro_noise(flight, chosen) if _of_an_autopilot(flight) else ((), NO_LOOP)
    wide = {each.axis: each.step.bandwidth for each in loops if each.step is not None}
    following, about = next_sweeps(
        flight, {axis: None if b is None else b.value for axis, b in wide.items()}, swept=apart
    )
    kind = aircraft_kind(flight)
    return FlightReview(
        flight.provenance.source,
        kind.noun if kind is not None else flight.provenance.vehicle,
        loops,
        chosen,
        untold,
        noise,
        no_noise,
        incidents(flight, swept=apart),
        following,
        about,
    )


def _of_an_autopilot(flight: Flight) -> bool:
    """Whether the log knows a loop: a target, or an autopilot's settings."""
    return bool(flight.provenance.parameters) or any(axis.target in flight for axis in AXES)


def _loop(flight: Flight, axis: LoopAxis, swept: list[Interval]) -> LoopReview:
    if axis.target not in flight:
        return LoopReview(axis.name, None, f"the log has no target of this rate ({axis.target})", (), 0.0)
    names = [axis.motion, axis.target, *([axis.reference] if axis.reference in flight else [])]
    order = [1, 0, *([2] if len(names) > 2 else [])]
    stretches = [
        type(each)(each.start, each.rate, each.values[:, order])
        for each in pieces(flight, names, swept=swept, fastest=FASTEST, shortest=_SHORTEST)
    ]
    octaves, coherent = tracking(stretches)
    try:
        step = step_response(stretches, usable=coherent, reference=names[2] if len(names) > 2 else "")
    except StepResponseError as reason:
        return LoopReview(axis.name, None, str(reason), octaves, coherent)
    return LoopReview(axis.name, step, "", octaves, coherent)
