"""Rotor speed: what the log has of it, else from the line that a rotor leaves in motion capture, gyros, accelerometers.

What is tracked is once per turn, unless `per_turn` says otherwise: a record cannot tell a rotor's first harmonic from
its second. Nor can it tell a line from one that the sampling folded. Where no band is given, a line is the main rotor's
only if no other line that a main rotor may have would look the same, and only if the aircraft has a main rotor.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError, SwashError
from swashplate.flights.aircraft_kind import aircraft_kind
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.sweeps import sweeps
from swashplate.flights.schema import QUATERNION
from swashplate.flights.spectral_lines import HOP, STANDS_OUT, WINDOW, SpectralLine, track

LOWEST = 8.0
"""Hz below which a helicopter moves by itself."""

HIGHEST = 0.47
"""Share of the sample rate up to which a line is looked for."""

FASTEST_TURN = 80.0
"""Turns a second that no main rotor of a helicopter reaches: 4800 rpm. The smallest ones make 72."""

FASTEST_LINE = 700.0
"""Hz that no motor, gear or rotor of a small helicopter reaches."""

MAIN = "omega_rotor"

PAIRS = (("ax", "ay"), ("ax_imu", "ay_imu"), ("p", "q"), ("p_imu", "q_imu"), ("phi", "theta"), QUATERNION)
"""Signals that lie across each other, the second to the right of the first."""

_GAP = 1.9  # usual steps between samples that make a gap
_FOLLOWS = 0.5
"""Correlation of a line with a motor's command below whose opposite the line is taken for a folded one."""

_MOVED = 2.0  # standard deviations of its own error by which a line must move for that test
_CLEAR = 2.0  # usual errors of a line while the rotor runs
_RUNS = 0.1  # of the usual speed: outside, the rotor spools up or down, or stands


def rotor_speed(
    flight: Flight, *, lines: Mapping[str, tuple[float, float]] | None = None, per_turn: float = 1.0
) -> Flight:
    """The flight with rotor speeds measured from vibration, as channels of a stream `rotor` every 0.1 s.

    Where no lines are asked for and the log has the main rotor's speed, that is told, and vibration is not asked.

    Args:
        flight: as logged, at its native rate: a low-pass takes the line away.
        lines: by channel, the band [Hz] in which its line lies, signed: positive for a rotor that turns clockwise from
            above, negative for a counter-clockwise one. None: `omega_rotor`, the strongest line of either sense.
        per_turn: vibrations per turn, e.g. the number of blades where that line is tracked.

    Returns:
        The flight with `NAME` [rad/s, positive] and `NAME_sigma`, its standard deviation, for every line, while the
        rotor runs: without spool-up and standstill. The history's step has for each line the mean speed, its error, the
        signals, the decibels over the surroundings, from when to when it runs, where folded lines would lie, and
        remarks. A speed that the log has is told in the same step, with `logged`.

    Raises:
        FlightError: no signals, an aircraft without a main rotor, a band that the sampling does not show, no line above
            its surroundings, two lines that cross, a line that the sampling may have folded, that wanders, or that
            moves against the commands.
    """
    source = flight.provenance.source or None
    if not per_turn > 0.0:
        raise FlightError(f"{per_turn:g} vibrations per turn make no rotor speed.", where=source, channel="per_turn")
    if lines is None:
        if (logged := _logged(flight)) is not None:
            return flight.done("rotor_speed", per_turn=per_turn, lines={MAIN: logged})
        _refuse_without_rotor(flight)
        flight = _without_dead(flight)
    pairs: list[tuple[str, ...]] = [pair for pair in PAIRS if all(name in flight for name in pair)]
    pairs = [pair for pair in pairs if len({flight.stream_of(name) for name in pair}) == 1]
    if not pairs:
        raise FlightError(
            "has no pair of signals that lie across each other in one stream.",
            where=source,
            channel=" or ".join(f"{a} and {b}" for a, b, *_ in PAIRS[:5]),
            hint="Rotor lines are found in accelerometers, gyros, roll and pitch, or a quaternion.",
        )
    # A sweep is a line too, and so are its harmonics: it is left out.
    swept = [(sweep.start, sweep.stop) for sweep in sweeps(flight) if 2.0 * sweep.high > LOWEST]
    streams, found_lines = dict(flight.streams), {}
    for name, band in (lines or {MAIN: (0.0, 0.0)}).items():
        if name in flight:
            raise FlightError("is there already.", where=source, channel=name, hint="Choose another name for the line.")
        pair, rate, line = _best(flight, pairs, swept, name, band if lines else None, per_turn)
        _refuse_crossing(line, name, source)
        if not lines:
            _refuse_folded(flight, line, name, rate, per_turn)
        remarks = _against_commands(flight, line, name, rate, sure=bool(lines))
        factor = 2.0 * np.pi / per_turn
        speed, sigma = factor * np.abs(line.frequency), factor * line.sigma
        part = _running(speed, sigma)
        if not lines:
            _refuse_wandering(speed[part], name, source)
        time, speed, sigma, frequency = line.time[part], speed[part], sigma[part], line.frequency[part]
        streams[f"rotor_{name}" if lines and len(lines) > 1 else "rotor"] = stream(
            time, {name: speed, f"{name}_sigma": sigma}, {name: "rad/s", f"{name}_sigma": "rad/s"}
        )
        found_lines[name] = {
            "mean": float(speed.mean()),
            "sigma_of_mean": float(np.sqrt(np.mean(sigma**2) * WINDOW / (HOP * sigma.size))),
            "spread": float(speed.std()),
            "hertz": float(frequency.mean()),
            "runs": [float(time[0]), float(time[-1])],
            "signals": list(pair),
            "decibel": line.decibel,
            "score": line.score,
            "folded_from_hertz": sorted(float(frequency.mean()) + k * rate for k in (-1, 1)),
            "remarks": [*remarks, *_motor_words(flight, float(speed.mean()))],
        }
    return flight.with_streams(streams).done("rotor_speed", per_turn=per_turn, lines=found_lines)


def _running(speed: Array, sigma: Array) -> slice:
    """From the first to the last place where the rotor has its usual speed, which is where its line is clearest."""
    order = np.argsort(speed)
    weight = np.cumsum(1.0 / sigma[order] ** 2)
    usual = speed[order][np.searchsorted(weight, 0.5 * weight[-1])]
    near = np.abs(speed - usual) < _RUNS * usual
    # Before a rotor turns, the path is noise, and may lie anywhere.
    runs = np.flatnonzero(near & (sigma < _CLEAR * np.median(sigma[near])))
    return slice(int(runs[0]), int(runs[-1]) + 1)


def _logged(flight: Flight) -> dict[str, Any] | None:
    """The main rotor's speed as the log has it; None where it has none, or a sensor that tells nothing."""
    if MAIN not in flight:
        return None
    time, speed = flight.time(MAIN), flight.values(MAIN)
    good = np.isfinite(speed) & (speed > 0.0)
    if not good.any():
        return None
    time, speed = time[good], speed[good]
    part = _running(speed, np.ones(speed.size))
    time, speed = time[part], speed[part]
    return {
        "mean": float(speed.mean()),
        "spread": float(speed.std()),
        "runs": [float(time[0]), float(time[-1])],
        "signals": [flight.stream_of(MAIN)],
        "logged": True,
        "remarks": _motor_words(flight, float(speed.mean())),
    }


def _without_dead(flight: Flight) -> Flight:
    """The flight without a rotor speed that is nothing but zeros: no sensor is there."""
    kept = {home: data.drop_vars(MAIN, errors="ignore") for home, data in flight.streams.items()}
    return flight.with_streams({home: data for home, data in kept.items() if data.data_vars})


def _motors(flight: Flight) -> dict[str, float]:
    """Mean speeds of motors [rad/s] that turn, as their speed controllers tell them."""
    speeds = {name: flight.values(name) for name in flight.channels if name.startswith("omega_motor_")}
    return {name: float(np.mean(v[v > 0.0])) for name, v in speeds.items() if np.any(v > 0.0)}


def _motor_words(flight: Flight, speed: float) -> list[str]:
    return [
        f"{name}, from the speed controller, is {motor:.4g} rad/s: {motor / speed:.3g} turns of the motor a turn"
        for name, motor in _motors(flight).items()
    ]


def _telemetry(flight: Flight) -> str:
    """What the log itself says of speeds, as a sentence."""
    speeds = [f"{name} {motor:.4g} rad/s ({motor / (2.0 * np.pi):.3g} Hz)" for name, motor in _motors(flight).items()]
    return f" The motors' speed controllers tell {', '.join(speeds)}." if speeds else ""


def _refuse_without_rotor(flight: Flight) -> None:
    kind = aircraft_kind(flight)
    if kind is not None and not kind.main_rotors:
        raise FlightError(
            f"the log is of {kind.noun} ({kind.source}), which has no main rotor.{_telemetry(flight)}",
            where=flight.provenance.source or None,
            channel=MAIN,
            hint="A line of something else is measured where you say what it is and where it lies: "
            "--settings line=NAME=LOW..HIGH.",
        )


def _best(
    flight: Flight,
    pairs: list[tuple[str, ...]],
    swept: list[tuple[float, float]],
    name: str,
    band: tuple[float, float] | None,
    per_turn: float,
) -> tuple[tuple[str, ...], float, SpectralLine]:
    """The pair of signals in which the line stands out most, their rate, and the line."""
    source, candidates, shown = flight.provenance.source or None, [], []
    for pair in pairs:
        pieces, rate = _unbroken(flight, pair, swept)
        shown.append(HIGHEST * rate)
        highest = min(HIGHEST * rate, FASTEST_TURN * per_turn)
        bands = [band] if band else [(LOWEST, highest), (-highest, -LOWEST)]
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
            f"{WINDOW:g} s without a gap and without a sweep.",
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


def _unbroken(
    flight: Flight, pair: tuple[str, ...], swept: list[tuple[float, float]]
) -> tuple[list[tuple[Array, Complex]], float]:
    """Stretches of even sampling outside of sweeps as stamps and complex signal, and the rate [Hz].

    A sensor samples evenly; stamps that jitter by less than a step are the log's.
    """
    table, time = flight.array(pair), flight.time(pair[0])
    if pair == QUATERNION:
        from scipy.spatial.transform import Rotation

        angles = Rotation.from_quat(table[:, [1, 2, 3, 0]]).as_euler("ZYX")
        table = angles[:, [2, 1]]
    signal = np.asarray(table[:, 0] + 1j * table[:, 1])
    good = np.isfinite(signal)
    for start, stop in swept:
        good &= (time < start - WINDOW) | (time > stop + WINDOW)
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


def _refuse_wandering(speed: Array, name: str, source: str | None) -> None:
    """Refuses a line that no rotor in flight leaves: governors and motors hold their speed within a few percent."""
    mean, share = float(speed.mean()), float(speed.std() / speed.mean())
    if share > _RUNS:
        raise FlightError(
            f"the strongest line wanders by {100.0 * share:.0f} % about {mean:.4g} rad/s: it is no rotor's.",
            where=source,
            channel=name,
            hint="Take the stretch in which the rotor runs (FILE@START-STOP), or give the band in which its line lies.",
        )


def _refuse_folded(flight: Flight, line: SpectralLine, name: str, rate: float, per_turn: float) -> None:
    """Refuses a line that would look the same if the main rotor turned at another speed that a main rotor may have."""
    hertz, highest = float(np.median(line.frequency)), FASTEST_TURN * per_turn
    count = int(highest / rate) + 1
    others = [hertz + k * rate for k in range(-count, count + 1) if k]
    others = sorted((other for other in others if LOWEST <= abs(other) <= highest), key=abs)
    if others:
        listed = ", ".join(f"{other:+.1f}" for other in others)
        raise FlightError(
            f"the line at {hertz:+.1f} Hz may be folded: at {rate:.4g} samples a second lines at {listed} Hz look the "
            f"same, and a main rotor may have any of them.{_telemetry(flight)}",
            where=flight.provenance.source or None,
            channel=name,
            hint=f"Log the vibration at {2.0 * highest:.3g} Hz or more, log the rotor's speed (RPM sensor, ESC), or "
            "give the band in which the line lies: --settings line=NAME=LOW..HIGH.",
        )


def _against_commands(flight: Flight, line: SpectralLine, name: str, rate: float, *, sure: bool) -> list[str]:
    """Whether a line slows down when the motors are told to speed up, as the image of a faster one does.

    So does a rotor whose governor lets it sag under load: with a band given (`sure`) it is remarked, else refused.
    """
    size = np.abs(line.frequency)
    image = rate - float(size.mean())
    if np.std(size) < _MOVED * float(np.median(line.sigma)) or image > FASTEST_LINE:
        return []
    by_motor = {}
    for motor in (each for each in flight.channels if each.startswith("motor")):
        time, command = flight.time(motor), flight.values(motor)
        total = np.concatenate([[0.0], np.cumsum(command)])
        first, last = (np.searchsorted(time, line.time + side * 0.5 * WINDOW) for side in (-1.0, 1.0))
        mean = (total[last] - total[first]) / np.maximum(last - first, 1)
        if np.std(mean) > 0.0:
            by_motor[motor] = float(np.corrcoef(mean, size)[0, 1])
    if not by_motor or max(by_motor.values()) >= _FOLLOWS or min(by_motor.values()) >= -_FOLLOWS:
        return []
    motor = min(by_motor, key=lambda m: by_motor[m])
    text = (
        f"the line at {line.frequency.mean():+.1f} Hz falls where '{motor}' rises (correlation {by_motor[motor]:.2f}): "
        f"the rotor sags under load, or it is the image of a line at {image:.1f} Hz, which {rate:.0f} samples a second "
        "fold"
    )
    if sure:
        return [text]
    raise FlightError(
        f"{text}.{_telemetry(flight)}",
        where=flight.provenance.source or None,
        channel=name,
        hint="Log the vibration faster, take the speed from elsewhere, or give the band in which the line lies.",
    )


_LINE = re.compile(r"(?P<name>[a-z]\w*)=(?P<low>[-+]?[\d.]+)\.\.(?P<high>[-+]?[\d.]+)")


def lines_of(texts: Sequence[str]) -> dict[str, tuple[float, float]] | None:
    """`omega_upper=-40..-30` each as bands [Hz] by channel; None for no text.

    Raises:
        SwashError: for a text that is no line.
    """
    bands = {}
    for text in texts:
        match = _LINE.fullmatch(text)
        try:
            bands[match["name"]] = (float(match["low"]), float(match["high"]))  # pyrefly: ignore[unsupported-operation]
        except (TypeError, ValueError):
            hint = "For example --settings line=omega_upper=-40..-30."
            raise SwashError(f"'{text}' is no line.", channel="line", hint=hint) from None
    return bands or None


def line_words(lines: Mapping[str, Any]) -> Iterator[str]:
    """What `rotor_speed` found, a text each."""
    for name, line in lines.items():
        start, stop = line["runs"]
        if line.get("logged"):
            yield (
                f"{name}: {line['mean']:.4g} rad/s on average, spread {line['spread']:.2g}, from {start:.1f} to "
                f"{stop:.1f} s, as the log has it. Vibration was not asked; --settings line=... asks it."
            )
        else:
            folded = " or ".join(f"{hertz:+.1f}" for hertz in line["folded_from_hertz"])
            yield (
                f"{name}: {line['mean']:.1f} ± {line['sigma_of_mean']:.2g} rad/s on average, spread "
                f"{line['spread']:.2g}, from {start:.1f} to {stop:.1f} s; line at {line['hertz']:+.2f} Hz in "
                f"{', '.join(line['signals'])}, {line['decibel']:.0f} dB over its surroundings. A line at {folded} Hz "
                "would look the same."
            )
        yield from (f"! {text}." for text in line["remarks"])
