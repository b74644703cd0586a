"""`swash validate` and `swash compare`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FLIGHT, FromConditioned, FromFewLogs, called, drawn, strings
from swashplate.api.languages import Aircraft, Band, Drawn, Logs, Names, Numbers, Renamed, Things
from swashplate.api.question import argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.compare import CaseComparison
    from swashplate.validation.along_inputs import ModelComparison
    from swashplate.validation.validation import Validation
    from swashplate.validation.verification import Verification


class Validate(FromConditioned["Validation | Verification"]):
    """Predict flights from many start points and judge the predictions, next to the card and naive predictors.

    So is a vehicle with the states of a rigid body, in flights whose pose was tracked. Any other model is flown along
    each flight's inputs; start states, shifts and biases are solved for. --band adds how a state-space model does
    within the band that it was fitted over. Writes report.html and validation.json (verification.json) to --out.

    Raises:
        FlightError: no record that is long enough, or flights that lack what the model needs.
        SwashError: an axis whose loop cannot be closed, draws that are too few or of another model, or what such a
            model has no use for.
        CardError: an identified vehicle that does not say what it was identified from, and no `published`.
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
    horizons: Numbers = option(
        default=(0.5, 1.0, 2.0, 5.0), help="Seconds ahead, separated by commas.", least=0.001, most=600.0
    )
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
    draws: Drawn | None = setting(
        default=None, help="with --posterior: how many, 39, 79, 119 and so on; in Python also models.", least=39
    )
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

    def answer(self, say: Say = silent) -> Validation | Verification:
        from swashplate.identification.core.result import Result
        from swashplate.models.catalogue import started_from, vehicle
        from swashplate.models.linear.state_space import StateSpaceModel
        from swashplate.validation.along_inputs import fitted, verify_vehicle

        judged = vehicle(self.vehicle) if isinstance(self.vehicle, str | Path) else fitted(self.vehicle)
        other = vehicle(self.published) if isinstance(self.published, str | Path) else self.published
        if isinstance(self.draws, int) and self.posterior is None:
            raise SwashError("is for --posterior.", channel="--draws", hint="Add --posterior fit.json.")
        model = judged.model if isinstance(judged, Result) else judged
        linear = model if isinstance(model, StateSpaceModel) else model.structure
        if linear is None and self.band is not None:
            raise SwashError(
                f"'{self._name(model)}' is a vehicle, and a band is for state-space models.", channel="--band"
            )
        if linear is not None:
            from swashplate.api.fit_linear import along_flights

            self._along(model, close_loop=self.close_loop, posterior=self.posterior, draws=self.draws)
            say("flying the model along the inputs")
            return along_flights(self, linear, other)
        from swashplate.flights.checked import check_disjoint
        from swashplate.identification.core.records import records
        from swashplate.identification.time.kinematics import PREDICTED
        from swashplate.validation.validate import validate

        count = self.draws if isinstance(self.draws, int) else 39
        draws = self.draws if isinstance(self.draws, tuple) else drawn(model, self.posterior, count=count)
        say("reading flights")
        flights = self.conditioned(self.flight)
        check_disjoint(flights, called(self.flight))
        if not set(PREDICTED) <= set(model.state_names):
            self._along(model, close_loop=self.close_loop, posterior=draws, published=other)
            return verify_vehicle(model, flights)
        records(flights, model)
        say("predicting (compiling takes longest the first time)")
        return validate(
            model,
            flights,
            published=other or (judged.start if isinstance(judged, Result) else started_from(model)),
            fitted=[seen.record for seen in judged.in_time] if isinstance(judged, Result) else (),
            horizons=tuple(self.horizons),
            every=self.every,
            calibration=self.calibration,
            close_loop=strings(self.close_loop),
            draws=draws,
            progress=lambda done, total: say("predicting", done=done, total=total),
        )

    def _name(self, model: Any) -> str:
        return str(self.vehicle) if isinstance(self.vehicle, str | Path) else model.name

    def _along(self, model: Any, **unused: Any) -> None:
        """Refuse what is nothing to a model that is flown along the inputs."""
        for name, value in unused.items():
            if value:
                raise SwashError(
                    f"is nothing for '{self._name(model)}': it flies along the recorded inputs.",
                    channel=f"--{name.replace('_', '-')}",
                )

    def write(self, answer: Any, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.validation.validation import Validation

        other = "verification.json" if isinstance(answer, Validation) else "validation.json"
        super().write(answer, folder, tuple(name for name in names if name != other))

    def text(self, answer: Any, width: int) -> list[Any]:
        from swashplate.reporting.terminal_tables import validation_parts
        from swashplate.validation.validation import Validation

        return validation_parts(answer, width=width) if isinstance(answer, Validation) else [repr(answer)]

    def problems(self, answer: Any) -> Sequence[str]:
        from swashplate.identification.responses.response_warnings import damaged
        from swashplate.validation.verification import Verification

        return damaged(answer.data) if isinstance(answer, Verification) else ()


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
validate = verb("validate", Validate)
