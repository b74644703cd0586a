"""What a user may add to a flight's name: `FILE@START-STOP` for a window [s], `FILE#N` for a log among several."""

from __future__ import annotations

import os
import re
from pathlib import Path

from swashplate.errors import FlightError
from swashplate.flights.datasets import locate
from swashplate.flights.flight import Flight

_WINDOW = re.compile(r"(?P<file>.+)@(?P<start>\d+(?:\.\d*)?)-(?P<stop>\d+(?:\.\d*)?)")
_LOG = re.compile(r"(?P<file>.+)#(?P<number>\d{1,6})")


def split_window(text: str | os.PathLike[str]) -> tuple[str, tuple[float, float] | None]:
    """`FILE@START-STOP` as the file and the window [s]; a file of just this name wins."""
    name = os.fspath(text)
    match = _WINDOW.fullmatch(name)
    if match is None or Path(name).exists():
        return name, None
    return match["file"], (float(match["start"]), float(match["stop"]))


def split_log(text: str) -> tuple[str, int | None]:
    """`FILE#N` as the file and which of its logs is meant; a file of just this name wins."""
    match = _LOG.fullmatch(text)
    return (text, None) if match is None or Path(text).exists() else (match["file"], int(match["number"]))


def is_log(named: object, *, matrices: bool) -> bool:
    """Whether a text names a log and no model: by its ending, which a model's name lacks, or as a folder (rosbag2).

    Args:
        named: a text or a path. matrices: whether a .mat is an export's matrices, else it is a log.
    """
    if not isinstance(named, str | os.PathLike):
        return False
    file = Path(locate(split_log(split_window(named)[0])[0]))
    return file.is_dir() or file.suffix.lower() not in ("", ".toml", ".json", *([".mat"] * matrices))


def cut(flight: Flight, start: float, stop: float, *, where: str) -> Flight:
    """The window of a flight, its limits [s] in the flight's time or in the log's own.

    Args:
        where: the file, for messages.

    Raises:
        FlightError: for a window that holds nothing.
    """
    if flight.epoch and start >= flight.epoch:  # given as the log has them
        start, stop = start - flight.epoch, stop - flight.epoch
    if not (start < stop and start < flight.stop and stop > flight.start):
        raise FlightError(
            f"the window {start:g}-{stop:g} s holds nothing; the flight runs from {flight.start:.2f} to "
            f"{flight.stop:.2f} s.",
            where=where,
            hint="Give FILE@START-STOP in the log's seconds, as `swash inspect` shows them.",
        )
    return flight.between(start, stop)
