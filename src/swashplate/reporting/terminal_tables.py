"""Fits, validations and cards as tables for a terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from swashplate.text_table import TextTable
from swashplate.text_table import text_columns as table

if TYPE_CHECKING:
    from swashplate.identification.core.result import Result
    from swashplate.models.vehicle import Vehicle
    from swashplate.validation.validation import Score, Validation

_FIGURES_FROM = 110  # columns of a terminal that hold all three figures side by side


def fit_table(fit: Result[object, object]) -> TextTable:
    """Published and identified value of each parameter, two corrected sigmas, and what decided it."""
    rows = []
    for e in fit.estimates:
        remarks = [f"= {e.tie}"] if e.tie else []
        remarks += ["at its bound"] if e.at_bound else []
        remarks += [f"{100 * e.prior_share:.0f} % from the prior"] if e.prior_share > 0.1 else []
        remarks += [f"bound: {e.bound}"] if e.bound not in ("", "coloured errors") else []
        known = math.isfinite(e.best_sigma) and not e.tie
        bound = f"{2 * e.best_sigma:.2g}" if known else "-"
        true = [f"{fit.truth[e.name]:.4g}" if e.name in fit.truth else "-"] if fit.truth else []
        rows.append((e.name, f"{e.start:.4g}", f"{e.value:.4g}", bound, *true, e.unit, ", ".join(remarks)))
    n = 5 if fit.truth else 4
    head = ("parameter", "published", "identified", "+- 2 sigma", *(["truth"] if fit.truth else []), "unit", "remark")
    return table(head, rows, words=(n, n + 1))


def _cells(scores: dict[str, Score], figure: str, factor: float, style: str) -> list[str]:
    values = [getattr(score, figure) * factor if score is not None else None for score in scores.values()]
    return ["-" if value is None else format(value, style) for value in values]


def validation_table(validation: Validation, *, width: int) -> TextTable:
    """Fit %, RMS error and Theil's coefficient of the model and its rivals, by channel and horizon."""
    from swashplate.flights.schema import channel
    from swashplate.validation.validation import PREDICTORS

    short = dict(zip(PREDICTORS, ("model", "card", "hold", "rates"), strict=False))
    figures = [("fit", "fit % ", ".0f"), ("rms", "rms ", ".3g"), ("theil", "Theil ", ".2f")]
    figures = figures if width >= _FIGURES_FROM else figures[:1]
    rows = []
    for name, horizon in dict.fromkeys((score.channel, score.horizon) for score in validation.scores):
        by_predictor = {s.predictor: s for s in validation.scores if (s.channel, s.horizon) == (name, horizon)}
        scores = {predictor: by_predictor.get(predictor) for predictor in PREDICTORS}
        known = channel(name)
        row = [name, known.shown_unit, f"{horizon:g}"]
        for figure, _, style in figures:
            row += _cells(scores, figure, known.shown_factor if figure == "rms" else 1.0, style)  # pyrefly: ignore[bad-argument-type]
        rows.append(row)
    head = ["channel", "unit", "ahead [s]"]
    for _, heading, _ in figures:
        first, *others = (short[predictor] for predictor in PREDICTORS)
        head += [f"{heading}{first}", *others]
    return table(head, rows, left=2, keys=3)


def floors_table(validation: Validation) -> TextTable:
    """What the model's scores stand beside, by channel and horizon."""
    from swashplate.validation.floors import ROWS

    head = ("channel", "ahead [s]", "fit %", *(heading for heading, _ in ROWS))
    rows = [(f.channel, f"{f.horizon:g}", f"{f.fit:.0f}", *(cell(f) for _, cell in ROWS)) for f in validation.floors]
    return table(head, rows, keys=2)


def closed_table(validation: Validation) -> TextTable:
    """Fits with loops closed beside those on the recorded inputs, by channel and horizon."""
    from swashplate.validation.floors import CLOSED_ROWS

    head = ("channel", "ahead [s]", *(heading for heading, _ in CLOSED_ROWS))
    rows = [(f.channel, f"{f.horizon:g}", *(cell(f) for _, cell in CLOSED_ROWS)) for f in validation.loop_closed]
    return table(head, rows, keys=2)


def bands_table(validation: Validation) -> TextTable:
    """What the bands of the predictions hold, by channel and horizon."""
    from swashplate.validation.bands import ROWS, pairs

    head = ("channel", "ahead [s]", *(heading for heading, _ in ROWS))
    rows = [(a.channel, f"{a.horizon:g}", *(cell(a, b) for _, cell in ROWS)) for a, b in pairs(validation.bands)]
    return table(head, rows, keys=2)


def parameter_table(vehicle: Vehicle) -> TextTable:
    """Every number of a card with its unit, status and source."""
    rows = [
        (name, f"{p.value:.6g}", p.unit, p.status, p.source + (f" ({p.note})" if p.note else ""))
        for name, p in vehicle.card.parameters.items()
    ]
    return table(("parameter", "value", "unit", "status", "source"), rows, words=(2, 3, 4))


def validation_parts(validation: Validation, *, width: int) -> list[Any]:
    """What `swash validate` prints: tables under their headings, what was found, and the verdict of each axis."""
    parts: list[Any] = [validation_table(validation, width=width)]
    if validation.floors:
        parts += ["\nWhat the model's scores stand beside", floors_table(validation)]
    if validation.loop_closed:
        parts += ["\nWith the controller in the place of the recorded command", closed_table(validation)]
    if validation.bands:
        parts += ["\nWhat the bands of drawn models hold [%]", bands_table(validation)]
    remarks = (*(one.summary_text for one in validation.contacts), *(law.summary_text for law in validation.laws))
    parts += [f"\n{text}" for text in remarks]
    return [*parts, "\n" + "\n".join(f"{axis.axis}: {axis.level}. {axis.words}" for axis in validation.verdict)]
