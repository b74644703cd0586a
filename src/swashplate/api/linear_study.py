"""What the verbs on linear models return: fits, verification in time, margins and gains, as one object."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from swashplate import atomic
from swashplate.api.report_folder import ReportFolder
from swashplate.identification.core.result import Result
from swashplate.identification.frequency.handling_readings import Line
from swashplate.identification.responses.response_warnings import damaged
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import to_toml
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.response_report import compose_responses
from swashplate.reporting.sections_responses import ResponseMaterial
from swashplate.reporting.structure import Report
from swashplate.validation.verification import Verification


@dataclass(frozen=True, repr=False)
class LinearStudy(ReportFolder):
    """A linear model: how it was fitted, how it follows records, and what can be read off it.

    Attributes:
        material: responses, fits, trials, search, verification and gains, as far as there are any.
        margins: read off the responses and the model.
        structure: matrices of named expressions, which `model` is made of; None where there is no model.
        remarks: what the user must know beside the fit's own warnings.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "fit.json", "model.toml", "verification.json")

    material: ResponseMaterial
    margins: tuple[Line, ...] = ()
    structure: StateSpaceModel | None = None
    remarks: tuple[str, ...] = ()

    @property
    def fit(self) -> Result[object, object] | None:
        """The fit: of a state-space model or of transfer functions."""
        m = self.material
        return m.fit or m.time_fit or (m.transfer_functions[0] if m.transfer_functions else None)

    @cached_property
    def model(self) -> Vehicle | None:
        """The vehicle, as `swashplate.vehicle` loads it; None where there is none."""
        return None if self.structure is None else linear_vehicle(self.structure)

    @property
    def verification(self) -> Verification | None:
        """How the model follows records, in time."""
        return self.material.verification

    @property
    def problems(self) -> tuple[str, ...]:
        """What could not be computed, gains that are refused, logs that are damaged; empty where all is well."""
        own = () if self.fit is None else self.fit.problems
        refused = tuple(f"{one.axis}: {one.refused}" for one in self.material.gains if one.refused)
        logs = (*(self.fit.data if self.fit else ()), *(self.verification.data if self.verification else ()))
        return (*own, *refused, *dict.fromkeys(damaged(logs)))

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        verification = self.verification and self.verification.to_document()
        if self.fit is None:
            return dict(verification or {})
        document: dict[str, object] = {"fit": self.fit.to_document(comparisons=False), "verification": verification}
        if self.material.time_fit is not None:
            return document
        tried = [{"form": t.form.text, "J": t.cost, "unsound": t.unsound} for t in self.material.trials]
        gains = [suggestion.to_document() for suggestion in self.material.gains]
        if self.material.search is not None:
            document["search"] = self.material.search.to_document()
        return document | {"margins": [line.to_document() for line in self.margins], "gains": gains, "tried": tried}

    def parts(self) -> list[Any]:
        """What a terminal shows."""
        return [repr(self)]

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return compose_responses(self.material, title=title)

    def write(self, folder: Path) -> None:
        super().write(folder)
        if self.fit is not None:
            self.fit.save(folder / "fit.json")
        if self.structure is not None:
            atomic.write_text(folder / "model.toml", to_toml(self.structure))
        if self.verification is not None:
            self.verification.save(folder / "verification.json")

    def __repr__(self) -> str:
        m, parts = self.material, []
        parts += [repr(m.search)] if m.search is not None else []
        if m.trials:
            rows = [
                f"  {t.form.text:<14}{t.parameters:>3} parameters   J = {t.cost:8.1f}   {t.unsound}".rstrip()
                for t in m.trials
            ]
            parts.append("\n".join(["Structures tried (zeros/poles):", *rows]))
        if self.fit is not None:
            parts.append("\n".join([repr(self.fit), *map(repr, self.margins)]))
        parts += [repr(m.verification)] if m.verification is not None else []
        parts += [repr(suggestion) for suggestion in m.gains]
        return "\n\n".join(parts)


_PIECE = re.compile(r"(?P<source>.+) (?P<start>-?[\d.]+)-(?P<stop>-?[\d.]+) s")


def marked(verification: Verification, sources: Sequence[str]) -> Verification:
    """The verification, with what of it lies in what the fit was made from, and a warning of that.

    Args:
        sources: names of the fit's records, "log 3.00-9.00 s" each.
    """
    fitted = [m for m in map(_PIECE.fullmatch, sources) if m]
    used = [
        trace.source
        for trace in verification.traces
        if (t := _PIECE.fullmatch(trace.source))
        and any(
            f["source"] == t["source"] and float(f["start"]) < float(t["stop"]) and float(t["start"]) < float(f["stop"])
            for f in fitted
        )
    ]
    if not used:
        return verification
    words = f"NOT A HOLD-OUT: the fit has seen {', '.join(used)}."
    return replace(verification, warnings=(words, *verification.warnings), fitted_sources=tuple(used))
