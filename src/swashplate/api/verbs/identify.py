"""`swash identify`: what is fitted follows from what is given. Each kind of fit is a question of its own."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FLIGHT, FromConditioned
from swashplate.api.languages import (
    Air,
    Aircraft,
    Bands,
    Logs,
    Names,
    Numbers,
    Priors,
    Renamed,
    Stretches,
    Texts,
    Things,
    Values,
)
from swashplate.api.question import Answer, VerbQuestion, default_of, entries, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.api.verbs.respond import load_responses
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from swashplate.api.linear_study import LinearStudy
    from swashplate.identification.core.result import Result
    from swashplate.models.linear.state_space import StateSpaceModel


class AnswersFit(VerbQuestion["Result[object, object]"]):
    """A verb whose answer is a fit, judged on what was held out."""

    def document(self, answer: Result[object, object]) -> Any:
        validation = answer.validation and answer.validation.to_document()
        return {"fit": answer.to_document(comparisons=False), "validation": validation}

    def write(self, answer: Result[object, object], folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.api.identification import write_fit

        write_fit(answer, folder)

    def text(self, answer: Result[object, object], width: int) -> list[Any]:
        from swashplate.api.identification import fit_parts

        return fit_parts(answer)

    def problems(self, answer: Result[object, object]) -> Sequence[str]:
        return [f"The fit failed: {' '.join(answer.problems) or 'see the report.'}"] if answer.failed else []


class Fit(FromConditioned[Answer]):
    """What every fit takes."""

    hold_out: Logs | None = option(
        default=None, help="Flight that the fit never sees, to validate on.", complete="flight"
    )
    outputs: Names | None = option(
        default=None, help="Channels to fit, separated by commas; all that there are by default."
    )
    fix: Values | None = option(default=None, help="Hold a parameter at a value. Repeatable.")

    kind: ClassVar[str]


class FitOfRecords(Fit[Answer]):
    """What fits to records in time take."""

    method: str | None = option(
        default=None,
        help="output-error (undisturbed, open loop), filter-error (disturbed air or feedback; usual where the "
        "pose was tracked), prediction-error (long records, any stationary gust), or another's.",
    )
    horizon: Numbers | None = option(
        default=None,
        metavar="FIRST,LAST",
        help="After maximum likelihood, minimise errors FIRST, 2 FIRST, ... LAST seconds ahead, e.g. 0.25,1.",
        least=0.001,
        most=600.0,
    )
    iterations: int | None = setting(default=None, help="largest number of iterations; the method's own", least=1)
    gusts: str | None = setting(
        default=None,
        help="of filter-error of a state-space model: white (usual) or lasting, in the air of u, v, w or on p, q, r",
    )
    biases: Names = setting(default=(), help="outputs with a constant bias in each record")
    shifts: bool | None = setting(
        default=None, help="estimate constants in the states' rates; usual for state-space models"
    )

    def to_estimators(self) -> dict[str, Any]:
        """The method, and what it is asked as this verb is."""
        from swashplate.identification.estimators import Question

        same = {field.name for field in dataclasses.fields(Question)} & entries(type(self)).keys() - {"free", "prior"}
        return {name: getattr(self, name) for name in ("method", *same)}


class LinearFit(Fit[Answer]):
    """What fits of linear models take."""

    rename: Renamed | None = option(
        default=None, help="NAME=CHANNEL, by commas: the log's CHANNEL as the model's NAME, for example az=az_sid."
    )

    def remarks(self, answer: Any) -> Sequence[str]:
        return answer.remarks

    def text(self, answer: Any, width: int) -> list[Any]:
        return answer.parts()

    def problems(self, answer: Any) -> Sequence[str]:
        return answer.problems


class FromResponses(LinearFit[Answer]):
    """What fits to responses take."""

    responses: Aircraft | None = option(
        default=None, help="What `swash respond` wrote: the file responses.nc or its folder.", kw_only=False
    )
    gains: bool = option(
        default=False, help="Also suggest rate-loop gains: ArduPilot's, Rotorflight's or Betaflight's."
    )
    band: Bands | None = option(
        default=None, help="Limits in Hz: 0.1-10 for all, p/lateral=0.5-12 for a pair, collective=0.3-5 for a channel."
    )
    coherence: float = setting(default=0.6, help="smallest coherence that is used", least=0.0, most=1.0)

    def split_band(self) -> tuple[tuple[float, float] | None, dict[str, tuple[float, float]]]:
        """The band of all pairs, and those of some."""
        if self.band is None or isinstance(self.band, tuple):
            return self.band, {}
        return self.band.get(""), {name: band for name, band in self.band.items() if name}


class WithStructure(LinearFit[Answer]):
    """What fits of state-space models take."""

    structure: Aircraft | None = option(
        default=None,
        help="Structure of a state-space model: compose:body+flap, a name or a file; several with --search.",
        kw_only=False,
    )
    start: Values | None = option(default=None, help="Start value of a parameter of a state-space model. Repeatable.")

    def structures(self) -> Iterator[StateSpaceModel]:
        """Those that are named or given; texts may have several by commas."""
        from swashplate.models.catalogue import structure
        from swashplate.models.linear.linear_vehicle import structure_of

        given = self.structure
        if isinstance(given, str) and not Path(given).exists():
            given = given.split(",")
        for one in () if given is None else given if isinstance(given, list | tuple) else (given,):
            yield structure_of(structure(one) if isinstance(one, str | Path) else one)


class FitVehicle(AnswersFit, FitOfRecords["Result[object, object]"]):
    """Identify a model from flights, and predict with it those that are held out, as `validation` of the result.

    Raises:
        IdentificationError: where no fit can be started: no method suits, unknown names, parameters without a trace.
        FlightError: a flight that lacks a channel, or is on no uniform grid.
        CardError: a prior card of another vehicle.
    """

    vehicle: Aircraft | None = option(
        default=None, help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False
    )
    flight: Logs | None = option(
        default=None,
        help=f"Flight: {FLIGHT}. May be repeated; in Python also measured responses.",
        complete="flight",
        kw_only=False,
    )
    free: Names | None = option(
        default=None,
        metavar="NAMES",
        help="Ready choice (full, flight, ...) or parameter names separated by commas; full where there is that.",
    )
    tie: Texts = setting(default=(), metavar="'A = B'", help="tie a parameter to an expression. Repeatable.")
    prior: Priors | None = option(
        default=None,
        help="What is known beforehand: a card of the bench or of another flight, or one parameter; repeatable.",
    )
    keep_unexcited: bool = option(default=False, help="Also fit parameters of axes that no flight moves independently.")
    wind: bool = option(default=False, help="Estimate a horizontal wind too: flights outdoors or in strong gusts.")
    residual: bool = option(
        default=False,
        help="Also fit accelerations that the equations lack, linear in motion and inputs, as far as blocks of the "
        "flights that are left out speak for them; with --horizon to the errors ahead (for predictions only).",
    )
    close_loop: Names = option(
        default=(),
        metavar="AXES",
        help="Predict the hold-outs also with the controller of these axes (yaw,heave), as the first seconds tell it, "
        "in the place of its recorded command.",
    )
    posterior: str | None = option(
        default=None,
        metavar="laplace|nuts",
        help="Draw models from the fit's uncertainty, into posterior.nc (for ArviZ) and for Monte Carlo: laplace "
        "(normal, fast) or nuts (from the likelihood, minutes).",
    )
    environment: Air | None = setting(
        default=None, help="air_density, gravity, wind, for equations of your own; the card's where not given"
    )
    leave_out: Stretches = setting(
        default=(), help="learn nothing from these stretches, as ['10,12'], where it was touched", unit="s"
    )

    kind = "a vehicle"

    def answer(self, say: Say = silent) -> Result[object, object]:
        from swashplate.api.identification import identify_vehicle

        return identify_vehicle(self, say)

    def problems(self, answer: Result[object, object]) -> Sequence[str]:
        refused = self.posterior is not None and answer.posterior is None and not answer.failed
        told = [f"The fit is written, its posterior is not: {answer.warnings[-1]}"] if refused else []
        return told or super().problems(answer)


class FitTransferFunctions(FromResponses["LinearStudy"]):
    """Fit transfer functions with a delay to responses; without a form the usual ones are tried and one is suggested.

    Raises:
        IdentificationError: no coherent response, a fixed name that the form does not have, or a hold-out for a form
            that cannot be flown.
        FlightError: a hold-out flight without the model's channels.
    """

    input: str | None = option(default=None, help="The input channel of transfer functions; the only one by default.")
    form: str | None = option(
        default=None, help='Zeros/poles of transfer functions: "1/2", "0/1+1s" (integrator), "0/0" (gain and delay).'
    )
    margins: bool = option(
        default=False, help="Also margins of the responses as open loops; bandwidth and phase delay."
    )

    kind = "transfer functions"

    def answer(self, say: Say = silent) -> LinearStudy:
        from swashplate.api.fit_linear import transfer_functions

        return transfer_functions(self, say)


class FitStateSpace(FromResponses["LinearStudy"], WithStructure["LinearStudy"]):
    """Fit a state-space model to responses, with accuracy figures, and verify it in time on what it has not seen.

    Raises:
        CardError: a name that the model does not have, or a value outside its bounds.
        IdentificationError: channels that do not meet, no coherent response, parameters without a trace.
        FlightError: a hold-out flight without the model's channels.
        SwashError: several structures, or none, without a search; a search that is to start from something.
    """

    search: bool = option(default=False, help="Try structures, drop the worst early, choose one and say why.")
    start_from: Things | None = option(
        default=None,
        metavar="SOURCE",
        help="Start from a vehicle's linearisation in hover, or from models of earlier fits.",
    )
    without: Texts = setting(default=(), help="pairs (r/collective) or channels that are not fitted")
    reduce: bool = setting(default=False, help="remove parameters that the responses do not determine")
    starts: int = setting(default=4, help="number of starting points", least=1)
    seed: int = setting(default=0, help="seed of the starting points", least=0)

    kind = "a state-space model"

    def answer(self, say: Say = silent) -> LinearStudy:
        from swashplate.api.fit_linear import state_space

        return state_space(self, say)


class FitInTime(FitOfRecords["LinearStudy"], WithStructure["LinearStudy"]):
    """Fit a state-space model, delays included, to records in time by maximum likelihood, and verify it on others.

    Without hold-outs the records of the fit are shown, and marked as such.
    """

    flight: Logs | None = option(default=None, help=f"Flight: {FLIGHT}.", complete="flight", kw_only=False)

    kind = "a state-space model in time"

    def answer(self, say: Say = silent) -> LinearStudy:
        from swashplate.api.fit_linear import in_time

        return in_time(self, say)


class Identify(FitVehicle, FitTransferFunctions, FitStateSpace, FitInTime):  # pyrefly: ignore[invalid-inheritance]
    """Identify a model, validate it on flights that the fit has not seen, and write a report.

    What is fitted follows from what is given:

    --vehicle and --flight: the vehicle's parameters, by maximum likelihood.

    --responses and --structure: a state-space model (compose:body+flap, a ready structure, a model file).

    --responses and --input: transfer functions with a delay; without --form the usual forms are tried. With --gains the
    rate that the input commands is fitted, and its gains are suggested.

    --flight and --structure: a state-space model along records in time.

    Writes report.html, model.toml, fit.json and (with --hold-out) validation.json or verification.json to --out. A fit
    that ends at values which physics forbids has failed: exit code 2, a report that says so, and no model. A posterior
    that did not converge is not written, and gains that are refused are said: exit code 2, and the reason.
    """

    files: ClassVar[tuple[str, ...]] = (
        "report.html", "model.toml", "fit.json", "validation.json", "verification.json", "posterior.nc",
    )  # fmt: skip

    def answer(self, say: Say = silent) -> Any:
        of = self._kind()
        own, every = entries(of), entries(type(self))
        for name in every:
            if name not in own and getattr(self, name) != default_of(type(self), name):
                raise SwashError(f"is not for {of.kind}.", channel=f"--{name.replace('_', '-')}")
        return of(**{name: getattr(self, name) for name in own}).answer(say)

    def _kind(self) -> type[Fit[Any]]:
        """What is fitted."""
        if self.responses is not None:
            if self.structure is not None or self.search:
                return FitStateSpace
            return FitTransferFunctions
        if self.flight is None:
            raise self._missing("--flight", "Name a log, or responses with --responses.")
        if self.structure is not None:
            return FitInTime
        if self.vehicle is None:
            raise self._missing("--vehicle", "Name one, or a linear model with --structure.")
        return FitVehicle

    def _missing(self, which: str, hint: str) -> SwashError:
        """What was typed is judged before what was not."""
        from swashplate.models.catalogue import vehicle

        if isinstance(self.vehicle, str) and not Path(self.vehicle).exists():
            vehicle(self.vehicle)
        self.read(self.flight)
        self.read(self.hold_out)
        if self.responses is not None:
            load_responses(self.responses)
        return SwashError("is missing.", channel=which, hint=hint)

    def remarks(self, answer: Any) -> Sequence[str]:
        return self._kind().remarks(self, answer)

    def document(self, answer: Any) -> Any:
        return self._kind().document(self, answer)

    def write(self, answer: Any, folder: Path, names: tuple[str, ...]) -> None:
        self._kind().write(self, answer, folder, names)

    def text(self, answer: Any, width: int) -> list[Any]:
        return self._kind().text(self, answer, width)

    def problems(self, answer: Any) -> Sequence[str]:
        return self._kind().problems(self, answer)


identify = verb("identify", FitVehicle)
fit_tf = verb("fit_tf", FitTransferFunctions)
fit_ss = verb("fit_ss", FitStateSpace)
