"""Bands of predictions: where a model's flights may go, and how much of an unseen flight they hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from swashplate.arrays import Array
from swashplate.flights.schema import channel as known
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation import block_bootstrap

SHARES = (50.0, 95.0)
"""Percent of the flights that each band promises to hold."""
SURE = max(SHARES)
"""Percent of the band whose failure is part of a verdict."""
FEWEST_DRAWS = 39
"""Between the outermost of so many paths lie 95 % of the flights that the same law made, exactly."""
_BY_CHANCE = 0.05
"""Chance of a widening where nothing is wrong."""
NEAR = 3.0
"""Points between what a band promises and what it holds that are called kept."""
_WORDS = {
    "holds": "as promised",
    "too narrow": "too narrow: this motion is larger than the model and the gusts of its fit explain",
    "too wide": "wider than this flight needs",
    "cannot be judged": "the flights are too short to tell",
}


class BandedRecord(NamedTuple):
    """A record at one horizon, from starts at `time` [s] (s,).

    Attributes:
        below: how many of the `paths` lie below what came (s, 12).
        variance: of the paths about the prediction, and `by_parameters`, that of drawn models without gusts (s, 12).
        missed: square of what came less the prediction (s, 12).
        wider: times that the paths were taken from the prediction (12,), see `widening`.
    """

    time: Array
    below: Array
    paths: int
    variance: Array
    by_parameters: Array
    missed: Array
    wider: Array


@dataclass(frozen=True)
class Band:
    """How much of the unseen flights one band of one channel holds.

    Attributes:
        channel, unit: which. horizon: seconds ahead.
        promised, held: percent of the starts inside; low, high: 95 % interval of `held` (block bootstrap over the
            flight; NaN with fewer than three blocks).
        sigma: root mean square of the paths about the prediction [unit].
        by_parameters: percent of its square that the draws of the parameters brought; the rest is the start, the gusts
            to come and the sensors' noise.
        starts: how many.
        off: root mean square of the predictions' errors, over `sigma`.
        wider: how many times as wide as its fit says the band was made, see `widening`; the most of any record.
    """

    channel: str
    unit: str
    horizon: float
    promised: float
    held: float
    low: float
    high: float
    sigma: float
    by_parameters: float
    starts: int
    off: float = math.nan
    wider: float = 1.0

    @property
    def level(self) -> str:
        """ "holds" within `NEAR` points; "too narrow" or "too wide" where the interval lies wholly beyond them;
        otherwise, and without an interval, "cannot be judged"."""
        if not math.isfinite(self.low):
            return "cannot be judged"
        if abs(self.held - self.promised) <= NEAR:
            return "holds"
        if self.high < self.promised - NEAR:
            return "too narrow"
        return "too wide" if self.low > self.promised + NEAR else "cannot be judged"

    @property
    def summary_text(self) -> str:
        """What the band holds, and so."""
        scatter = f" ({self.low:.0f} to {self.high:.0f})" if math.isfinite(self.low) else ""
        text = f"the {self.promised:g} % band holds {self.held:.0f} %{scatter}"
        return f"{self.channel}, {self.horizon:g} s ahead: {text}, {_WORDS[self.level]}"

    @property
    def warning(self) -> str:
        """Where it is too narrow: by how much; "" for another."""
        if self.level != "too narrow":
            return ""
        known = "" if self.by_parameters else " How sure the model's numbers are is not in it."
        return (
            f"{self.channel}: do not trust the {self.promised:g} % band. It holds {self.held:.0f} % of the flight "
            f"[{self.low:.0f} to {self.high:.0f}], because errors are {self.off:.1f} times as large as it says.{known}"
        )


def _share_text(band: Band) -> str:
    scatter = f" [{band.low:.0f} to {band.high:.0f}]" if math.isfinite(band.low) else ""
    return f"{band.held:.0f}{scatter}"


ROWS: tuple[tuple[str, Callable[[Band, Band], str]], ...] = (
    ("50 % band holds", lambda half, _: _share_text(half)),
    ("so", lambda half, _: half.level),
    ("95 % band holds", lambda _, most: _share_text(most)),
    ("so", lambda _, most: most.level),
    ("sigma", lambda half, _: f"{half.sigma * known(half.channel).shown_factor:.3g}"),
    ("unit", lambda half, _: known(half.channel).shown_unit),
    ("% by parameters", lambda half, _: f"{half.by_parameters:.0f}"),
)
"""What is told of the two bands of a channel: words, and the cell."""


def pairs(judged: Sequence[Band]) -> list[tuple[Band, Band]]:
    """The narrow and the wide band of each channel and horizon."""
    narrow, wide = ([band for band in judged if band.promised == share] for share in SHARES)
    return list(zip(narrow, wide, strict=True))


def widening(errors: Array, sigma: Array, *, seconds: float, horizon: float) -> Array:
    """How many times as wide as its fit says a band is to be, by what the first seconds of a flight were missed (12,).

    How strong gusts are belongs to a flight and not to the aircraft: one whose first seconds are missed by more than
    chance allows has stronger ones, or lacks something. Where they are not, one.

    Args:
        errors: of predictions from starts in those seconds (s, 12). sigma: standard deviations that the fit promises
            (12,). seconds: that the starts cover. horizon: of the predictions [s]; starts closer together repeat it.
    """
    freedom = seconds / horizon
    if freedom < 1.0 or not len(errors):
        return np.ones(sigma.size)
    square = np.mean((errors / np.maximum(sigma, 1e-300)) ** 2, axis=0)
    by_chance = float(chdtri(freedom, _BY_CHANCE)) / freedom
    return np.where(square > by_chance, np.sqrt(square), 1.0)


def bands(by_horizon: Mapping[float, Sequence[BandedRecord]]) -> tuple[Band, ...]:
    """How much the bands hold, by horizon, promised share and channel.

    A band goes from the k-th lowest path to the k-th highest. A flight by the law of the paths has any rank among n of
    them with equal probability, so that it lies in the band with 1 - 2k/(n + 1), however few paths there are.
    """
    judged = []
    for horizon, records in by_horizon.items():
        times = [record.time for record in records]
        variance, own_variance, missed = (
            np.concatenate([getattr(r, part) for r in records]).mean(axis=0)
            for part in ("variance", "by_parameters", "missed")
        )
        share = 100.0 * own_variance / np.maximum(variance, 1e-300)
        for promised in SHARES:
            inside = [np.stack([_inside(r, promised), np.ones(r.below.shape)], axis=1) for r in records]
            sums, drawn = np.concatenate(inside).sum(axis=0), block_bootstrap.drawn(times, inside, horizon=horizon)
            held = 100.0 * sums[0] / sums[1]
            for i, name in enumerate(PREDICTED):
                low, high = block_bootstrap.interval(None if drawn is None else 100.0 * drawn[:, 0, i] / drawn[:, 1, i])
                sigma, starts = math.sqrt(variance[i]), int(sums[1, i])
                judged.append(
                    Band(
                        channel=name,
                        unit=known(name).unit,
                        horizon=horizon,
                        promised=promised,
                        held=float(held[i]),
                        low=low,
                        high=high,
                        sigma=sigma,
                        by_parameters=float(share[i]),
                        starts=starts,
                        off=math.sqrt(missed[i] / max(variance[i], 1e-300)),
                        wider=max(float(record.wider[i]) for record in records),
                    )
                )
    return tuple(judged)


def _inside(record: BandedRecord, promised: float) -> Array:
    outside = round((record.paths + 1) * (0.5 - 0.005 * promised))
    return ((record.below >= outside) & (record.below <= record.paths - outside)).astype(float)


def in_brief(judged: Sequence[Band], horizon: float, *, drawn: bool = True) -> str:
    """Which bands at one horizon hold and which do not, in a sentence; "" where nothing is to be said.

    Args:
        judged: all bands. horizon: seconds ahead.
        drawn: False for bands of one model, of which only those that are too narrow are named: the others may be so
            with the spread of its numbers.
    """
    rows = [band for band in judged if abs(band.horizon - horizon) < 1e-9]
    said = []
    for level, phrase in _WORDS.items():
        if not drawn and level != "too narrow":
            continue
        named = [f"{b.channel} {b.held:.0f} of {b.promised:g} %" for b in rows if b.level == level]
        if named:
            said.append(f"{phrase[0].upper()}{phrase[1:]}: {', '.join(named)}.")
    if not drawn and not said:
        return ""
    by = "" if drawn else " (how sure the model's numbers are is not in them)"
    return f"Bands {horizon:g} s ahead{by}. {' '.join(said)}"


def widened_words(judged: Sequence[Band]) -> str:
    """Which bands are wider than the fit says, in words; "" for none."""
    wide = {band.channel: band.wider for band in judged if band.wider > 1.0}
    if not wide:
        return ""
    named = ", ".join(f"{name} {factor:.1f}" for name, factor in wide.items())
    return (
        "Bands were made wider than the fit says, because errors in the first seconds of this flight were larger: "
        f"{named} times. Its gusts are stronger than those of the fit's flights, or the model lacks something."
    )
