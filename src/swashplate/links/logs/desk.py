"""The logs that lie on the page: opened, read anew with other options, aligned, and asked for what is drawn."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from swashplate.errors import SwashError
from swashplate.flights import example_logs
from swashplate.flights.flight import did_you_mean
from swashplate.links.logs import code_lines
from swashplate.links.logs.bins import trace
from swashplate.links.logs.cockpit import Cockpit
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.job import Identified, PageJob, Tell
from swashplate.links.logs.opened import READY, Opened
from swashplate.links.logs.remedies import Remedy
from swashplate.links.logs.sweep_channels import channels_of
from swashplate.links.logs.uploads import LARGEST, PIECE, Uploads

MOST_LOGS = 12
"""Logs on the page at a time."""
BINS = 4000
"""Most bins of a trace: no screen shows more."""


class Desk:
    """What `swash open` holds.

    Args:
        given: the logs of the command line: where each lies, and how it is read.
    """

    def __init__(self, given: Sequence[tuple[Path, Read]] = ()) -> None:
        self._lock = threading.Lock()
        self._logs: dict[int, Opened] = {}
        self.uploads = Uploads()
        self.job = PageJob()
        self.cockpit = Cockpit()
        for path, read in given:
            self._put(path, read)

    def close(self) -> None:
        """Stop what runs, and remove what was dropped and made."""
        self.cockpit.close()
        self.job.close()
        self.uploads.close()

    # ---- logs --------------------------------------------------------------------------------------------------
    def _put(self, path: Path, read: Read) -> Opened:
        with self._lock:
            if len(self._logs) >= MOST_LOGS:
                raise SwashError(
                    f"{MOST_LOGS} logs are open, and no more fit.", where=read.file, hint="Close one of them first."
                )
            number = max(self._logs, default=0) + 1
            self._logs[number] = opened = Opened(number, path, read)
        return opened

    def open(self, path: Path, name: str = "") -> Opened:
        """A file that was dropped, read under its name, or under that by which a command finds it.

        Raises:
            SwashError: where too many logs are open.
        """
        opened = self._put(path, Read(name or path.name))
        opened.load(opened.read)
        return opened

    def open_example(self, file: str) -> Opened:
        """A log that comes with the package.

        Raises:
            SwashError: where there is none of this name.
        """
        path = example_logs.example(file)
        if path is None:
            raise SwashError(f"there is no example '{file}'.", hint="Reload the page.")
        return self.open(path, f"{example_logs.NAME}/{path.name}")

    def read_given(self) -> None:
        """Read what the command line gave, one after the other."""
        for opened in list(self._logs.values()):
            if opened.version == 0:
                opened.load(opened.read)

    def log(self, number: int) -> Opened:
        """A log by its number.

        Raises:
            SwashError: where there is none.
        """
        with self._lock:
            opened = self._logs.get(number)
        if opened is None:
            raise SwashError(f"log {number} is not open.", hint="Open it again.")
        return opened

    def drop(self, number: int) -> None:
        """Take a log off the page."""
        with self._lock:
            self._logs.pop(number, None)

    def apply(self, number: int, remedy: Remedy) -> Opened:
        """A log read anew with more options.

        Raises:
            SwashError: where there is no such log.
        """
        opened = self.log(number)
        opened.load(opened.read.with_remedy(remedy))
        return opened

    def to_document(self) -> dict[str, object]:
        """Every log as the page lists it, and what may be dropped."""
        with self._lock:
            logs = list(self._logs.values())
        examples = [{"file": e.file, "title": e.title, "words": e.summary} for e in example_logs.EXAMPLES]
        listed = [log.to_document() for log in logs]
        return {"logs": listed, "largest": LARGEST, "piece": PIECE, "examples": examples}

    # ---- what is drawn -----------------------------------------------------------------------------------------
    def traces(self, wanted: Sequence[tuple[int, str, float, float]], *, bins: int) -> list[dict[str, Any]]:
        """Channels between two times of their log [s], thinned.

        Raises:
            SwashError: naming a log that is not open, or a channel that it lacks.
        """
        curves = []
        for number, name, start, stop in wanted:
            shown = self.log(number).shown(name)
            drawn = trace(
                shown.time, shown.numbers, start=start, stop=stop, bins=max(2, min(bins, BINS)), breaks=shown.breaks
            )
            curves.append(
                {
                    "log": number,
                    "channel": name,
                    "unit": shown.unit,
                    "time": drawn.time,
                    "values": drawn.values,
                    "thinned": drawn.thinned,
                }
            )
        return curves

    def plot_code(self, wanted: Sequence[tuple[int, str]], span: tuple[float, float] | None) -> dict[str, str]:
        """The lines that draw the same channels; fields that are no channels have no such lines."""
        wanted = [(number, name) for number, name in wanted if name in self.log(number).ready]
        numbers = list(dict.fromkeys(number for number, _ in wanted))
        channels = [[name for number, name in wanted if number == log] for log in numbers]
        return code_lines.plotted([self.log(number).read for number in numbers], channels, span).to_document()

    def align(self, first: int, second: int) -> dict[str, Any]:
        """How many seconds the second log's clock is put forward to show the same motion as the first's at one time.

        Raises:
            SwashError: where the two share no motion, or what they share does not match.
        """
        from swashplate.flights.conditioning.synchronise import synchronise  # SciPy's images take half a second

        one, other = self.log(first), self.log(second)
        shift = synchronise(one.ready, other.ready)
        middle = 0.5 * (other.ready.start + other.ready.stop)
        return {
            "offset": float(shift.offset + shift.drift * middle),
            "words": str(shift),
            "code": code_lines.aligned(one.read, other.read).to_document(),
        }

    # ---- identification ----------------------------------------------------------------------------------------
    def identify(self, number: int, sweep: int, input: str, output: str) -> dict[str, Any]:
        """Begin with the identification of a sweep, by its number in the log; channels by its axis where "" is given.

        Raises:
            SwashError: no such log or sweep, no channels for it, or another identification is running.
        """
        opened = self.log(number)
        flight, inspection = opened.ready, opened.inspection
        if inspection is None:
            raise SwashError("is still being checked.", where=opened.read.file, hint="Wait until its findings stand.")
        if not sweep < len(inspection.sweeps):
            raise SwashError(f"has no sweep {sweep + 1}.", where=opened.read.file)
        chosen = channels_of(flight, inspection.sweeps[sweep], input=input, output=output)
        with self._lock:
            others = [log for log in self._logs.values() if log is not opened and log.state == READY]

        def work(folder: Path, tell: Tell) -> Identified:
            # A quarter of a second that no first picture need wait.
            from swashplate.links.logs.identify_sweep import identify_sweep

            one = inspection.sweeps[sweep]
            by_hand = bool(input or output)
            return identify_sweep(opened, one, chosen, others=others, folder=folder, tell=tell, alone_only=by_hand)

        return {"number": self.job.start(work), "channels": chosen._asdict()}

    def common(self, numbers: Sequence[int]) -> dict[str, Any]:
        """Channels that several logs share, and a sentence where they share none."""
        ready = [log for log in (self.log(number) for number in numbers) if log.state == READY]
        shared = [name for name in (ready[0].ready.channels if ready else ()) if all(name in x.ready for x in ready)]
        remark = ""
        if len(ready) > 1 and not shared:
            names = ", ".join(log.read.file for log in ready)
            near = did_you_mean(ready[0].ready.channels[0], ready[1].ready.channels)
            remark = f"{names} share no channel: each is drawn for itself. {near or ''}".strip()
        return {"channels": shared, "words": remark}
