"""A conditioned flight as the arrays that estimators work on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.local_polynomials import local_polynomials
from swashplate.flights.flight import Flight, did_you_mean
from swashplate.flights.schema import ATTITUDE, POSITION, RATES
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.registry import listed

HORIZONS = (0.5, 1.0, 2.0, 5.0)
"""Seconds ahead at which predictions are judged."""
CALIBRATION = 5.0
"""Seconds at the start of a record that may be used; no prediction starts before they are over."""

SHORTEST_CALIBRATION = 1.0
"""Seconds: the filter has settled and a delay of a tenth of a second has left its trace."""


class Compared(Protocol):
    """One piece of data beside the model."""

    @property
    def name(self) -> str:
        """The record, or the response as "output / input"."""
        ...

    @property
    def residuals(self) -> Array:
        """Data less model: (n, n_outputs) of a record; dB and degrees (n, 2) of a response."""
        ...


@dataclass(frozen=True)
class Comparison:
    """Flight and model over one record used for the fit.

    Attributes:
        record: the record.
        counted: which samples the cost counted, shape (n,).
        model: model outputs, shape (n, n_outputs): one-step predictions (of a filter) or simulation.
        sigma: standard deviation of the model's output error, shape (n_outputs,).
        states: estimated body states (n, 12) in the order x y z u v w phi theta psi p q r; (n, 0) where the method
            does not tell.
    """

    kind: ClassVar[str] = "record"
    record: Record
    counted: Array
    model: Array
    sigma: Array
    states: Array

    @property
    def name(self) -> str:
        return self.record.name

    @property
    def residuals(self) -> Array:
        return np.asarray(self.record.outputs - self.model, dtype=np.float64)


POSE = (*POSITION, *ATTITUDE)
"""What motion capture measures."""


_TO_DO = "Condition the flight first (flight.condition(rate=100)), or map its columns to these names."


@dataclass(frozen=True)
class Record:
    """One unbroken piece of a flight on a uniform time grid.

    Attributes:
        name: the flight's source and the piece's interval.
        time: stamps [s], shape (n,).
        inputs: commands in the order of the vehicle's inputs, shape (n, n_inputs).
        outputs: measured channels in the order of `output_names`, shape (n, n_outputs).
        voltage: battery voltage [V], shape (n,).
        output_names: names of the measured channels.
        voltage_known: False where the flight has no such channel and the card's nominal voltage stands in.
        log: the flight it is a piece of; the pieces of one log share their delays, trims and lever arm.
        left_out: stamps (start, stop) [s] that a filter passes and no criterion counts.
        bridged: stamps (start, stop) [s] between which the pose was not seen: outputs there are lines.
    """

    name: str
    time: Array
    inputs: Array
    outputs: Array
    voltage: Array
    output_names: tuple[str, ...]
    voltage_known: bool
    log: str = ""
    left_out: tuple[tuple[float, float], ...] = ()
    bridged: tuple[tuple[float, float], ...] = ()

    @property
    def dt(self) -> float:
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    @property
    def counts(self) -> NDArray[np.bool_]:
        """Samples (n,) that are not left out."""
        counted = np.ones(self.time.size, dtype=bool)
        for first, last in self.left_out:
            counted &= (self.time < first) | (self.time > last)
        return counted

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Samples (n,) whose outputs are readings and no bridge over a gap."""
        measured = np.ones(self.time.size, dtype=bool)
        for first, last in self.bridged:
            measured &= (self.time <= first + _CLOCK) | (self.time >= last - _CLOCK)
        return measured


def seen_of(vehicle: Vehicle, flights: Sequence[Flight]) -> tuple[str, ...]:
    """What a vehicle's motion is told by: the tracked pose, and the gyroscope where its kind reads one and all logs
    have one (rates that were derived from the pose say nothing new)."""
    derived = {name for flight in flights for step in flight.history for name in step.details.get("derived", ())}
    read = vehicle.traits.gyroscope and not derived & set(RATES)
    return (*POSE, *RATES) if read and all(name in f for f in flights for name in RATES) else POSE


def records(
    flights: Flight | Iterable[Flight], vehicle: Vehicle, *, outputs: Sequence[str] | None = None
) -> list[Record]:
    """The unbroken pieces of one or more conditioned flights.

    Args:
        outputs: measured channels (None: `seen_of`).

    Raises:
        FlightError: where a flight lacks a channel, is not on a uniform grid or holds NaN, or where no input moves.
    """
    pieces: list[Record] = []
    given = [flights] if isinstance(flights, Flight) else list(flights)
    outputs = seen_of(vehicle, given) if outputs is None else outputs
    for flight in given:
        source = flight.provenance.source or "flight"
        again = sum(1 for name in logs(pieces)[0] if name.split(" #")[0] == source)
        log = f"{source} #{again + 1}" if again else source
        for piece in flight.split():
            pieces.append(_record(piece, vehicle, tuple(outputs), log=log))
    if not pieces:
        raise FlightError("there is no flight to work on.")
    steps = {round(piece.dt, 9) for piece in pieces}
    if len(steps) > 1:
        raise FlightError(
            f"the flights have different rates (steps of {sorted(steps)} s).",
            hint="Condition all of them to the same rate.",
        )
    if not any((np.ptp(piece.inputs, axis=0) > _STILL).any() for piece in pieces):
        raise FlightError(
            "no input ever moves, so nothing can be learnt about what they do.",
            where=pieces[0].name,
            channel=", ".join(vehicle.input_names),
            hint="Check that the commands were logged (swash inspect), or fly a sweep or a multisine.",
        )
    return pieces


def logs(pieces: Sequence[Record]) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    """Names of the logs, in order, and which of them each piece comes from."""
    names = tuple(dict.fromkeys(piece.log for piece in pieces))
    return names, np.array([names.index(piece.log) for piece in pieces], dtype=np.intp)


def uniform_table(flight: Flight, wanted: Sequence[str], *, who: str) -> tuple[Array, Array]:
    """Time (n,) and channels (n, len(wanted)) of an unbroken flight on a uniform grid.

    Args:
        flight: one unbroken piece.
        wanted: channels, in order.
        who: what needs them, for the message.

    Raises:
        FlightError: where a channel is missing, on another time base, not finite, or the grid is not uniform.
    """
    source = flight.provenance.source or "flight"
    missing = [name for name in wanted if name not in flight]
    if missing:
        raise FlightError(
            f"lacks what {who} needs.", where=source, channel=", ".join(missing), hint=_instead(flight, missing)
        )
    table = flight.array(wanted)
    time = flight.time(wanted[0])
    if time.size < 3:
        raise FlightError(f"has {time.size} samples, expected at least 3.", where=source)
    steps = np.diff(time)
    # A clock that began in 1970 is no finer than 0.24 us in float64: two steps of one length differ by four roundings.
    clock = 2.0 * float(np.spacing(abs(flight.epoch))) if flight.epoch else 0.0
    if np.ptp(steps) > 1e-6 * float(np.mean(steps)) + 1e-9 + clock:
        raise FlightError(
            f"time steps vary from {steps.min():.6f} to {steps.max():.6f} s.",
            where=source,
            hint="Bring the flight to a uniform rate with flight.condition(rate=100).",
        )
    for column, name in enumerate(wanted):
        if not np.all(np.isfinite(table[:, column])):
            raise FlightError("holds values that are not finite.", where=source, channel=name)
    return time, table


def _instead(flight: Flight, missing: Sequence[str]) -> str:
    """What to do about a flight that lacks channels."""
    axes = [name for name in flight.channels if name.startswith("mixer_")]
    if axes and any(name.startswith(("motor_", "servo_")) for name in missing):
        return (
            f"It has what an autopilot asked of its mixer ({', '.join(axes)}), not what each motor and servo got. Such "
            "a log gives a linear model: `swash respond LOG --out DIR`, then `swash identify --responses DIR`."
        )
    return f"{did_you_mean(missing[0], flight.channels) or _TO_DO} It has {listed(flight.channels)}."


def _record(flight: Flight, vehicle: Vehicle, outputs: tuple[str, ...], *, log: str) -> Record:
    wanted = (*vehicle.input_names, *outputs)
    time, table = uniform_table(flight, wanted, who=f"'{vehicle.name}'")
    source = flight.provenance.source or "flight"
    if "theta" in outputs and not vehicle.traits.linear:
        _refuse_steep(time, table[:, wanted.index("theta")], source)
    nominal = float(environment_of(vehicle).voltage)
    known = "voltage" in flight
    n_inputs = len(vehicle.input_names)
    return Record(
        name=f"{source} {time[0]:.2f}-{time[-1]:.2f} s",
        time=time,
        inputs=table[:, :n_inputs],
        outputs=table[:, n_inputs:],
        voltage=_slow(flight.values("voltage"), float(np.mean(np.diff(time))), vehicle.traits.voltage_seconds)
        if known
        else np.full(time.size, nominal),
        output_names=outputs,
        voltage_known=known,
        log=log,
        bridged=_bridged(flight),
    )


def _bridged(flight: Flight) -> tuple[tuple[float, float], ...]:
    """Where conditioning drew lines over gaps of the pose."""
    bridged = [step.details.get("bridged", ()) for step in flight.history if step.operation == "resample"]
    return tuple((float(first), float(last)) for holes in bridged for first, last in holes)


_CLOCK = 1e-6
"""Stamps closer than this are the same [s]."""


def _refuse_steep(time: Array, pitch: Array, source: str) -> None:
    steep = np.flatnonzero(np.abs(pitch) > _STEEP)
    if steep.size:
        most, first, last = np.degrees(np.abs(pitch).max()), time[steep[0]], time[steep[-1]]
        raise FlightError(
            f"pitches to {most:.0f} degrees ({first:.2f} to {last:.2f} s): a fit carries roll, pitch and yaw, "
            "which have no rates near the vertical.",
            where=source,
            channel="theta",
            hint="Give the stretches before and after: FILE@START-STOP.",
        )


_STEEP = np.radians(80.0)
_STILL = 1e-6
"""Change of a command that is no change: what interpolation leaves of a constant."""


def _slow(voltage: Array, dt: float, seconds: float) -> Array:
    """A logged voltage without its noise: straight lines over some seconds each way (Savitzky and Golay 1964)."""
    window = min(2 * round(seconds / dt) + 1, voltage.size - (voltage.size + 1) % 2)
    return local_polynomials(voltage, window, 1)
