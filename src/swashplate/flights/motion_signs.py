"""Which way an input moves the aircraft, read off its responses, and whether its name promises the other way.

A command accelerates: its response, taken as an acceleration, is the gain of a rate's lag or of a rotor's mode times a
delay,

    K s / ((s + a) (1 + s / b)) e^(-tau s)    or    K s / (s^2 + 2 zeta omega s + omega^2) e^(-tau s),

with K of one sign or the other. Both are fitted, the phase tells them apart: a turned sign costs half a turn, which no
lag and no delay of a flying thing give back over a wide band. Where neither follows (a controller's answer is minus its
inverse and follows none), or both do (a narrow band), the sign is not told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array, Complex

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
        told: what the response says, 1 or -1; 0 where it cannot tell.
        low, high: band that was used [Hz].
        misfit: rms of the logarithm of the gain, and of the phase [rad], with the better sign and with the other one.
        odds: logarithm of the odds for the better sign.
    """

    output: str
    input: str
    expected: int
    told: int
    low: float
    high: float
    misfit: tuple[float, float]
    odds: float

    @property
    def wrong(self) -> bool:
        """Whether the response contradicts what the names promise."""
        return self.told == -self.expected

    @property
    def words(self) -> str:
        """What was found, in a sentence's part."""
        if not self.low < self.high:
            return f"it has no coherent band above {LOWEST / 2.0 / np.pi:g} Hz"
        band, (better, worse) = f"over {self.low:.2g}-{self.high:.2g} Hz", self.misfit
        both = f"{better:.2f} and {worse:.2f} rad off"
        if better > _FOLLOWS:
            return f"{band} neither sign follows an aircraft's response ({both}); a controller's answer looks like this"
        if not self.told:
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
            f"{SIGNED[self.told]}, expected {SIGNED[self.expected]} ({self.words}). {remedy} If it is "
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
    late = np.exp(-s * _DELAYS[:, None])
    weight = 1.0 / ((2.0 * _FORM) ** 2 + (0.0 if error is None else error**2))
    weight = np.broadcast_to(weight / np.sum(np.broadcast_to(weight, omega.shape)), omega.shape)
    gain = np.log(np.abs(acceleration)) - np.log(np.abs(forms))
    gain -= (gain @ weight)[:, None]
    turned = acceleration / (forms[:, None] * late)
    off = [
        float(np.sqrt(0.5 * np.min((gain**2 @ weight)[:, None] + np.angle(sign * turned) ** 2 @ weight)))
        for sign in (1.0, -1.0)
    ]
    best, better, worse = (1, *off) if off[0] <= off[1] else (-1, off[1], off[0])
    count = _PER_OCTAVE * float(np.log2(omega[-1] / omega[0]))
    odds = 0.5 * count * float(np.log((worse**2 + _FORM**2) / (better**2 + _FORM**2)))
    sure = odds >= _SURE and better <= _FOLLOWS
    return best if sure else 0, odds, (better, worse)
