"""Identification of a recording in a process of its own: `swash identify`, or `swash respond` where that fails."""

from __future__ import annotations

import asyncio
import contextlib
import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from swashplate import progress_lines
from swashplate.models.vehicle import Vehicle
from swashplate.own_python import own_python
from swashplate.systems import step_back

How = Literal["model", "responses"]
Window = tuple[float, float]
HOWS: tuple[How, ...] = get_args(How)
REPORT = "report.html"
_LONGEST_WORD = 300
USUAL = 25
"""Iterations that such fits have taken (22 from a recording of 3-2-1-1s): what the time left is estimated with."""


@dataclass(frozen=True)
class Job:
    """How an identification is going.

    Attributes:
        recording: which one is identified.
        state: "running", "done" or "failed".
        outcome: what the command said, where it failed.
        seconds: since it began.
        doing: what the command is at.
        share: of the fit that is done, 0 to 1; None where that is not known.
        left: seconds that are left if it takes as many iterations as usual; None where that is not known.
    """

    recording: int
    state: str
    outcome: str = ""
    seconds: float = 0.0
    doing: str = ""
    share: float | None = None
    left: float | None = None


def commands(
    vehicle: Vehicle,
    flight: Path,
    *,
    card: Path,
    out: Path,
    how: How = "model",
    window: tuple[float, float] | None = None,
) -> tuple[list[str], ...]:
    """Command lines to try in this order until one leaves a report, as lists that no shell ever sees.

    The model is fitted as its traits say, in `window` [s] of the recording. Where a flight gives no model, its
    frequency responses are left, which can also be asked for at once. Of a model that says nothing they are all there
    is.
    """
    identify = ["identify", "--vehicle", str(card), "--out", str(out), "--quiet"]
    inputs = ",".join(name for name in vehicle.input_names if name != "throttle")
    channels = ["--inputs", inputs, "--outputs", "p,q,r,w"]
    respond = _swash("respond", str(flight), *channels, "--out", str(out), "--quiet")
    fitted = vehicle.traits.recording
    if how == "responses" or fitted is None:
        return (respond,)
    part = str(flight) if window is None else f"{flight}@{window[0]:g}-{window[1]:g}"
    return (_swash(*identify, "--flight", part, *fitted.options), respond)


def _swash(*arguments: str) -> list[str]:
    return own_python("swashplate.__main__", *arguments)


def busiest(inputs: NDArray[np.float64], *, period: float, seconds: float) -> Window | None:
    """The stretch [s] in which inputs, shape (n, n_inputs), move most, each by its own spread; None where all fits."""
    count = round(seconds / period)
    if len(inputs) <= count:
        return None
    moves = np.diff(inputs, axis=0)
    spread = np.std(moves, axis=0)
    effort = np.sum((moves / np.where(spread > 0.0, spread, np.inf)) ** 2, axis=1)
    total = np.concatenate([[0.0], np.cumsum(effort)])
    start = int(np.argmax(total[count - 1 :] - total[: len(total) - count + 1]))
    return round(start * period, 2), round(start * period + seconds, 2)


class Identifying:
    """One job at a time.

    Args:
        folder: where recordings lie and results go, in folders `identified-N`.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._job: Job | None = None
        self._begun = 0.0
        self._process: asyncio.subprocess.Process | None = None
        self._stopped = False

    @property
    def job(self) -> Job | None:
        """The job, with the seconds it has taken so far."""
        if self._job is not None and self._job.state == "running":
            return replace(self._job, seconds=time.monotonic() - self._begun)
        return self._job

    def out(self, recording: int) -> Path:
        """Where the results of a recording go."""
        return self._folder / f"identified-{recording}"

    async def run(self, vehicle: Vehicle, recording: int, how: How = "model", *, window: Window | None = None) -> None:
        """A model of a recording (a single rotor's of its `window`), or its responses; returns when it is over.

        Nothing happens while another one runs.
        """
        if self._job is not None and self._job.state == "running":
            return
        self._job, self._begun = Job(recording, "running"), time.monotonic()
        card = self._folder / f"card-{recording}.toml"
        flight, out = self._folder / f"recording-{recording}.nc", self.out(recording)
        self._stopped = False
        ways = commands(vehicle, flight, card=card, out=out, how=how, window=window)
        for tried in ways:
            code, outcome = await self._run(tried)
            finished = (out / REPORT).is_file()
            if finished or self._stopped:
                break
        if finished and tried is not ways[0]:
            outcome = "No model could be fitted to it; the report shows its frequency responses."
        elif finished and code not in (0, None):
            outcome = outcome or "The fit failed; the report says why."
        elif code == 0:
            outcome = ""
        self._job = Job(recording, "done" if finished else "failed", outcome, time.monotonic() - self._begun)

    async def _run(self, arguments: list[str]) -> tuple[int | None, str]:
        """Exit code of a command and the end of what it said."""
        self._process = await asyncio.create_subprocess_exec(
            *arguments,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            env={**os.environ, progress_lines.SWITCH: "lines"},
        )
        step_back(self._process.pid)  # the flight goes on meanwhile and comes first
        stream, said, begun = self._process.stderr, "", None
        assert stream is not None
        while heard := await stream.readline():
            text = heard.decode("utf-8", "replace").rstrip()
            line = progress_lines.parse(text)
            if line is None:
                said = f"{said} {text}"[-4 * _LONGEST_WORD :]
                continue
            now = time.monotonic()
            if begun is None and line.done:
                begun = (now, line.done)
            self._advance(line, begun, now)
        code = await self._process.wait()
        self._process = None
        return code, " ".join(said.split())[-_LONGEST_WORD:]

    def _advance(self, line: progress_lines.Told, begun: tuple[float, float] | None, now: float) -> None:
        """How far the command is; `begun` are the time and number of the first iteration that it told."""
        assert self._job is not None
        share = left = None
        if line.total and line.done:
            share = min(0.95, line.done / USUAL)
            if begun is not None and begun[1] < line.done < USUAL:
                left = (USUAL - line.done) * (now - begun[0]) / (line.done - begun[1])
        self._job = replace(self._job, doing=line.what, share=share, left=left)

    def stop(self) -> None:
        """End the job; its files appear only when it is complete, so nothing is left half-written."""
        self._stopped = True
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                self._process.terminate()
