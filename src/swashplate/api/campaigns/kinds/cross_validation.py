"""Campaigns of fits to all flights but some, each judged on those: how well is predicted what is new to a model?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from swashplate.api.campaigns.fitting import Attempt, LogsCampaign, outcome_columns, unusable
from swashplate.api.campaigns.kind import CampaignFindings, NamedFile
from swashplate.api.campaigns.shares import share_words
from swashplate.api.campaigns.tasks import Columns, Portion, seed_of
from swashplate.errors import CampaignError
from swashplate.identification.core.result import Result
from swashplate.identification.core.spans import CALIBRATION, HORIZONS
from swashplate.identification.estimators import check_method
from swashplate.validation.validation import Validation
from swashplate.validation.verb import validate

_SCORE = "fit."
_FAR = 2.0
"""Jackknife deviation over the bound from which numbers differ between folds by more than their bounds say."""


class CrossValidationCampaign(LogsCampaign, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """The file of a campaign of folds. A row is a fold, so that `count` says nothing.

    Attributes:
        folds: in how many the flights are dealt out, one by one; None: each flight is one.
        horizons, calibration: as of `sp.validate`.
    """

    folds: int | None = None
    horizons: list[float] = msgspec.field(default_factory=lambda: list(HORIZONS))
    calibration: float = CALIBRATION


class CrossValidationKind:
    """See `CampaignKind`."""

    rows = "fold"
    schema = CrossValidationCampaign

    def files(self, settings: CrossValidationCampaign) -> Sequence[NamedFile]:
        return settings.logs

    def parts(self, settings: CrossValidationCampaign, folder: Path) -> tuple[Portion, ...]:
        check_method(settings.method)
        if len(set(settings.flights)) < max(2, len(settings.flights)):
            raise CampaignError("expected two or more different logs.", channel="flights")
        if not 2 <= _folds(settings) <= len(settings.flights):
            raise CampaignError(f"is {settings.folds}, expected 2 to {len(settings.flights)}.", channel="folds")
        folds = [", ".join(settings.flights[k :: _folds(settings)]) for k in range(_folds(settings))]
        return tuple(Portion(k, 1, seed_of(settings.seed, k), of) for k, of in enumerate(folds))

    def run(self, settings: CrossValidationCampaign, portion: Portion, files: Mapping[str, Path]) -> Columns:
        fit, seen = self._fitted(settings, portion, files)
        left_out = [flight for k, flight in enumerate(seen) if k % _folds(settings) == portion.first]
        outputs = None if settings.outputs is None else tuple(settings.outputs)
        judged = validate(
            fit, left_out, horizons=settings.horizons, calibration=settings.calibration, outputs=outputs
        )  # a fit that is refused, or flights that cannot judge it, are an error of the whole task
        if isinstance(judged, Validation):
            scores = {f"{s.channel}@{s.horizon:g}s": s.fit for s in judged.scores if s.predictor == "model"}
        else:
            scores = {output.output: output.fit for output in judged.outputs}
        row: dict[str, Any] = {"left_out": portion.of, **{f"{_SCORE}{name}": fit for name, fit in scores.items()}}
        table = outcome_columns([Attempt(fit)]) | {name: np.array([value]) for name, value in row.items()}
        for name in settings.free_of(settings.model(files)):
            table |= {name: np.array([fit[name].value]), f"{name}.sigma": np.array([fit[name].best_sigma])}
        return table

    def replay(
        self, settings: CrossValidationCampaign, portion: Portion, files: Mapping[str, Path], row: int
    ) -> Result[Any, Any]:
        return self._fitted(settings, portion, files)[0]

    def findings(self, settings: CrossValidationCampaign, table: Columns) -> CampaignFindings:
        scores = [name for name in table if name.startswith(_SCORE)]
        if not scores or "usable" not in table:
            return CampaignFindings((), {})
        usable = table["usable"] == 1
        every, lost = len(usable), int(np.sum(~usable))
        careful = unusable(table, usable)
        names = [name.removesuffix(".sigma") for name in table if name.endswith(".sigma")]
        folds = [str(name) for name in table.get("left_out", table["number"])]
        told = []
        for name in scores:
            fits = np.asarray(table[name], dtype=np.float64)
            known = usable & np.isfinite(fits)
            if known.any():
                worst = int(np.argmin(np.where(known, fits, np.inf)))
                words = (f"{np.mean(fits[known]):.1f}", f"{np.std(fits[known]):.1f}", f"{fits[worst]:.1f}")
                told.append((name.removeprefix(_SCORE), *words, folds[worst]))
        tables: list[Any] = [
            ("Fits of what no fit had seen [%]", ("of", "mean", "scatter", "worst", "in"), tuple(told))
        ]
        cells = [_moved(name, table, usable) for name in names if np.sum(usable) > 1]
        far = [name for name, ratio, _ in cells if ratio > _FAR]
        if far:
            careful.append(f"numbers differ between flights by more than their bounds say: {', '.join(far)}")
        head = ("parameter", "mean", "bound (1 sigma)", "jackknife (1 sigma)", "ratio")
        tables.append(("How numbers differ from fold to fold", head, tuple(words for _, _, words in cells)))
        summary = (("Usable fits", share_words(every - lost, every), "caution" if lost else "good"),)
        return CampaignFindings(
            summary, dict.fromkeys(scores, ("%", 1.0)), tables=tuple(tables), careful=tuple(careful),
            counted="usable",
        )  # fmt: skip

    def _fitted(
        self, settings: CrossValidationCampaign, portion: Portion, files: Mapping[str, Path]
    ) -> tuple[Result[Any, Any], tuple[Any, ...]]:
        """The fit of a fold, and all flights."""
        seen = settings.records(files)
        kept = tuple(flight for k, flight in enumerate(seen) if k % _folds(settings) != portion.first)
        return settings.fitted(settings.model(files), kept, biases=settings.biases), seen


def _folds(settings: CrossValidationCampaign) -> int:
    return len(settings.flights) if settings.folds is None else settings.folds


def _moved(name: str, table: Columns, usable: Any) -> tuple[str, float, tuple[str, ...]]:
    """A number, its jackknife deviation over its bound, and both in words.

    Deviation of the fit of all from those that each leave one part out: Efron and Stein (1981), eq. 1.2.
    """
    values, sigma = (np.asarray(table[key], dtype=np.float64)[usable] for key in (name, f"{name}.sigma"))
    n, bound = len(values), float(np.sqrt(np.mean(sigma**2)))
    moved = float(np.sqrt((n - 1) / n * np.sum((values - values.mean()) ** 2)))
    ratio = moved / bound if bound > 0.0 else np.nan
    return name, ratio, (name, f"{values.mean():.4g}", f"{bound:.2g}", f"{moved:.2g}", f"{ratio:.2f}")


CROSS_VALIDATION = CrossValidationKind()
