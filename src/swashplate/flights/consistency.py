"""Do the channels of a log tell one motion? Rates against attitude, velocities against positions, weight against az.

Each measured rate is held against the three that the attitude's change gives, in windows and in a band that both sides
know well. Where the two move together the ratio is 1; 57.3, -1, or a better agreement with another axis is a wrong
unit, sign or axis. Where an axis does not move, nothing is said. Kinematics only (Klein and Morelli 2006, ch. 10): it
holds for any vehicle, and with the heading unknown for roll and pitch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import continuous, interpolate, quaternion_from_euler, to_body
from swashplate.flights.conditioning.derive import GRAVITY, body_rates, differentiate
from swashplate.flights.conditioning.filters import within
from swashplate.flights.conditioning.resample import common, unbroken
from swashplate.flights.flight import Flight
from swashplate.flights.readers.given_units import unit_to_give
from swashplate.flights.schema import ATTITUDE, POSITION, QUATERNION, RATES, VARIANTS, VELOCITY, channel

Reference = Callable[[Array], Array]
"""What the other side of the log says about the three axes at the times of a uniform grid, shape (n, 3)."""

UNCHECKED = "consistency_not_checked"
"""Step of a history by which the user takes a flight as it is."""

_BANDS = (((0.2, 3.0), 5.0), ((0.1, 0.8), 10.0))
"""Bands [Hz] with windows [s]: above drift, below rotor shake and what a delay of 50 ms turns round; and a slow one."""
_LOCAL = ("vx", "vy", "vz")
_FASTEST = 50.0  # Hz: over ten times the highest corner; what is sampled faster is averaged down to it first
_SHORTEST = 60  # samples
_FEWEST = 3  # windows in which an axis must move
_TOGETHER = 0.8  # correlation from which two channels show one motion, whatever their ratio
_RIGHT = 0.7  # the same where the ratio's size is right: noise has neither the size nor, window by window, the sign
_SCALED = 0.5  # the same where the ratio is a unit's: noise that large would leave no correlation at all
_SURE = 0.95  # correlation from which a ratio that is no unit's is worth a word
_APART = 0.8  # of its correlation with another axis: below, a channel does not belong to its own
_SAME = 0.4  # of the logarithm: a ratio between 0.67 and 1.5 is 1 (real sensors' filters: 0.8 to 1.2)
_CLOSER = 0.03  # of correlation: more than chance makes between a channel and a copy of it
_QUIET = 0.15  # of its usual motion: a window in which an axis moves less is not judged
_STEEPEST = 0.5 * np.pi + 0.02  # rad: no pitch angle is larger
_MAX_GAP = 0.25  # s
_UPRIGHT = 0.5  # cosine of the tilt beyond which the weight along body z says little


@dataclass(frozen=True)
class Inconsistency:
    """One channel that contradicts the others.

    Attributes:
        channel: the channel.
        text: what is wrong, with the number.
        mend: the option that mends it.
        decisive: whether work on the flight is refused until it is mended.
    """

    channel: str
    text: str
    mend: str
    decisive: bool = True

    def __str__(self) -> str:
        return f"{self.channel}: {self.text}. {self.mend}"


def consistency(flight: Flight) -> tuple[Inconsistency, ...]:
    """Every contradiction between the flight's measured channels; none where nothing can be held against anything."""
    made = {name for step in flight.history if step.operation == "derive" for name in step.details.get("derived", ())}
    contradictions: list[Inconsistency] = []
    if (attitude := _attitude(flight, contradictions)) is not None:
        for names in _families(flight, RATES, made):
            told = _compared(flight, names, attitude.time, attitude.turning, attitude.axes, _RATE)
            # Pitch without roll: on its back, q and the change of theta have opposite signs.
            contradictions += [replace(one, decisive=one.decisive and attitude.axes != (1,)) for one in told]
    if all(name in flight for name in POSITION):
        place = [_thinned(*_series(flight, name)) for name in POSITION]

        def local(grid: Array) -> Array:
            return _moving(place, grid)

        def body(grid: Array) -> Array:
            assert attitude is not None
            return to_body(interpolate(attitude.time, attitude.quaternion, grid), local(grid))

        whole = attitude is not None and len(attitude.axes) == 3
        for names, reference in ((_LOCAL, local), *([(VELOCITY, body)] if whole else [])):
            measured = tuple(name if name in flight and name not in made else "" for name in names)
            if any(measured):
                contradictions += _compared(flight, measured, place[0][0], reference, (0, 1, 2), _SPEED)
    return (*contradictions, *_weight(flight, made, attitude if attitude and len(attitude.axes) > 1 else None))


def refuse_inconsistent(flight: Flight) -> None:
    """Refuses a flight whose channels contradict each other beyond doubt, unless the user has taken it as it is.

    Raises:
        FlightError: naming the channels, the ratios and the option that mends them.
    """
    if any(step.operation == UNCHECKED for step in flight.history):
        return
    decisive = [finding for finding in consistency(flight) if finding.decisive]
    if decisive:
        told = [f"{'' if i == 0 else one.channel + ': '}{one.text}" for i, one in enumerate(decisive)]
        raise FlightError(
            f"{'; '.join(told)}.",
            where=flight.provenance.source or None,
            channel=decisive[0].channel,
            hint=" ".join(dict.fromkeys(finding.mend for finding in decisive))
            + " To use the log as it is: condition(check=False) in Python.",
        )


# ---- what is held against what ---------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Kind:
    """Units that a channel of this kind is often logged in: what a value must be divided by, by unit."""

    units: Mapping[str, float]
    reference: str


_DEGREE = 180.0 / np.pi
_RATE = _Kind({"deg/s": _DEGREE, "rpm": 30.0 / np.pi}, "what the attitude's change gives")
_SPEED = _Kind({"mm/s": 1e3, "cm/s": 1e2, "ft/s": 1.0 / 0.3048, "km/h": 3.6}, "what the position's change gives")


def _families(flight: Flight, plain: Sequence[str], made: set[str]) -> list[tuple[str, ...]]:
    """The measured channels of a kind, axis by axis ("" where one is missing), with second opinions."""
    families = []
    for variant in ("", *VARIANTS):
        names = tuple(f"{name}_{variant}" if variant else name for name in plain)
        if variant != "demand" and any(name in flight for name in names):
            families.append(tuple(name if name in flight and name not in made else "" for name in names))
    return [names for names in families if any(names)]


def _series(flight: Flight, name: str) -> tuple[Array, Array]:
    """Finite samples of a channel: stamps and values."""
    time, values = flight.time(name), flight.values(name)
    good = np.isfinite(values) & np.isfinite(time)
    return time[good], values[good]


def _thinned(time: Array, table: Array) -> tuple[Array, Array]:
    """Means over blocks of samples, so that a fast recording comes down to between 50 and 100 Hz; shapes (n,), (n, m).

    A block that spans a gap is left out. A slower recording is returned as it is.
    """
    step = float(np.median(np.diff(time))) if time.size > 1 else np.inf
    k = int(min(1.0 / (step * _FASTEST), time.size + 1)) if step > 0.0 else 1
    if k < 2 or time.size < k:
        return time, table
    blocks = time.size // k
    stamps = time[: blocks * k].reshape(blocks, k)
    whole = stamps[:, -1] - stamps[:, 0] < 2.0 * k * step
    means = table[: blocks * k].reshape(blocks, k, *table.shape[1:]).mean(axis=1)
    return stamps.mean(axis=1)[whole], means[whole]


@dataclass(frozen=True)
class _Attitude:
    """Stamps, quaternions, and the axes about which they tell the turn (without heading no yaw)."""

    time: Array
    quaternion: Array
    axes: tuple[int, ...]

    def turning(self, grid: Array) -> Array:
        """Body rates [rad/s] at the times of a uniform grid, shape (n, 3)."""
        return body_rates(interpolate(self.time, self.quaternion, grid), rate=1.0 / float(grid[1] - grid[0]))


def _attitude(flight: Flight, contradictions: list[Inconsistency]) -> _Attitude | None:
    """The flight's attitude, None where it has none; angles that are degrees are said and put right."""
    if all(name in flight for name in QUATERNION) and len({flight.stream_of(n) for n in QUATERNION}) == 1:
        table = flight.array(QUATERNION)
        good = np.isfinite(table).all(axis=1) & (np.linalg.norm(table, axis=1) > 0.5)
        if good.sum() < 2:
            return None
        free = continuous(table[good])  # of sign flips: a mean over a block is near the attitude of its middle
        return _Attitude(*_thinned(flight.time(QUATERNION[0])[good], free), (0, 1, 2))
    there = tuple(name for name in ATTITUDE if name in flight)
    tilts = [i for i in (0, 1) if ATTITUDE[i] in there]
    if not tilts or len({flight.stream_of(name) for name in there}) > 1:
        return None
    table = np.zeros((flight.time(there[0]).size, 3))
    for name in there:
        table[:, ATTITUDE.index(name)] = flight.values(name)
    good = np.isfinite(table).all(axis=1)
    if good.sum() < 2:
        return None
    table = table[good]
    steep = float(np.quantile(np.abs(table[:, 1]), 0.99))
    if steep > _STEEPEST:
        contradictions.append(
            Inconsistency(
                "theta",
                f"reaches {steep:.3g} rad, and no pitch angle passes 1.57 rad: it looks like degrees",
                "Give --unit theta=deg (and phi, psi alike).",
            )
        )
        table = np.radians(table)
    for column in (0, 2):  # a mean over the wrap of roll or yaw would be no angle
        if np.ptp(table[:, column]) > np.pi:
            table[:, column] = np.unwrap(table[:, column])
    stamps, table = _thinned(flight.time(there[0])[good], table)
    axes = tuple(range(len(there))) if len(tilts) == 2 else tuple(tilts)
    return _Attitude(stamps, quaternion_from_euler(table), axes)


def _moving(place: Sequence[tuple[Array, Array]], grid: Array) -> Array:
    at = np.stack([np.interp(grid, time, values) for time, values in place], axis=-1)
    return differentiate(at, rate=1.0 / float(grid[1] - grid[0]))


# ---- the comparison --------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Agreement:
    """Medians over the windows in which the axis moves: correlation and signed ratio of a channel to an axis."""

    correlation: float
    ratio: float
    sigma: float


def _compared(
    flight: Flight, names: tuple[str, ...], time: Array, reference: Reference, axes: tuple[int, ...], kind: _Kind
) -> list[Inconsistency]:
    """Findings on the channels `names` (one an axis, "" where missing) against `reference(grid)`, shape (n, 3)."""
    contradictions = []
    for home in dict.fromkeys(flight.stream_of(name) for name in names if name):
        here = tuple(name if name and flight.stream_of(name) == home else "" for name in names)
        pieces = list(_pieces(flight, [name for name in here if name], time, reference))
        there = [i for i, name in enumerate(here) if name]
        both = [_agreements(pieces, there, axes, band=band, window=window) for band, window in _BANDS]
        for i, name in enumerate(here):
            told = [made[i] for made in both if i in made]
            if name and told:
                # The band in which the two sides know each other best: noise of a derivative, drift of a gyroscope.
                clearest = max(told, key=lambda by_axis: max(abs(at.correlation) for at in by_axis.values()))
                every = next(agreements for agreements in both if agreements.get(i) is clearest)
                owners = {j: by_axis[j] for j, by_axis in every.items() if j in by_axis}
                contradictions += _judged(flight, here, i, clearest, kind, owners)
    return contradictions


def _pieces(flight: Flight, names: Sequence[str], time: Array, reference: Reference) -> Iterator[tuple[float, Array]]:
    """Rate [Hz] and columns (channels, then three axes) of each piece without a gap on either clock, on one grid."""
    table = np.stack([flight.values(name) for name in names], axis=-1)
    stamps = flight.time(names[0])
    good = np.isfinite(table).all(axis=1) & np.isfinite(stamps)
    stamps, table = _thinned(stamps[good], table[good])
    if stamps.size < _SHORTEST or time.size < _SHORTEST:
        return
    own = 1.0 / float(np.median(np.diff(stamps)))
    rate = min(own, 1.0 / float(np.median(np.diff(time))), _FASTEST)
    width = round(own / rate)
    if width > 1:  # vibration must not fold into the band
        from scipy.ndimage import uniform_filter1d  # a quarter of a second that most logs need not wait

        table = uniform_filter1d(table, width, axis=0)
    gap = max(_MAX_GAP, 2.5 / rate)
    for start, stop in common(unbroken(time, max_gap=gap), unbroken(stamps, max_gap=gap)):
        grid = start + np.arange(int((stop - start) * rate)) / rate
        if grid.size >= _SHORTEST:
            columns = [np.interp(grid, stamps, values) for values in table.T]
            yield rate, np.column_stack([*columns, reference(grid)])


def _agreements(
    pieces: Sequence[tuple[float, Array]],
    there: Sequence[int],
    axes: tuple[int, ...],
    *,
    band: tuple[float, float],
    window: float,
) -> dict[int, dict[int, _Agreement]]:
    """By channel and axis: how they agree in a band [Hz], over windows of that length [s].

    Args:
        pieces: as `_pieces` gives them.
        there: the channels' own axes, in the order of their columns.
    """
    k = len(there)
    spreads, correlations = [], []
    for rate, columns in pieces:
        if band[1] > 0.4 * rate or columns.shape[0] < max(_SHORTEST, window * rate):
            continue
        smooth = within(columns - columns.mean(axis=0), rate=rate, band=band)
        n = int(window * rate)
        for part in smooth[: smooth.shape[0] // n * n].reshape(-1, n, smooth.shape[1]):
            spreads.append(part.std(axis=0))
            centred = part - part.mean(axis=0)
            least = np.sqrt(np.finfo(np.float64).tiny)  # so that two still channels give 0, not 0 / 0
            length = np.sqrt(np.sum(centred**2, axis=0)) + least
            correlations.append((centred.T @ centred)[:k, k:] / np.outer(length[:k], length[k:]))
    made: dict[int, dict[int, _Agreement]] = {}
    if not spreads:
        return made
    spread, correlation = np.array(spreads), np.array(correlations)
    for row, i in enumerate(there):
        for j in axes:
            axis = spread[:, k + j]
            moves = (axis > _QUIET * np.median(axis)) & (spread[:, row] > 0.0) & (axis > 0.0)
            if moves.sum() < _FEWEST:
                continue
            ratio = spread[moves, row] / axis[moves]
            sigma = 1.4826 * float(np.median(np.abs(ratio - np.median(ratio)))) / np.sqrt(ratio.size)
            middle = float(np.median(correlation[moves, row, j]))
            made.setdefault(i, {})[j] = _Agreement(middle, float(np.copysign(np.median(ratio), middle)), sigma)
    return made


def _judged(
    flight: Flight,
    names: tuple[str, ...],
    i: int,
    by_axis: Mapping[int, _Agreement],
    kind: _Kind,
    owners: Mapping[int, _Agreement],
) -> list[Inconsistency]:
    """What the agreements of one channel with the three axes say; nothing where all is right or nothing can be told.

    An axis whose own channel follows it more closely (`owners`, by axis) is not exchanged: the two move together.
    """
    name, own = names[i], by_axis.get(i)
    best = max(by_axis, key=lambda j: abs(by_axis[j].correlation))
    at = by_axis[best]
    unit = _unit_of(abs(at.ratio), kind)
    number = f"ratio {at.ratio:.3g} ± {at.sigma:.1g}, correlation {at.correlation:+.2f}"
    if best != i:
        clear = abs(at.correlation) >= _TOGETHER and unit is not None
        if not clear or own is None or abs(own.correlation) > _APART * abs(at.correlation):
            return []
        if best in owners and abs(owners[best].correlation) > abs(at.correlation) + _CLOSER:
            return []
        other = names[best] or f"axis {best + 1}"
        text = (
            f"moves with {kind.reference} for {other}, not for {name} ({number}; with its own {own.correlation:+.2f}): "
            "axes seem to be exchanged"
        )
        return [Inconsistency(name, text, f"Name the right column in a mapping file: {name} = {{column = ...}}.")]
    if abs(at.correlation) < (_TOGETHER if unit is None else _RIGHT if not unit else _SCALED):
        return []
    if unit is None:
        text = f"is {at.ratio:.3g} ± {at.sigma:.1g} times {kind.reference}"
        sure = abs(at.correlation) > _SURE
        return [Inconsistency(name, text, "Check its unit.", decisive=at.ratio < 0.0)] if sure or at.ratio < 0.0 else []
    inside, sign = channel(name).unit, "-" if at.ratio < 0.0 else ""
    doubled = unit.startswith("/")
    words = [f"is {unit[1:]} times too small (converted twice?)" if doubled else f"looks like {unit}, not {inside}"]
    words = words * bool(unit) + ["has the other sign"] * bool(sign)
    text = f"{' and '.join(words)}, against {kind.reference} ({number})"
    mend = "Check the units of both sides." if doubled else unit_to_give(flight, name, sign=sign, looks_like=unit)
    return [Inconsistency(name, text, mend)] if words else []


def _unit_of(ratio: float, kind: _Kind) -> str | None:
    """The unit that a ratio speaks for: "" for the right one, "/57.3" for one converted twice, None for none."""
    near = {"": 1.0, **kind.units, **{f"/{factor:.3g}": 1.0 / factor for factor in kind.units.values()}}
    unit = min(near, key=lambda u: abs(np.log(ratio / near[u])))
    return unit if abs(np.log(ratio / near[unit])) < _SAME else None


def _weight(flight: Flight, made: set[str], attitude: _Attitude | None) -> list[Inconsistency]:
    """The accelerometers' mean along body z: what neither falls nor climbs away feels its weight, -9.81 m/s^2 level."""
    contradictions, gravity = [], flight.gravity or GRAVITY
    for (name,) in _families(flight, ("az",), made):
        stamps, values = _thinned(*_series(flight, name))
        if values.size < _SHORTEST:
            continue
        down = np.ones(values.size)
        if attitude is not None:
            # Third row, third column of body to local: how much of body z points down.
            down = to_body(interpolate(attitude.time, attitude.quaternion, stamps), np.array([0.0, 0.0, 1.0]))[:, 2]
        upright = np.abs(down) > _UPRIGHT
        felt = float(np.median(values[upright] / -down[upright])) if upright.sum() >= _SHORTEST else gravity
        for unit, weight in (("m/s^2", gravity), ("g", 1.0)):
            if abs(abs(felt) - weight) < 0.3 * weight and (unit, felt > 0.0) != ("m/s^2", True):
                words = ["looks like g, not m/s^2"] * (unit == "g") + ["has the other sign"] * (felt < 0.0)
                text = f"{' and '.join(words)}: its median is {-felt:+.3g} when level, expected {-gravity:.3g} m/s^2"
                mend = unit_to_give(flight, name, sign="-" * (felt < 0.0), looks_like=unit.removeprefix("m/s^2"))
                # Without an attitude it may have lain on its back.
                contradictions.append(Inconsistency(name, text, mend, decisive=attitude is not None))
    return contradictions
