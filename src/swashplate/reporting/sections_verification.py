"""The section on an identified linear model's verification in time."""

from __future__ import annotations

import numpy as np

from swashplate.flights.schema import channel
from swashplate.reporting.figures_responses import verification_figure
from swashplate.reporting.structure import Block, Cell, Section, Text, tabulate
from swashplate.reporting.theme import shown, unit_words
from swashplate.reporting.words import value_words
from swashplate.validation.refutation import REFUTED
from swashplate.validation.verification import GOOD_TIC, Verification

_TRACES = 4
"""Stretches that are drawn."""


def verification_section(v: Verification) -> Section:
    rival = v.other
    rows = tuple(
        (
            o.output,
            unit_words(channel(o.output).shown_unit or o.unit),
            value_words(float(shown(o.output, np.array(o.rms)))),
            Cell(f"{o.theil:.2f}", number=True, tone="good" if o.theil <= GOOD_TIC else "caution"),
            f"{o.fit:.0f}",
        )
        for o in v.outputs
    )
    tone = "bad" if v.verdict == REFUTED else "good" if v.good else "caution"
    blocks: list[Block] = [Text(text, tone=tone) for text in v.headline]
    blocks += [Text(text, tone="caution") for text in v.warnings]
    if v.inside is not None:
        low, high = v.inside.settings["band_hz"]
        theil = ", ".join(f"{o.output} {o.theil:.2f}" for o in v.inside.outputs)
        blocks.append(
            Text(
                f"Between {low:g} and {high:g} Hz, the band of the fit: J_rms = {v.inside.cost:.2f}, Theil {theil}.",
                tone="good" if v.inside.good else "caution",
            )
        )
    blocks.append(
        tabulate(
            "Along records of the fit" if v.fitted_sources else "Along unseen records",
            ("output", "unit", "rms error", "Theil", "fit %"),
            rows,
            note=f"Theil's coefficient up to {GOOD_TIC:g} is good (1: of no use). Biases and shifts are solved for per "
            "record.",
        )
    )
    blocks += [Text(f"{f.channel}: fit {f.fit:.0f} %, {f.scatter}{f.summary_text}", tone="quiet") for f in v.floors]
    if rival is not None:
        theirs = tuple((o.output, f"{o.theil:.2f}", f"{o.fit:.0f}") for o in rival.outputs)
        rival_summary = f"{rival.model.name}: {rival.verdict}; J_rms = {rival.cost:.2f}, {rival.constants} constants."
        blocks.append(Text(rival_summary))
        blocks.append(tabulate(f"{rival.model.name} on the same records", ("output", "Theil", "fit %"), theirs))
        if not {t.source for t in rival.traces} & {t.source for t in v.traces}:
            blocks.append(Text(f"{rival.model.name} is not drawn: it was flown in other stretches.", tone="quiet"))
    outputs = tuple(o.output for o in v.outputs)
    for k, trace in enumerate(v.traces[:_TRACES]):
        twins = [t for t in rival.traces if t.source == trace.source] if rival is not None else []
        other = (rival.model.name, twins[0], [o.output for o in rival.outputs]) if rival and twins else None
        blocks.append(verification_figure(trace, outputs, v.inputs, number=k, units=v.units, rival=other))
    return Section("verification", "Does it follow flights in time?", tuple(blocks), folded=True)
