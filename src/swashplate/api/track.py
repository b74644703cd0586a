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
from swashplate.arrays import Array
from swashplate.atomic import write_text
from swashplate.engine.c_expression import Precision
from swashplate.errors import ExportError, FlightError, IdentificationError
from swashplate.export.formats import Export
from swashplate.export.regression_c import RegressionCode, regression_code
from swashplate.filtering.sensor_suite import KINDS, suite
from swashplate.flights.channel_names import with_names
from swashplate.flights.flight import Flight
from swashplate.identification.recursive.equation import RegressionEquation, model_equations, regression_equation
from swashplate.identification.recursive.fourier_regression import RecursiveRegression, RegressionPlan, regression_plan
from swashplate.identification.recursive.slow_parameters import slow_plan
from swashplate.identification.recursive.tracked import Tracked, stream_of, tracked, tracked_parameters
from swashplate.json_text import as_json
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Report
from swashplate.reporting.tracking import compose_tracking

_MEGAHERTZ = 216.0
"""Clock of the slowest Cortex-M7 in flight controllers."""


@dataclass(frozen=True, repr=False)
class Tracking(ReportFolder):
    """Recursive estimates along a stream.

    Attributes:
        source: the log's name. simulated: whether it was one.
        followed: equations, or a vehicle's parameters, along the stream.
        notes: what a user must know of them.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "track.json")

    source: str
    simulated: bool
    followed: tuple[Tracked, ...]
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> tuple[float, float]:
        """The last estimate of a coefficient and its standard error.

        Raises:
            KeyError: a name that no equation has, or one that was never told.
        """
        for one in self.followed:
            if one.final is not None and name in one.names:
                i = one.names.index(name)
                return float(one.final.values[i]), float(one.final.sigmas[i])
        raise KeyError(name)

    @property
    def problems(self) -> tuple[str, ...]:
        """Equations whose coefficients the stream never told apart, or lost again."""
        return tuple(
            f"'{e.text}' has coefficients that the log does not separate." for e in self.followed if e.final is None
        )

    def to_document(self) -> dict[str, Any]:
        """All of it as what becomes JSON."""
        return {
            "source": self.source,
            "simulated": self.simulated,
            "notes": list(self.notes),
            "followed": [_document(one) for one in self.followed],
        }

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return compose_tracking(self.source, self.followed, self.notes, simulated=self.simulated, title=title)

    def write(self, folder: Path) -> None:
        super().write(folder)
        write_text(folder / "track.json", as_json(self.to_document()))

    def code(self, *, precision: Precision = "double") -> Export:
        """The equations' estimators as C, a file pair each; `.save(folder)` writes it, its notes say what it costs.

        Raises:
            ExportError: for parameters of a vehicle, whose filter has no C.
        """
        texts: dict[str, str] = {}
        notes = []
        for plan in (one.plan for one in self.followed):
            if not isinstance(plan, RegressionPlan):
                raise ExportError("the filter of a vehicle's parameters has no C.", channel="--c")
            made = regression_code(plan, name=f"track_{plan.equation.left}", precision=precision)
            texts |= made.files()
            notes.append(_cost(made, 1.0 / plan.dt))
        return Export({name: text.encode() for name, text in texts.items()}, tuple(notes))

    def __repr__(self) -> str:
        parts = [f"{self.source}, followed as a stream"]
        for one in self.followed:
            parts.append(f"\n{one.text}   ({one.counted:.1f} s counted)")
            if one.final is None:
                parts.append("  not separated by this stream")
                continue
            for i, name in enumerate(one.names):
                unit = one.units[i]
                parts.append(f"  {name:<14}{one.final.values[i]:>13.6g} +- {one.final.sigmas[i]:<9.2g} {unit}".rstrip())
            parts += [f"  stood still {s.start:.2f} to {s.stop:.2f} s: {s.why}" for s in one.frozen[:5]]
            parts += [f"  {words}" for words in one.notes]
            parts += [f"  and {len(one.frozen) - 5} more stretches"] if len(one.frozen) > 5 else []
        return "\n".join([*parts, *(["", *self.notes] if self.notes else [])])


def _document(one: Tracked) -> dict[str, Any]:
    final = one.final
    document = {
        "what": one.text,
        "units": dict(zip(one.names, one.units, strict=True)),
        "seconds_counted": one.counted,
        "values": None if final is None else dict(zip(one.names, final.values, strict=True)),
        "sigmas": None if final is None else dict(zip(one.names, final.sigmas, strict=True)),
        "covariance": None if final is None else final.covariance,
        "time": one.time,
        "values_over_time": one.values,
        "sigmas_over_time": one.sigmas,
        "stood_still": [{"start": s.start, "stop": s.stop, "why": s.why} for s in one.frozen],
        "notes": list(one.notes),
    }
    if isinstance(one.plan, RegressionPlan):
        plan, e = one.plan, one.plan.equation
        document |= {"rate": 1.0 / plan.dt, "hertz": plan.hertz, "memory": plan.memory, "held": plan.held}
        document["instruments"] = plan.instruments
        document["delays"] = dict(e.delays)
    return document


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
    band: tuple[float, float] | None = None,
    spacing: float | None = None,
    memory: float | None = None,
    held: Sequence[str] = (),
    instruments: Sequence[str] = (),
    delays: Mapping[str, float] | None = None,
) -> RecursiveRegression:
    """An estimator for a stream: feed it with `.step(elapsed, sample)`, ask `.estimate()` at any time.

    Args:
        equation: such as "p_dot = Lp*p + La*aileron + bias"; a name is unknown, a number known.
        rate: samples per second [Hz].
        band: frequencies from and to [Hz] that are looked at; what moves the vehicle should lie in it. None: 0.1 to
            2.5 Hz, or to a fifth of the rate where that is less.
        spacing: of the frequencies [Hz]; a 25th of the band's upper end where None.
        memory: time constant of forgetting [s]; None: nothing is forgotten.
        held: channels that keep their value between samples, such as commands.
        instruments: channels that gusts do not move, such as commands that no controller gives: with them strong gusts
            do not bias the coefficients.
        delays: seconds by channel of the right side.

    Raises:
        IdentificationError: an equation that is none, or settings that cannot work.
    """
    e = regression_equation(equation, delays=delays) if isinstance(equation, str) else equation
    return RecursiveRegression(_plan(e, rate, band, spacing, memory, held, instruments))


def _plan(
    e: RegressionEquation,
    rate: float,
    band: tuple[float, float] | None,
    spacing: float | None,
    memory: float | None,
    held: Sequence[str],
    instruments: Sequence[str],
) -> RegressionPlan:
    return regression_plan(e, rate=rate, band=band, spacing=spacing, memory=memory, held=held, instruments=instruments)


def track(
    flight: Flight,
    equations: str | Sequence[str] | StateSpaceModel | Vehicle,
    *,
    rate: float | None = None,
    band: tuple[float, float] | None = None,
    spacing: float | None = None,
    memory: float | None = None,
    held: Sequence[str] = (),
    instruments: Sequence[str] = (),
    delays: Mapping[str, float] | None = None,
    unknown: Sequence[str] = (),
    spread: float = 0.2,
    wander: float = 0.02,
    every: float = 0.2,
    names: Mapping[str, str] | None = None,
    say: Say = silent,
) -> Tracking:
    """Replay a log as a stream through recursive estimators: what would have been known on board, and how well.

    Equations go through recursive Fourier regressions (Morelli 2000), the `unknown` parameters of a vehicle through the
    extended Kalman filter that flies in controllers. Nothing is conditioned: what was on board is what was logged. A
    gap, a value that is no number and a clock that jumps freeze the estimate, and are told.

    Args:
        flight: as logged.
        equations: texts such as "p_dot = Lp*p + La*aileron + bias", or a linear model, whose rows are taken and whose
            inputs are held; with `unknown` a vehicle.
        rate: samples per second [Hz]; the left side's usual rate where None.
        band, spacing, memory, held: as of `recursive_estimator`.
        instruments: as of it; each goes to the equations that have the channel on the right.
        delays: seconds by channel; each goes to the equations that have the channel.
        unknown: parameters of the vehicle.
        spread: standard deviation of each at the start, as a share of the card's value.
        wander: by how much of it each may wander in a second (standard deviation, growing with the root of time).
        every: between looks at the estimate [s].
        names: the log's channel by the name in the equations, where the log calls it otherwise.
        say: told what is being done.

    Raises:
        IdentificationError: an equation that is none, none at all, or settings that cannot work.
        FlightError: a channel that the flight lacks, or a stream of fewer than three samples.
    """
    renamed = with_names(flight, names or {})
    source, simulated = flight.provenance.source or "flight", flight.provenance.simulated
    if unknown:
        if not isinstance(equations, Vehicle):
            raise IdentificationError("are a vehicle's: give the vehicle.", channel="unknown")
        say("estimating", note=", ".join(unknown))
        one = _parameters(equations, renamed, tuple(unknown), rate, delays, spread, wander, every)
        return Tracking(source, simulated, (one,))
    given = linear(equations) if isinstance(equations, Vehicle) else equations
    texts, notes = _equations(given, renamed, dict(delays or {}))
    own = given.inputs if isinstance(given, StateSpaceModel) else ()
    for what, names_given in (("held", held), ("instrument", instruments)):
        strange = [name for name in names_given if not any(name in e.channels for e in texts)]
        if strange:
            raise IdentificationError("stands in no equation.", channel=f"{what} {strange[0]}")
    if useless := [name for name in instruments if all(name == e.left for e in texts if name in e.channels)]:
        raise IdentificationError(
            "is what its equation explains: no instrument.",
            channel=f"instrument {useless[0]}",
            hint="Name a command that no controller gives.",
        )
    tracks = []
    for e in texts:
        say("estimating", note=e.text)
        time, samples = stream_of(renamed, e.channels)
        usual = _rate(time, source)
        wanted = [name for name in dict.fromkeys((*held, *own)) if name in e.channels]
        told = [name for name in instruments if name in e.channels and name != e.left]
        plan = _plan(e, rate or usual, band, spacing, memory, wanted, told)
        units = {name: str(renamed[name].attrs.get("units", "")) for name in e.channels}
        tracks.append(tracked(plan, time, samples, every=every, units=units))
    return Tracking(source, simulated, tuple(tracks), notes)


def _rate(time: Array, source: str) -> float:
    if time.size < 3:
        raise FlightError(f"has {time.size} samples, expected at least 3.", where=source)
    return 1.0 / float(np.median(np.diff(time)))


def _parameters(
    vehicle: Vehicle,
    flight: Flight,
    unknown: tuple[str, ...],
    rate: float | None,
    delays: Mapping[str, float] | None,
    spread: float,
    wander: float,
    every: float,
) -> Tracked:
    """Slow parameters, read by every sensor whose channels the flight has."""
    source = flight.provenance.source or "flight"
    kinds = [kind for kind in ("imu", "mocap") if all(name in flight for name in KINDS[kind].channels)]
    kinds += ["gyro"] if "imu" not in kinds and all(name in flight for name in KINDS["gyro"].channels) else []
    if not kinds:
        wanted = "; ".join(f"{kind}: {', '.join(KINDS[kind].channels)}" for kind in ("imu", "gyro", "mocap"))
        raise FlightError(f"has the channels of no sensor ({wanted}).", where=source)
    channels = [name for kind in kinds for name in KINDS[kind].channels]
    lacking = [name for name in vehicle.input_names if name not in flight]
    if lacking:
        raise FlightError("lacks inputs of the vehicle.", where=source, channel=", ".join(lacking))
    volts = ["voltage"] if "voltage" in flight else []
    time, table = stream_of(flight, [*channels, *vehicle.input_names, *volts])
    steps = round(rate or _rate(time, source), 6)
    plan = slow_plan(
        vehicle,
        unknown,
        sensors=suite(",".join(f"{kind}@{steps}+0ms" for kind in kinds)),
        rate=steps,
        spread=spread,
        wander=wander,
        delays=delays,
    )
    inputs = table[:, len(channels) :]
    if not volts:
        inputs = np.column_stack([inputs, np.full(len(time), float(plan.trim.environment.voltage))])
    estimates = tracked_parameters(plan, time, inputs, table[:, : len(channels)], every=every)
    told = () if volts else ("The log has no battery voltage; the card's nominal one stands in.",)
    return replace(estimates, notes=(*told, *estimates.notes))


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
