"""`residuals`: what a model leaves of a flight, whether it is noise, and whether the inputs still explain it.

A model that has the whole answer to its inputs leaves residuals that no past input is correlated with; their own colour
is the noise's and tells nothing against it (Ljung 1999, System Identification, sec. 16.6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import ndtri

from swashplate.arrays import Array
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.validation.along_inputs import along_inputs
from swashplate.validation.saved import SavedWhole
from swashplate.validation.verification import Verification

if TYPE_CHECKING:
    import pandas as pd

_LEVEL = 0.01
"""Chance that a right model is found wanting, over all lags and pairs together; and each lag's for the drawn bounds."""
_SAMPLES_PER_LAG = 10
"""Samples that a lag needs at least."""
_LEAST_SPREAD = 0.05


@dataclass(frozen=True)
class Correlation:
    """Correlation of one output's residuals with themselves or with an input.

    Attributes:
        output: whose residuals. input: "" for their autocorrelation.
        lags: [s], shape (n,); positive where the input comes first.
        values: shape (n,). bound: of each lag at 99 %.
        limit: bound of the largest over all causal lags and pairs together at 99 %.
    """

    output: str
    input: str
    lags: Array
    values: Array
    bound: float
    limit: float

    @property
    def worst(self) -> tuple[float, float]:
        """Lag [s] and value of the largest correlation with what the input did before."""
        causal = np.flatnonzero(self.lags >= 0.0)
        place = causal[int(np.argmax(np.abs(self.values[causal])))]
        return float(self.lags[place]), float(self.values[place])


@dataclass(frozen=True, repr=False)
class Residuals(SavedWhole):
    """What a model leaves of a flight.

    Attributes:
        verification: the model along the flight.
        auto: autocorrelations, one an output. cross: correlations with the inputs, one a pair.
        samples: how many there are.
    """

    verification: Verification
    auto: tuple[Correlation, ...]
    cross: tuple[Correlation, ...]
    samples: int

    @property
    def unexplained(self) -> tuple[Correlation, ...]:
        """Pairs whose residuals an input still explains."""
        return tuple(c for c in self.cross if abs(c.worst[1]) > c.limit)

    @property
    def complete(self) -> bool:
        """Whether the inputs explain nothing of what the model leaves."""
        return not self.unexplained

    @property
    def white(self) -> dict[str, bool]:
        """By output, whether the residuals are uncorrelated in time: at most 5 % of the lags outside their bound."""
        return {c.output: bool(np.mean(np.abs(c.values[c.lags > 0.0]) > c.bound) <= 0.05) for c in self.auto}

    @property
    def headline(self) -> str:
        """The verdict in words."""
        if self.complete:
            return "COMPLETE: no input explains anything of what the model leaves (99 %, all lags and pairs together)."
        lines = [
            f"{c.output} from {c.input} ({c.worst[1]:+.2f} at {c.worst[0]:.3g} s, limit {c.limit:.2f})"
            for c in sorted(self.unexplained, key=lambda c: -abs(c.worst[1]) / c.limit)
        ]
        return f"INCOMPLETE: inputs still explain what the model leaves: {'; '.join(lines)}."

    def to_document(self) -> dict[str, object]:
        """The verdict and the largest correlation of each pair as JSON types."""
        pairs = [
            {"output": c.output, "input": c.input, "largest": c.worst[1], "lag_s": c.worst[0], "limit": c.limit}
            for c in self.cross
        ]
        return {"kind": "residuals", "verdict": self.headline, "white": self.white, "pairs": pairs}

    def to_dataframe(self) -> pd.DataFrame:
        """The residuals over time [s], one column an output, inside units."""
        import pandas as pd

        traces = self.verification.traces
        names = [o.output for o in self.verification.outputs]
        rows = np.concatenate([t.flight - t.model for t in traces])
        return pd.DataFrame(rows, index=np.concatenate([t.time for t in traces]), columns=names)

    def __repr__(self) -> str:
        colours = ", ".join(f"{name} {'white' if white else 'coloured'}" for name, white in self.white.items())
        lines = [f"Residuals of {self.verification.model.name}, {self.samples} samples", f"  {self.headline}"]
        lines.append(f"  {colours}. Colour is the noise's and speaks against no simulated model.")
        lines.append(f"  {'output':<12}{'input':<16}{'largest':>9}{'at [s]':>9}{'limit':>8}")
        for c in self.cross:
            lag, value = c.worst
            lines.append(f"  {c.output:<12}{c.input:<16}{value:>+9.3f}{lag:>9.3g}{c.limit:>8.3f}")
        return "\n".join(lines)


def residuals(
    model: Any, flights: Flight | Sequence[Flight], *, outputs: Sequence[str] | None = None, seconds: float = 1.0
) -> Residuals:
    """What a model leaves of a flight, and whether the inputs still explain it, as MATLAB's `resid` does.

    The residuals are those of the model flown along the recorded inputs, biases and start states solved for. The bounds
    allow for the colour of residuals and inputs; under feedback the input knows of past noise, which shows at negative
    lags and does not count. On the flight of the fit the verdict says little: take one that it has not seen.

    Args:
        model: a result, a vehicle or a state-space model.
        flights: conditioned.
        outputs: channels; all that both have where None.
        seconds: the longest lag [s].

    Raises:
        FlightError: an input that the flights lack, no output that both have, or too few samples for the lags.
        SwashError: a longest lag that is not positive.
    """
    if not seconds > 0.0:
        raise SwashError(f"is {seconds:g} s, expected more than 0.", channel="seconds")
    verification = along_inputs(model, flights, outputs=outputs)
    dt = float(np.median(np.diff(verification.traces[0].time)))
    lags = max(1, round(seconds / dt))
    samples = sum(t.time.size for t in verification.traces)
    if min(t.time.size for t in verification.traces) <= lags or samples < _SAMPLES_PER_LAG * lags:
        raise FlightError(
            f"has {samples} samples, expected at least {_SAMPLES_PER_LAG * lags} for lags up to {seconds:g} s.",
            where=verification.traces[0].source,
            hint="Ask for shorter lags, or give a longer flight.",
        )
    names = [o.output for o in verification.outputs]
    pairs = len(names) * len(verification.inputs)
    single = float(ndtri(1.0 - 0.5 * _LEVEL))
    all_together = float(ndtri(1.0 - 0.5 * _LEVEL / (pairs * (lags + 1))))
    left = {name: [_level(t.flight[:, k] - t.model[:, k]) for t in verification.traces] for k, name in enumerate(names)}
    inputs = {name: [_level(t.inputs[:, k]) for t in verification.traces] for k, name in enumerate(verification.inputs)}
    of_residuals, theirs = ({n: _correlation(rows, rows, lags) for n, rows in each.items()} for each in (left, inputs))
    times = np.asarray(dt * np.arange(-lags, lags + 1), dtype=np.float64)
    cross = []
    for output in names:
        for name in verification.inputs:
            pooled = max(_LEAST_SPREAD, float(of_residuals[output] @ theirs[name]))
            spread = float(np.sqrt(pooled / samples))
            values = _correlation(left[output], inputs[name], lags)
            cross.append(Correlation(output, name, times, values, single * spread, all_together * spread))
    bound = single / float(np.sqrt(samples))
    auto = tuple(Correlation(n, "", times[lags:], of_residuals[n][lags:], bound, bound) for n in names)
    return Residuals(verification, auto, tuple(cross), samples)


def _level(row: Array) -> Array:
    return np.asarray(row - np.mean(row), dtype=np.float64)


def _correlation(later: Sequence[Array], early: Sequence[Array], lags: int) -> Array:
    """Correlation of late(t) with early(t - lag) for lags from -`lags` to `lags`, products pooled over the pieces."""
    total = np.zeros(2 * lags + 1)
    for a, b in zip(later, early, strict=True):
        for k in range(-lags, lags + 1):
            total[k + lags] += float(a[k:] @ b[: a.size - k]) if k >= 0 else float(a[:k] @ b[-k:])
    size = float(np.sqrt(sum(float(a @ a) for a in later) * sum(float(b @ b) for b in early)))
    return total / max(size, np.finfo(float).tiny)
