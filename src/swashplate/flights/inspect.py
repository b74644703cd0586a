"""What is in a flight and what is wrong with it: `swash inspect`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.consistency import consistency
from swashplate.flights.epoch import note
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep, sweeps
from swashplate.flights.schema import QUATERNION, channel, is_known
from swashplate.shown import Shown
from swashplate.text_table import TextTable, screen_width

if TYPE_CHECKING:
    from rich.console import Group

_LARGEST = 1e30  # in the channel's unit: no sensor reaches it, and its square is still a number
_GAP = 3.0  # usual steps; a step longer than this has lost at least two samples
_TURN = 31  # steps whose median is the usual one there: half as many slow ones in a row are another rate, no gaps
_JITTER = 0.05  # of the median step; beyond it, equal steps cannot be assumed
_OUTLIER = 12.0  # robust standard deviations of the sample-to-sample change
_NEAR = 25  # changes on each side that are its neighbours
_UNUSUAL = 4.0  # robust standard deviations of the neighbours; a sweep's own changes reach one
_ORDINARY = ("rcin_", "rcout_")  # switches and unused outputs hardly ever move
_MAD_TO_SIGMA = 1.4826  # of a normal distribution: 1 / Phi^-1(3/4)
_Q95_TO_SIGMA = 1.0 / 1.95996  # of a normal distribution: 1 / Phi^-1(0.975)
_SLIGHT = 1e-3  # of the channel's span; a smaller change is no jump, however still the channel is otherwise
_COMMANDS = {"motor_lower": (0, 1), "motor_upper": (0, 1), "servo_roll": (-1, 1), "servo_pitch": (-1, 1)}
"""Channels that may step, and their ranges."""
_STEPPING = ("mixer_", "stick_", *_ORDINARY)  # commands of autopilots and pilots: they may step too


@dataclass(frozen=True)
class StreamSummary:
    """Time base of a stream.

    Attributes:
        rate: sample rate [Hz] from the median step; NaN for a single sample.
        jitter: scatter of the steps that are no gaps: 1.4826 times the median absolute deviation [s].
        gaps: steps longer than three usual ones there; longest_gap: the longest of them [s] (0 where there is none).
        rates: the slowest and the fastest usual rate [Hz]: autopilots log some messages slowly outside tests. Both are
            `rate` where no step is three times another one.
    """

    name: str
    n: int
    start: float
    stop: float
    rate: float
    jitter: float
    gaps: int
    longest_gap: float
    rates: tuple[float, float]


@dataclass(frozen=True)
class ChannelSummary:
    """Values of a channel, in the unit shown on screens.

    Attributes:
        unit: the screen's unit (deg where a pilot expects it).
        low, high, median: over the finite samples.
        missing: samples that are not finite.
        constant: never moves.
        outliers: sample-to-sample changes beyond 12 robust standard deviations of all of them (4 of their neighbours);
            for the four channels of a quaternion, those of the rotation between samples; for a command, which may step,
            only those that the next sample takes back.
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

    def as_dict(self) -> dict[str, Any]:
        """The same as plain JSON types (NaN becomes None)."""

        def plain(value: Any) -> Any:
            if isinstance(value, dict):
                return {key: plain(entry) for key, entry in value.items()}
            if isinstance(value, list | tuple):
                return [plain(entry) for entry in value]
            return None if isinstance(value, float) and not np.isfinite(value) else value

        return {key: plain(value) for key, value in asdict(self).items()}

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
        return (("sweeps", tuple(map(str, self.sweeps))), ("problems", self.problems), ("notes", self.notes))

    def _tables(self) -> Iterator[TextTable]:
        for heading, *rows in (self.stream_rows(), self.channel_rows()):
            words = [i for i in range(len(heading)) if not (rows and _is_number(rows[0][i]))]
            yield TextTable(heading, rows, words)

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


def _summarise_stream(name: str, data: xr.Dataset) -> StreamSummary:
    time = np.asarray(data["time"].values, dtype=np.float64)
    if time.size < 2:
        edge = float(time[0]) if time.size else float("nan")
        nothing = float("nan")
        return StreamSummary(name, time.size, edge, edge, nothing, nothing, 0, 0.0, (nothing, nothing))
    steps = np.diff(time)
    median = float(np.median(steps))
    rates, usual = (1.0 / median, 1.0 / median), np.full(steps.shape, median)
    if float(steps.max()) > _GAP * float(steps.min()):
        from scipy.ndimage import median_filter  # a quarter of a second that an even log need not wait

        by_turns = median_filter(steps, size=_TURN, mode="mirror")
        rates = (1.0 / float(by_turns.max()), 1.0 / float(by_turns.min()))
        if rates[1] > _GAP * rates[0]:
            usual = by_turns
    long = steps > _GAP * usual
    return StreamSummary(
        name,
        time.size,
        float(time[0]),
        float(time[-1]),
        rate=1.0 / median,
        jitter=_MAD_TO_SIGMA * float(np.median(np.abs(steps - usual)[~long])),
        gaps=int(long.sum()),
        longest_gap=float(steps[long].max()) if long.any() else 0.0,
        rates=rates,
    )


def _jumps(changes: Array) -> NDArray[np.bool_]:
    """Changes between samples that are far outside the scatter of all changes (Hampel's identifier on differences).

    The scatter is the larger of what half and what 95 % of the changes give: a channel that is held between the updates
    of a slower clock (and moves there by rounding only) is judged by its updates. One that hardly ever moves is not
    judged, and a change that is slight beside the channel's span is no jump. Nor is one that is usual among its
    neighbours: a sweep's changes grow with its frequency, all of them.
    """
    if not changes.size:
        return np.zeros(0, dtype=np.bool_)
    off = np.abs(changes - np.median(changes))
    sigma = max(_MAD_TO_SIGMA * float(np.median(off)), _Q95_TO_SIGMA * float(np.quantile(off, 0.95)))
    span = float(np.ptp(np.cumsum(changes)))
    if not sigma > np.finfo(np.float64).eps * span:
        return np.zeros(changes.shape, dtype=np.bool_)
    jumps = np.asarray(off > max(_OUTLIER * sigma, _SLIGHT * span))
    for i in np.flatnonzero(jumps).tolist():
        jumps[i] = off[i] > _UNUSUAL * _MAD_TO_SIGMA * np.median(off[max(0, i - _NEAR) : i + _NEAR + 1])
    return jumps


def _spikes(changes: Array) -> NDArray[np.bool_]:
    """Jumps that the next sample takes back: what no flight computer commands."""
    jumps = _jumps(changes)
    there = jumps[:-1] & jumps[1:] & (changes[:-1] * changes[1:] < 0.0)
    return np.append(there, False) | np.insert(there, 0, False)


def _attitude_jumps(flight: Flight) -> int:
    """Jumps of the attitude: outliers in any component of the rotation from sample to sample, blind to sign flips."""
    quaternion = np.stack([flight.values(name) for name in QUATERNION])
    quaternion = quaternion[:, np.isfinite(quaternion).all(axis=0)]
    (w0, x0, y0, z0), (w1, x1, y1, z1) = quaternion[:, :-1], quaternion[:, 1:]
    sign = np.sign(w0 * w1 + x0 * x1 + y0 * y1 + z0 * z1)
    # Vector part of conj(q0) * q1, which is half the rotation vector where the step is small.
    turned = (
        sign * (w0 * x1 - x0 * w1 - y0 * z1 + z0 * y1),
        sign * (w0 * y1 - y0 * w1 - z0 * x1 + x0 * z1),
        sign * (w0 * z1 - z0 * w1 - x0 * y1 + y0 * x1),
    )
    return int(np.sum(np.any([_jumps(component) for component in turned], axis=0)))


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


def _summarise_channel(flight: Flight, name: str, home: str, impossible: int) -> ChannelSummary:
    values = flight.values(name)
    known = channel(name)
    inside = str(flight[name].attrs.get("units", ""))
    shown = values * known.shown_factor
    finite = shown[np.isfinite(shown)]
    low, median, high = (finite.min(), np.median(finite), finite.max()) if finite.size else (np.nan,) * 3
    bounds = _COMMANDS.get(name, (-np.inf, np.inf))
    if name in QUATERNION and all(other in flight for other in QUATERNION):
        outliers = _attitude_jumps(flight)
    else:
        changes = np.diff(values[np.isfinite(values)])
        if name.startswith(("phi", "psi")) and inside == "rad":  # a whole turn is no jump
            changes = np.remainder(changes + np.pi, 2.0 * np.pi) - np.pi
        steps = name in _COMMANDS or name.startswith(_STEPPING) or name.endswith("_demand")
        outliers = int(np.sum(_spikes(changes) if steps else _jumps(changes)))
    return ChannelSummary(
        name=name,
        stream=home,
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


def _stream_problems(stream: StreamSummary) -> list[str]:
    problems = []
    if stream.gaps:
        problems.append(
            f"{stream.name}: {stream.gaps} gap{'s' * (stream.gaps != 1)} in the time stamps, the longest "
            f"{1e3 * stream.longest_gap:.0f} ms (usual step {1e3 / stream.rate:.1f} ms)"
        )
    if stream.jitter * stream.rate > _JITTER:
        problems.append(
            f"{stream.name}: time stamps jitter by {1e3 * stream.jitter:.2f} ms; bring them to one rate before a fit"
        )
    return problems


def _stream_notes(stream: StreamSummary) -> list[str]:
    slow, fast = stream.rates
    if not fast > _GAP * slow:
        return []
    return [
        f"{stream.name}: recorded at {slow:.3g} Hz and at {fast:.3g} Hz by turns; take a piece of one rate for a fit"
    ]


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


def _shared_problems(channels: tuple[ChannelSummary, ...]) -> list[str]:
    """What several channels may have in common, one line for all of them."""
    still = [c.name for c in channels if c.constant and not c.name.startswith(_ORDINARY)]
    jumps = {"attitude" if c.name in QUATERNION else c.name: c.outliers for c in channels if c.outliers}
    beyond = f"beyond {_OUTLIER:g} robust sigmas (outliers?)"
    problems = []
    if still:
        move, it = ("moves", "it") if len(still) == 1 else ("move", "them")
        problems.append(f"{', '.join(still)}: never {move}, so nothing can be learnt from {it}")
    if len(jumps) > 1:
        problems.append(f"jumps {beyond}: {', '.join(f'{count} in {name}' for name, count in jumps.items())}")
    problems += [f"{n}: {count} jump{'s' * (count > 1)} {beyond}" for n, count in jumps.items() if len(jumps) == 1]
    return problems


def inspect(flight: Flight) -> Inspection:
    """Summary of a flight: channels, units, rates, gaps, jitter, constants, jumps, sweeps, the problems in words.

    Nothing is repaired; conditioning does that.
    """
    streams = tuple(_summarise_stream(name, data) for name, data in flight.streams.items())
    flight, impossible = _without_impossible(flight)
    channels = tuple(
        _summarise_channel(flight, name, flight.stream_of(name), impossible.get(name, 0)) for name in flight.channels
    )
    damage = flight.provenance.damage
    problems = [*damage, *(str(finding) for finding in consistency(flight))]
    problems += [text for stream in streams for text in _stream_problems(stream)]
    problems += [text for summary in channels for text in _channel_problems(summary)]
    problems += _shared_problems(channels)
    return Inspection(
        source=flight.provenance.source,
        simulated=flight.provenance.simulated,
        duration=flight.duration if any(stream.n for stream in streams) else 0.0,
        streams=streams,
        channels=channels,
        notes=(
            *flight.provenance.notes,
            *([note(flight.epoch)] if flight.epoch else ()),
            *(text for stream in streams for text in _stream_notes(stream)),
        ),
        problems=tuple(problems),
        sweeps=sweeps(flight),
        damage=damage,
        vehicle=flight.provenance.vehicle,
    )
