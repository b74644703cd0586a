"""Several models flown along one flight, in one figure and one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.shown import Shown
from swashplate.validation.along_inputs import along_inputs
from swashplate.validation.verification import Verification

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class ModelComparison(Shown):
    """Models beside one flight.

    Attributes:
        found: how each model follows the flight, by the model's name.
    """

    found: Mapping[str, Verification]

    def fits(self) -> dict[str, dict[str, float]]:
        """Fit [%] by output and model: 100 (1 - rms error / rms of the flight about its mean).

        The measure of MATLAB's `compare` (the normalised root mean square error, NRMSE). 100 is perfect; 0 is as good
        as the mean; below 0 is worse than that.
        """
        outputs = dict.fromkeys(o.output for v in self.found.values() for o in v.outputs)
        return {
            name: {who: o.fit for who, v in self.found.items() for o in v.outputs if o.output == name}
            for name in outputs
        }

    def to_document(self) -> dict[str, object]:
        """Fits and warnings as JSON types."""
        warnings = {name: list(v.warnings) for name, v in self.found.items() if v.warnings}
        return {"kind": "comparison", "fit": self.fits(), "warnings": warnings}

    def save(self, path: str | Path) -> Path:
        """Write it as a JSON file, whole: `swashplate.load` reads it back."""
        from swashplate.validation import saved

        return saved.save(self, self.to_document(), path)

    def to_dataframe(self) -> pd.DataFrame:
        """Fit [%], one row an output and one column a model."""
        import pandas as pd

        return pd.DataFrame.from_dict(self.fits(), orient="index")

    def __repr__(self) -> str:
        width = max(12, *(len(name) + 2 for name in self.found))
        lines = ["Fit [%] = 100 (1 - rms error / rms of the flight about its mean)"]
        lines.append(f"  {'output':<12}" + "".join(f"{name:>{width}}" for name in self.found))
        for output, fits in self.fits().items():
            cells = (f"{fits[n]:>{width}.1f}" if n in fits else " " * (width - 1) + "-" for n in self.found)
            lines.append(f"  {output:<12}{''.join(cells)}")
        warnings = dict.fromkeys(f"! {n}: {text}" for n, v in self.found.items() for text in v.warnings)
        return "\n".join([*lines, *warnings])


def along_flights(
    named: Mapping[str, Any], flights: Flight | Sequence[Flight], *, outputs: Sequence[str] | None = None
) -> ModelComparison:
    """Models by name flown along recorded inputs; see `swashplate.compare`.

    Raises:
        SwashError: without a model.
        FlightError: an input that the flights lack, or no output that both have.
    """
    if not named:
        raise SwashError("there is no model to compare.", channel="models")
    return ModelComparison({name: along_inputs(model, flights, outputs=outputs) for name, model in named.items()})
