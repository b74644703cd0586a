"""`swash identify`: what is fitted follows from what is given."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import FLIGHT, FromConditioned, called, strings
from swashplate.api.languages import (
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
from swashplate.api.question import option, setting
from swashplate.api.saying import Say, silent
from swashplate.api.verbs.respond import load_responses
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.api.identification import Identification
    from swashplate.api.linear_study import LinearStudy


class Identify(FromConditioned["Identification | LinearStudy"]):
    """Identify a model, validate it on flights that the fit has not seen, and write a report.

    What is fitted follows from what is given:

    --vehicle and --flight: the vehicle's parameters, by maximum likelihood.

    --responses and --structure: a state-space model (compose:body+flap, a ready structure, a model file).

    --responses and --input: transfer functions with a delay; without --form the usual forms are tried.

    --flight and --structure: a state-space model along records in time.

    Writes report.html, model.toml, fit.json and (with --hold-out) validation.json or verification.json to --out. A fit
    that ends at values which physics forbids has failed: exit code 2, a report that says so, and no model. A posterior
    that did not converge is not written, and gains that are refused are said: exit code 2, and the reason.
    """

    files: ClassVar[tuple[str, ...]] = (
        "report.html", "model.toml", "fit.json", "validation.json", "verification.json", "posterior.nc",
    )  # fmt: skip

    vehicle: Aircraft | None = option(
        default=None, help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False
    )
    flight: Logs | None = option(
        default=None, help=f"Flight: {FLIGHT}. May be repeated.", complete="flight", kw_only=False
    )
    responses: Aircraft | None = option(
        default=None, help="What `swash respond` wrote: the file responses.nc or its folder."
    )
    structure: Aircraft | None = option(
        default=None,
        help="Structure of a state-space model: compose:body+flap, a name or a file; several with --search.",
    )
    hold_out: Logs | None = option(
        default=None, help="Flight that the fit never sees, to validate on.", complete="flight"
    )
    free: Names = option(
        default=("full",),
        metavar="NAMES",
        help="Ready choice (full, flight, ...) or parameter names separated by commas.",
    )
    method: str | None = option(
        default=None,
        help="filter-error (a vehicle's usual), output-error (the usual in time), prediction-error, or another's.",
    )
    outputs: Names | None = option(
        default=None, help="Channels to fit, separated by commas; all that there are by default."
    )
    fix: Values | None = option(default=None, help="Hold a parameter at a value. Repeatable.")
    tie: Texts = setting(default=(), metavar="'A = B'", help="tie a parameter to an expression. Repeatable.")
    prior: Priors | None = option(
        default=None,
        help="What is known beforehand: a card of the bench or of another flight, or one parameter; repeatable.",
    )
    keep_unexcited: bool = option(default=False, help="Also fit parameters of axes that no flight moves independently.")
    wind: bool = option(default=False, help="Estimate a horizontal wind too: flights outdoors or in strong gusts.")
    horizon: Numbers | None = option(
        default=None,
        metavar="FIRST,LAST",
        help="After maximum likelihood, minimise errors FIRST, 2 FIRST, ... LAST seconds ahead, e.g. 0.25,1.",
    )
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
    input: str | None = option(default=None, help="The input channel of transfer functions.")
    form: str | None = option(
        default=None, help='Zeros/poles of transfer functions: "1/2", "0/1+1s" (integrator), "0/0" (gain and delay).'
    )
    margins: bool = option(
        default=False, help="Also margins of the responses as open loops; bandwidth and phase delay."
    )
    gains: bool = option(default=False, help="Also suggest rate-loop gains, ArduPilot's or Rotorflight's.")
    band: Bands | None = option(
        default=None, help="Limits in Hz: 0.1-10 for all, p/lateral=0.5-12 for a pair, collective=0.3-5 for a channel."
    )
    search: bool = option(default=False, help="Try structures, drop the worst early, choose one and say why.")
    start: Values | None = option(default=None, help="Start value of a parameter of a state-space model. Repeatable.")
    start_from: Things | None = option(
        default=None,
        metavar="SOURCE",
        help="Start from a vehicle's linearisation in hover, or from models of earlier fits.",
    )
    iterations: int | None = setting(default=None, help="largest number of iterations; 60, in time 80", least=1)
    leave_out: Stretches = setting(
        default=(), help="learn nothing from these stretches, as ['10,12'], where it was touched", unit="s"
    )
    without: Texts = setting(default=(), help="pairs (r/collective) or channels that are not fitted")
    coherence: float = setting(default=0.6, help="smallest coherence that is used", least=0.0, most=1.0)
    reduce: bool = setting(default=False, help="remove parameters that the responses do not determine")
    starts: int = setting(default=4, help="number of starting points", least=1)
    seed: int = setting(default=0, help="seed of the starting points", least=0)
    gusts: str | None = setting(
        default=None, help="of filter-error in time: white (usual) or lasting, in the air of u, v, w or on p, q, r"
    )
    biases: Names = setting(default=(), help="outputs with a constant bias in each record, in time")
    shifts: bool = setting(default=True, help="estimate constants in the states' rates, in time")
    rename: Renamed | None = option(
        default=None, help="NAME=CHANNEL, by commas: the log's CHANNEL as the model's NAME, for example az=az_sid."
    )

    def answer(self, say: Say = silent) -> Identification | LinearStudy:
        kind, wanted = self._kind()
        self._refuse_others(kind, wanted)
        return _KINDS[kind](self, say)

    def _kind(self) -> tuple[str, frozenset[str]]:
        """What is fitted, and the fields that belong to it."""
        if self.responses is not None:
            transfer = self.structure is None and not self.search
            if transfer and self.input is None:
                hint = "--input CHANNEL fits transfer functions, --structure compose:body+flap a state-space model."
                raise self._missing("--input", hint)
            return ("transfer functions", _TRANSFER) if transfer else ("a state-space model", _STATE_SPACE)
        if self.flight is None:
            raise self._missing("--flight", "Name a log, or responses with --responses.")
        if self.structure is not None:
            return "a state-space model in time", _TIME
        if self.vehicle is None:
            raise self._missing("--vehicle", "Name one, or a linear model with --structure.")
        return "a vehicle", _VEHICLE

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

    def _refuse_others(self, kind: str, wanted: frozenset[str]) -> None:
        from swashplate.api.question import default_of, entries

        for name in entries(type(self)):
            if name in wanted | _ALWAYS or name.startswith("_"):
                continue
            if getattr(self, name) != default_of(type(self), name):
                raise SwashError(f"is not for {kind}.", channel=f"--{name.replace('_', '-')}")

    def _vehicle(self, say: Say) -> Identification:
        from swashplate.api.identification import identify_and_validate
        from swashplate.engine.roots import require_casadi
        from swashplate.models.catalogue import vehicle
        from swashplate.models.vehicle import Vehicle

        card = (self.prior or {}).get("")
        priors = {name: value for name, value in (self.prior or {}).items() if name}
        prior_card = None if card is None else vehicle(card).card  # pyrefly: ignore[bad-argument-type]
        given: Any = self.vehicle
        aircraft = given if isinstance(given, Vehicle) else vehicle(given)
        require_casadi()
        say("reading flights")
        seen, unseen = self.conditioned(self.flight), self.conditioned(self.hold_out)
        named, free = (called(self.flight), called(self.hold_out)), strings(self.free)
        return identify_and_validate(
            aircraft,
            seen,
            hold_out=unseen,
            free=free[0] if len(free) == 1 else free,
            method=self.method or "filter-error",
            outputs=None if self.outputs is None else strings(self.outputs),
            ties=strings(self.tie),
            fixed=self.fix,
            priors=priors or None,
            prior_card=prior_card,
            iterations=self.iterations or 60,
            keep_unexcited=self.keep_unexcited,
            wind=self.wind,
            leave_out=self.leave_out,
            horizon=self.horizon,
            residual=self.residual,
            close_loop=strings(self.close_loop),
            posterior=self.posterior,
            names=None if None in named else [*(named[0] or ()), *(named[1] or ())],
            say=say,
        )

    def _transfer_functions(self, say: Say) -> LinearStudy:
        from swashplate.api.fit_tf import fit_tf

        band, own = _split(self.band)
        if own:
            raise SwashError("takes one band for transfer functions.", channel="--band")
        return fit_tf(
            load_responses(self.responses),
            input=self.input or "",
            outputs=strings(self.outputs) or None,
            form=self.form,
            fixed=self.fix,
            band=band,
            least_coherence=self.coherence,
            margins=self.margins,
            gains=self.gains,
            hold_out=self.read(self.hold_out),
            rate=self.rate,
            cutoff=self.cutoff,
            names=self.rename,  # pyrefly: ignore[bad-argument-type]
            say=say,
        )

    def _state_space(self, say: Say) -> LinearStudy:
        from swashplate.api.fit_ss import fit_ss
        from swashplate.models.catalogue import structure

        given = self.structure.split(",") if self.search and isinstance(self.structure, str) else self.structure
        named = () if given is None else (given,) if isinstance(given, str | Path) or not _listed(given) else given
        begun: Any = [structure(one) if isinstance(one, str | Path) else one for one in named]
        band, own = _split(self.band)
        return fit_ss(
            begun,
            load_responses(self.responses),
            search=self.search,
            start=self.start,
            start_from=_sources(self.start_from),
            fixed=self.fix,
            band=band,
            bands=own,
            without=strings(self.without),
            least_coherence=self.coherence,
            reduce=self.reduce,
            starts=self.starts,
            seed=self.seed,
            gains=self.gains,
            hold_out=self.read(self.hold_out),
            rate=self.rate,
            cutoff=self.cutoff,
            names=self.rename,  # pyrefly: ignore[bad-argument-type]
            say=say,
        )

    def _in_time(self, say: Say) -> LinearStudy:
        from swashplate.api.fit_time import fit_time
        from swashplate.models.catalogue import structure

        begun: Any = structure(self.structure) if isinstance(self.structure, str | Path) else self.structure
        return fit_time(
            begun,
            self.read(self.flight),
            method=self.method or "output-error",
            outputs=strings(self.outputs) or None,
            gusts=self.gusts,
            biases=strings(self.biases),
            shifts=self.shifts,
            start=self.start,
            fixed=self.fix,
            iterations=self.iterations or 80,
            horizon=self.horizon,
            hold_out=self.read(self.hold_out),
            rate=self.rate,
            cutoff=self.cutoff,
            names=self.rename,  # pyrefly: ignore[bad-argument-type]
            say=say,
        )

    def remarks(self, answer: Any) -> list[str]:
        return list(getattr(answer, "remarks", ()))

    def text(self, answer: Any, width: int) -> list[Any]:
        if not hasattr(answer, "lines"):
            return [repr(answer)]
        from swashplate.reporting.terminal_tables import fit_table

        fit = answer.fit
        shown: list[Any] = [fit_table(fit) if hasattr(fit.solution, "card") else repr(fit)]
        shown += [f"\n{fit.posterior!r}"] if fit.posterior is not None else []
        return [*shown, "\n" + "\n".join(answer.lines())]

    def problems(self, answer: Any) -> list[str]:
        if not hasattr(answer, "refused"):
            return list(answer.problems)
        if answer.fit.failed:
            return [f"The fit failed: {' '.join(answer.fit.problems) or 'see the report.'}"]
        return [f"The fit is written, its posterior is not: {answer.refused}"] if answer.refused else []


def _listed(given: Any) -> bool:
    return isinstance(given, list | tuple)


def _sources(given: Any) -> Any:
    """A vehicle, or the places of models; texts may have several by commas."""
    if given is None or not _listed(given):
        return given
    parts = [part.strip() for one in given for part in str(one).split(",") if part.strip()]
    return parts or None


def _split(bands: Any) -> tuple[tuple[float, float] | None, dict[str, tuple[float, float]]]:
    """The band of all pairs, and those of some."""
    if bands is None or isinstance(bands, tuple):
        return bands, {}
    return bands.get(""), {name: band for name, band in bands.items() if name}


_KINDS: dict[str, Callable[[Identify, Say], Any]] = {
    "a vehicle": Identify._vehicle,
    "transfer functions": Identify._transfer_functions,
    "a state-space model": Identify._state_space,
    "a state-space model in time": Identify._in_time,
}
_ALWAYS = frozenset(
    ("hold_out", "outputs", "fix", "rate", "cutoff", "mapping", "units", "drop_bad_stamps", "as_logged")
)
_VEHICLE = frozenset(
    ("vehicle", "flight", "free", "method", "tie", "prior", "keep_unexcited", "wind", "horizon",
     "residual", "close_loop", "posterior", "iterations", "leave_out")
)  # fmt: skip
_TRANSFER = frozenset(("responses", "input", "form", "margins", "gains", "band", "coherence", "rename"))
_STATE_SPACE = frozenset(
    ("responses", "structure", "search", "start", "start_from", "gains", "band", "without", "coherence", "reduce",
     "starts", "seed", "rename")
)  # fmt: skip
_TIME = frozenset(
    ("flight", "structure", "method", "start", "horizon", "iterations", "gusts", "biases", "shifts", "rename")
)
