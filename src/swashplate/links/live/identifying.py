"""Identification of a recording in a process of its own: `swash identify`, or `swash respond` where that fails."""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

from swashplate.links.live.picture import is_coaxial
from swashplate.vehicles.linear import NAME as LINEAR
from swashplate.vehicles.vehicle import Vehicle

How = Literal["model", "responses"]
HOWS: tuple[How, ...] = get_args(How)
REPORT = "report.html"
_LONGEST_WORD = 300


@dataclass(frozen=True)
class Job:
    """How an identification is going.

    Attributes:
        recording: which one is identified.
        state: "running", "done" or "failed".
        words: what the command said, where it failed.
        seconds: since it began.
    """

    recording: int
    state: str
    words: str = ""
    seconds: float = 0.0


def commands(vehicle: Vehicle, flight: Path, *, card: Path, out: Path, how: How = "model") -> tuple[list[str], ...]:
    """Command lines to try in this order until one leaves a report, as lists that no shell ever sees.

    A single rotor frees what turns its answer to a stick; where a short flight gives no model, its frequency responses
    are left, which can also be asked for at once. Of a linear model they are all there is: it has no card to fit.
    """
    python = [sys.executable, "-m", "swashplate"]
    identify = [*python, "identify", "--vehicle", str(card), "--flight", str(flight), "--out", str(out), "--quiet"]
    inputs = ",".join(name for name in vehicle.input_names if name != "throttle")
    channels = ["--inputs", inputs, "--outputs", "p,q,r,w"]
    respond = [*python, "respond", str(flight), *channels, "--out", str(out), "--quiet"]
    if how == "responses" or vehicle.name == LINEAR:
        return (respond,)
    if is_coaxial(vehicle):
        return (identify,)
    return ([*identify, "--free", "rotor"], respond)


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

    async def run(self, vehicle: Vehicle, recording: int, how: How = "model") -> None:
        """A model of a recording, or its responses; returns when it is over. Nothing happens while another one runs."""
        if self._job is not None and self._job.state == "running":
            return
        self._job, self._begun = Job(recording, "running"), time.monotonic()
        card = self._folder / f"card-{recording}.toml"
        vehicle.save(card)
        flight, out = self._folder / f"recording-{recording}.nc", self.out(recording)
        self._stopped = False
        ways = commands(vehicle, flight, card=card, out=out, how=how)
        for tried in ways:
            code, words = await self._run(tried)
            finished = (out / REPORT).is_file()
            if finished or self._stopped:
                break
        if finished and tried is not ways[0]:
            words = "No model could be fitted to it; the report shows its frequency responses."
        elif finished and code not in (0, None):
            words = words or "The fit failed; the report says why."
        elif code == 0:
            words = ""
        self._job = Job(recording, "done" if finished else "failed", words, time.monotonic() - self._begun)

    async def _run(self, arguments: list[str]) -> tuple[int | None, str]:
        """Exit code of a command and the end of what it said."""
        self._process = await asyncio.create_subprocess_exec(
            *arguments,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
        )
        with contextlib.suppress(OSError):  # the flight goes on meanwhile and comes first
            os.setpriority(os.PRIO_PROCESS, self._process.pid, 10)
        _, said = await self._process.communicate()
        code, self._process = self._process.returncode, None
        return code, " ".join(said.decode("utf-8", "replace").split())[-_LONGEST_WORD:]

    def stop(self) -> None:
        """End the job; its files appear only when it is complete, so nothing is left half-written."""
        self._stopped = True
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                self._process.terminate()
