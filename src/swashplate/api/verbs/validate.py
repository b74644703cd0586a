"""`swash validate` and `swash compare`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FLIGHT, FromConditioned, FromFewLogs, called, drawn, strings
from swashplate.api.languages import Aircraft, Band, Logs, Names, Numbers, Renamed, Things
from swashplate.api.question import argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.case_comparison import CaseComparison
    from swashplate.api.linear_study import LinearStudy
    from swashplate.validation.compare import ModelComparison
    from swashplate.validation.validation import Validation


class Validate(FromConditioned["Validation | LinearStudy"]):
    """Predict flights from many start points and judge the predictions, next to the card and naive predictors.

    A state-space model is flown along each flight's inputs instead; --band adds how it does within the band that it
    was fitted over. Writes report.html and validation.json (verification.json) to --out.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "validation.json", "verification.json")

    vehicle: Aircraft = option(
        help="The model that is judged: a model file, or a vehicle's name.", complete="vehicle", kw_only=False
    )
    flight: Logs = option(help=f"Flight: {FLIGHT}. May be repeated.", complete="flight", kw_only=False)
    published: Aircraft | None = setting(
        default=None,
        help="the card to compare with (by default the one that it was identified from). Beside a state-space model a "
        "vehicle flies linearised in hover, as that model does; another model may be given too.",
    )
    horizons: Numbers = option(default=(0.5, 1.0, 2.0, 5.0), help="Seconds ahead, separated by commas.")
    close_loop: Names = option(
        default=(),
        metavar="AXES",
        help="Predict also with the controller of these axes (yaw,heave), as the first seconds tell it, in the place "
        "of its recorded command.",
    )
    posterior: Aircraft | None = option(
        default=None,
        metavar="FILE",
        help="A fit.json of this model: bands of predictions by models drawn from it, held against the flights.",
    )
    draws: int | None = setting(default=None, help="with --posterior: how many, 39, 79, 119 and so on.", least=39)
    band: Band | None = option(
        default=None, help="Of a state-space model: limits in Hz that it was fitted over, as 0.1-10."
    )
    as_logged: bool = setting(default=False, help="use channels even where they contradict each other")
    every: float = setting(default=0.1, help="seconds between start points", unit="s", least=0.01)
    calibration: float = setting(
        default=5.0, help="first seconds of each flight, from which delays and trims are estimated", unit="s", least=1.0
    )
    rename: Renamed | None = setting(
        default=None, help="NAME=CHANNEL, by commas: the log's CHANNEL as the model's NAME"
    )

    def answer(self, say: Say = silent) -> Validation | LinearStudy:
        from swashplate.identification.core.result import Result
        from swashplate.models.catalogue import vehicle

        text = isinstance(self.vehicle, str | Path)
        judged = vehicle(self.vehicle) if text else self.vehicle
        other = vehicle(self.published) if isinstance(self.published, str | Path) else self.published
        if self.draws is not None and self.posterior is None:
            raise SwashError("is for --posterior.", channel="--draws", hint="Add --posterior fit.json.")
        model = judged.model if isinstance(judged, Result) else judged
        draws = drawn(model, self.posterior, count=self.draws or 39)
        if model.structure is not None:
            return self._linear(model, other, say, draws=bool(draws))
        if self.band is not None:
            raise SwashError(
                f"'{self._name(model)}' is a vehicle, and a band is for state-space models.", channel="--band"
            )
        if min(self.horizons) <= 0.0:
            told = ",".join(f"{one:g}" for one in self.horizons)
            raise SwashError(f"'{told}' are not all positive.", channel="--horizons")
        from swashplate.flights.checked import check_disjoint
        from swashplate.identification.core.records import records
        from swashplate.validation.validation import Validation
        from swashplate.validation.verb import validate

        say("reading flights")
        flights = self.conditioned(self.flight)
        check_disjoint(flights, called(self.flight))
        records(flights, model)
        say("predicting (compiling takes longest the first time)")
        made = validate(
            judged,
            flights,
            published=other,
            horizons=tuple(self.horizons),
            every=self.every,
            calibration=self.calibration,
            close_loop=strings(self.close_loop),
            draws=draws,
            progress=lambda done, total: say("predicting", done=done, total=total),
        )
        assert isinstance(made, Validation)  # `records` has found the pose
        return made

    def _name(self, model: Any) -> str:
        return str(self.vehicle) if isinstance(self.vehicle, str | Path) else model.name

    def _linear(self, model: Any, other: Any, say: Say, *, draws: bool) -> LinearStudy:
        from swashplate.api.fit_linear import along_flights

        if self.close_loop or draws:
            channel = "--close-loop" if self.close_loop else "--posterior"
            raise SwashError(
                f"'{self._name(model)}' is a state-space model: it flies along the inputs.", channel=channel
            )
        return along_flights(self, model.structure, other, say)

    def write(self, answer: Any, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.validation.validation import Validation

        super().write(answer, folder, names[:2] if isinstance(answer, Validation) else names)

    def text(self, answer: Any, width: int) -> list[Any]:
        from swashplate.reporting.terminal_tables import validation_parts
        from swashplate.validation.validation import Validation

        return validation_parts(answer, width=width) if isinstance(answer, Validation) else [repr(answer)]

    def remarks(self, answer: Any) -> Sequence[str]:
        from swashplate.api.linear_study import LinearStudy

        return answer.remarks if isinstance(answer, LinearStudy) else ()

    def problems(self, answer: Any) -> Sequence[str]:
        from swashplate.api.linear_study import LinearStudy

        return answer.problems if isinstance(answer, LinearStudy) else ()


class Compare(FromFewLogs["CaseComparison | ModelComparison"], FromConditioned["CaseComparison | ModelComparison"]):
    """Put cases side by side, each against the first: frequency responses, fits (parameters, modes) or models (modes).

    Responses show coherent bands and mismatch J; fits parameters in standard deviations; models modes and responses.
    With --flight the models are simulated with the recorded inputs, and the fit of every output is printed: start
    states, shifts of the rates and biases are solved for, each model alike; all else has to come from the model.
    --out FILE.html writes a page with figures.

    Raises:
        SwashError: fewer than two cases (one model beside flights), responses beside something else, no common pair.
        FlightError: an input that the flights lack, or no output that both have.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html",)

    cases: Things = argument(
        metavar="CASE...",
        help="responses.nc, fit.json, models' files or names, or folders; in Python also a dict by name.",
    )
    flight: Logs | None = option(
        default=None,
        help="Fly the models along this flight instead. May be repeated.",
        complete="flight",
        kw_only=False,
    )
    outputs: Names | None = setting(default=None, help="channels of the flight to compare; all by default.")
    as_logged: bool = setting(default=False, help="use channels even where they contradict each other")

    def answer(self, say: Say = silent) -> CaseComparison | ModelComparison:
        from swashplate.api.compare import compare_cases

        return compare_cases(self)


compare = verb("compare", Compare)
