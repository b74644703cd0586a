"""What the server of `swash live` does beside a page that flies: recordings, estimates, identifications, models."""

from __future__ import annotations

import asyncio
import base64
import math
import secrets
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.engine.equations import SURROUNDINGS
from swashplate.errors import SwashError
from swashplate.links.live.frame_code import frame_code, web_assembly
from swashplate.links.live.identifying import HOWS, How, Identifying, Job, busiest
from swashplate.links.live.messages import MessageError
from swashplate.links.live.recording import LiveRecording, SavedRecording
from swashplate.links.live.single_page import page_model
from swashplate.links.live.world import World
from swashplate.links.notices import Say
from swashplate.models.catalogue import from_card
from swashplate.models.doubts import doubts
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller

if TYPE_CHECKING:
    from swashplate.links.estimating import Estimating

_LOOK_EVERY = 50
"""Periods of the controller between looks at what the equations hold for."""
_FLOWN = 1e9
"""No state, input or surrounding of a flight is larger, in SI units."""
_JUMPED = "The flight began anew, and the recording ends with the one before. Save it."


class LiveSession:
    """What `swash live` runs. The page flies; of each period it tells states, inputs and surroundings.

    Args:
        vehicle: what flies.
        controller: a designed controller, or None.
        folder: where recordings and results go; made with the first one.
        estimate: parameters and equations that are estimated in flight (`Estimating`).
        model: what the pilot's law is made for and estimates begin with; the vehicle where None.
        draws: models that a fit cannot tell from it, which fly beside it (`World`).
        tell: told where recordings are, for whoever does not look at the page.

    Raises:
        MissingLibraryError: without what makes WebAssembly (extra `compiler`) or CasADi (extra `model`).
        SwashError: a model that cannot hover, a controller for another vehicle.
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
        self.version = secrets.randbelow(1 << 32)
        """Of what flies; another server's is another one."""
        self._goes_on = False
        self.world, self.code, self.estimating = self._make(vehicle)
        self.identifying = Identifying(folder)
        self.recording: LiveRecording | None = None
        self.recordings: list[SavedRecording] = []
        self.notice = ""
        self._jobs: set[asyncio.Task[None]] = set()
        self._tick, self._looked, self._doubts = 0, 0, ""

    def _make(self, vehicle: Vehicle) -> tuple[World, bytes, Estimating | None]:
        draws = [_switched(one, vehicle) for one in self._draws]
        world = World(vehicle, controller=self._controller, believed=self._believed(vehicle), draws=draws)
        code = web_assembly(frame_code(world))
        return world, code, self._estimator(vehicle, world) if self._estimate else None

    def _estimator(self, vehicle: Vehicle, world: World) -> Estimating:
        from swashplate.links.estimating import Estimating

        delays = dict(zip(vehicle.input_names, world.delays.tolist(), strict=True))
        return Estimating(self._believed(vehicle), self._estimate, rate=1.0 / world.period, delays=delays)

    def _believed(self, vehicle: Vehicle) -> Vehicle:
        """The pilot's model of a vehicle, with the options that the page has switched since."""
        return vehicle if self._model is None else _switched(self._model, vehicle)

    # ---- what a page has flown ---------------------------------------------------------------------------------
    def fly(self, data: bytes) -> None:
        """Take in what was flown: numbers of 8 bytes, each period's `version` and number, its states, inputs and
        surroundings. What another version flew is let go.

        Raises:
            MessageError: where they are not that.
        """
        vehicle, period = self.world.vehicle, self.world.period
        n, m = len(vehicle.state_names), len(vehicle.input_names)
        if len(data) % 8 or len(data) < 16:
            raise MessageError("bad rows")
        numbers = np.frombuffer(data, "<f8")
        if numbers[0] != self.version:
            return
        if numbers.size % (2 + n + m + len(SURROUNDINGS)) or not np.all(np.isfinite(numbers)):
            raise MessageError("bad rows")
        rows = numbers.reshape(-1, 2 + n + m + len(SURROUNDINGS))
        if np.any(np.abs(rows[:, 2:]) > _FLOWN):
            raise MessageError("bad rows")
        for version, tick, *rest in rows:
            row, jumped = np.array(rest), tick != self._tick + 1
            if version != self.version:
                raise MessageError("bad rows")
            going, self._tick = self.recording, int(tick)
            if going is not None:
                if jumped and going.seconds:
                    going.trouble = going.trouble or _JUMPED
                going.add(row)
            if self.estimating is not None:
                if jumped:
                    self.estimating.pause()
                self.estimating.step(period, row[:n], row[n : n + m], float(row[-1]))
        if abs(self._tick - self._looked) >= _LOOK_EVERY:
            self._looked = self._tick
            around = self.world.environment._replace(**dict(zip(SURROUNDINGS, row[n + m :].tolist(), strict=True)))
            said = doubts(vehicle, row[:n], row[n : n + m], around)
            self._doubts = " ".join(f"{text[:1].upper()}{text[1:]}." for text in said)

    # ---- life --------------------------------------------------------------------------------------------------
    def let_go(self) -> None:
        """The page that flew is gone: what it was recording is saved; what became of it is told."""
        going, self.recording = self.recording, None
        if going is None:
            return
        try:
            saved = going.finish()
            self.recordings.append(saved)
            text = f"Recording {going.number} is saved: {saved.path}."
        except SwashError as error:
            text = f"Recording {going.number}: {error}"
        except BaseException:  # a second interrupt while it is written
            self._tell(f"Recording {going.number} stays in {going.path}: the next `swash live` there saves it.")
            raise
        self._tell(text)

    def close(self) -> None:
        """End what runs beside it, and save what is being recorded."""
        self.identifying.stop()
        self.let_go()

    # ---- what a page says --------------------------------------------------------------------------------------
    async def obey(self, message: dict[str, Any]) -> None:
        """Do what a checked message asks for.

        Raises:
            SwashError: in words for the pilot, where it cannot be done now.
        """
        kind = message["type"]
        self.notice = ""
        if kind == "bar":
            await self._set_bar(message["value"])
        elif kind == "record":
            await self._record(message["value"])
        elif kind == "identify":
            self._identify(message["recording"], message["how"])
        elif kind == "stop_identifying":
            self.identifying.stop()
        else:
            await self._learn()

    async def _learn(self) -> None:
        """Fly on by a law for the parameters as they are estimated now."""
        estimating = self.estimating
        known = () if estimating is None else estimating.known
        values = {k.name: k.value for k in known if k.model is not None and k.value is not None}
        if estimating is None or not values:
            raise SwashError("No parameter is estimated yet: start with --estimate, and fly.")
        law = await asyncio.to_thread(self.world.law_for, estimating.model.with_values(values))
        self.world.pilot = law
        self.code = await asyncio.to_thread(lambda: web_assembly(frame_code(self.world)))
        self.version, self._goes_on = self.version + 1, True
        self.notice = f"The law now takes {', '.join(f'{name} = {value:.4g}' for name, value in values.items())}."

    async def _set_bar(self, on: bool) -> None:
        if "bar" not in self.world.vehicle.traits.switches:
            raise SwashError("This model has no bar to put on or off.")
        card = self.world.vehicle.card
        if card.options.get("bar", _has_bar(self.world.vehicle)) == on:
            return
        await self._record(False)
        vehicle = from_card(replace(card, options={**card.options, "bar": on}))
        self.world, self.code, self.estimating = await asyncio.to_thread(self._make, vehicle)
        self.version, self._goes_on = self.version + 1, False

    async def _record(self, on: bool) -> None:
        """Begin a recording, or save the one that is going."""
        if on:
            if self.recording is None:
                vehicle, period = self.world.vehicle, self.world.period
                self.recording = LiveRecording(vehicle, period=period, folder=self.folder)
                self._tell(f"Recording {self.recording.number} grows in {self.recording.path}.")
            return
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
        """What flies: numbers and code, for a page that opens or flies another version."""
        vehicle, known = self.world.vehicle, () if self.estimating is None else self.estimating.known
        model = page_model(
            self.world,
            name=vehicle.name,
            bar="bar" in vehicle.traits.switches,
            barred=_has_bar(vehicle),
            hows=["responses"] if vehicle.traits.recording is None else list(HOWS),
            folder=str(self.folder),
            estimates=[[k.name, k.unit] for k in known],
            learns=any(k.model is not None for k in known),
        )
        code = base64.b64encode(self.code).decode()
        return {"type": "model", "version": self.version, "goes_on": self._goes_on, "model": model, "code": code}

    def report(self) -> dict[str, Any]:
        """What the server knows of the flight, for one update of the page."""
        going, estimating, job = self.recording, self.estimating, self.identifying.job
        return {
            "type": "told",
            "notice": self.notice or (going.trouble if going is not None else ""),
            "doubts": self._doubts,
            "recording": None if going is None else round(going.seconds, 1),
            "recordings": [[r.number, round(r.seconds, 1)] for r in self.recordings],
            "job": None if job is None else _job_row(job),
            "frozen": "" if estimating is None else estimating.frozen,
            "estimates": [] if estimating is None else [_short([k.value, k.sigma, k.model]) for k in estimating.known],
        }


def _switched(model: Vehicle, vehicle: Vehicle) -> Vehicle:
    """A model with the options of a vehicle."""
    options = vehicle.card.options
    return model if model.card.options == options else from_card(replace(model.card, options=options))


def _job_row(job: Job) -> list[Any]:
    """A job as the page reads it."""
    left = None if job.left is None else round(job.left)
    share = None if job.share is None else round(job.share, 2)
    return [job.recording, job.state, job.outcome, round(job.seconds), job.doing, share, left]


def _has_bar(vehicle: Vehicle) -> bool:
    return "bar" in vehicle.traits.switches and "bar" in vehicle.roles


def _short(values: Sequence[float | None]) -> list[float | None]:
    """Numbers for JSON: what is not finite is not known."""
    return [value if value is None or math.isfinite(value) else None for value in values]
