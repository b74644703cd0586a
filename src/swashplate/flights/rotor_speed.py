"""Rotor speed from vibration: the line that a rotor leaves in motion capture, gyros or accelerometers, as a channel.

What is tracked is once per turn, unless `per_turn` says otherwise: a record cannot tell a rotor's first harmonic from
its second. Nor can it tell a line from one that the sampling folded: the step says where a folded one would lie, and a
line that falls where the motors' commands rise is refused.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.schema import QUATERNION
from swashplate.flights.spectral_lines import HOP, STANDS_OUT, WINDOW, SpectralLine, track

LOWEST = 8.0
"""Hz below which a helicopter moves by itself."""

HIGHEST = 0.47
"""Share of the sample rate up to which a line is looked for."""

PAIRS = (("ax", "ay"), ("ax_imu", "ay_imu"), ("p", "q"), ("p_imu", "q_imu"), ("phi", "theta"), QUATERNION)
"""Signals that lie across each other, the second to the right of the first."""

_GAP = 1.9  # usual steps between samples that make a gap
_FOLLOWS = 0.5
"""Correlation of a line with a motor's command below whose opposite the line is taken for a folded one."""

_MOVED = 2.0  # standard deviations of its own error by which a line must move for that test


def rotor_speed(
    flight: Flight, *, lines: Mapping[str, tuple[float, float]] | None = None, per_turn: float = 1.0
) -> Flight:
    """The flight with rotor speeds measured from vibration, as channels of a stream `rotor` every 0.1 s.

    Args:
        flight: as logged, at its native rate: a low-pass takes the line away.
        lines: by channel, the band [Hz] in which its line lies, signed: positive for a rotor that turns clockwise from
            above, negative for a counter-clockwise one. None: `omega_rotor`, the strongest line of either sense.
        per_turn: vibrations per turn, e.g. the number of blades where that line is tracked.

    Returns:
        The flight with `NAME` [rad/s, positive] and `NAME_sigma`, its standard deviation, for every line. The history's
        step has for each line the mean speed, its error, the signals, the decibels over the surroundings and where a
        folded line would lie.

    Raises:
        FlightError: no signals, a band that the sampling does not show, no line above its surroundings, two lines that
            cross, or a line that moves against the commands.
    """
    source = flight.provenance.source or None
    pairs: list[tuple[str, ...]] = [pair for pair in PAIRS if all(name in flight for name in pair)]
    pairs = [pair for pair in pairs if len({flight.stream_of(name) for name in pair}) == 1]
    if not pairs:
        raise FlightError(
            "has no pair of signals that lie across each other in one stream.",
            where=source,
            channel=" or ".join(f"{a} and {b}" for a, b, *_ in PAIRS[:5]),
            hint="Rotor lines are found in accelerometers, gyros, roll and pitch, or a quaternion.",
        )
    if not per_turn > 0.0:
        raise FlightError(f"{per_turn:g} vibrations per turn make no rotor speed.", where=source, channel="per_turn")
    made, told = dict(flight.streams), {}
    for name, band in (lines or {"omega_rotor": (0.0, 0.0)}).items():
        if name in flight:
            raise FlightError("is there already.", where=source, channel=name, hint="Choose another name for the line.")
        pair, rate, line = _best(flight, pairs, name, band if lines else None)
        _refuse_crossing(line, name, source)
        _refuse_folded(flight, line, name, rate, source)
        factor = 2.0 * np.pi / per_turn
        speed, sigma = factor * np.abs(line.frequency), factor * line.sigma
        made[f"rotor_{name}" if lines and len(lines) > 1 else "rotor"] = stream(
            line.time, {name: speed, f"{name}_sigma": sigma}, {name: "rad/s", f"{name}_sigma": "rad/s"}
        )
        told[name] = {
            "mean": float(speed.mean()),
            "sigma_of_mean": float(np.sqrt(np.mean(sigma**2) * WINDOW / (HOP * sigma.size))),
            "spread": float(speed.std()),
            "hertz": float(line.frequency.mean()),
            "signals": list(pair),
            "decibel": line.decibel,
            "score": line.score,
            "folded_from_hertz": sorted(float(line.frequency.mean()) + k * rate for k in (-1, 1)),
        }
    return flight.with_streams(made).done("rotor_speed", per_turn=per_turn, lines=told)


def _best(
    flight: Flight, pairs: list[tuple[str, ...]], name: str, band: tuple[float, float] | None
) -> tuple[tuple[str, ...], float, SpectralLine]:
    """The pair of signals in which the line stands out most, their rate, and the line."""
    source, candidates, shown = flight.provenance.source or None, [], []
    for pair in pairs:
        pieces, rate = _unbroken(flight, pair)
        shown.append(HIGHEST * rate)
        bands = [band] if band else [(LOWEST, HIGHEST * rate), (-HIGHEST * rate, -LOWEST)]
        for low, high in bands:
            if not (low < high and max(abs(low), abs(high)) <= HIGHEST * rate and high - low > 2.0 / WINDOW):
                continue
            line = track(pieces, rate, (low, high))
            if line is not None:
                candidates.append((pair, rate, line))
    if not candidates:
        asked = f"{band[0]:g} to {band[1]:g} Hz" if band else f"{LOWEST:g} Hz and more"
        raise FlightError(
            f"no line can be looked for at {asked}: the log's sampling shows up to {max(shown):.3g} Hz.",
            where=source,
            channel=name,
            hint=f"A band must rise, be wider than {2.0 / WINDOW:g} Hz and lie below that; the log must hold more than "
            f"{WINDOW:g} s without a gap.",
        )
    best = max(candidates, key=lambda item: item[2].score)
    if best[2].score < STANDS_OUT:
        raise FlightError(
            f"no line stands out: the best is {best[2].score:.1f} standard deviations above what noise gives, at "
            f"{best[2].frequency.mean():+.1f} Hz; expected {STANDS_OUT:g}.",
            where=source,
            channel=name,
            hint="Give its band, use the log as it was recorded (not low-passed), or log accelerometers faster.",
        )
    return best


def _unbroken(flight: Flight, pair: tuple[str, ...]) -> tuple[list[tuple[Array, Complex]], float]:
    """Stretches of even sampling as stamps and complex signal, and the rate [Hz].

    A sensor samples evenly; stamps that jitter by less than a step are the log's.
    """
    table, time = flight.array(pair), flight.time(pair[0])
    if pair == QUATERNION:
        from scipy.spatial.transform import Rotation

        angles = Rotation.from_quat(table[:, [1, 2, 3, 0]]).as_euler("ZYX")
        table = angles[:, [2, 1]]
    signal = np.asarray(table[:, 0] + 1j * table[:, 1])
    good = np.isfinite(signal)
    time, signal = time[good], signal[good]
    usual = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    cuts = np.flatnonzero(np.diff(time) > _GAP * usual) + 1
    parts = [part for part in zip(np.split(time, cuts), np.split(signal, cuts), strict=True) if part[0].size > 1]
    if not parts:
        return [], 1.0 / usual
    longest = max(parts, key=lambda part: part[0].size)[0]
    return parts, float((longest.size - 1) / (longest[-1] - longest[0]))


def _refuse_crossing(line: SpectralLine, name: str, source: str | None) -> None:
    if line.crossing:
        raise FlightError(
            f"two lines cross at {line.crossing[0]:.1f} s (and {len(line.crossing) - 1} times more): which is "
            "the rotor's after that cannot be told.",
            where=source,
            channel=name,
            hint="Give a band that holds one of them.",
        )


def _refuse_folded(flight: Flight, line: SpectralLine, name: str, rate: float, source: str | None) -> None:
    """Refuses a line that slows down when the motors are told to speed up: such is the image of one beyond the band."""
    motors = [motor for motor in flight.channels if motor.startswith("motor")]
    size = np.abs(line.frequency)
    if np.std(size) < _MOVED * float(np.median(line.sigma)):
        return
    by_motor = {}
    for motor in motors:
        time, command = flight.time(motor), flight.values(motor)
        total = np.concatenate([[0.0], np.cumsum(command)])
        first, last = (np.searchsorted(time, line.time + side * 0.5 * WINDOW) for side in (-1.0, 1.0))
        mean = (total[last] - total[first]) / np.maximum(last - first, 1)
        if np.std(mean) > 0.0:
            by_motor[motor] = float(np.corrcoef(mean, size)[0, 1])
    if by_motor and max(by_motor.values()) < _FOLLOWS and min(by_motor.values()) < -_FOLLOWS:
        motor = min(by_motor, key=lambda m: by_motor[m])
        raise FlightError(
            f"the line at {line.frequency.mean():+.1f} Hz falls where '{motor}' rises (correlation "
            f"{by_motor[motor]:.2f}): it is the image of a line at {rate - size.mean():.1f} Hz, which "
            f"{rate:.0f} samples a second fold.",
            where=source,
            channel=name,
            hint="Log the vibration faster, or take the speed from elsewhere.",
        )
