"""Sections on the validation: verdict, predictions to look at, tables per horizon, innovations."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.schema import channel
from swashplate.identification.time.estimates import record_unit
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.reporting.figures_time import Prediction, Series, flight_name, time_figures
from swashplate.reporting.figures_validation import JUDGED, fit_over_horizon, horizons
from swashplate.reporting.glossary import meaning
from swashplate.reporting.structure import Block, Cell, Section, Table, Text
from swashplate.reporting.theme import unit_words
from swashplate.reporting.words import counted, percent, sigma_words, value_words
from swashplate.validation.bands import NEAR, pairs
from swashplate.validation.bands import ROWS as BAND_ROWS
from swashplate.validation.floors import CLOSED_ROWS
from swashplate.validation.validation import PREDICTORS, Example, Score, Validation

_SHORT = {"model": "model", "published card": "card", "hold": "hold", "constant rates": "rates"}
LEVEL_TONE = {"good": "good", "usable": "caution", "poor": "bad"}

_HONEST = (0.5, 2.0)
"""Mean squared innovation over its promised variance between which the promise counts as kept."""


def verdict(validation: Validation) -> Section:
    """One line per axis, and the thresholds behind the words."""
    rows = tuple(
        (Cell(v.axis), Cell(v.level, tone=LEVEL_TONE.get(v.level, "quiet"), strong=True), Cell(v.words))
        for v in validation.verdict
    )
    blocks: list[Block] = [Table("Verdict per axis", ("axis", "verdict", "why"), rows)]
    if validation.thresholds:
        blocks.append(
            Table(
                "Thresholds behind the words",
                ("threshold", "value"),
                tuple(
                    (Cell(k.replace("_", " ")), Cell(value_words(float(v)), number=True))
                    for k, v in validation.thresholds.items()
                ),
                note="Least prediction fit [%] of every channel of an axis; good and usable must beat every rival too.",
            )
        )
    return Section("verdict", "Verdict", tuple(blocks))


def prediction(validation: Validation) -> Section:
    """Predictions to look at, then the numbers per horizon."""
    names = {flight_name(record.name) for record in validation.records}
    blocks: list[Block] = [
        Text(
            "At each start point a causal observer knew the flight up to there and nothing after it; from there on "
            f"the model ran on the recorded inputs. The shaded band is ±2σ of {_band_of(validation)}."
        )
    ]
    for i, source in enumerate(sorted(names)):
        blocks += _pictures(validation, source, identifier=f"prediction-{i + 1}")
    blocks += [Text(one.words, tone="caution") for one in validation.contacts]
    blocks += [Text(law.words[0].upper() + law.words[1:]) for law in validation.laws]
    blocks += [Text(words, tone="caution" if "narrow" in words else "plain") for words in validation.bands_told]
    blocks += _told(validation)
    blocks.append(fit_over_horizon(validation))
    for horizon in horizons(validation):
        blocks.append(_table(validation, horizon))
        blocks += _bands(validation, horizon)
        blocks += _beside(validation, horizon)
        blocks += _without_contact(validation, horizon)
        blocks += _loop_closed(validation, horizon)
    return Section("prediction", "Prediction", tuple(blocks))


def _band_of(validation: Validation) -> str:
    count = validation.settings.get("draws", 0)
    if not count:
        return "what the model promises"
    return (
        f"{count} flights that models drawn from the posterior might have made from there, each with gusts and "
        "sensors' noise of its own"
    )


_PARAMETERS = {True: "the parameters by their posterior, ", False: ""}


def _bands(validation: Validation, horizon: float) -> tuple[Block, ...]:
    """How much of the flights the bands hold."""
    rows = {half.channel: (half, most) for half, most in pairs(validation.bands) if half.horizon == horizon}
    if not rows:
        return ()
    drawn = bool(validation.settings.get("draws"))
    return (
        Table(
            f"What the bands {horizon:g} s ahead hold",
            ("channel", *(words for words, _ in BAND_ROWS)),
            tuple(
                (Cell(name), *(_band_cell(words, cell(*rows[name])) for words, cell in BAND_ROWS))
                for name in JUDGED
                if name in rows
            ),
            note="Percent of the starts whose measured motion lies inside, with its 95 % interval (block bootstrap "
            f"over 4 s of flight). A band holds within {NEAR:g} points of its promise. In it: {_PARAMETERS[drawn]}the "
            "observer's error at the start, gusts and drifts to come, the sensors' noise. By parameters: part of the "
            "variance. Not in it: a wrong structure, and how sure the fit is of the gusts.",
        ),
    )


def _band_cell(words: str, text: str) -> Cell:
    tone = "caution" if text.startswith("too ") else "quiet" if text.startswith("cannot") else "plain"
    return Cell(text, number=words not in ("so", "unit"), tone=tone)


def _told(validation: Validation) -> tuple[Block, ...]:
    """What the first seconds of each record told, and the vehicle could not know."""
    told = validation.calibrated
    names = [name for name in Nuisance._fields if any(float(getattr(one, name)) for one in told)]
    if not names:
        return ()
    seconds = float(validation.settings["calibration"])
    return (
        Table(
            "What belongs to the predicted flights and not to the vehicle",
            ("quantity", "meaning", "unit", *(record.name for record in validation.records)),
            tuple(
                (
                    Cell(name),
                    Cell(meaning(name)),
                    Cell(unit_words(record_unit(name))),
                    *(_cell(f"{float(getattr(one, name)):.3f}", False) for one in told),
                )
                for name in names
            ),
            note=f"Told by the first {seconds:g} s of each record, the vehicle held; every prediction starts later.",
        ),
    )


def _pictures(validation: Validation, source: str, *, identifier: str) -> tuple[Block, ...]:
    records = [
        (record, states)
        for record, states in zip(validation.records, validation.measured, strict=True)
        if flight_name(record.name) == source
    ]
    mine = {record.name for record, _ in records}
    examples = apart([example for example in validation.examples if example.record in mine])
    channels = {
        name: [Series(record.time, states[:, j]) for record, states in records] for j, name in enumerate(PREDICTED)
    }
    predictions = {
        name: [Prediction(e.time, e.states[:, j], np.broadcast_to(e.sigma, e.states.shape)[:, j]) for e in examples]
        for j, name in enumerate(PREDICTED)
    }
    return time_figures(
        channels,
        [(record.time, record.inputs) for record, _ in records],
        validation.vehicle.input_names,
        identifier=identifier,
        source=source,
        model_words="prediction from each dot on",
        predictions=predictions,
    )


def apart(examples: Sequence[Example]) -> list[Example]:
    """Examples that do not overlap in time, earliest first: overlapping ones would hide each other."""
    chosen: list[Example] = []
    for example in sorted(examples, key=lambda e: e.start):
        if not chosen or example.time[0] >= chosen[-1].time[-1]:
            chosen.append(example)
    return chosen


def _table(validation: Validation, horizon: float) -> Table:
    scores = {(s.channel, s.predictor): s for s in validation.scores if s.horizon == horizon}
    names = sorted({name for name, _ in scores}, key=lambda n: (JUDGED.index(n) if n in JUDGED else len(JUDGED), n))
    shown = [p for p in PREDICTORS if any(predictor == p for _, predictor in scores)]
    rated = [p for p in shown if p != "hold"]
    rows = []
    for name in names:
        present = {p: scores[name, p] for p in shown if (name, p) in scores}
        best = max(present, key=lambda p: present[p].fit)
        nearest = min((s.theil for s in present.values() if math.isfinite(s.theil)), default=math.nan)
        unit = channel(name)
        rows.append(
            (
                Cell(name),
                Cell(unit_words(unit.shown_unit)),
                *(_cell(percent(s.fit), s is present[best]) for s in _row(present, rated)),
                *(
                    _cell(value_words(s.rms * unit.shown_factor, 0.01 * s.rms * unit.shown_factor), s is present[best])
                    for s in _row(present, shown)
                ),
                *(
                    _cell(f"{s.theil:.2f}" if math.isfinite(s.theil) else "–", s.theil == nearest)
                    for s in _row(present, shown)
                ),
            )
        )
    words, rated_words = [_SHORT[p] for p in shown], [_SHORT[p] for p in rated]
    starts = max((s.starts for s in scores.values()), default=0)
    return Table(
        f"Prediction {horizon:g} s ahead, from {counted(starts, 'start point')}",
        ("channel", "unit", *rated_words, *words, *words),
        tuple(rows),
        groups=(
            ("", 2),
            ("fit [%] (hold scores 0)", len(rated)),
            ("RMS error", len(shown)),
            ("Theil's coefficient", len(shown)),
        ),
        note="Model: the identified one. Card: the published one. Hold: the last value stays. Rates: constant rates. "
        "Bold: the best of the row by each measure. Fit: 100 (1 − rms error / rms change since the start). "
        "Theil: 0 perfect, 1 no better than the opposite; holding the last value always has 1.",
    )


def _without_contact(validation: Validation, horizon: float) -> tuple[Block, ...]:
    """The model's scores with and without the starts that a proposed mask touches."""
    rows = {s.channel: s for s in validation.without_contact if s.horizon == horizon}
    if not rows:
        return ()
    table = []
    for name in [n for n in JUDGED if n in rows]:
        whole = validation.score(name, horizon)
        counts = (whole.starts, rows[name].starts)
        cells = [_cell(percent(s.fit), False) for s in (whole, rows[name])]
        table.append((Cell(name), *cells, *(_cell(str(count), False) for count in counts)))
    return (
        Table(
            f"With and without the suspected contact, {horizon:g} s ahead",
            ("channel", "fit [%]", "without [%]", "starts", "starts without"),
            tuple(table),
            note="The mask is a proposal; every other figure has all starts.",
        ),
    )


def _loop_closed(validation: Validation, horizon: float) -> tuple[Block, ...]:
    """Fits with controllers in the place of recorded commands."""
    rows = {f.channel: f for f in validation.loop_closed if f.horizon == horizon}
    if not rows:
        return ()
    closed = " and ".join(dict.fromkeys(law.axis for law in validation.laws))
    return (
        Table(
            f"With the {closed} controller in the place of its recorded command, {horizon:g} s ahead",
            ("channel", *(f"{words} [%]" for words, _ in CLOSED_ROWS)),
            tuple((Cell(n), *(_cell(cell(rows[n]), False) for _, cell in CLOSED_ROWS)) for n in JUDGED if n in rows),
            note="Recorded commands answer gusts that no prediction knows. Gain: points that closing the loop adds; "
            "95 %: block bootstrap over 4 s of flight, the same blocks for both.",
        ),
    )


def _beside(validation: Validation, horizon: float) -> tuple[Block, ...]:
    """Whether the model or the flight is poor: scatter, movement, what the filter expects, what a black box reaches."""
    rows = {f.channel: f for f in validation.floors if f.horizon == horizon}
    if not rows:
        return ()
    table = []
    for name in [n for n in JUDGED if n in rows]:
        f, unit = rows[name], channel(name)
        scatter = f"{percent(f.low)} to {percent(f.high)}" if math.isfinite(f.low) else "–"
        ahead = f"{percent(f.lead)} ({percent(f.lead_low)} to {percent(f.lead_high)})" if math.isfinite(f.low) else "–"
        told = math.isfinite(f.ceiling)
        table.append(
            (
                Cell(name),
                _cell(percent(f.fit), False),
                _cell(scatter, False),
                _cell(ahead, False),
                _cell(value_words(f.rms * unit.shown_factor, 0.01 * f.rms * unit.shown_factor), False),
                _cell(value_words(f.moved * unit.shown_factor, 0.01 * f.moved * unit.shown_factor), False),
                Cell(unit_words(unit.shown_unit)),
                _cell(percent(f.expected), False),
                _cell(percent(f.past), False),
                Cell(percent(f.ceiling) if told else "refused", number=True, tone="plain" if told else "caution"),
                Cell(f"{f.words[0].upper()}{f.words[1:]}"),
            )
        )
    return (
        Table(
            f"What the model's scores {horizon:g} s ahead stand beside",
            (
                "channel",
                "fit [%]",
                "95 %",
                "points ahead of the best rival",
                "RMS error",
                "RMS movement",
                "unit",
                "filter expects [%]",
                "past alone [%]",
                "ceiling [%]",
                "so",
            ),
            tuple(table),
            note="95 %: block bootstrap over 4 s of flight, the same blocks for all. Movement: of the flight since the "
            "start. Filter expects: what its own covariance promises. Ceiling: ridge regression on past motion, past "
            f"inputs and the inputs up to the target ({' or '.join(sorted({f.by for f in rows.values() if f.by}))}); "
            "refused where inputs after the target help too, as a controller's answers do. Past alone: the same "
            "without any input after the start.",
        ),
    )


def _row(present: dict[str, Score], wanted: Sequence[str]) -> list[Score]:
    return [present.get(p, Score("", 0.0, p, math.nan, math.nan, math.nan, 0)) for p in wanted]


def _cell(words: str, strong: bool) -> Cell:
    return Cell(words, number=True, strong=strong)


def innovations(validation: Validation) -> Section:
    """One-step prediction errors: size, honesty of their covariance, whiteness, likelihood."""
    rows = []
    for check in validation.innovations:
        unit = channel(check.channel)
        honest = _HONEST[0] <= check.consistency <= _HONEST[1]
        white = check.whiteness <= check.whiteness_bound
        rows.append(
            (
                Cell(check.channel),
                Cell(unit_words(unit.shown_unit)),
                Cell(sigma_words(check.rms * unit.shown_factor), number=True),
                Cell(sigma_words(check.expected * unit.shown_factor), number=True),
                Cell(f"{check.consistency:.2f}", number=True, tone="plain" if honest else "caution"),
                Cell(
                    "as promised"
                    if honest
                    else ("larger than promised" if check.consistency > 1 else "smaller than promised")
                ),
                Cell(
                    f"{check.whiteness:.2f} (bound {check.whiteness_bound:.2f})",
                    number=True,
                    tone="plain" if white else "caution",
                ),
                Cell("white" if white else "coloured"),
            )
        )
    blocks: list[Block] = [
        Table(
            "One-step prediction errors",
            ("channel", "unit", "RMS", "promised σ", "consistency", "size", "largest autocorrelation", "colour"),
            tuple(rows),
            note="Consistency: mean squared error over promised variance; called as promised between "
            f"{_HONEST[0]:g} and {_HONEST[1]:g}. White noise keeps its autocorrelation below the bound at 99 %.",
        )
    ]
    if validation.log_likelihood:
        blocks.append(
            Table(
                "Log-likelihood per sample",
                ("predictor", "log-likelihood"),
                tuple((Cell(k), Cell(f"{v:.3f}", number=True)) for k, v in validation.log_likelihood.items()),
                note="Larger is better; a difference of 1 per sample is large.",
            )
        )
    return Section("innovations", "Innovations", tuple(blocks))
