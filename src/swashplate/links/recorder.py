"""Flights that are kept while they are flown, one file after the other, never over a file that is there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import count
from pathlib import Path

from swashplate.atomic import added_when_complete
from swashplate.errors import FlightError, LinkError, SwashError, WriteError
from swashplate.flights import growing
from swashplate.flights.flight import Flight
from swashplate.flights.growing import SUFFIX, Abandoned, Growing
from swashplate.flights.tabular import write_csv
from swashplate.links.notices import Say

LEAST = 2
"""Samples of a flight: fewer are none."""
SHORT = 10_000
"""Samples that are saved at once (in a tenth of a second). Longer flights wait for the end: while they are saved nobody
is answered, and who is answered late may be taken for silent."""


def numbered(file: Path) -> Iterator[Path]:
    """`flight.nc`, `flight-2.nc`, `flight-3.nc` and so on without end."""
    yield file
    for number in count(2):
        yield file.with_stem(f"{file.stem}-{number}")


def begin(names: Iterable[Path], *, like: Flight, taken: Callable[[Path], bool] = Path.exists) -> tuple[Path, Growing]:
    """The first of `names` that is free, and a growing file beside it that keeps the name from other programs.

    Args:
        names: of the files that the recording will become.
        like: a flight without samples, see `Growing`.
        taken: whether a name is in use.

    Raises:
        LinkError: where the folder cannot be written to.
    """
    for file in names:
        if taken(file):
            continue
        try:
            begun = Growing(file.with_suffix(SUFFIX), like=like)
        except FileExistsError:
            continue
        except OSError as error:
            raise LinkError(
                f"cannot be written: {error.strerror}.", where=file, hint="Check that the folder is yours."
            ) from None
        if not taken(file):  # since it was asked for, another program may have saved its own and let the name go
            return file, begun
        begun.discard()
    raise AssertionError("names end")


def save(flight: Flight, file: Path) -> Path:
    """Write a flight as .nc or .csv under the first free name of `numbered`; returns it.

    Raises:
        FlightError: where it cannot be written.
    """
    for free in numbered(file):
        try:
            with added_when_complete(free) as temporary:
                if file.suffix.lower() == ".nc":
                    flight.save(temporary)
                else:
                    write_csv(flight, temporary)
        except FileExistsError:
            continue
        except (FlightError, WriteError) as error:  # it names the temporary file
            raise FlightError(error.problem, where=free, channel=error.channel, hint=error.hint) from None
        return free
    raise AssertionError("names end")


def recover(file: Path, say: Say) -> tuple[Path, ...]:
    """Save what programs that were killed have left of their recordings to `file`; returns the files written.

    Recordings of programs that are alive are left alone. One that cannot be read stays where it is, and is told.
    """
    grown = []
    for left in sorted(file.parent.glob(f"{_escaped(file.stem)}*{SUFFIX}")):
        if left.stem == file.stem or left.stem.removeprefix(f"{file.stem}-").isdecimal():
            grown.append(left)
    return salvage(grown, lambda left, flight: save(flight, left.with_suffix(file.suffix)), say)


def salvage(
    grown: Iterable[Path], keep: Callable[[Path, Flight], Path], say: Say, *, shortest: float = 0.0
) -> tuple[Path, ...]:
    """Save flights of growing files whose programs were killed, and remove these files; returns the files written.

    Args:
        grown: the growing files; one whose program is alive is left alone, one that cannot be saved stays, and is told.
        keep: saves a flight; returns the file.
        say: told of each.
        shortest: seconds; of less nothing is kept.
    """
    saved = []
    for left in grown:
        with Abandoned(left) as abandoned:
            if not abandoned.free:
                continue
            try:
                flight = read_grown(left)
                if flight is not None and flight.duration >= shortest:
                    saved.append(keep(left, flight))
                    say(f"an earlier recording was cut off; its {flight.duration:.1f} s are saved: {saved[-1]}.")
            except SwashError as error:
                say(f"an earlier recording was cut off and stays as it is: {error}")
                continue
            left.unlink()
    return tuple(saved)


def _escaped(stem: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in stem)


def read_grown(file: Path) -> Flight | None:
    """What is in a growing file; None for less than a flight."""
    if file.stat().st_size == 0:
        return None  # killed before its first line
    flight = growing.load(file)
    (data,) = flight.streams.values()
    return flight if data.sizes["time"] >= LEAST else None


Judge = Callable[[Flight], Flight]


class Recorder:
    """The true flights of a link: one for every time that the vehicle was put on the ground.

    Args:
        file: the first flight's, .nc or .csv; others, and all where it exists, are numbered (`numbered`).
        like: a flight without samples, see `Growing`.
        say: where lines go.
        judge: puts into a flight's notes what of it may not be believed.
    """

    def __init__(self, file: Path, *, like: Flight, say: Say, judge: Judge = lambda flight: flight) -> None:
        self._file, self._like, self._say, self._judge = file, like, say, judge
        self._now: tuple[Path, Growing] | None = None
        self._waiting: list[tuple[Path, Growing]] = []
        self._saved: list[Path] = []
        self._troubles: list[str] = []
        self._stopped = False

    def restart(self) -> None:
        """What comes next is another flight."""
        if self._now is not None:
            if self._now[1].rows > SHORT:
                self._waiting.append(self._now)
            else:
                self._save(*self._now)
        self._now = None

    def add(self, time: float, row: Iterable[float]) -> None:
        """Keep one sample. Where that fails the flight goes on without being recorded, which is told at once."""
        if self._stopped:
            return
        try:
            if self._now is None:
                self._now = begin(numbered(self._file), like=self._like)
                if self._now[0] != self._file:
                    self._say(f"{self._file} is kept as it is: this flight becomes {self._now[0]}.")
            self._now[1].append(time, row)
        except LinkError as error:
            self._stop(str(error))
        except OSError as error:
            self._stop(f"{self._now[1].path if self._now else self._file}: {error.strerror}.")

    def _stop(self, why: str) -> None:
        self._stopped = True
        self._troubles.append(f"the recording has stopped: {why}")
        self._say(f"the recording has stopped, the flight goes on: {why}")

    def _save(self, target: Path, recording: Growing) -> None:
        try:
            flight = read_grown(recording.path)
            if flight is not None:
                judged = self._judge(flight)
                self._saved.append(save(judged, target))
                for note in judged.provenance.notes:
                    self._say(f"{self._saved[-1]}: {note}.")
        except FlightError as error:
            recording.close()
            self._troubles.append(f"{error} What was flown stays in {recording.path}; `swash inspect` reads it.")
        else:
            recording.discard()

    def finish(self) -> tuple[Path, ...]:
        """End the recording and save its flights; returns the files of all of them.

        Raises:
            LinkError: where something could not be recorded or saved, after the rest was.
        """
        waiting = self._waiting if self._now is None else [*self._waiting, self._now]
        self._now, self._waiting = None, []
        for target, recording in waiting:
            self._save(target, recording)
        if self._troubles:
            raise LinkError(" ".join(self._troubles), channel="--record")
        return tuple(self._saved)
