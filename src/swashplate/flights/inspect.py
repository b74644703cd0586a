"""What is in a flight and what is wrong with it: `swash inspect`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.consistency import consistency
from swashplate.flights.epoch import note
from swashplate.flights.flight import Flight
from swashplate.flights.jumps import OUTLIER, attitudes, jumps
from swashplate.flights.maneuvers.sweeps import Sweep, sweeps
from swashplate.flights.motion_signs import input_signs, sign_problem, sign_words
from swashplate.flights.schema import channel, is_known
from swashplate.flights.time_base import StreamSummary, jittering, time_base
from swashplate.shown import Shown
from swashplate.text_table import TextTable, screen_width

if TYPE_CHECKING:
    from rich.console import Group

_LARGEST = 1e30  # in the channel's unit: no sensor reaches it, and its square is still a number
_COMMANDS = {"motor_lower": (0, 1), "motor_upper": (0, 1), "servo_roll": (-1, 1), "servo_pitch": (-1, 1)}
"""Ranges of commands."""
_STILL = (
    "rcin_", "rcout_", "omega_", "pid_", "sid_", "voltage", "current", "airspeed", "wind_", "gps_", "clips", "vibe_",
)  # fmt: skip
"""Channels that may stand still all flight: switches and unused outputs, governed rotors, terms of gains that are zero,
sensors that are not there, how well satellites are seen, and what counts faults. Set-points may too."""


@dataclass(frozen=True)
class ChannelSummary:
    """Values of a channel, in the unit shown on screens.

    Attributes:
        unit: the screen's unit (deg where a pilot expects it).
        low, high, median: over the finite samples.
        missing: samples that are not finite.
        constant: never moves.
        outliers: sample-to-sample changes that no motion explains (`flights.jumps`); for the channels of an attitude,
            those of the rotation between samples.
        outside: samples of a command that lie outside its range (motors 0 to 1, servos -1 to 1).
        impossible: samples beyond 1e30, which stand in no other figure.
    """

    name: str
    stream: str
    unit: str
    low: float
    median: float
    high: float
    missing: int
    constant: bool
    outliers: int
    outside: int
    impossible: int = 0


@dataclass(frozen=True)
class Inspection(Shown):
    """What `inspect` found; prints as tables in a terminal (rich) and as text.

    Attributes:
        sweeps: frequency sweeps in the flight.
        signs: which way each command moves the aircraft, in words, or why that is not told.
        damage: what is broken in the file itself; it stands among the problems too.
        vehicle: as the log names it.
    """

    source: str
    simulated: bool
    duration: float
    streams: tuple[StreamSummary, ...]
    channels: tuple[ChannelSummary, ...]
    notes: tuple[str, ...]
    problems: tuple[str, ...]
    sweeps: tuple[Sweep, ...] = ()
    damage: tuple[str, ...] = ()
    vehicle: str = ""
    signs: tuple[str, ...] = ()

    def to_document(self) -> dict[str, object]:
        """The same as plain JSON types (NaN becomes None)."""

        def as_json(value: Any) -> Any:
            if isinstance(value, dict):
                return {key: as_json(entry) for key, entry in value.items()}
            if isinstance(value, list | tuple):
                return [as_json(entry) for entry in value]
            return None if isinstance(value, float) and not np.isfinite(value) else value

        return {key: as_json(value) for key, value in asdict(self).items()}

    def stream_rows(self) -> list[tuple[str, ...]]:
        """Cells of the streams' table, its heading first."""
        head = ("stream", "samples", "from [s]", "to [s]", "rate [Hz]", "jitter [ms]", "gaps", "longest gap [ms]")
        rows = [
            (
                *(s.name, f"{s.n}", f"{s.start:.3f}", f"{s.stop:.3f}", f"{s.rate:.1f}", f"{1e3 * s.jitter:.2f}"),
                *(f"{s.gaps}", f"{1e3 * s.longest_gap:.0f}" if s.gaps else "-"),
            )
            for s in self.streams
        ]
        return [head, *rows]

    def channel_rows(self) -> list[tuple[str, ...]]:
        """Cells of the channels' table, its heading first."""
        head = ("channel", "unit", "stream", "min", "median", "max", "outliers", "remark")
        rows = []
        for c in self.channels:
            remarks = ["never moves"] * c.constant + [f"{c.missing} missing"] * bool(c.missing)
            remarks += [f"{c.impossible} impossible"] * bool(c.impossible)
            remarks += ["not in the schema"] * (not is_known(c.name))
            numbers = (f"{c.low:.4g}", f"{c.median:.4g}", f"{c.high:.4g}", f"{c.outliers or '-'}")
            rows.append((c.name, c.unit, c.stream, *numbers, ", ".join(remarks)))
        return [head, *rows]

    def _title(self) -> str:
        whose = f", {self.vehicle}" if self.vehicle else ""
        return f"{self.source or '(unnamed)'}: {self.duration:.1f} s{whose}{', simulated' if self.simulated else ''}"

    def _lists(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        signs = (("signs from commands to motion", self.signs),) if self.signs else ()
        return (("sweeps", tuple(map(str, self.sweeps))), *signs, ("problems", self.problems), ("notes", self.notes))

    def _tables(self) -> Iterator[TextTable]:
        for heading, *rows in (self.stream_rows(), self.channel_rows()):
            left = [i for i in range(len(heading)) if not (rows and _is_number(rows[0][i]))]
            yield TextTable(heading, rows, left)

    def __str__(self) -> str:
        lines = [self._title()]
        for table in self._tables():
            lines += ["", table.text(screen_width())]
        for heading, texts in self._lists():
            lines += ["", f"{heading}: {'' if texts else 'none'}".rstrip(), *(f"  - {text}" for text in texts)]
        return "\n".join(lines)

    def __rich__(self) -> Group:
        from rich.console import Group, RenderableType
        from rich.markup import escape

        parts: list[RenderableType] = [f"[bold]{escape(self._title())}[/bold]"]
        for table in self._tables():
            parts += ["", table]
        for title, texts in self._lists():
            parts += ["", f"[bold]{title}[/bold]", *(f"  • {escape(text)}" for text in texts or ("none",))]
        return Group(*parts)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _without_impossible(flight: Flight) -> tuple[Flight, dict[str, int]]:
    """The flight with NaN for numbers beyond what anything measures, and how many those are by channel."""
    counts: dict[str, int] = {}
    streams = {}
    for stream_name, data in flight.streams.items():
        changed = {}
        for name, values in data.data_vars.items():
            numbers = np.asarray(values.values, dtype=np.float64)
            beyond = np.isfinite(numbers) & (np.abs(numbers) > _LARGEST)
            if np.any(beyond):
                counts[str(name)] = int(np.sum(beyond))
                changed[name] = values.copy(data=np.where(beyond, np.nan, numbers))
        streams[stream_name] = data.assign(changed) if changed else data
    return (replace(flight, streams=streams) if counts else flight), counts


def _summarise_channel(flight: Flight, name: str, *, outliers: int, impossible: int) -> ChannelSummary:
    values = flight.values(name)
    known = channel(name)
    inside = str(flight[name].attrs.get("units", ""))
    shown = values * known.shown_factor
    finite = shown[np.isfinite(shown)]
    low, median, high = (finite.min(), np.median(finite), finite.max()) if finite.size else (np.nan,) * 3
    bounds = _COMMANDS.get(name, (-np.inf, np.inf))
    return ChannelSummary(
        name=name,
        stream=flight.stream_of(name),
        unit=known.shown_unit or inside,
        low=float(low),
        median=float(median),
        high=float(high),
        missing=int(values.size - finite.size) - impossible,
        constant=bool(finite.size > 1 and low == high),
        outliers=outliers,
        outside=int(np.sum((finite < bounds[0]) | (finite > bounds[1]))),
        impossible=impossible,
    )


def _channel_problems(summary: ChannelSummary) -> list[str]:
    problems = []
    if summary.missing:
        problems.append(f"{summary.name}: {summary.missing} samples are not finite")
    if summary.impossible:
        problems.append(f"{summary.name}: {summary.impossible} samples beyond {_LARGEST:g}: nothing measures that")
    if summary.outside:
        low, high = _COMMANDS[summary.name]
        samples = "sample" if summary.outside == 1 else "samples"
        problems.append(f"{summary.name}: {summary.outside} {samples} outside {low} to {high}, which no command is")
    return problems


def _shared_problems(channels: Sequence[ChannelSummary], jumps: Mapping[str, int]) -> list[str]:
    """What several channels may have in common, one line for all of them."""
    still = [c.name for c in channels if c.constant and not (c.name.startswith(_STILL) or c.name.endswith("_demand"))]
    beyond = f"beyond {OUTLIER:g} robust sigmas (outliers?)"
    problems = []
    if still:
        move, it = ("moves", "it") if len(still) == 1 else ("move", "them")
        problems.append(f"{', '.join(still)}: never {move}, so nothing can be learnt from {it}")
    if len(jumps) > 1:
        problems.append(f"jumps {beyond}: {', '.join(f'{count} in {name}' for name, count in jumps.items())}")
    problems += [f"{n}: {count} jump{'s' * (count > 1)} {beyond}" for n, count in jumps.items() if len(jumps) == 1]
    return problems


def _looked(
    flight: Flight, beside: Flight | None = None
) -> tuple[tuple[StreamSummary, ...], tuple[ChannelSummary, ...]]:
    """Every stream and every channel of a flight without impossible numbers, which are counted."""
    switched = np.sort([event.time for event in flight.provenance.events if event.kind == "mode"])
    streams = tuple(time_base(name, data, switched) for name, data in flight.streams.items())
    flight, impossible = _without_impossible(flight)
    outliers = jumps(flight, beside)
    labels = {channel: name for name, group in attitudes(flight).items() for channel in group}
    channels = tuple(
        _summarise_channel(
            flight, name, outliers=outliers.get(labels.get(name, name), 0), impossible=impossible.get(name, 0)
        )
        for name in flight.channels
    )
    return streams, channels


def _problems_of(flight: Flight, streams: Sequence[StreamSummary], channels: Sequence[ChannelSummary]) -> list[str]:
    labels = {channel: name for name, group in attitudes(flight).items() for channel in group}
    outliers = {labels.get(summary.name, summary.name): summary.outliers for summary in channels if summary.outliers}
    lines = [*(text for stream in streams for text in stream.problems), *jittering(streams)]
    lines += [text for summary in channels for text in _channel_problems(summary)]
    return lines + _shared_problems(channels, outliers)


def problems(flight: Flight, beside: Flight | None = None) -> tuple[str, ...]:
    """What is wrong with a flight's streams and channels, each by itself, in words (`beside`: as of `jumps`)."""
    return tuple(_problems_of(flight, *_looked(flight, beside)))


def inspect(flight: Flight) -> Inspection:
    """Summary of a flight: channels, units, rates, gaps, jitter, constants, jumps, sweeps, the problems in words.

    Nothing is repaired; conditioning does that.
    """
    streams, channels = _looked(flight)
    possible, _ = _without_impossible(flight)
    damage = flight.provenance.damage
    contradictions = tuple(str(finding) for finding in consistency(possible))
    swept = sweeps(possible)
    signs = input_signs(possible, swept)
    # A motion that contradicts itself is told as that: its commands may well be right.
    doubted = tuple(text.partition(":")[0] for text in contradictions if "has the other sign" in text)
    turned = (sign_problem(possible, sign) for sign, _ in signs if sign.wrong and sign.output not in doubted)
    return Inspection(
        source=flight.provenance.source,
        simulated=flight.provenance.simulated,
        duration=flight.duration if any(stream.n for stream in streams) else 0.0,
        streams=streams,
        channels=channels,
        notes=(
            *flight.provenance.notes,
            *([kind.made_for] if (kind := aircraft_kind(flight)) is not None and kind.made_for else []),
            *([note(flight.epoch)] if flight.epoch else ()),
            *(text for stream in streams for text in stream.notes),
        ),
        problems=(*damage, *contradictions, *turned, *_problems_of(flight, streams, channels)),
        sweeps=swept,
        damage=damage,
        vehicle=flight.provenance.vehicle,
        signs=tuple(sign_words(sign, why) for sign, why in signs),
    )
