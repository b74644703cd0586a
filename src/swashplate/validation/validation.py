"""`Validation`: how well a model predicts flights that no fit has seen, next to its rivals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import Record
from swashplate.identification.core.sources import DataSource
from swashplate.models.vehicle import Vehicle
from swashplate.validation.bands import Band, in_brief, widened_words
from swashplate.validation.contact import Contact
from swashplate.validation.controller_law import Law
from swashplate.validation.floors import ROWS, Floor
from swashplate.validation.saved import SavedWhole

PREDICTORS = ("model", "published card", "hold", "constant rates")


def rms(rows: Array) -> Array:
    """Root mean square over the first axis."""
    return np.asarray(np.sqrt(np.mean(np.square(rows), axis=0)), dtype=np.float64)


def fit_percent(predicted: Array, truth: Array, at_start: Array) -> Array:
    """100 (1 - rms error / rms of the change since the start), per column.

    Holding the last value scores 0, a perfect prediction 100; below 0 it would have been better to predict nothing.
    """
    return 100.0 * (1.0 - rms(predicted - truth) / rms(truth - at_start))


def theil(predicted: Array, truth: Array, at_start: Array) -> Array:
    """Theil's inequality coefficient of the changes since the start: 0 perfect, 1 no better than the opposite sign.

    rms(error) / (rms(predicted change) + rms(true change)) (Theil 1966; Jategaonkar 2015, sec. 11.2.3).
    """
    return rms(predicted - truth) / (rms(predicted - at_start) + rms(truth - at_start))


@dataclass(frozen=True)
class Score:
    """One predictor on one channel at one horizon.

    Attributes:
        channel: schema name (u, v, w, phi, theta, psi, p, q, r, x, y, z).
        horizon: seconds ahead.
        predictor: one of `PREDICTORS`.
        fit: 100 (1 - rms error / rms change since the start) [%]; "hold" scores 0.
        rms: RMS error in the channel's inside unit.
        theil: Theil's inequality coefficient of the changes.
        starts: how many start points.
    """

    channel: str
    horizon: float
    predictor: str
    fit: float
    rms: float
    theil: float
    starts: int


@dataclass(frozen=True)
class InnovationCheck:
    """One-step prediction errors of one output.

    Attributes:
        channel: the output.
        rms: in its unit.
        expected: standard deviation that the model promises.
        consistency: mean squared normalised innovation (1: honest covariance).
        whiteness: largest autocorrelation over lags 1 to 20 samples.
        whiteness_bound: its 99 % bound for white noise.
    """

    channel: str
    rms: float
    expected: float
    consistency: float
    whiteness: float
    whiteness_bound: float


@dataclass(frozen=True)
class AxisVerdict:
    """One axis in words.

    Attributes:
        axis: "roll", "pitch", "yaw", "heave" or "horizontal".
        level: "good", "usable", "poor" or "cannot be judged".
        words: the verdict with its numbers.
    """

    axis: str
    level: str
    words: str


@dataclass(frozen=True)
class Example:
    """One prediction to look at: from `start` [s] on, states (n, 12) with their 2-sigma band."""

    record: str
    start: float
    time: Array
    states: Array
    sigma: Array


@dataclass(frozen=True)
class Validation(SavedWhole):
    """Predictions of unseen flights, judged.

    Attributes:
        vehicle: the model. `published`: the untouched card beside it.
        scores: per channel, horizon and predictor.
        innovations: per output. `log_likelihood`: mean per sample of the model and of the published card.
        verdict: per axis.
        thresholds: the numbers behind the words.
        examples: predictions to draw.
        records: what was predicted; `measured`: body states (n, 12) of each.
        data: the flights, as a fit's `data`.
        settings: observer, horizons.
        calibrated: of each record, what its first seconds told the model: delays, trims, lever arm and heading.
        floors: what the model's scores stand beside, per channel and horizon.
        contacts: proposed masks; none was applied.
        without_contact: the model's scores from starts that no mask touches.
        loop_closed: fits with controllers in the place of recorded commands, and their lead over the model's on those;
            nothing where no loop was closed. `laws`: the controllers.
        bands: how much of the flights the bands of the predictions hold: with draws at all horizons, and the examples'
            sigmas have the parameters' part and the sensors' noise in them too; without, those of the model alone at
            the verdict's.
        not_logged: rotor speeds and voltage that the model has and some flight does not.
    """

    vehicle: Vehicle
    published: Vehicle
    scores: tuple[Score, ...]
    innovations: tuple[InnovationCheck, ...]
    log_likelihood: Mapping[str, float]
    verdict: tuple[AxisVerdict, ...]
    thresholds: Mapping[str, float]
    examples: tuple[Example, ...]
    records: tuple[Record, ...]
    measured: tuple[Array, ...]
    data: tuple[DataSource, ...]
    settings: Mapping[str, Any]
    calibrated: tuple[Nuisance, ...] = ()
    floors: tuple[Floor, ...] = ()
    contacts: tuple[Contact, ...] = ()
    without_contact: tuple[Score, ...] = ()
    loop_closed: tuple[Floor, ...] = ()
    laws: tuple[Law, ...] = ()
    bands: tuple[Band, ...] = ()
    not_logged: tuple[str, ...] = ()

    def score(self, channel: str, horizon: float, predictor: str = "model") -> Score:
        """The score of one predictor on one channel at one horizon."""
        return next(
            s
            for s in self.scores
            if s.channel == channel and abs(s.horizon - horizon) < 1e-9 and s.predictor == predictor
        )

    def floor(self, channel: str, horizon: float) -> Floor:
        """What the model's score on one channel at one horizon stands beside."""
        return next(f for f in self.floors if f.channel == channel and abs(f.horizon - horizon) < 1e-9)

    @property
    def bands_told(self) -> list[str]:
        """Which bands hold and which do not, a sentence by horizon."""
        horizons, drawn = dict.fromkeys(band.horizon for band in self.bands), bool(self.settings.get("draws"))
        texts = [in_brief(self.bands, horizon, drawn=drawn) for horizon in horizons] + [widened_words(self.bands)]
        return [text for text in texts if text]

    def to_document(self) -> dict[str, object]:
        """Numbers and words as JSON types (no time histories)."""
        return {
            "kind": "validation",
            "vehicle": self.vehicle.name,
            "scores": [vars(score) for score in self.scores],
            "floors": [vars(floor) | {"words": floor.summary_text} for floor in self.floors],
            "contacts": [vars(one) | {"words": one.summary_text} for one in self.contacts],
            "scores_without_contact": [vars(score) for score in self.without_contact],
            "loop_closed": [vars(floor) for floor in self.loop_closed],
            "laws": [vars(law) for law in self.laws],
            "bands": [vars(band) | {"level": band.level, "words": band.summary_text} for band in self.bands],
            "innovations": [vars(check) for check in self.innovations],
            "log_likelihood": dict(self.log_likelihood),
            "verdict": [vars(axis) for axis in self.verdict],
            "not_logged": list(self.not_logged),
            "thresholds": dict(self.thresholds),
            "flights": [vars(one) | {"history": [vars(step) for step in one.history]} for one in self.data],
            "settings": dict(self.settings),
            "calibrated": [
                {"record": record.name} | {name: float(value) for name, value in constants._asdict().items()}
                for record, constants in zip(self.records, self.calibrated, strict=False)
            ],
        }

    def __repr__(self) -> str:
        fits = {(s.channel, s.horizon, s.predictor): s.fit for s in self.scores}
        channels = [
            c for c in ("u", "v", "w", "phi", "theta", "psi", "p", "q", "r") if any(key[0] == c for key in fits)
        ]
        lines = ["Prediction fit % (100 perfect, 0 as good as holding the last value)"]
        for horizon in sorted({key[1] for key in fits}):
            lines.append(f"{horizon:g} s".ljust(18) + "".join(f"{channel:>9s}" for channel in channels))
            for predictor in PREDICTORS:
                row = (fits.get((channel, horizon, predictor), float("nan")) for channel in channels)
                lines.append(f"  {predictor:16s}" + "".join(f"{value:9.1f}" for value in row))
            beside_it = (("no contact", self.without_contact), ("loop closed", self.loop_closed))
            for label, others in beside_it:
                by_channel = {s.channel: s.fit for s in others if s.horizon == horizon}
                if by_channel:
                    row = (by_channel.get(channel, float("nan")) for channel in channels)
                    lines.append(f"  {label:16s}" + "".join(f"{value:9.1f}" for value in row))
            beside = {f.channel: f for f in self.floors if f.horizon == horizon}
            for label, cell in ROWS if beside else ():
                row_of = (cell(beside[channel]) if channel in beside else "" for channel in channels)
                lines.append(f"  {label:16s}" + "".join(f"{text:>9s}" for text in row_of))
        remarks = [*(c.summary_text for c in self.contacts), *(law.summary_text for law in self.laws), *self.bands_told]
        return "\n".join([*lines, *remarks, *(f"{v.axis}: {v.level}. {v.words}" for v in self.verdict)])


_LAGS = 20


def log_likelihood(innovations: Array, covariance: Array) -> float:
    """Mean Gaussian log-likelihood per sample of innovations (n, m) with a constant covariance (m, m)."""
    L = np.linalg.cholesky(covariance)
    white = np.linalg.solve(L, innovations.T)
    m = covariance.shape[0]
    return float(-0.5 * np.mean(np.sum(white**2, axis=0)) - np.log(np.diag(L)).sum() - 0.5 * m * np.log(2.0 * np.pi))


def check_innovations(innovations: Array, covariance: Array, names: tuple[str, ...]) -> tuple[InnovationCheck, ...]:
    """Size, consistency and whiteness per output (Bar-Shalom, Li and Kirubarajan 2001, sec. 5.4)."""
    n = innovations.shape[0]
    checks = []
    for i, name in enumerate(names):
        row = innovations[:, i] - innovations[:, i].mean()
        power = float(row @ row) or 1e-300
        correlations = [float(row[:-lag] @ row[lag:]) / power for lag in range(1, min(_LAGS, n - 1) + 1)]
        expected = float(np.sqrt(covariance[i, i]))
        size = float(np.sqrt(np.mean(innovations[:, i] ** 2)))
        checks.append(
            InnovationCheck(
                channel=name,
                rms=size,
                expected=expected,
                consistency=(size / expected) ** 2,
                whiteness=max(map(abs, correlations), default=0.0),
                whiteness_bound=2.576 / np.sqrt(n),
            )
        )
    return tuple(checks)
