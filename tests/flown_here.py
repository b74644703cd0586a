"""What the page flies, flown here from the package's own parts: the oracle of `page/flight.js` and of recordings.

`World` here is that of `links/live/world.py` with a step: the law by numbers, the loop of `engine/fly.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, equations_of, parameter_row
from swashplate.engine.fly import FlightPlan, fly
from swashplate.engine.trace import traced_force
from swashplate.errors import ControllerError, SwashError
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.links.live import world as begins
from swashplate.links.live.axes import STICKS
from swashplate.links.live.pilots import WANTED, Mode
from swashplate.links.live.sensors import BODY
from swashplate.links.live.world import FAN_SECONDS, OPENS, page_gusts
from swashplate.models.doubts import doubts
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.controller import Controller
from swashplate.simulation.record import check_divergence
from swashplate.simulation.wind import Gusts, filters_of_gusts

_LEAN = np.radians(60.0)
"""Roll or pitch at which the flight of a linear model ends: its angles are small ones."""


class Turbulence:
    """The same turbulence, one sample at a time, for a simulation whose end is not known.

    Args:
        gusts: the setting.
        rate: samples per second [Hz].
        seed: of the noise.
    """

    def __init__(self, gusts: Gusts, *, rate: float, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        self._filters = filters_of_gusts(gusts, rate)
        self._x = [part.start @ self._random.standard_normal(part.step.shape[0]) for part in self._filters]

    def sample(self) -> Array:
        """Wind towards north, east and down [m/s], shape (3,), and on to the next."""
        now = np.array([part.output @ x for part, x in zip(self._filters, self._x, strict=True)])
        self._x = [
            part.step @ x + part.noise @ self._random.standard_normal(x.size)
            for part, x in zip(self._filters, self._x, strict=True)
        ]
        return now


@dataclass
class Craft:
    """One flying copy: state row, inputs on their way, controller memory, the inputs it last got."""

    x: Array
    past: Array
    memory: Array
    inputs: Array

    def copied(self) -> Craft:
        """Another one, there where this one is."""
        return Craft(self.x.copy(), self.past.copy(), self.memory.copy(), self.inputs.copy())


@dataclass(frozen=True)
class Moment:
    """What is flown at one instant; never changed, so that another thread may read it.

    Attributes:
        time: of the simulation [s].
        crafts: state and input rows by name ("own", "ghost").
        around: wind and voltage, the row of `SURROUNDINGS`.
        target: the place, height and heading that are held (x, y, z, psi).
        stick_number: number of the last stick message that is in it.
        trouble: why it stands still, "" where it flies.
        fan: state rows of the drawn models, None of one that is lost. fan_begun: when they began where it was [s].
    """

    time: float
    crafts: dict[str, tuple[Array, Array]]
    around: Array
    target: Array
    stick_number: int
    trouble: str
    fan: tuple[Array | None, ...] = ()
    fan_begun: float = 0.0


@dataclass
class Setting:
    """What the page's switches and sliders say."""

    mode: Mode = OPENS
    decoupled: bool = True
    ghost: bool = False
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts: float = 0.0
    voltage: float = 0.0
    sticks: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STICKS, 0.0))
    stick_number: int = 0


class World(begins.World):
    """A flight of what the page flies.

    Args:
        vehicle, controller, believed, draws: as of the package's `World`.
        seed: of the gusts and of the sensors' noise.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        *,
        controller: Controller | None = None,
        believed: Vehicle | None = None,
        draws: Sequence[Vehicle] = (),
        seed: int = 0,
    ) -> None:
        super().__init__(vehicle, controller=controller, believed=believed, draws=draws)
        self._linear, self._rate, self._seed = vehicle.traits.linear, self.substeps / self.period, seed
        self.setting = Setting(mode=self.mode, voltage=float(self.environment.voltage))
        self.latest = np.empty(0)
        self._force = traced_force(equations_of(vehicle)) if self.pilot.feels else None
        self._p = parameter_row(vehicle, self.environment)
        self._drawn = [parameter_row(one, self.environment) for one in draws]
        self.normal: Callable[[], float] = np.random.default_rng(seed).standard_normal
        self._limits = np.array(vehicle.input_limits).T
        self._maneuver: tuple[Maneuver, int] | None = None
        self.reset()

    # ---- what the pilot does -----------------------------------------------------------------------------------
    def reset(self) -> None:
        """Back to the hover in still air; switches stay, what was being recorded is kept up to here."""
        self.ticks, self.trouble = 0, ""
        self.setting.wind, self.setting.gusts = (0.0, 0.0, 0.0), 0.0
        self._maneuver = None
        self._crafts = {"own": self._fresh()}
        if self.setting.ghost:
            self._crafts["ghost"] = self._fresh()
        self._turbulence: Turbulence | None = None
        self._take()
        self._begin_fan()

    def _take(self) -> None:
        """Hold the place and the heading that the sensors read now."""
        self._target = self.sensors[0].read(self._crafts["own"].x)[[0, 1, 2, 8]].copy()

    def _begin_fan(self) -> None:
        self._fan: list[Craft | None] = [self._crafts["own"].copied() for _ in self._drawn]
        self._fan_begun = self.ticks

    def _fresh(self) -> Craft:
        inputs = np.array(self.trim.inputs)
        past = np.tile(inputs, (self.depth, 1))
        return Craft(np.array(self.trim.state), past, np.array(self.pilot.memory), inputs)

    def set_mode(self, mode: Mode) -> None:
        """Another mode in flight: it begins where the aircraft is.

        Raises:
            ControllerError: a mode that the controller does not fly.
        """
        if mode not in self.pilot.modes:
            raise ControllerError(f"flies {', '.join(self.pilot.modes)} only, not {mode}.", where=self.pilot.title)
        if mode != self.setting.mode:
            self.setting.mode = mode
            for craft in self._crafts.values():
                craft.memory = np.array(self.pilot.memory)
            self._begin_fan()
            self._take()

    def set_ghost(self, on: bool) -> None:
        """A second copy with the decoupling the other way, from where the first one is now."""
        self.setting.ghost = on
        own = self._crafts["own"]
        self._crafts.pop("ghost", None)
        if on:
            self._crafts["ghost"] = own.copied()

    def set_gusts(self, sigma: float) -> None:
        """Turbulence of a standard deviation [m/s] across the wind; none at zero."""
        self.setting.gusts = sigma
        self._turbulence = None
        if sigma > 0.0:
            self._turbulence = Turbulence(page_gusts(sigma), rate=1.0 / self.period, seed=self._seed)

    def fly_maneuver(self, maneuver: Maneuver) -> None:
        """Add a maneuver to the inputs from now on.

        Raises:
            ManeuverError: where the vehicle lacks what it moves.
        """
        maneuver.offsets(np.zeros(1), inputs=self.vehicle.input_names, axes=self.vehicle.stick_axes)
        self._maneuver = (maneuver, self.ticks)

    @property
    def maneuver_left(self) -> float:
        """Seconds until the maneuver is over; zero where none is flown."""
        if self._maneuver is None:
            return 0.0
        maneuver, begun = self._maneuver
        return max(0.0, maneuver.duration - (self.ticks - begun) * self.period)

    # ---- time --------------------------------------------------------------------------------------------------
    def step(self) -> None:
        """One controller period further, for every copy; stands still where something went wrong."""
        if self.trouble:
            return
        wanted, around, added = self._wanted(), self._around(), self._added()
        before = self._crafts["own"].x
        if self._fan and (self.ticks - self._fan_begun) * self.period >= FAN_SECONDS:
            self._begin_fan()
        flying = [(craft, 0, self.setting.decoupled != (name == "ghost")) for name, craft in self._crafts.items()]
        flying += [(c, i, self.setting.decoupled) for i, c in enumerate(self._fan, start=1) if c is not None]
        for craft, which, decoupled in flying:
            self._advance(craft, which, self.pilot.gains[self.setting.mode, decoupled], wanted, around, added)
        self._fan = [None if c is None or self._lost(c.x) else c for c in self._fan]
        own = self._crafts["own"]
        self._check(own, before)
        if self.trouble:
            return
        self.latest = np.concatenate([before, own.inputs, around])
        ghost = self._crafts.get("ghost")
        if ghost is not None and self._lost(ghost.x):
            self.set_ghost(False)
        self.ticks += 1

    def _advance(self, craft: Craft, which: int, gains: Array, wanted: Array, around: Array, added: Array) -> None:
        """One controller step of a copy: sensors, law, then `_substeps` of physics with its inputs held.

        Args:
            which: 0 for the model itself, k for the k-th drawn one.
        """
        p, back, sensors = [self._p, *self._drawn][which], self.steps_back[which], self.sensors[which]
        columns = np.arange(craft.past.shape[1])
        acting = craft.past[len(craft.past) - 1 - back[-1], columns]
        read = sensors.read(craft.x).copy()
        read[:BODY] += np.array(sensors.sigma) * [self.normal() for _ in range(BODY)]
        told = np.concatenate([read, self._feel(craft.x, acting, around, p), around[-1:]])
        craft.memory, command = self.pilot.decide(craft.memory, told, wanted, gains)
        craft.inputs = np.clip(command + added, *self._limits)
        craft.past = np.concatenate([craft.past[1:], craft.inputs[None]])
        sent = craft.past[len(craft.past) - 1 - back, columns]
        rows = np.concatenate([sent, np.tile(around, (len(sent), 1))], axis=1)
        rows = np.concatenate([rows, rows[-1:]])
        plan = FlightPlan(craft.x[:, None], p[:, None], rows[:, :, None], 1.0 / self._rate, keep=self.substeps)
        craft.x = fly(self.vehicle, plan, quaternion=not self._linear)[0][-1, :, 0]

    def _feel(self, x: Array, inputs: Array, around: Array, p: Array) -> Array:
        """The specific force [m/s^2], where the law is told of it."""
        if self._force is None:
            return np.zeros(3)
        return np.asarray(self._force(x, np.concatenate([inputs, around]), p))[:, 0]

    def _lost(self, x: Array) -> bool:
        """Whether a ghost has flown to where it shows nothing any more."""
        if not np.all(np.isfinite(x)):
            return True
        return _leans_too_far(x) if self._linear else bool(x[2] >= 0.5 + self.start_height)

    def _check(self, own: Craft, before: Array) -> None:
        try:
            check_divergence(self.vehicle, np.zeros(1), own.x[None], None)
        except SwashError:
            self.trouble = "The simulation left the range in which the equations hold. Reset to fly again."
            own.x = before
            return
        if self._linear:
            if _leans_too_far(own.x):
                self.trouble = "Leans 60 deg, where a linear model tells nothing any more. Reset to fly again."
                own.x = before
            return
        grounded = bool(self.vehicle.card.options.get("ground"))
        if own.x[2] > 0.0 and not grounded:
            sink = (own.x[2] - before[2]) / self.period
            self.trouble = f"Touched the ground at {sink:.1f} m/s. Reset to fly again."
            own.x = before

    def _wanted(self) -> Array:
        """The reference row: sticks move what is held, or go through."""
        setting, law, s = self.setting, self.pilot, self.setting.sticks
        row = dict.fromkeys(WANTED, 0.0)
        if setting.mode == "raw":
            self._take()
            row.update(yaw=s["yaw"], heave=s["heave"])
        else:
            height = self._target[2] - self.period * law.climb * s["heave"]
            self._target[2] = height if self._linear else min(height, -0.2)
            self._target[3] += self.period * law.turn * s["yaw"]
        if setting.mode in ("raw", "held", "attitude"):
            row.update(roll=s["roll"], pitch=s["pitch"])
        else:
            ahead, right = law.speed * s["pitch"], law.speed * s["roll"]
            row.update(ahead=ahead, right=right)
            c, n = np.cos(self._target[3]), np.sin(self._target[3])
            self._target[:2] += self.period * np.array([c * ahead - n * right, n * ahead + c * right])
        row.update(x=self._target[0], y=self._target[1], z=self._target[2], psi=self._target[3])
        return np.array([row[name] for name in WANTED])

    def _around(self) -> Array:
        wind = np.array(self.setting.wind)
        if self._turbulence is not None:
            wind = wind + self._turbulence.sample()
        return np.array([*wind, self.setting.voltage])

    def _added(self) -> Array:
        none = np.zeros(len(self.vehicle.input_names))
        if self._maneuver is None:
            return none
        maneuver, begun = self._maneuver
        now = (self.ticks - begun) * self.period
        if now >= maneuver.duration:
            self._maneuver = None
            return none
        offsets = maneuver.offsets(np.array([now]), inputs=self.vehicle.input_names, axes=self.vehicle.stick_axes)
        return np.array([offsets[name][0] for name in self.vehicle.input_names])

    # ---- looking -----------------------------------------------------------------------------------------------
    def moment(self) -> Moment:
        """What is flown now."""
        crafts = {name: (craft.x, craft.inputs) for name, craft in self._crafts.items()}
        around = np.array([*self.setting.wind, self.setting.voltage])
        target, number = self._target.copy(), self.setting.stick_number
        fan = tuple(None if craft is None else craft.x for craft in self._fan)
        begun = self._fan_begun * self.period
        return Moment(self.ticks * self.period, crafts, around, target, number, self.trouble, fan, begun)

    def doubts(self) -> tuple[str, ...]:
        """What the flight is not that the pilot may take it for, now: a place that is not held, a speed or a state
        beyond what the vehicle holds for, in sentences."""
        own, remarks = self._crafts["own"], []
        off = float(np.hypot(*(own.x[:2] - self._target[:2])))
        if self.setting.mode == "position" and off > 3.0:
            ends = [
                name
                for name, value, (low, high) in zip(
                    self.vehicle.input_names, own.inputs, self.vehicle.input_limits, strict=True
                )
                if (value <= low or value >= high) and name not in dict(self.vehicle.trim_held)
            ]
            why = f": {', '.join(ends)} at the limit" if ends else ""
            if not ends and any(self.setting.wind):
                why = ": the controller leans no more than it may, which is too little against this wind"
            remarks.append(f"The place is not held, it is {off:.0f} m away{why}.")
        if np.all(np.isfinite(own.x)):
            said = doubts(self.vehicle, own.x, own.inputs, self._surroundings())
            remarks += [f"{words[:1].upper()}{words[1:]}." for words in said]
        return tuple(remarks)

    def _surroundings(self) -> Environment:
        row = [*self.setting.wind, self.setting.voltage]
        return self.environment._replace(**dict(zip(SURROUNDINGS, row, strict=True)))


def _leans_too_far(x: Array) -> bool:
    return bool(np.max(np.abs(x[6:8])) > _LEAN)
