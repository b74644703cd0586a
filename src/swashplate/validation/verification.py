"""What a verification in time found: per output, the traces to look at, the verdict and its reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.sources import DataSource
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.validation.floors import Floor
from swashplate.validation.refutation import STANDS, Judgement
from swashplate.validation.saved import SavedWhole

GOOD_J, GOOD_TIC = 2.0, 0.30
"""J_rms and Theil's coefficient up to which a rotorcraft model is called good (Tischler and Remple 2012)."""


@dataclass(frozen=True)
class OutputVerification:
    """One output over all records.

    Attributes:
        output, unit: the channel. rms: of the error [unit]. theil: rms(error) / (rms(flight) + rms(model)).
        fit: 100 (1 - rms error / rms of the flight) [%].
    """

    output: str
    unit: str
    rms: float
    theil: float
    fit: float


@dataclass(frozen=True)
class Trace:
    """One stretch: time [s], flight and model (n, n_outputs), inputs (n, n_inputs), what was solved for."""

    source: str
    time: Array
    flight: Array
    model: Array
    inputs: Array
    biases: Mapping[str, float]
    shifts: Mapping[str, float]


@dataclass(frozen=True)
class Verification(SavedWhole):
    """How an identified model follows unseen records.

    Attributes:
        model: what was flown. cost: J_rms. outputs: per output. traces: to look at.
        warnings: what a reader must know. data: the records, as a fit's `data`.
        inside: the same within the fitted band alone, where one was asked for.
        judgement: whether the records refute the model, and why. rivals: J_rms of the naive predictors.
        other: another model on the same records, where one was asked for.
        constants, samples: numbers solved for, and numbers compared.
        floors: what the fits stand beside, by output.
        inputs: names of the model's inputs, in the order of the traces'. units: of inputs and outputs, by name.
        fitted_sources: sources of stretches that the fit has seen: no hold-out.
    """

    model: StateSpaceModel | Vehicle
    cost: float
    outputs: tuple[OutputVerification, ...]
    traces: tuple[Trace, ...]
    warnings: tuple[str, ...]
    data: tuple[DataSource, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)
    inside: Verification | None = None
    judgement: Judgement | None = None
    rivals: Mapping[str, float] = field(default_factory=dict)
    constants: int = 0
    samples: int = 0
    floors: tuple[Floor, ...] = ()
    inputs: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    fitted_sources: tuple[str, ...] = ()
    other: Verification | None = None

    @property
    def good(self) -> bool:
        """Whether the book would call it good, no naive rival is as close, and the records stand behind it."""
        close = self.cost <= GOOD_J and all(o.theil <= GOOD_TIC for o in self.outputs)
        return close and self.verdict == STANDS and self.cost < min(self.rivals.values(), default=np.inf)

    @property
    def verdict(self) -> str:
        """ "refuted", "not refuted" or "cannot be judged"."""
        return "cannot be judged" if self.judgement is None else self.judgement.verdict

    @property
    def headline(self) -> tuple[str, ...]:
        """The verdict with its reasons, and what the figures stand beside."""
        judged = self.judgement
        share = (
            ""
            if judged is None or not np.isfinite(judged.share)
            else (
                f" Behind the noise filter its predictions miss {100.0 * judged.share:.2g} % of what the controls do."
            )
        )
        rivals = ", ".join(f"{name} {cost:.2f}" for name, cost in self.rivals.items())
        stretches, length = len(self.traces), self.settings.get("stretch_s", float("nan"))
        return (
            f"{self.verdict.upper()}: {' '.join(judged.reasons) if judged else ''}{share}",
            f"J_rms = {self.cost:.2f} (good up to {GOOD_J:g}), largest Theil {max(o.theil for o in self.outputs):.2f} "
            f"(good up to {GOOD_TIC:g}); naive rivals: {rivals}.",
            f"{self.constants} constants solved for, {self.samples} samples compared, {stretches} stretches of up to "
            f"{length:.3g} s.",
        )

    def __getitem__(self, output: str) -> OutputVerification:
        return next(o for o in self.outputs if o.output == output)

    def to_document(self) -> dict[str, object]:
        """Numbers and words as JSON types (no time histories)."""
        return {
            "kind": "verification",
            "model": self.model.name,
            "J_rms": self.cost,
            "good": self.good,
            "verdict": self.verdict,
            "reasons": list(self.judgement.reasons) if self.judgement else [],
            "missed_share": self.judgement.share if self.judgement else None,
            "says_nothing_about": list(self.judgement.silent) if self.judgement else [],
            "findings": [vars(f) for f in self.judgement.findings] if self.judgement else [],
            "J_rms_of_rivals": dict(self.rivals),
            "constants": self.constants,
            "samples": self.samples,
            "stretch_s": self.settings.get("stretch_s"),
            "outputs": [vars(o) for o in self.outputs],
            "floors": [vars(floor) | {"words": floor.summary_text} for floor in self.floors],
            "records": [{"source": t.source, "biases": dict(t.biases), "shifts": dict(t.shifts)} for t in self.traces],
            "warnings": list(self.warnings),
            "flights": [vars(one) | {"history": [vars(step) for step in one.history]} for one in self.data],
            "band_hz": self.settings.get("band_hz"),
            "inside_band": None if self.inside is None else self.inside.to_document() | {"flights": []},
        }

    def __repr__(self) -> str:
        band = self.settings.get("band_hz")
        where = " between {:g} and {:g} Hz".format(*band) if band else ""
        lines = [f"{self.model.name} in time{where}", *(f"  {text}" for text in self.headline)]
        lines.append(f"  {'output':<10}{'rms error':>12}  {'unit':<8}{'Theil':>7}{'fit %':>8}")
        for o in self.outputs:
            lines.append(f"  {o.output:<10}{o.rms:>12.4g}  {o.unit:<8}{o.theil:>7.2f}{o.fit:>8.1f}")
        lines += [f"  {floor.channel}: {floor.scatter}{floor.summary_text}" for floor in self.floors]
        lines += [f"! {text}" for text in self.warnings]
        lines += [repr(self.inside)] if self.inside is not None else []
        return "\n".join([*lines, "", repr(self.other)] if self.other is not None else lines)
