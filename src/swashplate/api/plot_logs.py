"""The verb `plot_logs`: any logs as one figure, in a file of any kind."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from swashplate.atomic import make_folder, write_bytes
from swashplate.errors import FlightError, SwashError
from swashplate.extras import library
from swashplate.flights.conditioning.synchronise import synchronise
from swashplate.flights.flight import Flight, as_flights
from swashplate.registry import listed
from swashplate.reporting.figures.of_flight import label, over_time, spectrogram, spectrum
from swashplate.reporting.figures.still import still
from swashplate.reporting.html import write_page
from swashplate.reporting.structure import Figure, Points, Report, Section

SUFFIXES = (".pdf", ".svg", ".png", ".html")
Kind = Literal["time", "spectrum", "spectrogram"]
Alignment = Literal["auto", "motion", "clock", "start", "none"]


@dataclass(frozen=True)
class Aligned:
    """How logs were brought on one clock: seconds added to the times of each, and how each was found, in words."""

    shifts: tuple[float, ...]
    words: tuple[str, ...]


def align(flights: Sequence[Flight], *, by: Alignment = "auto") -> Aligned:
    """Seconds to add to the times of each log so that they lie over the first.

    Args:
        flights: the first keeps its clock.
        by: "motion" (cross-correlation of rates or angles that both have seen), "clock" (the times that the logs
            recorded), "start" (first sample on first sample), "none"; "auto" takes the motion where it agrees, then the
            clock where both logs have one and overlap, then the start.

    Raises:
        FlightError: for "motion" and "clock", where that tells nothing.
    """
    shifts, words = [0.0], []
    first = flights[0]
    for k, flight in enumerate(flights[1:], start=1):
        name = label(flight, k)
        shift, how = _shift(first, flight, by)
        shifts.append(shift)
        words.append(f"{name}: {shift:+.3f} s, {how}")
    return Aligned(tuple(shifts), tuple(words))


def _shift(first: Flight, other: Flight, by: Alignment) -> tuple[float, str]:
    if by == "none":
        return 0.0, "as logged"
    if by in ("auto", "motion"):
        try:
            shift = synchronise(first, other)
            return shift.offset + shift.drift * 0.5 * (other.start + other.stop), f"by the motion ({shift})"
        except FlightError:
            if by == "motion":
                raise
    if by in ("auto", "clock"):
        apart = other.epoch - first.epoch
        clocked = bool(first.epoch and other.epoch)
        overlap = min(first.stop, other.stop + apart) - max(first.start, other.start + apart)
        if clocked and (overlap > 0.0 or by == "clock"):
            return apart, "by the logs' clocks"
        if by == "clock":
            raise FlightError(
                "has no clock that another log knows (no epoch).",
                where=other.provenance.source or None,
                hint="Align by the motion or by the start.",
            )
    return first.start - other.start, "start on start: neither motion nor clock tells more"


def plot_logs(
    flights: Flight | Sequence[Flight],
    *,
    channels: Sequence[str] | None = None,
    kind: Kind = "time",
    path: str | os.PathLike[str] | None = None,
    theme: Literal["paper", "light", "dark"] = "paper",
    alignment: Alignment = "auto",
) -> tuple[Figure, Aligned]:
    """Draw logs over each other, and write the figure where a path is given.

    Args:
        flights: one log or several.
        channels: one panel each; the usual ones that the logs have where None.
        kind: "time", "spectrum" (Welch's power density) or "spectrogram" (of one log).
        path: .pdf, .svg, .png, or .html to zoom in.
        theme: of a still figure. alignment: of several logs over time, see `align`.

    Returns:
        What was drawn, and how the logs were aligned.

    Raises:
        FlightError: a channel that no log has; logs that cannot be aligned as asked; several logs in a spectrogram.
        SwashError: another suffix, a place that cannot be written to, a library that is missing.
    """
    given = as_flights(flights)
    if path is not None and Path(path).suffix.lower() not in SUFFIXES:
        raise SwashError(
            f"ends in '{Path(path).suffix}', expected one of {', '.join(SUFFIXES)}.", where=Path(path), channel="-o"
        )
    known = any(name in flight for flight in given for name in channels or ())
    for k, flight in enumerate(given):
        if known and channels and not any(name in flight for name in channels):
            raise FlightError(
                "has none of the channels that were asked for.",
                where=label(flight, k),
                channel=", ".join(channels),
                hint=f"It has {listed(flight.channels)}.",
            )
    aligned = Aligned((0.0,) * len(given), ())
    if kind == "spectrogram":
        if len(given) > 1:
            raise FlightError(f"shows one log, {len(given)} were given.", channel="spectrogram")
        drawn = spectrogram(given[0], channels=channels)
    elif kind == "spectrum":
        drawn = spectrum(given, channels=channels)
    else:
        aligned = align(given, by=alignment) if len(given) > 1 else aligned
        drawn = over_time(given, channels=channels, shifts=aligned.shifts)
    if path is not None:
        _write(Path(path), drawn, given, aligned, theme)
    return drawn, aligned


def _write(
    path: Path, drawn: Figure, flights: Sequence[Flight], aligned: Aligned, theme: Literal["paper", "light", "dark"]
) -> None:
    names = ", ".join(label(flight, k) for k, flight in enumerate(flights))
    if path.suffix.lower() == ".html":
        told = (Points(aligned.words, title="How the logs were aligned"),) if aligned.words else ()
        simulated = any(flight.provenance.simulated for flight in flights)
        banners = (("caution", "SIMULATED FLIGHT: no aircraft flew for these numbers."),) if simulated else ()
        page = Report(
            title=names,
            banners=banners,
            summary=(),
            picture=None,
            sections=(Section("logs", "Channels", (drawn, *told)),),
        )
        write_page(path, page)
        return
    stamp = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}, ".png": {"Software": None}}[path.suffix.lower()]
    made = io.BytesIO()
    with library("matplotlib", what="drawing").rc_context({"svg.hashsalt": "swashplate"}):
        figure = still([drawn], theme=theme, title=names)
        figure.savefig(made, format=path.suffix.lower()[1:], dpi=160, metadata=stamp)
    make_folder(path.parent)
    write_bytes(path, made.getbuffer())
