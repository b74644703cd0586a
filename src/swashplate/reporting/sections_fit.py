"""Sections on the fit: parameters, flight against model, and residuals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import Comparison
from swashplate.identification.core.result import Estimate, Result
from swashplate.identification.estimators import GAINS
from swashplate.identification.one_step import in_words, not_judged, one_step_effects
from swashplate.identification.time.estimates import COLOURED
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.figures_fit import residual_correlation, residual_time
from swashplate.reporting.figures_time import Series, flight_name, time_figures
from swashplate.reporting.structure import Block, Cell, Points, Row, Section, Table, Text, tabulate
from swashplate.reporting.theme import unit_words
from swashplate.reporting.words import noise_told, sigma_words, value_words

PRIOR_HEAVY = 0.5
"""Share of prior information above which a value says more about the prior than about the flight."""


def parameters(fit: Result[Vehicle, object]) -> Section:
    """Every estimated number, with where it comes from."""
    rows = tuple(_row(fit, estimate) for estimate in fit.estimates)
    blocks: list[Block] = [Text(problem, tone="bad") for problem in fit.problems]
    blocks += [Text(f"{text}.") for text in fit.settings.get("set by the choice", ())]
    blocks += [Text(fit.beside_truth)] if fit.beside_truth else []
    asked_for = in_words(one_step_effects(fit))
    if asked_for:
        blocks.append(Text(f"Structure: the flights say that the model {asked_for} {not_judged(fit)}".rstrip()))
    blocks.append(
        tabulate(
            "Parameters before and after the fit",
            (
                "parameter",
                "unit",
                "published",
                "identified",
                "σ plain",
                "σ corrected",
                *(["truth"] if fit.truth else []),
                "change",
                "change / σ",
                "prior share",
                "remarks",
            ),
            rows,
            note="σ plain: Cramér-Rao bound. σ corrected: the same, allowing for coloured residuals (Morelli and Klein "
            "1997) or for what the remark says; use this one. Prior share: how much of the information is the prior's; "
            "near 100 % the flight said nothing. A name leads to its meaning and source.",
        )
    )
    if fit.constants:
        blocks.append(
            tabulate(
                "What belongs to the flights and not to the vehicle",
                ("quantity", "flight", "unit", "estimate", "±σ"),
                tuple(
                    (
                        Cell(e.name, link=f"meaning-{e.name}"),
                        e.record,
                        unit_words(e.unit),
                        value_words(e.value, e.sigma),
                        sigma_words(e.sigma),
                    )
                    for e in fit.constants
                ),
            )
        )
    return Section("parameters", "Which numbers came out, and how sure are they?", tuple(blocks), folded=True)


def noise(fit: Result[Vehicle, object]) -> Table | None:
    """The noise model, None where the method has none."""
    if fit.noise is None:
        return None
    intensities = noise_told({name: float(value) for name, value in fit.noise._asdict().items()})
    return tabulate(
        "Noise that the method assumed or estimated",
        ("intensity", "value"),
        tuple((name, value_words(value)) for name, value in intensities.items()),
        note="white_*: rad/s² or m/s² per √Hz; gust_* and drift_*: rad/s³ or m/s³ per √Hz; tau_*: s; sensor_*: "
        "standard deviation per sample in m or rad"
        + ("; wind: m/s² per √Hz; speed: horizontal, flown, rms in m/s." if "wind" in intensities else "."),
    )


def _row(fit: Result[Vehicle, object], e: Estimate) -> Row:
    change = e.value - e.start
    relative = _relative(change, e.start)
    sigmas = f"{change / e.sigma_corrected:+.1f}" if e.sigma_corrected > 0.0 else "–"
    return (
        Cell(e.name, link=f"meaning-{e.name}"),
        unit_words(e.unit),
        value_words(e.start),
        Cell(value_words(e.value, e.sigma_corrected), number=True, strong=True),
        sigma_words(e.sigma),
        sigma_words(e.sigma_corrected),
        *([value_words(fit.truth[e.name]) if e.name in fit.truth else "–"] if fit.truth else []),
        relative,
        sigmas,
        Cell(f"{100.0 * e.prior_share:.0f} %", number=True, tone="caution" if e.prior_share > PRIOR_HEAVY else "plain"),
        Cell(*_remarks(fit, e)),
    )


def _relative(change: float, published: float) -> str:
    if change == 0.0:
        return "none"
    share = 100.0 * change / abs(published) if published else math.inf
    return f"{share:+.0f} %" if abs(share) < 1000.0 else ("new" if not published else "> 999 %")


def _remarks(fit: Result[Vehicle, object], e: Estimate) -> tuple[str, bool, str]:
    remarks = []
    if e.at_bound:
        entry = fit.start.card.parameters.get(e.name)
        bounds = f" [{value_words(entry.lower)}, {value_words(entry.upper)}]" if entry else ""
        remarks.append(f"at its physical bound{bounds}")
    if e.tie:
        remarks.append(f"tied: = {e.tie}")
    if e.prior_mean is not None and e.prior_sigma is not None:
        remarks.append(f"prior {value_words(e.prior_mean, e.prior_sigma)} ± {sigma_words(e.prior_sigma)}")
    if e.bound not in ("", COLOURED):
        remarks.append(f"bound: {e.bound}")
    return "; ".join(remarks), False, "bad" if e.at_bound else "plain"


def comparison(fit: Result[Vehicle, object]) -> Section:
    """Flight against model for every channel, one pair of figures per flight."""
    one_step = GAINS.get(fit.method, "none") != "none"
    model_label = "one-step prediction" if one_step else "simulation on the recorded inputs"
    intro = (
        "Each model sample was predicted one sample ahead from everything measured before it, so the lines should "
        "lie on top of each other and only the residuals below tell how good they are. How the model does seconds "
        "ahead stands under Prediction. Velocities and rates are the filter's estimates, compared with the slopes of "
        "the measured pose."
        if one_step
        else "The model ran on the recorded inputs alone. Velocities and rates are its states, compared with the "
        "slopes of the measured pose."
    )
    blocks: list[Block] = [
        Text(f"{intro} Where the cost did not count a sample (settling, outliers), no model is drawn.")
    ]
    by_flight: dict[str, list[Comparison]] = {}
    for piece in fit.in_time:
        by_flight.setdefault(flight_name(piece.record.name), []).append(piece)
    for i, (source, pieces) in enumerate(by_flight.items()):
        blocks += time_figures(
            _series(fit, pieces),
            [(piece.record.time, piece.record.inputs) for piece in pieces],
            fit.model.input_names,
            identifier=f"fit-{i + 1}",
            source=source,
            model_words=model_label,
        )
    return Section("comparison", "Does it follow the flight it was fitted to?", tuple(blocks), folded=True)


def _series(fit: Result[Vehicle, object], pieces: Sequence[Comparison]) -> dict[str, list[Series]]:
    by_channel: dict[str, list[Series]] = {}
    for piece in pieces:
        record = piece.record
        counted = np.asarray(piece.counted) > 0
        for j, name in enumerate(record.output_names):
            by_channel.setdefault(name, []).append(
                Series(
                    record.time,
                    record.outputs[:, j],
                    np.where(counted, piece.model[:, j], np.nan),
                    np.asarray(piece.sigma)[j],
                )
            )
        if {"x", "y", "z", "phi", "theta", "psi"} <= set(record.output_names) and piece.states.shape[1] == len(
            PREDICTED
        ):
            motion = measured_states(record, _nuisance(fit, record.log))
            for j, name in enumerate(PREDICTED):
                if name not in record.output_names:
                    by_channel.setdefault(name, []).append(
                        Series(record.time, motion[:, j], np.where(counted, piece.states[:, j], np.nan))
                    )
    return by_channel


def _nuisance(fit: Result[Vehicle, object], log: str) -> Nuisance:
    """The log's own delays, trims, lever and level, the mean ones where it has none."""
    of_log = {e.name: e.value for e in fit.constants if e.record == log and e.name in Nuisance._fields}
    return (fit.nuisance or Nuisance())._replace(**of_log)


def residuals(fit: Result[Vehicle, object]) -> Section:
    """What the model left over: over time, and its autocorrelation."""
    names = fit.in_time[0].record.output_names
    timed: dict[str, list[tuple[Array, Array]]] = {name: [] for name in names}
    residuals_of: dict[str, list[Array]] = {name: [] for name in names}
    for piece in fit.in_time:
        counted = np.asarray(piece.counted) > 0
        for j, name in enumerate(names):
            rows = piece.residuals[:, j]
            timed[name].append((piece.record.time, np.where(counted, rows, np.nan)))
            residuals_of[name].append(rows[counted])
    sigma = {name: float(np.mean([c.sigma[j] for c in fit.in_time])) for j, name in enumerate(names)}
    residuals_of = {name: [rows for rows in pieces if rows.size > 1] for name, pieces in residuals_of.items()}
    dt = fit.in_time[0].record.dt
    return Section(
        "residuals",
        "Is what is left over only noise?",
        (residual_time(timed, sigma), residual_correlation(residuals_of, dt)),
        folded=True,
    )


def meanings(fit: Result[Vehicle, object], glossary: Mapping[str, str]) -> Section:
    """What each number means and where its first value comes from."""
    published = fit.start.card.parameters
    rows = [
        (
            Cell(e.name, anchor=f"meaning-{e.name}"),
            glossary.get(e.name, "") or "–",
            f"{published[e.name].source} ({published[e.name].status})",
            f"{_limit(published[e.name].lower)} to {_limit(published[e.name].upper)}",
        )
        for e in fit.estimates
        if e.name in published
    ]
    rows += [
        (Cell(name, anchor=f"meaning-{name}"), glossary.get(name, "") or "–", "estimated for each flight", "–")
        for name in dict.fromkeys(e.name for e in fit.constants)
    ]
    columns = ("parameter", "meaning [symbol of the paper]", "source of the published value", "physics allows")
    table = tabulate("Meaning and source of each parameter", columns, rows)
    return Section("meanings", "What does each number mean, and where does it come from?", (table,), folded=True)


def _limit(value: float | None) -> str:
    return "–" if value is None else value_words(value)


def warnings(fit: Result[Vehicle, object]) -> Points | None:
    """What a reader must know before using the numbers, None where there is nothing."""
    texts = [f"{e.name} ended at its physical bound." for e in fit.estimates if e.at_bound]
    heavy = [e.name for e in fit.estimates if e.prior_share > PRIOR_HEAVY and not e.tie]
    if heavy:
        texts.append(f"The prior, not the flight, decided {', '.join(heavy)}.")
    return Points(tuple(texts), title="Before you use the numbers") if texts else None
