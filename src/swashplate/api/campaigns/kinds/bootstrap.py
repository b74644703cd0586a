"""Campaigns of the same fit to pieces of the flights drawn anew: how far do its numbers scatter, whatever the noise?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from swashplate.api.campaigns.fitting import Attempt, LogsCampaign, outcome_columns, unusable
from swashplate.api.campaigns.kind import CampaignFindings, NamedFile, in_batches
from swashplate.api.campaigns.shares import SURE, share_words
from swashplate.api.campaigns.tasks import Columns, Portion, seed_of
from swashplate.arrays import Array
from swashplate.errors import CampaignError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.identification.estimators import check_method


class BootstrapCampaign(LogsCampaign, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file of a campaign of refits.

    Attributes:
        piece: length of the pieces that are drawn [s]; what is left of a record's end is in none. 0: whole records.
    """

    piece: float = 0.0


class BootstrapKind:
    """See `CampaignKind`. Row 0 is the fit of every piece once; the others of as many, drawn with replacement."""

    rows = "fit"
    schema = BootstrapCampaign

    def files(self, settings: BootstrapCampaign) -> Sequence[NamedFile]:
        return settings.logs

    def parts(self, settings: BootstrapCampaign, folder: Path) -> tuple[Portion, ...]:
        check_method(settings.method)
        if not settings.flights:
            raise CampaignError("expected one log or more.", channel="flights")
        if not settings.piece >= 0.0:
            raise CampaignError(f"is {settings.piece:g}, expected seconds, or 0.", channel="piece")
        return in_batches(settings, usual=1)

    def run(self, settings: BootstrapCampaign, portion: Portion, files: Mapping[str, Path]) -> Columns:
        model, cut = settings.model(files), self._cut(settings, files)
        attempts = [
            Attempt.at(partial(settings.fitted, model, _drawn(cut, portion, row), biases=settings.biases))
            for row in range(portion.count)
        ]
        columns = outcome_columns(attempts) | {"pieces": np.full(portion.count, len(cut))}
        for name in settings.free_of(model):
            columns[name], columns[f"{name}.sigma"] = np.array([attempt.estimate(name) for attempt in attempts]).T
        return columns

    def replay(
        self, settings: BootstrapCampaign, portion: Portion, files: Mapping[str, Path], row: int
    ) -> Result[Any, Any]:
        drawn = _drawn(self._cut(settings, files), portion, row)
        return settings.fitted(settings.model(files), drawn, biases=settings.biases)

    def findings(self, settings: BootstrapCampaign, table: Columns) -> CampaignFindings:
        names = [name.removesuffix(".sigma") for name in table if name.endswith(".sigma")]
        if not names or not {"usable", "pieces"} <= table.keys():
            return CampaignFindings((), {})
        usable, first = table["usable"] == 1, table["number"] == 0
        drawn, every = usable & ~first, len(usable)
        lost, pieces = int(np.sum(~usable)), int(table["pieces"][0])
        careful = unusable(table, usable)
        summary = (
            ("Usable fits", share_words(every - lost, every), "caution" if lost else "good"),
            ("Pieces", f"{pieces}, as many drawn for each fit", "plain"),
        )
        cells, narrow = [], []
        for name in names if np.any(usable & first) and np.sum(drawn) > 1 else ():
            values, at = np.asarray(table[name], dtype=np.float64), int(np.flatnonzero(first)[0])
            low, ratio, high = compared(values[drawn], float(table[f"{name}.sigma"][at]), pieces=pieces)
            words = "too narrow" if low > 1.0 else "too wide" if high < 1.0 else "as they say"
            narrow += [name] if low > 1.0 else []
            ends = np.quantile(values[drawn], (0.5 - 0.5 * SURE, 0.5 + 0.5 * SURE))
            cells.append(
                (name, f"{values[at]:.4g}", f"{table[f'{name}.sigma'][at]:.2g}", f"{ends[0]:.4g} to {ends[1]:.4g}",
                 f"{ratio:.2f}", f"{low:.2f} to {high:.2f}", words)
            )  # fmt: skip
        if narrow:
            careful.append(f"bounds are too narrow for how these flights scatter: {', '.join(narrow)}")
        head = ("parameter", "of all", "its bound (1 sigma)", "95 % of the refits", "scatter over bound", "which is",
                "the bounds")  # fmt: skip
        tables = (("Scatter of the refits beside the bounds", head, tuple(cells)),)
        return CampaignFindings(
            summary, dict.fromkeys(names, ("", 1.0)), tables=tables, careful=tuple(careful), counted="usable"
        )

    def _cut(self, settings: BootstrapCampaign, files: Mapping[str, Path]) -> tuple[Flight, ...]:
        """Pieces of all flights.

        Raises:
            CampaignError: fewer than two.
        """
        whole = [record for flight in settings.records(files) for record in flight.split()]
        if settings.piece:
            whole = [part for record in whole for part in pieces_of(record, settings.piece)]
        if len(whole) < 2:
            raise CampaignError(f"the flights have {len(whole)} pieces, expected two or more.", channel="piece")
        return tuple(whole)


def pieces_of(record: Flight, length: float) -> tuple[Flight, ...]:
    """Pieces of so many seconds, one after the other, all of the same number of samples."""
    (data,) = record.streams.values()
    time = np.asarray(data["time"], dtype=np.float64)
    samples = round(length / float(np.median(np.diff(time))))
    starts = range(0, len(time) - samples + 1, max(samples, 2))
    return tuple(record.between(float(time[k]), float(time[k + samples - 1])) for k in starts)


def compared(values: Array, bound: float, *, pieces: int) -> tuple[float, float, float]:
    """Scatter of refits over a bound, and the ends of its 95 % interval: low, ratio, high.

    The bootstrap's variance is too small by (n - 1) / n for n pieces (Efron and Tibshirani 1993, sec. 5.3), and no
    better known than from n - 1 of them, however many refits there are.
    """
    freedom = min(len(values), pieces) - 1
    ratio = float(np.std(values, ddof=1)) * np.sqrt(pieces / (pieces - 1)) / bound
    high, low = np.sqrt(freedom / chi2.ppf((0.5 - 0.5 * SURE, 0.5 + 0.5 * SURE), freedom))
    return float(low * ratio), float(ratio), float(high * ratio)


def _drawn(cut: Sequence[Flight], portion: Portion, row: int) -> tuple[Flight, ...]:
    """What a row is fitted to: every piece once for row 0 of the campaign."""
    if portion.first + row == 0:
        return tuple(cut)
    random = np.random.default_rng(seed_of(portion.seed, row))
    return tuple(cut[k] for k in np.sort(random.integers(len(cut), size=len(cut))))


BOOTSTRAP = BootstrapKind()
