"""The verb `track`: a log replayed as a stream through recursive estimators, and their C."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from swashplate.api.fit_ss import linear
from swashplate.api.report_folder import ReportFolder
from swashplate.api.saying import Say, silent
from swashplate.atomic import write_text
from swashplate.errors import FlightError, IdentificationError
from swashplate.export.c_text import Precision
from swashplate.export.formats import Export
from swashplate.export.regression_c import RegressionCode, regression_code
from swashplate.flights.conditioning.uniform_records import with_names
from swashplate.flights.flight import Flight
from swashplate.identification.recursive.equation import RegressionEquation, regression_equation
from swashplate.identification.recursive.fourier_regression import RecursiveRegression, RegressionPlan, regression_plan
from swashplate.identification.recursive.model_equations import model_equations
from swashplate.identification.recursive.tracked import TrackedEquation, stream_of, tracked
from swashplate.json_text import as_json
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Report
from swashplate.reporting.tracking import coefficient_unit, compose_tracking

_MEGAHERTZ = 216.0
"""Clock of the slowest Cortex-M7 in flight controllers."""


@dataclass(frozen=True, repr=False)
class Tracking(ReportFolder):
    """Recursive estimates along a stream.

    Attributes:
        source: the log's name. simulated: whether it was one.
        equations: each along the stream.
        notes: what a user must know of them.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "track.json")

    source: str
    simulated: bool
    equations: tuple[TrackedEquation, ...]
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> tuple[float, float]:
        """The last estimate of a coefficient and its standard error.

        Raises:
            KeyError: a name that no equation has, or one that was never told.
        """
        for one in self.equations:
            if one.final is not None and name in one.names:
                i = one.names.index(name)
                return float(one.final.values[i]), float(one.final.sigmas[i])
        raise KeyError(name)

    @property
    def problems(self) -> tuple[str, ...]:
        """Equations whose coefficients the stream never told apart, or lost again."""
        return tuple(f"'{e.plan.equation.text}' was not told apart." for e in self.equations if e.final is None)

    def to_document(self) -> dict[str, Any]:
        """All of it as what becomes JSON."""
        return {
            "source": self.source,
            "simulated": self.simulated,
            "notes": list(self.notes),
            "equations": [_document(one) for one in self.equations],
        }

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return compose_tracking(self.source, self.equations, self.notes, simulated=self.simulated, title=title)

    def write(self, folder: Path) -> None:
        super().write(folder)
        write_text(folder / "track.json", as_json(self.to_document()))

    def code(self, *, precision: Precision = "double") -> Export:
        """The estimators as C, a file pair each; `.save(folder)` writes it, its notes say what it costs."""
        pieces = [
            regression_code(one.plan, name=f"track_{one.plan.equation.left}", precision=precision)
            for one in self.equations
        ]
        texts = {name: text.encode() for piece in pieces for name, text in piece.files().items()}
        return Export(texts, tuple(map(_cost, pieces, (1.0 / one.plan.dt for one in self.equations))))

    def __repr__(self) -> str:
        parts = [f"{self.source}: {len(self.equations)} equations in flight"]
        for one in self.equations:
            parts.append(f"\n{one.plan.equation.text}   ({one.counted:.1f} s counted)")
            if one.final is None:
                parts.append("  not told apart by this stream")
                continue
            for i, name in enumerate(one.names):
                unit = coefficient_unit(one.plan.equation, name)
                parts.append(f"  {name:<14}{one.final.values[i]:>13.6g} +- {one.final.sigmas[i]:<9.2g} {unit}".rstrip())
            parts += [f"  stood still {s.start:.2f} to {s.stop:.2f} s: {s.why}" for s in one.frozen[:5]]
            parts += [f"  and {len(one.frozen) - 5} more stretches"] if len(one.frozen) > 5 else []
        return "\n".join([*parts, *(["", *self.notes] if self.notes else [])])


def _document(one: TrackedEquation) -> dict[str, Any]:
    plan, e = one.plan, one.plan.equation
    return {
        "equation": e.text,
        "rate": 1.0 / plan.dt,
        "hertz": plan.hertz,
        "memory": plan.memory,
        "held": plan.held,
        "delays": dict(e.delays),
        "units": {name: coefficient_unit(e, name) for name in e.names},
        "seconds_counted": one.counted,
        "values": None if one.final is None else dict(zip(e.names, one.final.values, strict=True)),
        "sigmas": None if one.final is None else dict(zip(e.names, one.final.sigmas, strict=True)),
        "covariance": None if one.final is None else one.final.covariance,
        "time": one.time,
        "values_over_time": one.values,
        "sigmas_over_time": one.sigmas,
        "stood_still": [{"start": s.start, "stop": s.stop, "why": s.why} for s in one.frozen],
    }


def _cost(code: RegressionCode, rate: float) -> str:
    every = max(1, round(rate / 20.0))
    share = 100.0 * code.load(rate=rate, megahertz=_MEGAHERTZ, every=every)
    return (
        f"{code.name}: {code.memory_bytes + code.work_bytes} bytes of memory, {code.table_bytes} of tables; "
        f"{code.step_operations} operations a step, {code.estimate_operations} an estimate: about {share:.1f} % of "
        f"{_MEGAHERTZ:g} MHz at {rate:g} steps and {rate / every:g} estimates a second, if an operation takes 5 cycles."
    )


def recursive_estimator(
    equation: str | RegressionEquation,
    *,
    rate: float,
    band: tuple[float, float] = (0.1, 2.5),
    spacing: float | None = None,
    memory: float | None = None,
    held: Sequence[str] = (),
    delays: Mapping[str, float] | None = None,
) -> RecursiveRegression:
    """An estimator for a stream: feed it with `.step(elapsed, sample)`, ask `.estimate()` at any time.

    Args:
        equation: such as "p_dot = Lp*p + La*aileron + bias"; a name is unknown, a number known.
        rate: samples per second [Hz].
        band: frequencies from and to [Hz] that are looked at; what moves the vehicle should lie in it.
        spacing: of the frequencies [Hz]; a 25th of the band's upper end where None.
        memory: time constant of forgetting [s]; None: nothing is forgotten.
        held: channels that keep their value between samples, such as commands.
        delays: seconds by channel of the right side.

    Raises:
        IdentificationError: an equation that is none, or settings that cannot work.
    """
    e = regression_equation(equation, delays=delays) if isinstance(equation, str) else equation
    return RecursiveRegression(_plan(e, rate, band, spacing, memory, held))


def _plan(
    e: RegressionEquation,
    rate: float,
    band: tuple[float, float],
    spacing: float | None,
    memory: float | None,
    held: Sequence[str],
) -> RegressionPlan:
    return regression_plan(e, rate=rate, band=band, spacing=spacing, memory=memory, held=held)


def track(
    flight: Flight,
    equations: str | Sequence[str] | StateSpaceModel | Vehicle,
    *,
    rate: float | None = None,
    band: tuple[float, float] = (0.1, 2.5),
    spacing: float | None = None,
    memory: float | None = None,
    held: Sequence[str] = (),
    delays: Mapping[str, float] | None = None,
    every: float = 0.2,
    names: Mapping[str, str] | None = None,
    say: Say = silent,
) -> Tracking:
    """Replay a log as a stream through recursive Fourier regressions (Morelli 2000): estimates with bounds over time.

    Nothing is conditioned: what was on board is what was logged. A gap, a value that is no number and a clock that
    jumps freeze the estimate, and are told.

    Args:
        flight: as logged.
        equations: texts such as "p_dot = Lp*p + La*aileron + bias", or a linear model, whose rows are taken and whose
            inputs are held.
        rate: samples per second [Hz]; the left side's usual rate where None.
        band, spacing, memory, held: as of `recursive_estimator`.
        delays: seconds by channel; each goes to the equations that have the channel.
        every: between looks at the estimate [s].
        names: the log's channel by the name in the equations, where the log calls it otherwise.
        say: told what is being done.

    Raises:
        IdentificationError: an equation that is none, none at all, or settings that cannot work.
        FlightError: a channel that the flight lacks, or a stream of fewer than three samples.
    """
    renamed = with_names(flight, names or {})
    given = linear(equations) if isinstance(equations, Vehicle) else equations
    texts, notes = _equations(given, renamed, dict(delays or {}))
    own = given.inputs if isinstance(given, StateSpaceModel) else ()
    found = []
    for e in texts:
        say("estimating", note=e.text)
        time, samples = stream_of(renamed, e.channels)
        if time.size < 3:
            raise FlightError(f"has {time.size} samples, expected at least 3.", where=flight.provenance.source or None)
        usual = 1.0 / float(np.median(np.diff(time)))
        wanted = [name for name in dict.fromkeys((*held, *own)) if name in e.channels]
        found.append(tracked(_plan(e, rate or usual, band, spacing, memory, wanted), time, samples, every=every))
    return Tracking(flight.provenance.source or "flight", flight.provenance.simulated, tuple(found), notes)


def _equations(
    given: str | Sequence[str] | StateSpaceModel, flight: Flight, delays: dict[str, float]
) -> tuple[tuple[RegressionEquation, ...], tuple[str, ...]]:
    if isinstance(given, StateSpaceModel):
        read, left_out = model_equations(given, flight.channels)
        if not read:
            raise IdentificationError(f"no equation can be estimated. {' '.join(left_out)}", where=given.name)
        notes = tuple(f"Left out: {words}" for words in left_out)
    else:
        read = tuple(regression_equation(text) for text in ([given] if isinstance(given, str) else given))
        notes = ()
    if not read:
        raise IdentificationError("none is given.", channel="equation")
    late = [replace(e, delays={**e.delays, **{n: s for n, s in delays.items() if n in e.channels}}) for e in read]
    strange = [name for name in delays if not any(name in e.channels for e in read)]
    if strange:
        raise IdentificationError("stands in no equation.", channel=f"delay of {strange[0]}")
    return tuple(late), notes
