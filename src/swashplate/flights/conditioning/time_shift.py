"""Time shift of an input against the motion it drives, and whether feedback allows to tell it.

The shift is the slope of the coherent phase between input and response, the constant part of the phase (integrations,
signs) left free: the equivalent delay of everything between the logged command and the logged motion. With a controller
in the loop the input answers the motion as well; then the phase is the loop's, not the aircraft's, and Sims' test shows
it: the motion depends on the input's future.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.filters import uniform_rate
from swashplate.flights.conditioning.regression import regress
from swashplate.flights.flight import Flight

_FEEDBACK = 1e-3  # probability below which the future of the input counts
_FUTURE_SHARE = 0.02  # of the explained power; significance alone is certain on a long record
_COHERENT = 0.5


@dataclass(frozen=True)
class TimeShift:
    """How much later the response comes than its input.

    Attributes:
        source: the input.
        response: the motion.
        lag: equivalent delay [s], positive where the response is later; NaN where nothing is coherent.
        sigma: standard error [s] from the coherence (Bendat and Piersol 2010, ch. 9).
        coherence: mean over the points used.
        points: frequencies that are coherent enough.
        feedback_p: probability of such a dependence on the input's future without feedback (Sims 1972, Wald test);
            NaN where the record cannot be tested (a few pure sines).
        future_share: what part of the variance that the past leaves goes with the input's future.
    """

    source: str
    response: str
    lag: float
    sigma: float
    coherence: float
    points: int
    feedback_p: float
    future_share: float

    @property
    def feedback(self) -> bool:
        return self.feedback_p < _FEEDBACK and self.future_share > _FUTURE_SHARE

    @property
    def acausal(self) -> bool:
        """The motion comes first: what the phase shows is the controller."""
        return bool(self.lag < -2.0 * self.sigma)

    @property
    def identifiable(self) -> bool:
        return self.points >= 4 and not self.feedback and not self.acausal

    def __str__(self) -> str:
        head = f"{self.source} -> {self.response}: "
        if self.points < 4:
            return head + f"no time shift: coherence above {_COHERENT:g} at {self.points} frequencies only"
        number = f"{1e3 * self.lag:.0f} ± {1e3 * self.sigma:.0f} ms (coherence {self.coherence:.2f})"
        if self.feedback:
            return head + (
                f"not identifiable: the input answers the motion ({100 * self.future_share:.0f} % of what the past "
                f"leaves goes with the input's future, p = {self.feedback_p:.1g}); the phase slope {number} is "
                "the loop's. Fly an independent excitation on top of the controller."
            )
        if self.acausal:
            return head + f"not identifiable: the motion leads the input, the phase slope {number} is the controller's"
        return head + number


def _future(source: Array, response: Array, *, rate: float) -> tuple[float, float]:
    """Sims' test: probability without feedback, and the share that the future explains of what the past leaves."""
    from scipy.stats import chi2

    step, reach = max(1, round(0.05 * rate)), 6
    lags = np.arange(-reach, reach + 1) * step  # positive: the input's past
    margin = reach * step
    n = source.size
    y = response[margin : n - margin]
    # The response's own past stands for all that lies further back (Geweke, Meese and Dent 1983).
    own = np.column_stack([response[margin - lag : n - margin - lag] for lag in lags[lags > 0]])
    x = np.column_stack([*(source[margin - lag : n - margin - lag] for lag in lags), own])
    future = np.flatnonzero(lags < 0)
    try:
        both = regress([(x, y)], lag=round(rate))
    except FlightError:  # a few sines or a constant: past and future are one and the same
        return float("nan"), float("nan")
    past = regress([(np.delete(x, future, axis=1), y)], lag=round(rate))
    b, c = both.values[future], both.covariance[np.ix_(future, future)]
    wald = float(b @ np.linalg.solve(c, b))
    share = (both.determination - past.determination) / (1.0 - past.determination)
    return float(chi2.sf(wald, future.size)), max(0.0, share)


def time_shift(flight: Flight, source: str, *, response: str, band: tuple[float, float] = (0.3, 6.0)) -> TimeShift:
    """The shift between one input and one response.

    Args:
        flight: conditioned; its longest segment is used.
        source: input channel.
        response: motion channel it drives (a rate).
        band: [Hz].

    Raises:
        FlightError: channels missing, or an input that does not move.
    """
    from scipy.signal import csd, welch

    rate = uniform_rate(flight)
    part = max(flight.split(), key=lambda piece: piece.duration)
    u, y = part.values(source), part.values(response)
    for name, values in ((source, u), (response, y)):
        if not np.ptp(values) > 0:
            raise FlightError(
                f"is constant ({values[0]:g}), so nothing can be timed by it.",
                where=flight.provenance.source or None,
                channel=name,
            )
    # Nine windows at 50 % overlap; a window must hold two periods of the lowest frequency.
    length = max(round(2.0 / band[0] * rate), u.size // 5)
    if u.size < 2 * length:
        raise FlightError(
            f"the longest segment lasts {u.size / rate:.1f} s, expected at least {2 * length / rate:.1f} s.",
            where=flight.provenance.source or None,
            hint="Use a longer record or raise the lower corner of the band.",
        )
    frequency, guu = welch(u, fs=rate, nperseg=length)
    _, gyy = welch(y, fs=rate, nperseg=length)
    _, guy = csd(u, y, fs=rate, nperseg=length)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    gamma2 = np.abs(guy) ** 2 / (guu * gyy)
    used = inside & (gamma2 > _COHERENT)
    points = int(used.sum())
    windows = (2 * u.size / length - 1) / 1.1  # half-overlapping Hann windows are nearly independent
    lag = sigma = float("nan")
    if points >= 4:
        omega, phase = 2 * np.pi * frequency[used], np.unwrap(np.angle(guy[used]))
        weight = 2.0 * windows * gamma2[used] / np.maximum(1e-6, 1.0 - gamma2[used])
        x = np.column_stack([np.ones_like(omega), -omega])
        inverse = np.linalg.inv(x.T @ (weight[:, None] * x))
        fit = inverse @ x.T @ (weight * phase)
        # A phase that is no straight line (dynamics) widens the bound.
        misfit = float(np.sum(weight * (phase - x @ fit) ** 2) / max(1, points - 2))
        lag, sigma = float(fit[1]), float(np.sqrt(inverse[1, 1] * max(1.0, misfit)))
    # No band-pass here: a zero-phase filter looks into the future by itself.
    feedback_p, share = _future(u - u.mean(), y - y.mean(), rate=rate)
    mean = float(np.mean(gamma2[used])) if points else float(np.max(gamma2[inside], initial=0.0))
    return TimeShift(source, response, lag, sigma, mean, points, feedback_p, share)
