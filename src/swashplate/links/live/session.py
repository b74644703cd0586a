"""One flight on the live page: the world, its clock, recordings and identifications, and what a page hears of it."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.errors import SwashError
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.links.live.axes import STICKS
from swashplate.links.live.clock import Clock
from swashplate.links.live.identifying import HOWS, How, Identifying, Job, busiest
from swashplate.links.live.picture import Pose, inputs_of, picture, pose_of
from swashplate.links.live.recording import LiveRecording, SavedRecording
from swashplate.links.live.world import FAN_SECONDS, World
from swashplate.links.notices import Say
from swashplate.models.catalogue import from_card
from swashplate.models.vehicle import Vehicle
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import Controller

if TYPE_CHECKING:
    from swashplate.links.estimating import Estimating

_BODY = len(RigidBody._fields)
_SWEEP_SECONDS, _SWEEP_BAND = 30.0, (0.3, 5.0)
_UNIT_SECONDS = 0.5
_LOOK_EVERY = 50
"""Steps of the controller between looks at what the equations hold for."""


class LiveSession:
    """What `swash live` runs.

    Args:
        vehicle: what flies.
        controller: a designed controller, or None.
        folder: where recordings and results go; made with the first one.
        estimate: parameters and equations that are estimated in flight (`Estimating`).
        model: what the pilot's law is made for and estimates begin with; the vehicle where None.
        draws: models that a fit cannot tell from it, which fly beside it (`World`).
        tell: told where recordings are, for whoever does not look at the page.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        *,
        controller: Controller | None,
        folder: Path,
        estimate: Sequence[str] = (),
        model: Vehicle | None = None,
        draws: Sequence[Vehicle] = (),
        tell: Say = lambda _: None,
    ) -> None:
        self._draws = tuple(draws)
        self.folder, self._controller = folder, controller
        self._estimate, self._model, self._tell = tuple(estimate), model, tell
        self.lock = threading.Lock()
        self.world, self._pose, self.estimating = self._make(vehicle)
        self.version = 1
        self.speed = 1.0
        self.clock = Clock(self._step, period=self.world.period, lock=self.lock)
        self.identifying = Identifying(folder)
        self.recording: LiveRecording | None = None
        self.recordings: list[SavedRecording] = []
        self.notice = ""
        self._jobs: set[asyncio.Task[None]] = set()
        self._wanted_to_run = True
        self._watched = -1, ""

    def _make(self, vehicle: Vehicle) -> tuple[World, Pose, Estimating | None]:
        draws = [_switched(one, vehicle) for one in self._draws]
        world = World(vehicle, controller=self._controller, believed=self._believed(vehicle), draws=draws)
        world.step()  # compiles, so that the first second of flight does not
        world.reset()
        return world, pose_of(vehicle), self._estimator(vehicle, world) if self._estimate else None

    def _estimator(self, vehicle: Vehicle, world: World) -> Estimating:
        from swashplate.links.estimating import Estimating

        late = dict(zip(vehicle.input_names, world.delays.tolist(), strict=True))
        return Estimating(self._believed(vehicle), self._estimate, rate=1.0 / world.period, delays=late)

    def _believed(self, vehicle: Vehicle) -> Vehicle:
        """The pilot's model of a vehicle, with the options that the page has switched since."""
        return vehicle if self._model is None else _switched(self._model, vehicle)

    def _step(self) -> None:
        world, estimating = self.world, self.estimating
        ticks = world.ticks
        world.step()
        if world.ticks == ticks:
            return
        row = world.latest
        if self.recording is not None:
            self.recording.add(row)
        if estimating is None:
            return
        if ticks == 0:
            estimating.pause()
        n, m = len(world.vehicle.state_names), len(world.vehicle.input_names)
        estimating.step(world.period, row[:n], row[n : n + m], float(row[-1]))

    # ---- life --------------------------------------------------------------------------------------------------
    def watched(self, count: int) -> None:
        """So many pages are open: time stands still while nobody looks."""
        self.clock.go(self._wanted_to_run and count > 0)
        going = self.recording
        if going is not None and not count:
            self._tell(
                f"No page is open: time stands still. Recording {going.number} waits with {going.seconds:.1f} s in "
                f"{going.path}; it is saved when this command ends."
            )

    def let_go(self) -> None:
        """Centre the sticks: whoever held them is gone."""
        with self.lock:
            self.world.setting.sticks = dict.fromkeys(STICKS, 0.0)

    def close(self) -> None:
        """End the thread and what runs beside it, and save what is being recorded."""
        self.clock.close()
        self.identifying.stop()
        going, self.recording = self.recording, None
        if going is not None:
            self._keep(going)

    def _keep(self, going: LiveRecording) -> None:
        """A recording that nobody stopped; what became of it is told."""
        try:
            words = f"Recording {going.number} is saved: {going.finish().path}."
        except SwashError as error:
            words = f"Recording {going.number}: {error}"
        except BaseException:  # a second interrupt while it is written
            self._tell(f"Recording {going.number} stays in {going.path}: the next `swash live` there saves it.")
            raise
        self._tell(words)

    # ---- what a page says --------------------------------------------------------------------------------------
    async def obey(self, message: dict[str, Any]) -> None:
        """Do what a checked message asks for.

        Raises:
            SwashError: in words for the pilot, where it cannot be done now.
        """
        kind = message["type"]
        if kind == "stick":
            with self.lock:
                setting = self.world.setting
                setting.sticks = {axis: float(message[axis]) for axis in STICKS}
                setting.stick_number = message["number"]
            return
        self.notice = ""
        if kind == "bar":
            await self._set_bar(message["value"])
        elif kind == "record":
            await self._record(message["value"])
        elif kind == "identify":
            self._identify(message["recording"], message["how"])
        elif kind == "stop_identifying":
            self.identifying.stop()
        elif kind == "learn":
            await self._learn()
        elif kind == "reset":
            await self._record(False)
            with self.lock:
                self.world.reset()
        elif kind == "pause":
            self._wanted_to_run = not message["value"]
            self.clock.go(self._wanted_to_run)
        elif kind == "step":
            self._wanted_to_run = False
            self.clock.go(False)
            with self.lock:
                self._step()
        elif kind == "speed":
            self.speed = float(message["value"])
            self.clock.period = self.world.period / self.speed
        else:
            with self.lock:
                self._switch(kind, message)

    def _switch(self, kind: str, message: dict[str, Any]) -> None:
        world, value = self.world, message.get("value")
        if kind == "mode":
            world.set_mode(message["value"])
        elif kind == "decoupled":
            world.setting.decoupled = bool(value)
        elif kind == "ghost":
            world.set_ghost(bool(value))
        elif not world.vehicle.traits.wind and kind in ("wind", "gusts"):
            raise SwashError("This model has no wind in its equations.")
        elif kind == "wind":
            world.setting.wind = tuple(float(message[name]) for name in ("north", "east", "down"))  # pyrefly: ignore[bad-assignment]
        elif kind == "gusts":
            world.set_gusts(float(message["value"]))
        elif kind == "voltage":
            if world.nominal_voltage is None:
                raise SwashError("This helicopter has no battery in its equations.")
            low, high = _voltages(world.nominal_voltage)
            world.setting.voltage = min(max(float(message["value"]), low), high)
        elif kind == "maneuver":
            world.fly_maneuver(self._maneuver(message["kind"], message["axis"], float(message["size"])))
        else:
            raise AssertionError(kind)

    def _maneuver(self, kind: str, axis: str, size: float) -> Maneuver:
        amplitude, moved = size * self.world.pilot.amplitude[axis], self.world.pilot.excited[axis]
        if kind == "sweep":
            return Maneuver("sweep", (moved,), _SWEEP_SECONDS, amplitude, _SWEEP_BAND)
        return Maneuver(kind, (moved,), _UNIT_SECONDS * {"doublet": 2, "3211": 7}[kind], amplitude)

    async def _learn(self) -> None:
        """Fly on by a law for the parameters as they are estimated now."""
        estimating = self.estimating
        known = () if estimating is None else estimating.known
        told = {k.name: k.value for k in known if k.model is not None and k.value is not None}
        if estimating is None or not told:
            raise SwashError("No parameter is estimated yet: start with --estimate, and fly.")
        law = await asyncio.to_thread(self.world.law_for, estimating.model.with_values(told))
        with self.lock:
            self.world.pilot = law
        self.notice = f"The law now takes {', '.join(f'{name} = {value:.4g}' for name, value in told.items())}."

    async def _set_bar(self, on: bool) -> None:
        if "bar" not in self.world.vehicle.traits.switches:
            raise SwashError("This model has no bar to put on or off.")
        card = self.world.vehicle.card
        if card.options.get("bar", _has_bar(self.world.vehicle)) == on:
            return
        await self._record(False)
        vehicle = from_card(replace(card, options={**card.options, "bar": on}))
        ran = self.clock.runs
        self.clock.go(False)  # compiling takes seconds in which no step would be on time
        try:
            world, pose, estimating = await asyncio.to_thread(self._make, vehicle)
            with self.lock:
                world.keep_setting(self.world)
                self.world, self._pose, self.estimating = world, pose, estimating
            self.version += 1
        finally:
            self.clock.go(ran)

    async def _record(self, on: bool) -> None:
        """Begin a recording, or save the one that is going."""
        if on:
            if self.recording is None:
                vehicle, period = self.world.vehicle, self.world.period
                begun = LiveRecording(vehicle, period=period, folder=self.folder)  # at once: another page may ask too
                self._tell(f"Recording {begun.number} grows in {begun.path}.")
                with self.lock:
                    self.recording = begun
            return
        with self.lock:
            going, self.recording = self.recording, None
        if going is None:
            return
        saved = await asyncio.to_thread(going.finish)
        if going.trouble:
            self.notice = f"{going.trouble} What it has is saved: {saved.path}."
        self.recordings.append(saved)

    def _identify(self, number: int, how: How) -> None:
        chosen = next((recording for recording in self.recordings if recording.number == number), None)
        if chosen is None:
            raise SwashError(f"There is no recording {number}.")
        fitted = chosen.vehicle.traits.recording
        longest = None if fitted is None else fitted.longest
        window = None if longest is None else busiest(chosen.inputs, period=chosen.period, seconds=longest)
        task = asyncio.create_task(self.identifying.run(chosen.vehicle, number, how, window=window))
        self._jobs.add(task)
        task.add_done_callback(self._jobs.discard)

    # ---- what a page hears -------------------------------------------------------------------------------------
    def hello(self) -> dict[str, Any]:
        """What does not change while one vehicle flies."""
        vehicle, world = self.world.vehicle, self.world
        return {
            "type": "hello",
            "version": self.version,
            "title": vehicle.card.title,
            "trust": vehicle.card.trust,
            "about": vehicle.traits.about,
            "wind": vehicle.traits.wind,
            "bar": "bar" in vehicle.traits.switches,
            "hows": ["responses"] if vehicle.traits.recording is None else list(HOWS),
            "controller": world.pilot.title,
            "picture": picture(vehicle),
            "inputs": inputs_of(vehicle),
            "modes": list(world.pilot.modes),
            "decoupling": world.pilot.decouples,
            "voltages": None if world.nominal_voltage is None else _voltages(world.nominal_voltage),
            "rate": 1.0 / world.period,
            "folder": str(self.folder),
            "estimates": [[k.name, k.unit] for k in self.estimating.known] if self.estimating else [],
            "fan": len(self._draws),
            "fan_seconds": FAN_SECONDS,
            "learns": any(k.model is not None for k in self.estimating.known) if self.estimating else False,
        }

    def _monitor(self) -> str:
        """What the pilot must know of the flight as it is, looked at every half second; "" for nothing."""
        with self.lock:
            if self._watched[0] != self.world.ticks // _LOOK_EVERY:
                words = self.world.doubts()
                self._watched = self.world.ticks // _LOOK_EVERY, " ".join(words)
        return self._watched[1]

    def moment(self) -> dict[str, Any]:
        """What is flown now, for one update of the page."""
        with self.lock:
            now, setting, left = self.world.moment(), self.world.setting, self.world.maneuver_left
            going = self.recording
            around, pose, vehicle = self.world.environment(), self._pose, self.world.vehicle
            estimating = self.estimating
            runs = self.clock.runs  # with the time that stands still, where it does
        crafts = {}
        for name, (x, u) in now.crafts.items():
            parts = pose(x.tolist(), u.tolist(), around)
            crafts[name] = {"x": _short(x[:_BODY]), "u": _short(u), **{k: _short(v) for k, v in parts.items()}}
        time, job = self.clock.punctuality, self.identifying.job
        failed = self.clock.failure
        return {
            "type": "moment",
            "version": self.version,
            "t": round(now.time, 4),
            **crafts,
            "fan": {"begun": now.fan_begun, "x": [None if x is None else _short(x[:_BODY]) for x in now.fan]}
            if now.fan
            else None,
            "target": _short(now.target),
            "stick": now.stick_number,
            "trouble": now.trouble or ("" if failed is None else f"The simulation stopped: {failed}"),
            "notice": self.notice or (going.trouble if going is not None else "") or self._monitor(),
            "runs": runs,
            "speed": self.speed,
            "steps": time.steps,
            "late": time.late,
            "skipped": round(time.skipped, 3),
            "busy": round(time.busy, 4),
            "maneuver": round(left, 1),
            "recording": None if going is None else round(going.seconds, 1),
            "recordings": [[r.number, round(r.seconds, 1)] for r in self.recordings],
            "job": None if job is None else _told(job),
            "frozen": "" if estimating is None else estimating.frozen,
            "estimates": [] if estimating is None else [[k.value, k.sigma, k.model] for k in estimating.known],
            "setting": {
                "mode": setting.mode,
                "decoupled": setting.decoupled,
                "ghost": setting.ghost,
                "bar": _has_bar(vehicle),
                "wind": list(setting.wind),
                "gusts": setting.gusts,
                "voltage": setting.voltage,
            },
        }


def _switched(model: Vehicle, vehicle: Vehicle) -> Vehicle:
    """A model with the options of a vehicle."""
    options = vehicle.card.options
    return model if model.card.options == options else from_card(replace(model.card, options=options))


def _told(job: Job) -> list[Any]:
    """A job as the page reads it."""
    left = None if job.left is None else round(job.left)
    share = None if job.share is None else round(job.share, 2)
    return [job.recording, job.state, job.words, round(job.seconds), job.doing, share, left]


def _has_bar(vehicle: Vehicle) -> bool:
    return "bar" in vehicle.traits.switches and "bar" in vehicle.roles


def _voltages(nominal: float) -> list[float]:
    """Lowest and highest battery voltage of the slider [V]."""
    return [round(0.8 * nominal, 1), round(1.08 * nominal, 1)]


def _short(values: Any) -> Any:
    """Numbers as short JSON, nested lists as they are; what is not finite as zero."""
    if values is None:
        return None
    if isinstance(values, float | int):
        return round(float(values), 5) if math.isfinite(values) else 0.0
    return [_short(value) for value in (values.tolist() if hasattr(values, "tolist") else values)]
