"""A log replayed as a stream through recursive estimators, and their C."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from swashplate.api.asking import strings
from swashplate.api.fit_linear import linear
from swashplate.api.report_folder import ReportFolder
from swashplate.api.saying import Say
from swashplate.arrays import Array
from swashplate.atomic import write_text
from swashplate.engine.statements import Precision
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
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Report
from swashplate.reporting.tracking import compose_tracking

if TYPE_CHECKING:
    from swashplate.api.verbs.track import TrackLog

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

    def to_document(self) -> dict[str, object]:
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
    return RecursiveRegression(
        regression_plan(e, rate=rate, band=band, spacing=spacing, memory=memory, held=held, instruments=instruments)
    )


def follow_log(asked: TrackLog, say: Say) -> Tracking:
    """What was asked for: equations by recursive Fourier regression (Morelli 2000), a vehicle's by a Kalman filter.

    Nothing is conditioned: what was on board is what was logged.
    """
    flight = asked.read(asked.log)[0]
    instruments, delays = strings(asked.instrument), dict(asked.delay or {})
    renamed = with_names(flight, asked.rename or {})  # pyrefly: ignore[bad-argument-type]
    source, simulated = flight.provenance.source or "flight", flight.provenance.simulated
    if unknown := strings(asked.unknown):
        say("estimating", note=", ".join(unknown))
        model = asked.vehicle if isinstance(asked.vehicle, Vehicle) else vehicle(asked.vehicle or "")
        one = _parameters(model, renamed, unknown, asked.rate, delays, asked.spread, asked.wander, asked.every)
        return Tracking(source, simulated, (one,))
    given = strings(asked.equation) if asked.vehicle is None else linear(asked.vehicle)
    texts, notes = _equations(given, renamed, delays)
    own = given.inputs if isinstance(given, StateSpaceModel) else ()
    held = strings(asked.held)
    for what, named in (("held", held), ("instrument", instruments)):
        strange = [name for name in named if not any(name in e.channels for e in texts)]
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
        plan = regression_plan(
            e,
            rate=asked.rate or _rate(time, source),
            band=asked.band,
            spacing=asked.spacing,
            memory=asked.memory,
            held=[name for name in dict.fromkeys((*held, *own)) if name in e.channels],
            instruments=[name for name in instruments if name in e.channels and name != e.left],
        )
        units = {name: str(renamed[name].attrs.get("units", "")) for name in e.channels}
        tracks.append(tracked(plan, time, samples, every=asked.every, units=units))
    return Tracking(source, simulated, tuple(tracks), notes)


def _rate(time: Array, source: str) -> float:
    if time.size < 3:
        raise FlightError(f"has {time.size} samples, expected at least 3.", where=source)
    return 1.0 / float(np.median(np.diff(time)))


def _parameters(
    model: Vehicle,
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
    lacking = [name for name in model.input_names if name not in flight]
    if lacking:
        raise FlightError("lacks inputs of the vehicle.", where=source, channel=", ".join(lacking))
    volts = ["voltage"] if "voltage" in flight else []
    time, table = stream_of(flight, [*channels, *model.input_names, *volts])
    steps = round(rate or _rate(time, source), 6)
    plan = slow_plan(
        model,
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
    given: Sequence[str] | StateSpaceModel, flight: Flight, delays: dict[str, float]
) -> tuple[tuple[RegressionEquation, ...], tuple[str, ...]]:
    if isinstance(given, StateSpaceModel):
        read, left_out = model_equations(given, flight.channels)
        if not read:
            raise IdentificationError(f"no equation can be estimated. {' '.join(left_out)}", where=given.name)
        notes = tuple(f"Left out: {words}" for words in left_out)
    else:
        read = tuple(regression_equation(text) for text in given)
        notes = ()
    if not read:
        raise IdentificationError("none is given.", channel="equation")
    late = [replace(e, delays={**e.delays, **{n: s for n, s in delays.items() if n in e.channels}}) for e in read]
    strange = [name for name in delays if not any(name in e.channels for e in read)]
    if strange:
        raise IdentificationError("stands in no equation.", channel=f"delay of {strange[0]}")
    return tuple(late), notes
