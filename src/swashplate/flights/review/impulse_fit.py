"""An impulse response from target and motion, and how sure it is: least squares with a prior, windows left out in turn.

The prior is of responses that decay (TC kernel: Chen, Ohlsson and Ljung 2012, "On the estimation of transfer functions,
regularizations and Gaussian processes - revisited", Automatica 48); its scale and decay are those under which the
record is most likely. PID-Analyzer and PIDtoolbox deconvolve by Wiener's filter and average windows; here parts of the
record are left out in turn, and what changes is the band (jackknife: Efron and Tibshirani 1993, ch. 11).

Where the target answers the motion too, another signal that moves by itself stands for it: what it explains of target
and motion is fitted (instruments, two-stage least squares: Soderstrom and Stoica 1989, ch. 8).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from swashplate.arrays import Array

_MOST = 12  # parts that are left out in turn: three windows of a minute each hold slow gusts together
_DECAYS = (0.03, 0.06, 0.12, 0.25)  # s
_SCALES = (0.1, 1.0, 10.0)
_RIDGE = 1e-4  # of the instruments' mean power: sticks hold nothing above a few Hz


@dataclass(frozen=True)
class Excerpt:
    """A stretch of the target with what lies before and behind it, of the motion, and of what stands for the target."""

    target: Array
    motion: Array
    instrument: Array | None = None


@dataclass(frozen=True)
class _Sums:
    """Products over windows: of the target at all lags with itself and the motion, and of the instruments with both."""

    square: Array
    cross: Array
    power: float
    count: int
    instruments: Array
    to_target: Array
    to_motion: Array

    def __add__(self, other: _Sums) -> _Sums:
        return _Sums(*(a + b for a, b in zip(vars(self).values(), vars(other).values(), strict=True)))

    def __sub__(self, other: _Sums) -> _Sums:
        return _Sums(*(a - b for a, b in zip(vars(self).values(), vars(other).values(), strict=True)))


class ImpulseFit:
    """Impulse responses of windows.

    Args:
        windows: of the record.
        before, after: lags that are looked at, in samples: so far may the motion come before its target, or behind it.
        rate: [Hz].
        instruments: whether another signal stands for the target.
    """

    def __init__(
        self, windows: Sequence[Excerpt], before: int, after: int, rate: float, *, instruments: bool = False
    ) -> None:
        self.windows, self.before, self.after, self.rate = windows, before, after, rate
        self.instruments = instruments
        self.explained = 0.0

    def by_instruments(self) -> ImpulseFit:
        """The same with the instruments."""
        other = ImpulseFit(self.windows, self.before, self.after, self.rate, instruments=True)
        other.parts = self.parts
        return other

    @cached_property
    def parts(self) -> list[_Sums]:
        """Sums of neighbouring windows."""
        groups = np.array_split(np.arange(len(self.windows)), min(_MOST, len(self.windows)))
        return [self._sums([self.windows[i] for i in group]) for group in groups]

    @property
    def explained_target(self) -> float:
        """Share of the target's power that the instruments explain; 0 where there are none."""
        sums = self.total
        if not sums.instruments.any():
            return 0.0
        x = sums.to_target[:, self.before]
        return float(x @ np.linalg.solve(_ridged(sums.instruments), x)) / float(sums.square[self.before, self.before])

    def early(self) -> tuple[float, float]:
        """How much of the step stands before its target, by more than the log's own steps blur, and its error."""
        parts = np.array([float(np.sum(h[: self.before - 2])) for h in self._solved(0)])
        return float(parts[0]), float(jackknife(parts[1:, None])[0])

    def steps(self) -> list[Array]:
        """Step responses: of all windows, then without each part. `explained` is known behind it."""
        impulses = self._solved(self.before)
        sums, h = self.total, impulses[0]
        square, cross = sums.square[self.before :, self.before :], sums.cross[self.before :]
        self.explained = float(2.0 * h @ cross - h @ square @ h) / sums.power
        return [np.cumsum(h) - 0.5 * h for h in impulses]  # a sample stands for half a step around it

    def _sums(self, windows: Sequence[Excerpt]) -> _Sums:
        lags = self.before + self.after + 1
        square, row = np.zeros((lags, lags)), np.zeros(lags)
        sums = _Sums(square, row, 0.0, 0, square, square, row)
        for window in windows:
            x, y = _lagged(window.target, lags), window.motion
            z = x[:, :0] if window.instrument is None else _lagged(window.instrument, lags)
            others = (z.T @ z, z.T @ x, z.T @ y) if z.size else (square, square, row)
            sums += _Sums(x.T @ x, x.T @ y, float(y @ y), y.size, *others)
        return sums

    @cached_property
    def total(self) -> _Sums:
        """Sums of all windows."""
        total = self.parts[0]
        for part in self.parts[1:]:
            total += part
        return total

    def _solved(self, first: int) -> list[Array]:
        """Impulse responses from a lag on: of all windows, then without each part."""
        total = self.total
        decay, scale, noise = self.prior
        kernel = scale * _kernel(self._lag(first), decay, self.rate)
        rows = [self._equations(total, first), *(self._equations(total - part, first) for part in self.parts)]
        return [_mean(gram, cross, kernel, noise) for gram, cross in rows]

    def _lag(self, first: int) -> Array:
        """Times of the lags from one on [s], shape (n,)."""
        return np.asarray((np.arange(self.before + self.after + 1 - first) + first - self.before) / self.rate)

    def _equations(self, sums: _Sums, first: int) -> tuple[Array, Array]:
        """Normal equations of the lags from one on."""
        if not self.instruments:
            return sums.square[first:, first:], sums.cross[first:]
        x = sums.to_target[:, first:]
        projected = np.linalg.solve(_ridged(sums.instruments), np.column_stack([x, sums.to_motion]))
        gram = x.T @ projected[:, :-1]
        return np.asarray(0.5 * (gram + gram.T)), np.asarray(x.T @ projected[:, -1])

    @cached_property
    def prior(self) -> tuple[float, float, float]:
        """Decay [s] and scale of the prior, and the noise's variance, under which the record is most likely."""
        sums, first, lag = self.total, self.before, self._lag(self.before)
        gram, cross = self._equations(sums, first)
        axes = {}
        for decay in _DECAYS:
            shape = _kernel(lag, decay, self.rate)
            root = np.linalg.cholesky(shape + 1e-9 * shape.max() * np.eye(lag.size))
            values, turned = np.linalg.eigh(root.T @ gram @ root)
            axes[decay] = values, turned.T @ (root.T @ cross)
        decay, scale, noise = _DECAYS[1], 1.0, 0.3 * sums.power / sums.count
        for _ in range(2):
            choices = [(d, s) for d in _DECAYS for s in _SCALES]
            decay, scale = max(choices, key=partial(_likely, axes, noise))
            h = _mean(gram, cross, scale * _kernel(lag, decay, self.rate), noise)
            rest = sums.power - 2.0 * float(h @ sums.cross[first:]) + float(h @ sums.square[first:, first:] @ h)
            noise = max(rest, 1e-6 * sums.power) / sums.count
        return decay, scale, noise


def _lagged(signal: Array, lags: int) -> Array:
    """A signal at all lags, the latest first, shape (n, lags)."""
    return np.lib.stride_tricks.sliding_window_view(signal, lags)[:, ::-1]


def _ridged(matrix: Array) -> Array:
    return matrix + _RIDGE * np.trace(matrix) / len(matrix) * np.eye(len(matrix))


def _likely(axes: Mapping[float, tuple[Array, Array]], noise: float, choice: tuple[float, float]) -> float:
    """Marginal log likelihood of a decay and a scale, but for what is the same for all of them.

    Args:
        axes: by decay, eigenvalues of the normal equations and correlations in their axes, shape (n,).
    """
    (values, projected), scale = axes[choice[0]], choice[1]
    wide = 1.0 + scale / noise * np.maximum(values, 0.0)
    return float(0.5 * scale / noise**2 * np.sum(projected**2 / wide) - 0.5 * np.sum(np.log(wide)))


def _mean(gram: Array, cross: Array, kernel: Array, noise: float) -> Array:
    """The impulse response that a prior and the normal equations make most likely."""
    inner = gram @ kernel
    inner[np.diag_indices_from(inner)] += noise
    return np.asarray(kernel @ np.linalg.solve(inner, cross))


def _kernel(lag: Array, decay: float, rate: float) -> Array:
    """Covariance of an impulse response that decays away from its target; before and after it independently."""
    decayed = np.exp(-np.maximum(np.abs(lag)[:, None], np.abs(lag)[None, :]) / decay)
    same = (lag[:, None] < 0.0) == (lag[None, :] < 0.0)
    return np.asarray(np.where(same, decayed, 0.0) / (rate * decay) ** 2)


def jackknife(rows: Array) -> Array:
    """Standard errors from estimates with parts left out in turn, shape (parts, n)."""
    count = len(rows)
    return np.asarray(np.sqrt((count - 1) / count * np.sum((rows - rows.mean(axis=0)) ** 2, axis=0)))


def quantile(count: int) -> float:
    """Student's 97.5 % for so many parts."""
    from scipy.stats import t  # a third of a second to import

    return float(t.ppf(0.975, count - 1))
