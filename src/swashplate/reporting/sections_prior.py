"""Section on priors: which number came from where, and whether flight and bench disagree."""

from __future__ import annotations

import math

from swashplate.identification.core.parameters import FROM_CARD
from swashplate.identification.core.result import APART, Estimate, Result
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Block, Cell, Row, Section, Text, tabulate
from swashplate.reporting.theme import unit_words
from swashplate.reporting.words import listed, percent, sigma_words, value_words


def prior(fit: Result[Vehicle, object]) -> Section | None:
    """Prior and flight side by side, None where no prior came from a card."""
    estimates = [e for e in fit.estimates if e.prior_source.startswith(FROM_CARD)]
    held = [name for name in fit.settings.get("held at the prior card", ()) if name in fit.model.card.parameters]
    if not estimates and not held:
        return None
    apart = [e for e in estimates if math.isfinite(e.disagreement) and abs(e.disagreement) > APART]
    comparable = [e for e in estimates if math.isfinite(e.disagreement)]
    verdict = (
        f"Flight and prior disagree by more than {APART:g} σ in {listed(e.name for e in apart)}. Either "
        "they measure different things, or one standard deviation is too small; the joined value agrees with neither."
        if apart
        else f"Flight and prior agree within {APART:g} σ in what both can see: {listed(e.name for e in comparable)}."
        if comparable
        else "The flight says nothing beyond the prior, so the two cannot disagree."
    )
    blocks: list[Block] = [Text(verdict, tone="bad" if apart else "good" if comparable else "plain")]
    if estimates:
        blocks.append(
            tabulate(
                "What the prior said, what the flight says alone, and both together",
                (
                    "parameter",
                    "unit",
                    "prior",
                    "±σ",
                    "flight alone",
                    "both",
                    "±σ",
                    "prior share",
                    "apart [σ]",
                    "prior from",
                ),
                tuple(_row(e) for e in estimates),
                note="Flight alone: without the prior's information, one parameter at a time. Apart: the "
                "difference of flight alone and prior, over its standard deviation, coloured residuals allowed for. "
                "It is a linear extrapolation: far from the prior only its direction counts.",
            )
        )
    if held:
        card = fit.model.card.parameters
        rows = tuple(
            (
                name,
                unit_words(card[name].unit),
                value_words(fit.start.card.parameters[name].value),
                value_words(card[name].value, card[name].sigma),
                sigma_words(card[name].sigma),
                card[name].source,
            )
            for name in held
        )
        blocks.append(
            tabulate("Held at the prior card", ("parameter", "unit", "published", "held at", "±σ", "from"), rows)
        )
    return Section("prior", "Do prior and flight agree?", tuple(blocks), folded=True)


def _row(e: Estimate) -> Row:
    apart = math.isfinite(e.disagreement) and abs(e.disagreement) > APART
    return (
        Cell(e.name, link=f"meaning-{e.name}"),
        unit_words(e.unit),
        value_words(e.prior_mean, e.prior_sigma),
        sigma_words(e.prior_sigma),
        value_words(e.alone, e.prior_sigma),
        Cell(value_words(e.value, e.sigma_corrected), number=True, strong=True),
        sigma_words(e.sigma_corrected),
        f"{percent(100.0 * e.prior_share)} %",
        Cell(f"{e.disagreement:+.1f}" if math.isfinite(e.disagreement) else "–", number=True,
             tone="bad" if apart else "plain"),
        e.prior_source.removeprefix(FROM_CARD)
    )  # fmt: skip
