"""Which way an input moves the aircraft, read off its responses, and whether its name promises the other way.

A command accelerates: its response, taken as an acceleration, is the gain of a rate's lag or of a rotor's mode times a
delay,

    K s / ((s + a) (1 + s / b)) e^(-tau s)    or    K s / (s^2 + 2 zeta omega s + omega^2) e^(-tau s),

with K of one sign or the other. Both are fitted, the phase tells them apart: a turned sign costs half a turn, which no
lag and no delay of a flying thing give back over a wide band. Where neither follows (a controller's answer is minus its
inverse and follows none), or both do (a narrow band), the sign is not told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.flights.channel_names import SET_POINT, STICK
from swashplate.flights.excitation import OUTSIDE, excitations, of_inputs
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import Sweep
from swashplate.flights.readers.options import unit_to_give
from swashplate.flights.schema import VARIANTS, axis_of

LOWEST = 2.0 * np.pi * 0.3
"""rad/s: below it speed and attitude act back on the rate, and turn its phase by up to half a turn in hover."""
_DAMPINGS: Array = np.geomspace(0.05, 300.0, 24)
"""1/s: a."""
_LAGS: tuple[float, ...] = (*np.geomspace(3.0, 200.0, 9), np.inf)
"""1/s: b, an actuator's or a rotor's."""
_MODES = tuple((zeta, omega) for zeta in (0.1, 0.3, 0.7) for omega in np.geomspace(5.0, 120.0, 12))
_DELAYS: Array = np.linspace(0.0, 0.25, 26)
"""s: more is no delay of a flying thing."""
_FORM = 0.1
"""rad: how well so few numbers follow any aircraft; smaller misfits count as this."""
_FOLLOWS = 0.35
"""rad: misfit of the better sign up to which a response is one of these forms. Measured: 0.04 to 0.23 on nine swept
axes, 0.4 and more on controllers' answers and where a loop's answer and the sweep mix."""
_PER_OCTAVE = 4.0
"""Lines of a response that count as independent: a form that is off stays off for a quarter of an octave."""
_SURE = 5.0
"""Logarithm of the odds from which the sign is told: 150 to 1."""
FEWEST, LINES = 8, 50
"""Lines that a response must have, and that are looked at."""
SIGNED = {1: "positive", -1: "negative"}


@dataclass(frozen=True)
class ResponseSign:
    """The sign of one response.

    Attributes:
        output, input: names.
        expected: what the names promise, 1 or -1.
        sense: what the response says, 1 or -1; 0 where it cannot tell.
        low, high: band that was used [Hz].
        misfit: rms of the logarithm of the gain, and of the phase [rad], with the better sign and with the other one.
        odds: logarithm of the odds for the better sign.
    """

    output: str
    input: str
    expected: int
    sense: int
    low: float
    high: float
    misfit: tuple[float, float]
    odds: float

    @property
    def wrong(self) -> bool:
        """Whether the response contradicts what the names promise."""
        return self.sense == -self.expected

    @property
    def facts(self) -> str:
        """What was found, in a sentence's part."""
        if not self.low < self.high:
            return f"it has no coherent band above {LOWEST / 2.0 / np.pi:g} Hz"
        band, (better, worse) = f"over {self.low:.2g}-{self.high:.2g} Hz", self.misfit
        both = f"{better:.2f} and {worse:.2f} rad off"
        if better > _FOLLOWS:
            return f"{band} neither sign follows an aircraft's response ({both}); a controller's answer looks like this"
        if not self.sense:
            return f"{band} both signs follow ({both}): the band is too narrow to tell"
        turned, kept = (better, worse) if self.wrong else (worse, better)
        return f"{band} it is {turned:.2f} rad off an aircraft's response with the sign turned, {kept:.2f} rad as it is"

    def problem(self, remedy: str) -> str:
        """That the sign is wrong, and what mends it.

        Args:
            remedy: the option that turns the input's sign, a sentence.
        """
        return (
            f"{self.output} / {self.input} has the wrong sign: a positive {self.input} makes {self.output} "
            f"{SIGNED[self.sense]}, expected {SIGNED[self.expected]} ({self.facts}). {remedy} If it is "
            f"{self.output} that counts the other way, turn the unit of that channel instead. If nothing but the "
            f"controller moved {self.input}, no sign mends it."
        )


def sign_of(
    omega: Array, response: Complex, *, integrations: int, error: Array | None = None
) -> tuple[int, float, tuple[float, float]]:
    """The sign of a response, 1, -1 or 0 for untold, the logarithm of its odds, and the misfits of both [rad].

    Args:
        omega: [rad/s], shape (n,), rising.
        response: H, shape (n,).
        integrations: how often an acceleration is integrated to what is measured.
        error: random error of each line; none where it is None.
    """
    s: Complex = np.asarray(1j * omega, dtype=np.complex128)
    acceleration = response * s**integrations
    forms = np.stack(
        [
            *(s / ((s + a) * (1.0 + s / b)) for a in _DAMPINGS for b in _LAGS),
            *(s / (s**2 + 2.0 * zeta * w * s + w**2) for zeta, w in _MODES),
        ]
    )
    lags = np.exp(-s * _DELAYS[:, None])
    weight = 1.0 / ((2.0 * _FORM) ** 2 + (0.0 if error is None else error**2))
    weight = np.broadcast_to(weight / np.sum(np.broadcast_to(weight, omega.shape)), omega.shape)
    gain = np.log(np.abs(acceleration)) - np.log(np.abs(forms))
    gain -= (gain @ weight)[:, None]
    turned = acceleration / (forms[:, None] * lags)
    off = [
        float(np.sqrt(0.5 * np.min((gain**2 @ weight)[:, None] + np.angle(sign * turned) ** 2 @ weight)))
        for sign in (1.0, -1.0)
    ]
    best, better, worse = (1, *off) if off[0] <= off[1] else (-1, off[1], off[0])
    count = _PER_OCTAVE * float(np.log2(omega[-1] / omega[0]))
    odds = 0.5 * count * float(np.log((worse**2 + _FORM**2) / (better**2 + _FORM**2)))
    sure = odds >= _SURE and better <= _FOLLOWS
    return best if sure else 0, odds, (better, worse)


_MOTION: Mapping[str, Mapping[str, int]] = {
    "roll": {"p": 1, "phi": 1},
    "pitch": {"q": 1, "theta": 1},
    "yaw": {"r": 1, "psi": 1},
    "climb": {"az": -1, "w": -1, "vz": -1},
}
"""Signs of what moves when the aircraft rolls right, pitches nose up, turns its nose right and climbs."""
_COMMANDS: Mapping[str, Mapping[str, int]] = {
    "mixer_roll": {"roll": 1},
    "mixer_pitch": {"pitch": 1},
    "mixer_yaw": {"yaw": 1},
    "mixer_collective": {"climb": 1},
    "servo_roll": {"roll": 1},
    "servo_pitch": {"pitch": -1},
    # Lower rotor clockwise from above: its torque turns the body the other way, nose left.
    "motor_lower": {"yaw": -1, "climb": 1},
    "motor_upper": {"yaw": 1, "climb": 1},
    "lateral": {"roll": 1},
    "pedal": {"yaw": 1},
    "collective": {"climb": 1},
    "stick_roll": {"roll": 1},
    "stick_lateral": {"roll": 1},
    "stick_pedal": {"yaw": 1},
    "stick_collective": {"climb": 1},
    "stick_throttle": {"climb": 1},
}
INTEGRATIONS: Mapping[str, int] = {"az": 0, "w": 1, "vz": 1, "p": 1, "q": 1, "r": 1, "phi": 2, "theta": 2, "psi": 2}
"""How often the acceleration that a command makes is integrated to this motion."""


def base_motion(name: str) -> str:
    """A motion without the suffix of a second opinion: p of `p_imu`."""
    base, _, variant = name.partition("_")
    return base if variant in VARIANTS and variant != "demand" else name


def has_sense(input: str) -> bool:
    """Whether a command's name promises a motion."""
    return input in _COMMANDS


def expected_sense(output: str, input: str) -> int:
    """The sign of a motion that a positive command makes, 1 or -1; 0 where the names promise none."""
    promised = {
        motion: sense * sign
        for axis, sense in _COMMANDS.get(input, {}).items()
        for motion, sign in _MOTION[axis].items()
    }
    return promised.get(base_motion(output), 0)


_MOTIONS = (("p",), ("q",), ("r",), ("az", "w", "vz"))
"""What is asked of roll, pitch, yaw and climb: the first that the log has."""
_BESIDE = {"motor_lower": "motor_upper", "motor_upper": "motor_lower"}
"""Commands of which each makes two motions, and the other one's is taken away."""
_COHERENT, _WINDOW, _SHARE, _HIGHEST = 0.6, 8.0, 0.35, 10.0
"""Coherence of a line that counts, length of a window [s], and highest line: over the rate, and [Hz]."""
_AROUND = 1.0  # s about a sweep
_LOOPS = "a loop makes it and no sweep moved it (`swash respond` asks sticks and set-points too)"


def input_signs(flight: Flight, sweeps: Sequence[Sweep]) -> tuple[tuple[ResponseSign, str], ...]:
    """The signs of all commands whose names promise one, and why one is not told.

    Args:
        flight: as logged. sweeps: that were told or seen in it.
    """
    signs = []
    for name in flight.channels:
        if has_sense(name) and _moves(flight.values(name)):
            outputs = [next((n for n in kind if n in flight and expected_sense(n, name)), "") for kind in _MOTIONS]
            asked = [output for output in outputs if output]
            part, why = _driven(flight, name, sweeps, asked) if asked else (None, "")
            for output in asked:
                sign = ResponseSign(output, name, expected_sense(output, name), 0, 0.0, 0.0, (np.nan, np.nan), 0.0)
                signs.append((sign, why) if part is None else _judged(part, sign))
    return tuple(signs)


def sign_words(sign: ResponseSign, why: str) -> str:
    """One of them as a line."""
    if not sign.sense:
        return f"{sign.input} to {sign.output}: not told, {why}"
    named = "NOT as its name says" if sign.wrong else "as its name says"
    return f"{sign.input} to {sign.output}: {SIGNED[sign.sense]}, {named} ({sign.low:.2g}-{sign.high:.2g} Hz)"


def sign_problem(flight: Flight, sign: ResponseSign) -> str:
    """What is wrong with one whose sign is, and the remedy."""
    return sign.problem(unit_to_give(flight, sign.input, sign="-"))


def _driven(flight: Flight, name: str, sweeps: Sequence[Sweep], outputs: Sequence[str]) -> tuple[Flight | None, str]:
    """The part of a flight in which something from outside moved a command; or why there is none."""
    of_axis = [s for s in sweeps if s.channel == name or (axis_of(name) and axis_of(name) in s.axis.split())]
    if of_axis:
        longest = max(of_axis, key=lambda s: s.stop - s.start)
        return flight.between(longest.start - _AROUND, longest.stop + _AROUND), ""
    if min(flight.time(n).size for n in (name, *outputs)) < 4 * FEWEST or flight.stop <= flight.start:
        return None, "the record is too short"
    if not name.startswith(STICK) and any(n.endswith(SET_POINT) for n in flight.channels):
        return None, _LOOPS
    excited = of_inputs(excitations(flight, (name,), outputs=outputs)).get(name)
    if excited is not None and excited.kind in OUTSIDE:
        return flight, ""
    return None, "nothing is known to have moved it from outside" if excited is None else excited.why.rstrip(".")


def _moves(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return bool(finite.size and np.ptp(finite) > 0.0)


def _judged(flight: Flight, sign: ResponseSign) -> tuple[ResponseSign, str]:
    beside = _BESIDE.get(sign.input, "")
    inputs = (sign.input, *([beside] if beside in flight else []))
    omega, h = _coherent_response(flight, inputs, sign.output)
    if omega.size < FEWEST:
        return sign, f"it moves {sign.output} coherently at too few lines"
    sense, odds, misfit = sign_of(omega, h, integrations=INTEGRATIONS[sign.output])
    low, high = float(omega[0] / 2.0 / np.pi), float(omega[-1] / 2.0 / np.pi)
    sign = replace(sign, sense=sense, low=low, high=high, misfit=misfit, odds=odds)
    return sign, "" if sense else sign.facts


def _coherent_response(flight: Flight, inputs: Sequence[str], output: str) -> tuple[Array, Complex]:
    """Response of an output to the first of the inputs, the others held still, where it is coherent: [rad/s], H."""
    signals = [(flight.time(n), flight.values(n)) for n in (*inputs, output)]
    signals = [(time[np.isfinite(values)], values[np.isfinite(values)]) for time, values in signals]
    nothing = np.zeros(0), np.zeros(0, dtype=np.complex128)
    if min(time.size for time, _ in signals) < 4 * FEWEST:
        return nothing
    dt = max(float(np.median(np.diff(time))) for time, _ in signals)
    first, last = max(float(time[0]) for time, _ in signals), min(float(time[-1]) for time, _ in signals)
    grid = np.arange(first, last, dt)
    if grid.size < 4 * FEWEST:
        return nothing
    table = np.stack([np.interp(grid, time, values) for time, values in signals])
    length = int(min(grid.size / 2, max(_WINDOW / dt, 8 * FEWEST)))
    frequency = np.asarray(np.fft.rfftfreq(length, dt), dtype=np.float64)
    spectra = _cross_spectra(table, length, dt)
    lines = np.flatnonzero((2.0 * np.pi * frequency >= LOWEST) & (frequency <= min(_SHARE / dt, _HIGHEST)))
    if lines.size < FEWEST:
        return nothing
    spread = np.geomspace(float(frequency[lines[0]]), float(frequency[lines[-1]]), LINES)
    lines = lines[np.unique(np.searchsorted(frequency[lines], spread).clip(max=lines.size - 1))]
    spectra, k = spectra[lines], len(inputs)
    others = spectra[:, 1:k, 1:k] + 1e-12 * np.eye(k - 1)
    left = spectra[:, [0, k]][:, :, [0, k]]
    if k > 1:  # what the others explain is taken away
        left = left - spectra[:, [0, k], 1:k] @ np.linalg.solve(others, spectra[:, 1:k][:, :, [0, k]])
    power, cross, total = left[:, 0, 0].real, left[:, 0, 1], left[:, 1, 1].real
    known = (power > 1e-6 * spectra[:, 0, 0].real) & (total > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        known &= np.abs(cross) ** 2 / (power * total) >= _COHERENT
        h = cross / power
    return 2.0 * np.pi * frequency[lines][known], h[known]


def _cross_spectra(table: Array, length: int, dt: float) -> Complex:
    """Densities of conj(a) b of signals (k, n) by Welch's method, (lines, k, k): Hann windows that overlap by half.

    Each is taken without its straight line. Not SciPy's, whose import takes as long as all else of an inspection.
    """
    pieces = np.lib.stride_tricks.sliding_window_view(table, length, axis=1)[:, :: length - length // 2]
    time = np.arange(length) - 0.5 * (length - 1)
    slope = pieces @ time / (time @ time)
    level = pieces - pieces.mean(axis=2, keepdims=True) - slope[..., None] * time
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
    lines = np.fft.rfft(level * window, axis=2)
    power = np.einsum("anl,bnl->lab", lines.conj(), lines, optimize=True)
    return np.asarray(power * 2.0 * dt / (lines.shape[1] * np.sum(window**2)))
