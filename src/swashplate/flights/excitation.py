"""Was an input moved from outside? What a log knows of it, and where it knows nothing, what the motion tells.

What relates an input to the motion is the aircraft only as far as something else than the motion moved the input: a
controller's answer shows minus the controller's inverse, however coherent (Ljung 1999, ch. 13). Asked in this order:

* Does the log tell of a sweep on the input's axis?
* Did a reference that is named move it: an excitation that was recorded, or a set-point?
* Does the log hold set-points? Then its commands are a controller's by construction, whatever the log's rate, and only
  sticks and set-points count that moved by themselves. A set-point that follows an outer loop is an answer itself.
* Otherwise the motion decides (`flights/feedback.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.channel_names import MOTION, SET_POINT, STICK, renamed_channels, slowest_of
from swashplate.flights.feedback import NOTHING, AnswerShares, share_of, told_by_motion
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import rising
from swashplate.flights.provenance import Event
from swashplate.flights.schema import POSITION, RATES, VELOCITY, axis_of

SWEEP, REFERENCE, STICKS, MANEUVER = "sweep", "reference", "sticks", "maneuver"
CONTROLLER, UNKNOWN = "controller", "unknown"
OUTSIDE = (SWEEP, REFERENCE, STICKS, MANEUVER)
"""Kinds of excitation that no loop makes."""
_BEST_FIRST = (SWEEP, REFERENCE, STICKS, MANEUVER, UNKNOWN, CONTROLLER)

FLY = "Fly a sweep, or move the sticks and name the set-point with --references."

_MOSTLY = 0.5
"""Share of a command that sticks or a set-point must explain: the rest of it answers gusts."""

_HEARD = 0.1
"""The same of a reference that is named: no loop biases the joint estimate, and its errors say how weak it is."""

_HELD = 0.5
"""Share of a rate's set-point from which an outer loop gives it. Simulated: at least 0.74 where one does and attitude
and speed are logged, at most 0.35 where sticks or a program move it (`docs/decisions/0155-premises-of-gains.md`)."""

_PURE = 0.8
"""Share of the local power that a program's sweep holds: 0.89 to 0.93 of sweeps of 0.5 to 8.5 Hz, while of 60 commands
that a loop makes in gusts none is a sweep at all."""

_MOVED = 0.02  # of a stick's travel
_TURNED = 0.01  # rad/s: a set-point below is no maneuver
_FUNCTION = {"collective": "throttle"}
_RECEIVED = {"roll": 1, "pitch": 2, "collective": 3, "yaw": 4}  # ArduPilot's channels, where RCMAP_* is not logged
_TRAVEL = {"s": 1e-3}  # of a receiver's pulses; other sticks go from -1 to 1
_OVERLAP = 1.0  # s of a sweep that a record must hold
_LOCAL = ("vx", "vy", "vz")
_AT_ONCE = ("m/s^2", "rad/s^2", "g")
_RATE_OF = {"roll": "p_demand", "pitch": "q_demand", "yaw": "r_demand"}
_AXES = {"lateral": "roll", "longitudinal": "pitch"} | {n: n for n in ("roll", "pitch", "yaw", "collective")}


@dataclass(frozen=True)
class Excitation:
    """What moved an input.

    Attributes:
        record: the record's name. input: channel.
        kind: "sweep", "reference", "sticks", "maneuver" (anything else that past motion does not explain),
            "controller" (an answer to the motion), "unknown".
        why: in words.
        shares: what the motion tells of it, where that was asked.
    """

    record: str
    input: str
    kind: str
    why: str
    shares: AnswerShares = NOTHING

    @property
    def outside(self) -> bool:
        """Whether something from outside moved it."""
        return self.kind in OUTSIDE


def excitations(
    flights: Flight | Iterable[Flight],
    inputs: Sequence[str],
    *,
    outputs: Sequence[str] = (),
    references: Sequence[str] = (),
    swept: Collection[str] = (),
) -> tuple[Excitation, ...]:
    """What moved each input of each record.

    Args:
        flights: at one rate. Sticks, set-points and motion beside the named channels are used where they are there.
        inputs: channels. outputs: motion that is looked at beside that of the schema.
        references: excitations or set-points that are said to have moved the inputs.
        swept: inputs in which a sweep was seen.
    """
    judged = []
    for flight in (flights,) if isinstance(flights, Flight) else flights:
        for piece in flight.split():
            record = _Record(piece, tuple(inputs), tuple(outputs), tuple(references))
            judged += [record.judged(name, swept=name in swept) for name in inputs]
    return tuple(judged)


def of_inputs(judged: Sequence[Excitation]) -> dict[str, Excitation]:
    """The best excitation of each input over all records: one sweep is enough."""
    best: dict[str, Excitation] = {}
    for one in sorted(judged, key=lambda one: _BEST_FIRST.index(one.kind)):
        best.setdefault(one.input, one)
    return best


@dataclass(frozen=True)
class _Record:
    """One unbroken piece of a flight, all signals at the stamps of its inputs."""

    flight: Flight
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    references: tuple[str, ...]

    @cached_property
    def time(self) -> Array:
        """Stamps [s], of the slowest logged input or output."""
        time = self.flight.time(self.inputs[0])
        dt = float(time[-1] - time[0]) / max(time.size - 1, 1)
        return time[:: max(1, round(1.0 / (slowest_of((self.flight,), (*self.inputs, *self.outputs))[1] * dt)))]

    @cached_property
    def name(self) -> str:
        return f"{self.flight.provenance.source or 'flight'} {self.time[0]:.2f}-{self.time[-1]:.2f} s"

    @property
    def dt(self) -> float:
        return float(self.time[-1] - self.time[0]) / max(self.time.size - 1, 1)

    def at(self, names: Iterable[str]) -> Array:
        """Channels side by side, shape (n, len(names))."""
        columns = [np.interp(self.time, self.flight.time(n), self.flight.values(n)) for n in names]
        return np.stack(columns, axis=1) if columns else np.zeros((self.time.size, 0))

    @cached_property
    def states(self) -> tuple[str, ...]:
        """The motion that the log knows: outputs, rates, attitude, velocity and place."""
        return self._others(lambda name: name in self.outputs or name in MOTION)

    @cached_property
    def motion(self) -> tuple[str, ...]:
        """The same, each quantity once: of velocities one kind, and places where there is none."""
        local = any(n in self.states for n in VELOCITY)
        moving = local or any(n in _LOCAL for n in self.states)
        spare = (*(_LOCAL if local else ()), *(POSITION if moving else ()))
        return tuple(n for n in self.states if n in self.outputs or n not in spare)

    @cached_property
    def shares(self) -> dict[str, AnswerShares]:
        """What the motion tells of each input; what the outputs tell, where the record is too short for more."""
        shares: tuple[AnswerShares, ...] = ()
        for names in (self.motion, self.outputs or tuple(n for n in self.motion if n in RATES)):
            forces = [str(self.flight[n].attrs.get("units", "")) in _AT_ONCE for n in names]
            shares = told_by_motion(self.at(self.inputs), self.at(names), self.dt, at_once=forces)
            if any(one.known for one in shares):
                break
        return dict(zip(self.inputs, shares, strict=True))

    def share(self, name: str, causes: Sequence[str]) -> float:
        """Share of an input that other channels explain."""
        return share_of(self.at([name])[:, 0], self.at(causes), self.dt)

    def pure(self, name: str) -> bool:
        """Whether an input is hardly more than one tone of rising frequency: no loop that answers gusts makes that."""
        ridge = rising(self.time, self.at([name])[:, 0])
        return ridge is not None and ridge.share >= _PURE

    @cached_property
    def sweeps(self) -> list[Event]:
        """The sweeps that the log tells of in this record."""
        return [
            event
            for event in self.flight.provenance.events
            if event.kind == "sweep"
            and min(float(event.details.get("seen", event.details.get("stop", event.time))), self.time[-1])
            - max(float(event.details.get("start", event.time)), self.time[0])
            > _OVERLAP
        ]

    def _others(self, known: Callable[[str], bool]) -> tuple[str, ...]:
        """Channels of a family that are no inputs, and whole."""
        there = (n for n in self.flight.channels if known(n) and n not in self.inputs)
        return tuple(n for n in there if np.isfinite(self.flight.values(n)).all())

    @cached_property
    def sticks(self) -> tuple[str, ...]:
        return self._others(lambda name: name.startswith(STICK))

    def moved_sticks(self, axis: str) -> tuple[str, ...]:
        """Sticks of an axis that moved; any stick where the axis of an input is not known."""
        received = self.flight.provenance.parameter(f"RCMAP_{_FUNCTION.get(axis, axis).upper()}")
        number = _RECEIVED.get(axis, 0) if received is None else int(received)
        known = (f"stick_{axis}", f"stick_{_FUNCTION.get(axis, axis)}", f"rcin_{number}")
        names = [n for n in self.sticks if n in known or not axis]
        size = np.ptp(self.at(names), axis=0)
        travel = np.array([_TRAVEL.get(str(self.flight[n].attrs.get("units", "")), 2.0) for n in names])
        return tuple(n for n, moves in zip(names, size > _MOVED * travel, strict=True) if moves)

    @cached_property
    def set_points(self) -> tuple[str, ...]:
        return self._others(lambda name: name.endswith(SET_POINT))

    def judged(self, name: str, *, swept: bool) -> Excitation:
        """What moved one input."""
        if not np.ptp(self.at([name])) > 0.0:
            return Excitation(self.name, name, UNKNOWN, "it never moves. Fly a sweep.")
        logged = renamed_channels((self.flight,), (name,)).get(name, name)
        axis = axis_of(logged)
        own_axis = [event.text for event in self.sweeps if axis and axis in _axes_in(event.text)]
        if own_axis:
            why = f"the log tells of a sweep: {own_axis[0]}."
            return Excitation(self.name, name, SWEEP, why)
        named = self._by_references(name, injected=not (axis and self.sweeps))
        if named is not None:
            return named
        if self.set_points and not logged.startswith(STICK):
            return self._by_set_points(name, axis, swept=swept)
        return self._by_motion(name, stick=logged.startswith(STICK), swept=swept)

    def held(self, set_point: str) -> bool:
        """Whether an outer loop gives a rate's set-point: attitude, speed and place of the instant explain it.

        They do not explain one that is moved: a rate that follows its set-point is no attitude.
        """
        rates = [n for n in self.states if str(self.flight[n].attrs.get("units", "")) == "rad/s"]
        turned = np.cumsum(self.at(rates) - self.at(rates).mean(axis=0), axis=0) * self.dt
        states = np.hstack([self.at([n for n in self.states if n not in rates]), turned])
        share = share_of(self.at([set_point])[:, 0], states, self.dt, past=False)
        return not share < _HELD

    def _by_references(self, name: str, *, injected: bool) -> Excitation | None:
        """Where a reference moved it; `injected`: whether one that is no set-point may have been on this axis."""
        for reference in self.references:
            is_set_point = reference.endswith(SET_POINT)
            if not np.ptp(self.at([reference])) > 0.0 or (self.held(reference) if is_set_point else not injected):
                continue
            share = self.share(name, [reference])
            if share >= _HEARD:
                return Excitation(self.name, name, REFERENCE, f"'{reference}' moved it, {100.0 * share:.0f} % of it.")
        return None

    def _by_set_points(self, name: str, axis: str, *, swept: bool) -> Excitation:
        """In a log with set-points: a controller's answer, unless sticks or a set-point moved by themselves."""
        stick = self.moved_sticks(axis)
        share = self.share(name, stick) if stick else 0.0
        if share >= _MOSTLY:
            why = f"sticks moved it: {', '.join(stick)} explain {100.0 * share:.0f} % of it."
            return Excitation(self.name, name, SWEEP if swept else STICKS, why)
        # While the sticks rest, an outer loop may hold a speed or a place that this log does not tell.
        sure = bool(stick) or not self.sticks or swept or any(n in (*VELOCITY, *_LOCAL, *POSITION) for n in self.states)
        for demand in [n for n in self.set_points if n == _RATE_OF.get(axis, n) and n in _RATE_OF.values()]:
            if np.std(self.at([demand])) > _TURNED and sure and not self.held(demand):
                followed = self.share(name, [demand])
                if followed >= _MOSTLY:
                    why = f"'{demand}' moved by itself, and explains {100.0 * followed:.0f} % of it."
                    return Excitation(self.name, name, SWEEP if swept else REFERENCE, why)
        if swept and self.pure(name):
            return Excitation(self.name, name, SWEEP, "a sweep is seen in it, and hardly anything else.")
        hands = f"; the sticks explain {100.0 * max(share, 0.0):.0f} % of it" if stick else ""
        why = (
            "a controller's answer: the log holds the set-points of its loop, and neither a sweep nor a stick nor a "
            f"set-point moved it from outside{hands}."
        )
        return Excitation(self.name, name, CONTROLLER, why)

    def _by_motion(self, name: str, *, stick: bool, swept: bool) -> Excitation:
        part = self.shares[name]
        share = f"the motion until then explains {100.0 * part.past:.1f} % of it"
        if part.answer and not (swept and self.pure(name)):
            text = f"a controller's answer: {share}, and the motion that follows tells it no better."
            return Excitation(self.name, name, CONTROLLER, text, part)
        if swept or stick:
            text = "a sweep is seen in it." if swept else "it is a pilot's stick."
            return Excitation(self.name, name, SWEEP if swept else STICKS, text, part)
        if part.independent:
            how = "the motion that follows tells it better" if part.follows else "something else moves it"
            return Excitation(self.name, name, MANEUVER, f"{share}, and {how}.", part)
        why = share if part.known else "the record is too short, or nothing moves"
        return Excitation(self.name, name, UNKNOWN, f"whether it answers the motion cannot be told: {why}. {FLY}", part)


def _axes_in(text: str) -> set[str]:
    """The axes that the head of a sweep's words names ("roll mixer, 0.5-20 Hz in 40 s")."""
    return {_AXES[word] for word in text.lower().partition(",")[0].split() if word in _AXES}
