"""Sections on the validation: verdict, predictions to look at, tables per horizon, innovations."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.schema import channel
from swashplate.identification.time.estimates import record_unit
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.reporting.figures_time import Prediction, Series, flight_name, time_figures
from swashplate.reporting.figures_validation import JUDGED, fit_over_horizon, horizons
from swashplate.reporting.glossary import meaning
from swashplate.reporting.structure import Block, Cell, Row, Section, Table, Text, tabulate
from swashplate.reporting.theme import PREDICTOR_WORDS, unit_words
from swashplate.reporting.words import percent, sigma_words, value_words
from swashplate.validation.bands import NEAR, pairs
from swashplate.validation.bands import ROWS as BAND_ROWS
from swashplate.validation.floors import CLOSED_ROWS
from swashplate.validation.validation import PREDICTORS, AxisVerdict, Example, Validation
from swashplate.validation.verdict import JUDGED_AT

LEVEL_TONE = {"good": "good", "usable": "caution", "poor": "bad"}

_HONEST = (0.5, 2.0)
"""Mean squared innovation over its promised variance between which the promise counts as kept."""


def verdict(validation: Validation) -> Section:
    """Why each axis has its verdict, with the thresholds behind the words."""
    rows = tuple((*_axis_cells(v), v.words) for v in validation.verdict)
    limits = ", ".join(
        f"{k.replace('_', ' ')} from {value_words(float(v))} %" for k, v in validation.thresholds.items()
    )
    note = f"Every channel of an axis must reach the fit and beat every rival: {limits}. " if limits else ""
    table = tabulate("Verdict per axis", ("axis", "verdict", "why"), rows, note=f"{note}{_FIT}")
    return Section("verdict", "Why this verdict?", (table,), folded=True)


def verdict_in_short(validation: Validation) -> Table | None:
    """One line per axis for the first screen: verdict, fits, and the best rival's."""
    if not validation.verdict:
        return None
    rows = tuple((*_axis_cells(v), _numbers(v.words)) for v in validation.verdict)
    return tabulate("Verdict per axis", ("axis", "verdict", "fit (best rival)"), rows)


def _axis_cells(judged: AxisVerdict) -> Row:
    return judged.axis, Cell(judged.level, tone=LEVEL_TONE.get(judged.level, "quiet"), strong=True)


def _numbers(verdict_text: str) -> str:
    """The numbers with which a verdict's words begin, as "phi 69 % (56 %), p 55 % (28 %), 1 s ahead"."""
    match = re.match(r"(.+?) at ([\d.]+) s\.", verdict_text)
    if match is None:
        return ""
    numbers = re.sub(r" \[[^]]*\]", "", match[1]).replace("(best rival ", "(")
    return f"{numbers}, {match[2]} s ahead"


_FIT = "Fit: 100 (1 − rms error / rms change since the start); holding the last value has 0."


def prediction(validation: Validation) -> Section:
    """Predictions to look at, then the numbers: fits at every horizon, and what stands beside those that are judged."""
    names = {flight_name(record.name) for record in validation.records}
    blocks: list[Block] = [
        Text(
            "At each start point a filter knew the flight up to there and nothing after it. From there on the model "
            f"ran on the recorded inputs. The shaded band is ±2σ of {_band_of(validation)}."
        )
    ]
    for i, source in enumerate(sorted(names)):
        blocks += _pictures(validation, source, identifier=f"prediction-{i + 1}")
    blocks += [Text(one.summary_text, tone="caution") for one in validation.contacts]
    blocks += [Text(line, tone="caution" if "narrow" in line else "plain") for line in validation.bands_told]
    blocks.append(fit_over_horizon(validation))
    tables = (_fits(validation), _beside(validation), _bands(validation), _loop_closed(validation))
    blocks += [table for table in (*tables, _without_contact(validation)) if table]
    blocks += [Text(law.summary_text[0].upper() + law.summary_text[1:]) for law in validation.laws]
    blocks += _calibrated_constants(validation)
    return Section("prediction", "How well does it predict what it has not seen?", tuple(blocks), folded=True)


def _judged(validation: Validation) -> dict[str, float]:
    """The channels that a verdict looks at, with the horizon [s] at which it does: the nearest that was scored."""
    there = horizons(validation)
    scored = {score.channel for score in validation.scores}
    return (
        {name: min(there, key=lambda h: abs(h - at)) for name, at in JUDGED_AT.items() if name in scored}
        if there
        else {}
    )


def _of_judged(validation: Validation, rows: Iterable[Any]) -> list[Any]:
    """The rows of the judged channels at their horizons, in the order in which people look at them."""
    wanted = {(row.channel, row.horizon): row for row in rows}
    judged = _judged(validation)
    keys = [(name, judged[name]) for name in JUDGED if name in judged]
    return [wanted[key] for key in keys if key in wanted]


def _band_of(validation: Validation) -> str:
    count = validation.settings.get("draws", 0)
    if not count:
        return "what the model promises"
    return (
        f"{count} flights that models drawn from the posterior might have made from there, each with gusts and "
        "sensors' noise of its own"
    )


_PARAMETERS = {True: "the parameters by their posterior, ", False: ""}


def _bands(validation: Validation) -> Table | None:
    """How much of the flights the bands hold."""
    most = {(one.channel, one.horizon): one for half, one in pairs(validation.bands)}
    halves = _of_judged(validation, (half for half, _ in pairs(validation.bands)))
    if not halves:
        return None
    drawn = bool(validation.settings.get("draws"))
    return tabulate(
        "Do the bands hold what they promise?",
        ("channel", "ahead [s]", *(heading for heading, _ in BAND_ROWS)),
        tuple(
            (
                half.channel,
                _cell(f"{half.horizon:g}", False),
                *(_band_cell(heading, cell(half, most[half.channel, half.horizon])) for heading, cell in BAND_ROWS),
            )
            for half in halves
        ),
        note="Percent of the starts whose measured motion lies inside, with its 95 % interval (block bootstrap over "
        f"4 s of flight). A band holds within {NEAR:g} points of its promise. In it: {_PARAMETERS[drawn]}the filter's "
        "error at the start, gusts and drifts to come, the sensors' noise. Not in it: a wrong structure, and how sure "
        "the fit is of the gusts.",
    )


def _band_cell(heading: str, text: str) -> Cell:
    tone = "caution" if text.startswith("too ") else "quiet" if text.startswith("cannot") else "plain"
    return Cell(text, number=heading not in ("so", "unit"), tone=tone)


def _calibrated_constants(validation: Validation) -> tuple[Block, ...]:
    """What the first seconds of each record told, and the vehicle could not know."""
    calibrated = validation.calibrated
    names = [name for name in Nuisance._fields if any(float(getattr(one, name)) for one in calibrated)]
    if not names:
        return ()
    seconds = float(validation.settings["calibration"])
    return (
        tabulate(
            "What belongs to the predicted flights and not to the vehicle",
            ("quantity", "meaning", "unit", *(record.name for record in validation.records)),
            tuple(
                (
                    name,
                    meaning(name),
                    unit_words(record_unit(name)),
                    *(_cell(f"{float(getattr(one, name)):.3f}", False) for one in calibrated),
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


def _fits(validation: Validation) -> Table | None:
    """Fit of every predictor on every channel at every horizon."""
    there = horizons(validation)
    scores = {(s.channel, s.predictor, s.horizon): s.fit for s in validation.scores}
    shown = [p for p in PREDICTORS if p != "hold" and any(predictor == p for _, predictor, _ in scores)]
    channels = {name for name, _, _ in scores}
    names = sorted(channels, key=lambda n: (JUDGED.index(n) if n in JUDGED else len(JUDGED), n))
    if not names:
        return None

    def cell(name: str, predictor: str, horizon: float) -> Cell:
        fits = {p: scores.get((name, p, horizon), math.nan) for p in shown}
        best = max((0.0, *(f for f in fits.values() if math.isfinite(f))))
        return _cell(percent(fits[predictor]), fits[predictor] == best)

    starts = {s.horizon: s.starts for s in validation.scores}
    counts = ", ".join(f"{starts[h]} at {h:g} s" for h in there)
    return tabulate(
        "Fit [%] of every predictor",
        ("channel", *(f"{h:g} s" for _ in shown for h in there)),
        tuple((name, *(cell(name, p, h) for p in shown for h in there)) for name in names),
        groups=(("", 1), *((PREDICTOR_WORDS[p], len(there)) for p in shown)),
        note=f"{_FIT} Bold: the best at that horizon. Start points: {counts}. Errors in units and Theil's coefficient "
        "are in validation.json.",
    )


def _without_contact(validation: Validation) -> Table | None:
    """The model's scores with and without the starts that a proposed mask touches."""
    rows = []
    for without in _of_judged(validation, validation.without_contact):
        all_starts = validation.score(without.channel, without.horizon)
        cells = [_cell(text, False) for text in (f"{without.horizon:g}", percent(all_starts.fit), percent(without.fit))]
        counts = [_cell(str(count), False) for count in (all_starts.starts, without.starts)]
        rows.append((without.channel, *cells, *counts))
    if not rows:
        return None
    return tabulate(
        "With and without the suspected contact",
        ("channel", "ahead [s]", "fit [%]", "without [%]", "starts", "starts without"),
        tuple(rows),
        note="The mask is a proposal; every other figure has all starts.",
    )


def _loop_closed(validation: Validation) -> Table | None:
    """Fits with controllers in the place of recorded commands."""
    rows = _of_judged(validation, validation.loop_closed)
    if not rows:
        return None
    closed = " and ".join(dict.fromkeys(law.axis for law in validation.laws))
    return tabulate(
        f"With the {closed} controller in the place of its recorded command",
        ("channel", "ahead [s]", *(f"{text} [%]" for text, _ in CLOSED_ROWS)),
        tuple(
            (f.channel, *(_cell(text, False) for text in (f"{f.horizon:g}", *(c(f) for _, c in CLOSED_ROWS))))
            for f in rows
        ),
        note="Recorded commands answer gusts that no prediction knows. Gain: points that closing the loop adds; "
        "95 %: block bootstrap over 4 s of flight, the same blocks for both.",
    )


def _beside(validation: Validation) -> Table | None:
    """Whether the model or the flight is poor: scatter, movement, what the filter expects, what a black box reaches."""
    rows = []
    for f in _of_judged(validation, validation.floors):
        unit = channel(f.channel)
        has_ceiling = math.isfinite(f.ceiling)
        ahead = f"{percent(f.lead)} ({percent(f.lead_low)} to {percent(f.lead_high)})" if math.isfinite(f.low) else "–"
        texts = (
            f"{f.horizon:g}",
            percent(f.fit),
            f"{percent(f.low)} to {percent(f.high)}" if math.isfinite(f.low) else "–",
            ahead,
            value_words(f.rms * unit.shown_factor, 0.01 * f.rms * unit.shown_factor),
            value_words(f.moved * unit.shown_factor, 0.01 * f.moved * unit.shown_factor),
        )
        rows.append(
            (
                f.channel,
                *(_cell(text, False) for text in texts),
                unit_words(unit.shown_unit),
                _cell(percent(f.expected), False),
                _cell(percent(f.past), False),
                Cell(
                    percent(f.ceiling) if has_ceiling else "refused",
                    number=True,
                    tone="plain" if has_ceiling else "caution",
                ),
            )
        )
    if not rows:
        return None
    return tabulate(
        "Is the model poor, or the flight? What the judged fits stand beside",
        (
            "channel",
            "ahead [s]",
            "fit [%]",
            "95 %",
            "points ahead of the best rival",
            "RMS error",
            "RMS movement",
            "unit",
            "filter expects [%]",
            "past alone [%]",
            "ceiling [%]",
        ),
        tuple(rows),
        note="95 %: block bootstrap over 4 s of flight, the same blocks for all. Movement: of the flight since the "
        "start. Filter expects: the fit that its own covariance promises. Past alone: a regression on past motion and "
        "past inputs. Ceiling: the same with the inputs up to the target; refused where inputs after the target help "
        "too, as a controller's answers do.",
    )


def _cell(text: str, strong: bool) -> Cell:
    return Cell(text, number=True, strong=strong)


def innovations(validation: Validation) -> Section:
    """One-step prediction errors: size, honesty of their covariance, whiteness, likelihood."""
    rows = []
    for check in validation.innovations:
        unit = channel(check.channel)
        honest = _HONEST[0] <= check.consistency <= _HONEST[1]
        white = check.whiteness <= check.whiteness_bound
        rows.append(
            (
                check.channel,
                unit_words(unit.shown_unit),
                sigma_words(check.rms * unit.shown_factor),
                sigma_words(check.expected * unit.shown_factor),
                Cell(f"{check.consistency:.2f}", number=True, tone="plain" if honest else "caution"),
                "as promised"
                if honest
                else ("larger than promised" if check.consistency > 1 else "smaller than promised"),
                Cell(
                    f"{check.whiteness:.2f} (bound {check.whiteness_bound:.2f})",
                    number=True,
                    tone="plain" if white else "caution",
                ),
                "white" if white else "coloured",
            )
        )
    blocks: list[Block] = [
        tabulate(
            "One-step prediction errors",
            ("channel", "unit", "RMS", "promised σ", "consistency", "size", "largest autocorrelation", "colour"),
            tuple(rows),
            note="Consistency: mean squared error over promised variance; called as promised between "
            f"{_HONEST[0]:g} and {_HONEST[1]:g}. White noise keeps its autocorrelation below the bound at 99 %.",
        )
    ]
    if validation.log_likelihood:
        blocks.append(
            tabulate(
                "Log-likelihood per sample",
                ("predictor", "log-likelihood"),
                tuple((k, f"{v:.3f}") for k, v in validation.log_likelihood.items()),
                note="Larger is better; a difference of 1 per sample is large.",
            )
        )
    return Section("innovations", "Are the filter's errors as large as it says?", tuple(blocks), folded=True)
