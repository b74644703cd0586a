"""What turns sticks into inputs on the live page: five modes, decoupling on or off, for every vehicle.

Sticks are roll (right), pitch (stick ahead, nose down), yaw (nose right) and heave (up), each -1 to 1. In mode "raw"
all four move the vehicle's inputs about the hover trim. In all others heave and yaw move the height and heading that
are held. Roll and pitch move the cyclic in "held", ask for an attitude in "attitude" and for a speed in "velocity",
and move the place that is held in "position". Modes differ in numbers only, so that a switch in flight compiles
nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple, Protocol, get_args

import numpy as np
from scipy.linalg import expm

from swashplate.arrays import Array
from swashplate.control.kinds import kind_of
from swashplate.control.laws.autopilot import Autopilot, autopilot, row_step
from swashplate.control.laws.state_hold import state_hold, state_hold_step
from swashplate.engine.law import REFERENCES
from swashplate.engine.roots import require_casadi
from swashplate.engine.symbols import SymbolArrays, expressions, symbols
from swashplate.errors import ControllerError
from swashplate.flights.maneuvers.series import DEFAULT_AMPLITUDE
from swashplate.links.live.axes import STICKS, axes_of
from swashplate.links.live.picture import picture
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import flown_delays
from swashplate.simulation.controller import Controller, Step
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.trim import Trim

Mode = Literal["raw", "held", "attitude", "velocity", "position"]
MODES: tuple[Mode, ...] = get_args(Mode)
WANTED = (*REFERENCES, "yaw", "heave")
"""The reference row here: that of every controller, then the sticks of raw yaw and heave."""
LEAN = np.radians(12.0)
"""Roll or pitch that a full stick asks for in the mode "attitude" [rad]."""


class DecisionGraph(NamedTuple):
    """A decision of the page's pilot as a graph.

    Attributes:
        function: of CasADi, of (memory, readings, wanted, gains) to memory and commands in one column; `readings` has
            what the law's own sensors draw at its end.
        memory: how many numbers it carries. draws: how many its sensors draw.
    """

    function: Any
    memory: int
    draws: int


class Decide(Protocol):
    """What a pilot decides, by numbers and as a graph."""

    def __call__(self, memory: Array, readings: Array, wanted: Array, gains: Array) -> tuple[Array, Array]: ...

    def graph(self, readings: int, memory: int, gains: int) -> DecisionGraph:
        """The same as a graph, for rows of so many numbers."""


@dataclass(frozen=True)
class SteppedDecision:
    """A controller's step, as `Pilot.decide`: without the specific force.

    Attributes:
        step: see `simulation.controller.Step`.
    """

    step: Step

    def __call__(self, memory: Array, readings: Array, wanted: Array, gains: Array) -> tuple[Array, Array]:
        measured = np.concatenate([readings[:-4], readings[-1:]])
        after, commands = self.step(memory, measured, wanted, gains, np)
        return np.asarray(after), np.asarray(commands)

    def graph(self, readings: int, memory: int, gains: int) -> DecisionGraph:
        casadi = require_casadi()
        carried, heard, asked, row = (
            casadi.SX.sym(name, size)
            for name, size in (("memory", memory), ("told", readings), ("wanted", len(WANTED)), ("gains", gains))
        )
        measured = np.concatenate([symbols(heard)[:-4], symbols(heard)[-1:]])
        after, commands = self.step(symbols(carried), measured, symbols(asked), symbols(row), SymbolArrays())
        results = casadi.densify(casadi.vertcat(expressions(after), expressions(commands)))
        return DecisionGraph(
            casadi.Function("decide", [carried, heard, asked, row], [results], {"cse": True}), memory, 0
        )


@dataclass(frozen=True)
class Pilot:
    """A control law for the live loop.

    Attributes:
        decide: `(memory, readings, wanted, gains) -> (memory, inputs)`; `readings` is the state row, the specific force
            and the voltage, `wanted` the row of `WANTED`.
        memory: at the start.
        gains: rows by mode and decoupling.
        amplitude: of maneuvers by axis [unit of the inputs].
        excited: what a maneuver of an axis moves, as `Maneuver` names it: the axis, or an input.
        speed, climb, turn: what a full stick asks for where something is held [m/s], [m/s], [rad/s].
        rate: of the controller [Hz].
        title: what it is, in words.
        delays: from command to actuator, by input [s], of a designed controller; None for the vehicle's own.
        feels: whether it wants the specific force.
        reads: whether it reads the model's identified sensors; a controller with sensors of its own does not.
    """

    decide: Decide
    memory: Array
    gains: Mapping[tuple[Mode, bool], Array]
    amplitude: Mapping[str, float]
    excited: Mapping[str, str]
    speed: float
    climb: float
    turn: float
    rate: float = 100.0
    title: str = ""
    delays: Array | None = None
    feels: bool = False
    reads: bool = True

    @property
    def gain_count(self) -> int:
        """Numbers in a row of gains."""
        return next(iter(self.gains.values())).size

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Those that it flies."""
        return tuple(mode for mode in MODES if (mode, True) in self.gains)

    @property
    def decouples(self) -> bool:
        """Whether it flies otherwise with the decoupling on than off."""
        return any(not np.array_equal(self.gains[mode, True], self.gains[mode, False]) for mode in self.modes)


def pilot(vehicle: Vehicle, trim: Trim, *, controller: Controller | None = None) -> Pilot:
    """The law for a vehicle, from its own equations and hover.

    Args:
        vehicle: coaxial, single rotor or linear.
        trim: its hover.
        controller: a designed controller instead of the default one. An autopilot flies in all modes; another one
            in "position", where sticks move the place or the speed that it is asked for.

    Raises:
        ControllerError: where the controller is for another vehicle, or does not run at a whole part of 500 Hz.
    """
    if controller is not None:
        kind = kind_of(controller)
        trimmed = kind.about(controller, vehicle, trim)
        return (_coaxial if kind.every_mode else _designed)(vehicle, trim, trimmed)
    return _coaxial(vehicle, trim, None) if vehicle.traits.coaxial else _state_feedback(vehicle, trim)


# ---- coaxial ---------------------------------------------------------------------------------------------------------
_COAX_TRAVEL = {"roll": 0.5, "pitch": 0.5, "yaw": 0.015, "heave": 0.06}
_COAX_HEAD = 3 + len(STICKS)


def _coaxial(vehicle: Vehicle, trim: Trim, controller: Autopilot | None) -> Pilot:
    base = controller or autopilot(vehicle, trim)
    coupled = autopilot(vehicle, trim, decoupled=False).numbers.law
    commands, gains = trim.commands(), {}
    names: dict[Mode, Any] = {
        "raw": "manual",
        "held": "manual",
        "attitude": "speed",
        "velocity": "speed",
        "position": "place",
    }
    for mode, name in names.items():
        for decoupled in (True, False):
            chosen = base.in_mode(name)
            if not decoupled:
                chosen = chosen.with_gains(**coupled._asdict())
            head = [commands["motor_lower"], commands["motor_upper"], float(mode == "raw")]
            travel = [_COAX_TRAVEL[axis] for axis in STICKS]
            if mode == "attitude":  # speed is free; the lean that is kept is where the stick balances its feedback
                chosen = chosen.with_gains(speed=0.0, speed_integral=0.0)
            gains[mode, decoupled] = np.array([*head, *travel, *chosen.gains])
    _check_rate(base.rate, base.model)
    return Pilot(
        SteppedDecision(coaxial_step),
        base.memory,
        gains,
        DEFAULT_AMPLITUDE,
        excited={axis: axis for axis in STICKS},
        speed=1.0,
        climb=0.5,
        turn=1.0,
        rate=base.rate,
        title=f"autopilot, {base.model}",
    )


def coaxial_step(memory: Any, measured: Any, wanted: Any, gains: Any, xp: Any) -> tuple[Any, Any]:
    """The CoaX's autopilot, with the motors on the sticks where the mode is raw."""
    lower, upper, raw = gains[0], gains[1], gains[2]
    roll, pitch, yaw, heave = (gains[3 + i] * wanted[6 + i] for i in range(len(STICKS)))
    reference = xp.concatenate([wanted[:6], xp.stack([roll, pitch])])
    after, commands = row_step(memory, measured, reference, gains[_COAX_HEAD:], xp)
    by_hand = xp.stack([lower + heave - yaw, upper + heave + yaw, commands[2], commands[3]])
    return xp.where(raw > 0.5, memory, after), xp.where(raw > 0.5, by_hand, commands)


def _check_rate(rate: float, where: str) -> None:
    if abs(500.0 / rate - round(500.0 / rate)) > 1e-9:
        raise ControllerError(f"runs at {rate:g} Hz, expected a whole part of 500 Hz.", where=where)


# ---- a designed controller -------------------------------------------------------------------------------------------
class ControllerPilot:
    """A controller's own law, which knows no raw yaw and heave, with what its sensors draw.

    Args:
        controller: whose. vehicle: that it flies.
    """

    def __init__(self, controller: Controller, vehicle: Vehicle) -> None:
        self.law = controller.law(vehicle)
        self._random = np.random.default_rng()

    def __call__(self, memory: Array, readings: Array, wanted: Array, gains: Array) -> tuple[Array, Array]:
        """As `Pilot.decide`."""
        everything = np.concatenate([readings, self._random.standard_normal(self.law.draws)])
        after = np.asarray(self.law.function(memory, everything[self.law.places], wanted[: len(REFERENCES)]))[:, 0]
        return after[: self.law.memory], after[self.law.memory :]

    def graph(self, readings: int, memory: int, gains: int) -> DecisionGraph:
        """As `Decide.graph`."""
        casadi, law = require_casadi(), self.law
        sizes = {"memory": memory, "told": readings + law.draws, "wanted": len(WANTED), "gains": gains}
        carried, heard, asked, row = (casadi.MX.sym(name, size) for name, size in sizes.items())
        results = law.function(carried, heard[law.places.tolist()], asked[: len(REFERENCES)])
        return DecisionGraph(casadi.Function("decide", [carried, heard, asked, row], [results]), memory, law.draws)


def _designed(vehicle: Vehicle, trim: Trim, controller: Controller) -> Pilot:
    """The aircraft is as late as the controller takes it to be, where its own card says nothing."""
    name = controller.type or type(controller).__name__
    _check_rate(controller.rate, name)
    axes = axes_of(vehicle, linearize(vehicle, trim))
    decide = ControllerPilot(controller, vehicle)
    return Pilot(
        decide,
        controller.memory_of_law(),
        {("position", on): np.zeros(0) for on in (True, False)},
        axes.amplitude,
        excited=axes.excited,
        speed=1.0,
        climb=0.5,
        turn=0.8,
        rate=controller.rate,
        title=f"{name}, as designed",
        delays=flown_delays(vehicle, controller),
        feels=decide.law.feels,
        reads=not decide.law.draws,
    )


# ---- any other -------------------------------------------------------------------------------------------------------
_HELD = ("z", "w", "psi", "r")


def _state_feedback(vehicle: Vehicle, trim: Trim) -> Pilot:
    model = linearize(vehicle, trim)
    axes = axes_of(vehicle, model)
    hold = state_hold(vehicle, trim, rate=100.0, along=axes.directions, spans=axes.spans)
    n, m = len(vehicle.state_names), len(vehicle.input_names)
    K = hold.gains[: m * n].reshape(m, n)
    rest = hold.gains[m * n :]
    keeping = np.zeros((m, n))
    rows = np.flatnonzero(np.any(axes.directions[:, [STICKS.index("yaw"), STICKS.index("heave")]], axis=1))
    columns = np.array([vehicle.index(name) for name in _HELD])
    keeping[np.ix_(rows, columns)] = K[np.ix_(rows, columns)]
    free = K.copy()  # of place and speed
    free[:, [vehicle.index(name) for name in ("x", "y", "u", "v")]] = 0.0
    leans = _leans(model, free)
    by_mode: dict[Mode, tuple[Array, float, tuple[float, float], float]] = {
        "raw": (np.zeros((m, n)), 0.0, (0.0, 0.0), 1.0),
        "held": (keeping, 0.0, (0.0, 0.0), 1.0),
        "attitude": (free, 0.0, leans, 0.0) if leans else (keeping, 0.0, (0.0, 0.0), 1.0),
        "velocity": (K, 0.0, (0.0, 0.0), 1.0),
        "position": (K, 1.0, (0.0, 0.0), 1.0),
    }
    gains = {
        (mode, on): np.array([place, *asked, *(by_hand * axes.mixing[on]).ravel(), *feedback.ravel(), *rest])
        for mode, (feedback, place, asked, by_hand) in by_mode.items()
        for on in (True, False)
    }
    return Pilot(
        SteppedDecision(partial(state_feedback_step, inputs=m, states=n)),
        np.zeros(1),
        gains,
        axes.amplitude,
        excited=axes.excited,
        speed=3.0 * max(1.0, float(picture(vehicle)["size"]) ** 0.5),
        climb=1.0,
        turn=0.8,
        title="linear-quadratic hold about hover",
    )


def _leans(model: LinearModel, feedback: Array) -> tuple[float, float] | None:
    """Roll and pitch to ask for, so that `LEAN` is reached a second later on the linear model.

    Speed is free, and its moments take a part of what is asked for. None where the hold without its feedback of speed
    hardly keeps an attitude: of an aircraft whose bar does (the coaxial structure), with the cyclic by hand.
    """
    n, kept = len(model.states), []
    for name in ("phi", "theta"):
        k = model.states.index(name)
        held = np.zeros((n + 1, n + 1))
        held[:n, :n], held[:n, n] = model.A - model.B @ feedback, model.B @ feedback[:, k]
        kept.append(float(expm(held * _SOON)[k, n]))
    return None if min(kept) < _LEAST_KEPT else (LEAN / min(1.0, kept[0]), LEAN / min(1.0, kept[1]))


_LEAST_KEPT = 0.4
_SOON = 1.0


def state_feedback_step(
    memory: Any, measured: Any, wanted: Any, gains: Any, xp: Any, *, inputs: int, states: int
) -> tuple[Any, Any]:
    """A state hold whose place follows the aircraft unless a place is held, with the sticks mixed on top."""
    place, mixing = gains[0], gains[3 : 3 + 4 * inputs].reshape(inputs, 4)
    x, y = xp.where(place > 0.5, wanted[0], measured[0]), xp.where(place > 0.5, wanted[1], measured[1])
    held = xp.concatenate([xp.stack([x, y]), wanted[2 : len(REFERENCES)]])
    # The hold works on deviations: what is asked for is taken from what is measured.
    asked = xp.stack([wanted[4], wanted[5], 0.0 * wanted[4], gains[1] * wanted[6], -gains[2] * wanted[7]])
    off = xp.concatenate([measured[:3], measured[3:8] - asked, measured[8:]])
    memory, commands = state_hold_step(memory, off, held, gains[3 + 4 * inputs :], xp, inputs=inputs, states=states)
    return memory, commands + mixing @ wanted[6:10]
