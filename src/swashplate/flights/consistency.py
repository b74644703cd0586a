"""Do the channels of a log tell one motion? Rates against attitude, velocities against positions, weight against az.

Each measured rate is held against the three that the attitude's change gives, in windows and in a band that both sides
know well (`agreement`). Where the two move together the ratio is 1; 57.3, -1, or a better agreement with another axis
is a wrong unit, sign or axis, and any other factor that noise and chance do not explain is a wrong scale. Where an axis
does not move, nothing is said. Kinematics only (Klein and Morelli 2006, ch. 10): it holds for any vehicle, and with the
heading unknown for roll and pitch.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.agreement import BANDS, SHORTEST, Agreement, Reference, agreements, pieces, series, thinned
from swashplate.flights.conditioning.attitude import continuous, interpolate, quaternion_from_euler, to_body
from swashplate.flights.conditioning.derive import GRAVITY, body_rates, differentiate
from swashplate.flights.flight import Flight
from swashplate.flights.readers.options import unit_to_give
from swashplate.flights.schema import ATTITUDE, LOGGED_UNIT, POSITION, QUATERNION, RATES, VARIANTS, VELOCITY, channel

UNCHECKED = "consistency_not_checked"
"""Step of a history by which the user takes a flight as it is."""

_LOCAL = ("vx", "vy", "vz")
_TOGETHER = 0.8  # correlation from which two channels show one motion, whatever their ratio
_RIGHT = 0.7  # the same where the ratio's size is right: noise has neither the size nor, window by window, the sign
_SCALED = 0.5  # the same where the ratio is a unit's: noise that large would leave no correlation at all
_SURE = 0.95  # correlation from which a ratio that is no unit's is worth a word
_APART = 0.8  # of its correlation with another axis: below, a channel does not belong to its own
_SAME = 0.4  # of the logarithm: a ratio between 0.67 and 1.5 is 1 (real sensors' filters: 0.8 to 1.2)
_CORRECTED = 0.1  # the same for what an estimator's corrections part its velocity from its place (0.05 in EKF3's logs)
_EXACT = 0.05  # the same for a unit that the log's format fixes: nothing less makes one doubt it
_FIXED = frozenset({"ardupilot", "blackbox", "ulog", "px4log", "coax56", "nanobench"})
"""Readers of formats that fix the units of their channels."""
_CLOSER = 0.03  # of correlation: more than chance makes between a channel and a copy of it
_STEEPEST = 0.5 * np.pi + 0.02  # rad: no pitch angle is larger
_UPRIGHT = 0.5  # cosine of the tilt beyond which the weight along body z says little


@dataclass(frozen=True)
class Inconsistency:
    """One channel that contradicts the others.

    Attributes:
        channel: the channel.
        text: what is wrong, with the number.
        mend: the option that mends it.
        decisive: whether work on the flight is refused until it is mended.
        against: channels that it was held against: one of them may be what is wrong.
        scale: the factor by which the channel is off, and its standard error; empty where that is not what is wrong.
    """

    channel: str
    text: str
    mend: str
    decisive: bool = True
    against: tuple[str, ...] = ()
    scale: tuple[float, ...] = ()

    def __str__(self) -> str:
        return f"{self.channel}: {self.text}. {self.mend}"


def consistency(flight: Flight) -> tuple[Inconsistency, ...]:
    """Every contradiction between the flight's measured channels; none where nothing can be held against anything."""
    inner = {name for step in flight.history if step.operation == "derive" for name in step.details.get("derived", ())}
    contradictions: list[Inconsistency] = []
    if (attitude := _attitude(flight, contradictions)) is not None:
        for names in _families(flight, RATES, inner):
            findings = _compared(flight, names, attitude.time, attitude.turning, attitude.axes, _RATE)
            # Pitch without roll: on its back, q and the change of theta have opposite signs.
            contradictions += [replace(one, decisive=one.decisive and attitude.axes != (1,)) for one in findings]
    if all(name in flight for name in POSITION):
        place = [thinned(*series(flight, name)) for name in POSITION]

        def local(grid: Array) -> Array:
            return _moving(place, grid)

        def body(grid: Array) -> Array:
            assert attitude is not None
            return to_body(attitude.during(grid), local(grid))

        complete = attitude is not None and len(attitude.axes) == 3
        for names, reference in ((_LOCAL, local), *([(VELOCITY, body)] if complete else [])):
            measured = tuple(name if name in flight and name not in inner else "" for name in names)
            if any(measured):
                contradictions += _compared(flight, measured, place[0][0], reference, (0, 1, 2), _SPEED)
    return (*contradictions, *_weight(flight, inner, attitude if attitude and len(attitude.axes) > 1 else None))


def refuse_inconsistent(flight: Flight, *, used: Collection[str] | None = None) -> tuple[Inconsistency, ...]:
    """Refuses a flight whose channels contradict each other beyond doubt, unless the user has taken it as it is.

    Args:
        used: the channels that are worked on; what is wrong with others stops nothing. None: all.

    Returns:
        The contradictions that concern these channels and stop nothing.

    Raises:
        FlightError: naming the channels, the ratios and the option that mends them.
    """
    findings = consistency(flight)
    if used is not None:
        findings = tuple(finding for finding in findings if {finding.channel, *finding.against} & set(used))
    taken = any(step.operation == UNCHECKED for step in flight.history)
    decisive = [finding for finding in findings if finding.decisive]
    if decisive and not taken:
        texts = [f"{'' if i == 0 else one.channel + ': '}{one.text}" for i, one in enumerate(decisive)]
        raise FlightError(
            f"{'; '.join(texts)}.",
            where=flight.provenance.source or None,
            channel=decisive[0].channel,
            hint=" ".join(dict.fromkeys(finding.mend for finding in decisive))
            + " To use the log as it is: --as-logged (in Python condition(check=False)).",
        )
    return findings


# ---- what is held against what ---------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Kind:
    """Units that a channel of this kind is often logged in: what a value must be divided by, by unit.

    The reference is made of some channels, by axis.
    """

    units: Mapping[str, float]
    reference: str
    made_of: tuple[tuple[str, ...], ...]


_DEGREE = 180.0 / np.pi
_RATE = _Kind(
    {"deg/s": _DEGREE, "rpm": 30.0 / np.pi},
    "what the attitude's change gives",
    tuple((angle, *QUATERNION) for angle in ATTITUDE),
)
_SPEED = _Kind(
    {"mm/s": 1e3, "cm/s": 1e2, "ft/s": 1.0 / 0.3048, "km/h": 3.6},
    "what the position's change gives",
    tuple((place,) for place in POSITION),
)


def _families(flight: Flight, bases: Sequence[str], inner: set[str]) -> list[tuple[str, ...]]:
    """The measured channels of a kind, axis by axis ("" where one is missing), with second opinions."""
    families = []
    for variant in ("", *VARIANTS):
        names = tuple(f"{name}_{variant}" if variant else name for name in bases)
        if variant != "demand" and any(name in flight for name in names):
            families.append(tuple(name if name in flight and name not in inner else "" for name in names))
    return [names for names in families if any(names)]


@dataclass(frozen=True)
class _Attitude:
    """Stamps, quaternions, and the axes about which they tell the turn (without heading no yaw)."""

    time: Array
    quaternion: Array
    axes: tuple[int, ...]

    def during(self, times: Array) -> Array:
        """Quaternions at rising times [s], shape (n, 4), from the samples around them alone: a log has many pieces."""
        first = max(0, int(np.searchsorted(self.time, times[0], side="right")) - 1)
        last = int(np.searchsorted(self.time, times[-1], side="right")) + 1
        return interpolate(self.time[first:last], self.quaternion[first:last], times)

    def turning(self, grid: Array) -> Array:
        """Body rates [rad/s] at the times of a uniform grid, shape (n, 3)."""
        return body_rates(self.during(grid), rate=1.0 / float(grid[1] - grid[0]))


def _attitude(flight: Flight, contradictions: list[Inconsistency]) -> _Attitude | None:
    """The flight's attitude, None where it has none; angles that are degrees are said and put right."""
    if all(name in flight for name in QUATERNION) and len({flight.stream_of(n) for n in QUATERNION}) == 1:
        table = flight.array(QUATERNION)
        good = np.isfinite(table).all(axis=1) & (np.linalg.norm(table, axis=1) > 0.5)
        if good.sum() < 2:
            return None
        free = continuous(table[good])  # of sign flips: a mean over a block is near the attitude of its middle
        return _Attitude(*thinned(flight.time(QUATERNION[0])[good], free), (0, 1, 2))
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
                against=ATTITUDE,
            )
        )
        table = np.radians(table)
    for column in (0, 2):  # a mean over the wrap of roll or yaw would be no angle
        if np.ptp(table[:, column]) > np.pi:
            table[:, column] = np.unwrap(table[:, column])
    stamps, table = thinned(flight.time(there[0])[good], table)
    axes = tuple(range(len(there))) if len(tilts) == 2 else tuple(tilts)
    return _Attitude(stamps, quaternion_from_euler(table), axes)


def _moving(place: Sequence[tuple[Array, Array]], grid: Array) -> Array:
    at = np.stack([np.interp(grid, time, values) for time, values in place], axis=-1)
    return differentiate(at, rate=1.0 / float(grid[1] - grid[0]))


# ---- the comparison --------------------------------------------------------------------------------------------------
def _compared(
    flight: Flight, names: tuple[str, ...], time: Array, reference: Reference, axes: tuple[int, ...], kind: _Kind
) -> list[Inconsistency]:
    """Findings on the channels `names` (one an axis, "" where missing) against `reference(grid)`, shape (n, 3)."""
    contradictions = []
    for home in dict.fromkeys(flight.stream_of(name) for name in names if name):
        here = tuple(name if name and flight.stream_of(name) == home else "" for name in names)
        parts = list(pieces(flight, [name for name in here if name], time, reference))
        there = [i for i, name in enumerate(here) if name]
        both = [agreements(parts, there, axes, band=band, window=window) for band, window in BANDS]
        for i, name in enumerate(here):
            pairs = [by_row[i] for by_row in both if i in by_row]
            if name and pairs:
                # The band in which the two sides know each other best: noise of a derivative, drift of a gyroscope.
                clearest = max(pairs, key=lambda by_axis: max(abs(at.correlation) for at in by_axis.values()))
                every = next(by_row for by_row in both if by_row.get(i) is clearest)
                owners = {j: by_axis[j] for j, by_axis in every.items() if j in by_axis}
                of_axis = [by_axis[i] for by_axis in pairs if i in by_axis]
                slight = _CORRECTED if _one_estimate(flight, name, kind.made_of[i]) else 0.0
                wrong = _judged(flight, here, i, clearest, kind, owners) or _scaled(name, of_axis, kind, slight)
                contradictions += [replace(one, against=kind.made_of[i]) for one in wrong]
    return contradictions


def _judged(
    flight: Flight,
    names: tuple[str, ...],
    i: int,
    by_axis: Mapping[int, Agreement],
    kind: _Kind,
    owners: Mapping[int, Agreement],
) -> list[Inconsistency]:
    """What the agreements of one channel with the three axes say; nothing where all is right or nothing can be told.

    An axis whose own channel follows it more closely (`owners`, by axis) is not exchanged: the two move together.
    """
    name, its = names[i], by_axis.get(i)
    best = max(by_axis, key=lambda j: abs(by_axis[j].correlation))
    at = by_axis[best]
    fixed = flight.provenance.reader in _FIXED and LOGGED_UNIT not in flight[name].attrs
    unit = _unit_of(abs(at.ratio), kind, within=_EXACT if fixed else _SAME)
    if unit and not at.scaled:
        unit = ""  # noise on one side makes any ratio
    number = f"ratio {at.ratio:.3g} ± {at.sigma:.1g}, correlation {at.correlation:+.2f}"
    if best != i:
        clear = abs(at.correlation) >= _TOGETHER and unit is not None
        if not clear or its is None or abs(its.correlation) > _APART * abs(at.correlation):
            return []
        if best in owners and abs(owners[best].correlation) > abs(at.correlation) + _CLOSER:
            return []
        other = names[best] or f"axis {best + 1}"
        text = (
            f"moves with {kind.reference} for {other}, not for {name} ({number}; with its own {its.correlation:+.2f}): "
            "axes seem to be exchanged"
        )
        return [Inconsistency(name, text, f"Name the right column in a mapping file: {name} = {{column = ...}}.")]
    if abs(at.correlation) < (_TOGETHER if unit is None else _RIGHT if not unit else _SCALED):
        return []
    if unit is None:
        text = f"is {at.ratio:.3g} ± {at.sigma:.1g} times {kind.reference}"
        return [Inconsistency(name, text, "Check its unit.")] if at.ratio < 0.0 else []
    inside, sign = channel(name).unit, "-" if at.ratio < 0.0 else ""
    doubled = unit.startswith("/")
    faults = [f"is {unit[1:]} times too small (converted twice?)" if doubled else f"looks like {unit}, not {inside}"]
    faults = faults * bool(unit) + ["has the other sign"] * bool(sign)
    text = f"{' and '.join(faults)}, against {kind.reference} ({number})"
    mend = "Check the units of both sides." if doubled else unit_to_give(flight, name, sign=sign, looks_like=unit)
    return [Inconsistency(name, text, mend)] if faults else []


def _one_estimate(flight: Flight, name: str, others: Sequence[str]) -> bool:
    """Whether an autopilot's estimator wrote all of it, in units that its format fixes."""
    of_format = flight.provenance.reader in _FIXED
    return of_format and all(other in flight and flight.stream_of(other) == flight.stream_of(name) for other in others)


def _scaled(name: str, pairs: Sequence[Agreement], kind: _Kind, slight: float) -> list[Inconsistency]:
    """A factor between a channel and its own axis that is none of 1, nor of a filter: alike in every band.

    One whose logarithm is below `slight` is none.
    """
    sure = [at for at in pairs if at.scaled and at.correlation > _SURE]
    if not sure:
        return []
    at = min(sure, key=lambda one: one.sigma / one.ratio)
    if abs(np.log(at.ratio)) < slight or any(other.excludes(at.ratio) for other in pairs):
        return []
    text = f"is {at.ratio:.4g} ± {at.sigma:.1g} times {kind.reference}: one of the two has a wrong scale"
    mend = f"If it is {name}'s, correct the log (in a mapping file: factor = {1.0 / at.ratio:.4g}); what is fitted to "
    return [Inconsistency(name, text, f"{mend}{name} is off by as much.", decisive=False, scale=(at.ratio, at.sigma))]


def _unit_of(ratio: float, kind: _Kind, *, within: float) -> str | None:
    """The unit that a ratio speaks for: "" for the right one, "/57.3" for one converted twice, None for none.

    Args:
        within: how far its logarithm may be from that of a unit; from 1 it may be as far as filters make it.
    """
    near = {"": 1.0, **kind.units, **{f"/{factor:.3g}": 1.0 / factor for factor in kind.units.values()}}
    unit = min(near, key=lambda u: abs(np.log(ratio / near[u])))
    return unit if abs(np.log(ratio / near[unit])) < (within if unit else _SAME) else None


def _weight(flight: Flight, inner: set[str], attitude: _Attitude | None) -> list[Inconsistency]:
    """The accelerometers' mean along body z: what neither falls nor climbs away feels its weight, -9.81 m/s^2 level."""
    contradictions, gravity = [], flight.gravity or GRAVITY
    for (name,) in _families(flight, ("az",), inner):
        stamps, values = thinned(*series(flight, name))
        if values.size < SHORTEST:
            continue
        down = np.ones(values.size)
        if attitude is not None:
            # Third row, third column of body to local: how much of body z points down.
            down = to_body(attitude.during(stamps), np.array([0.0, 0.0, 1.0]))[:, 2]
        upright = np.abs(down) > _UPRIGHT
        felt = float(np.median(values[upright] / -down[upright])) if upright.sum() >= SHORTEST else gravity
        for unit, weight in (("m/s^2", gravity), ("g", 1.0)):
            if abs(abs(felt) - weight) < 0.3 * weight and (unit, felt > 0.0) != ("m/s^2", True):
                faults = ["looks like g, not m/s^2"] * (unit == "g") + ["has the other sign"] * (felt < 0.0)
                text = f"{' and '.join(faults)}: its median is {-felt:+.3g} when level, expected {-gravity:.3g} m/s^2"
                mend = unit_to_give(flight, name, sign="-" * (felt < 0.0), looks_like=unit.removeprefix("m/s^2"))
                # Without an attitude it may have lain on its back.
                contradictions.append(Inconsistency(name, text, mend, decisive=attitude is not None))
    return contradictions
