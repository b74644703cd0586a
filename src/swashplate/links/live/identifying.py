"""Identification of a recording in a process of its own: `swash identify`, or `swash respond` for single rotors."""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

from swashplate.vehicles.coax import CoaxInputs
from swashplate.vehicles.vehicle import Vehicle

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


def command(vehicle: Vehicle, flight: Path, *, card: Path, out: Path) -> list[str]:
    """The command line, as a list that no shell ever sees."""
    python = [sys.executable, "-m", "swashplate"]
    if vehicle.input_names == CoaxInputs._fields:
        return [*python, "identify", "--vehicle", str(card), "--flight", str(flight), "--out", str(out), "--quiet"]
    inputs = ",".join(name for name in vehicle.input_names if name != "throttle")
    return [*python, "respond", str(flight), "--inputs", inputs, "--outputs", "p,q,r,w", "--out", str(out), "--quiet"]


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

    @property
    def job(self) -> Job | None:
        """The job, with the seconds it has taken so far."""
        if self._job is not None and self._job.state == "running":
            return replace(self._job, seconds=time.monotonic() - self._begun)
        return self._job

    def out(self, recording: int) -> Path:
        """Where the results of a recording go."""
        return self._folder / f"identified-{recording}"

    async def run(self, vehicle: Vehicle, recording: int) -> None:
        """Identify a recording; returns when it is over. Nothing happens while another one runs."""
        if self._job is not None and self._job.state == "running":
            return
        self._job, self._begun = Job(recording, "running"), time.monotonic()
        card = self._folder / f"card-{recording}.toml"
        vehicle.save(card)
        flight, out = self._folder / f"recording-{recording}.nc", self.out(recording)
        self._process = await asyncio.create_subprocess_exec(
            *command(vehicle, flight, card=card, out=out),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
        )
        with contextlib.suppress(OSError):  # the flight goes on meanwhile and comes first
            os.setpriority(os.PRIO_PROCESS, self._process.pid, 10)
        _, said = await self._process.communicate()
        code, self._process = self._process.returncode, None
        words = " ".join(said.decode("utf-8", "replace").split())[-_LONGEST_WORD:]
        finished = (out / REPORT).is_file()
        state = "done" if finished else "failed"
        if code not in (0, None) and finished:
            words = words or "The fit failed; the report says why."
        self._job = Job(recording, state, "" if code == 0 else words, time.monotonic() - self._begun)

    def stop(self) -> None:
        """End the job; its files appear only when it is complete, so nothing is left half-written."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                self._process.terminate()
