"""From a coaxial helicopter's model to the controller that decouples its roll and pitch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.api.asking import turbulence
from swashplate.api.design_controller import WithController, margins_document
from swashplate.control.analysis.margins import Margins
from swashplate.control.analysis.stability import loop_margins, loop_modes, require_stable
from swashplate.control.analysis.straightness import DURATION, StepRun, command_for_speed, nearer, step_run
from swashplate.control.draws.variations import draw_models
from swashplate.control.lateness import lateness
from swashplate.control.laws.autopilot import Autopilot, autopilot
from swashplate.control.laws.decoupling import estimated_lag
from swashplate.control.laws.learning import corrected_by_step, straightened
from swashplate.errors import SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.straightness import compose_straightness
from swashplate.reporting.structure import Report
from swashplate.simulation.trim import Trim, trim
from swashplate.simulation.wind import Gusts, dryden
from swashplate.text_table import text_table

if TYPE_CHECKING:
    from swashplate.api.verbs.decouple import Decouple

PAPERS_SPEED = 1.8
"""m/s, of the step of Fankhauser et al., Fig. 10."""


@dataclass(frozen=True)
class FlownStep:
    """A step of the pitch command with the decoupling and without.

    Attributes:
        command: the step.
        runs: "without" and "with"; "by the paper" between them where the lag was chosen by flying.
        draws: how many models were drawn, or flights flown in gusts.
        many: what the many flights are, in words; empty where there are none.
        gusts: that each of them had of its own, None for still air; the first run of the model has none.
    """

    command: float
    runs: Mapping[str, StepRun]
    draws: int
    many: str = ""
    gusts: Gusts | None = None

    def nearer_than(self) -> dict[str, tuple[int, int]]:
        """By other law, on how many of the same flights this one ends nearer to straight ahead, and of how many."""
        law = self.runs["with"].drawn
        others = {name: run.drawn for name, run in self.runs.items() if name != "with"}
        return {} if law is None else {name: nearer(law, path) for name, path in others.items() if path is not None}

    def figures(self) -> dict[str, dict[str, Any]]:
        """Paths on the step: of the model itself, and percentiles over drawn models."""
        figures = ("drift", "leftmost", "rightmost", "speed")
        by_run: dict[str, dict[str, Any]] = {}
        for name, run in self.runs.items():
            by_run[name] = {key: float(getattr(run.path, key)[0]) for key in figures} | {"models": "this one"}
            if run.drawn is not None:
                arrived = int(np.sum(np.isfinite(run.drawn.drift)))
                for percent in (5, 50, 95):
                    values = {key: float(np.nanpercentile(getattr(run.drawn, key), percent)) for key in figures}
                    by_run[f"{name}, {percent} %"] = values | {"models": f"{arrived} of {self.draws}"}
        return by_run

    def __repr__(self) -> str:
        head = ("path on the step", "drift at 6 m [m]", "leftmost [m]", "rightmost [m]", "fastest [m/s]", "models")
        cells = [
            (
                name,
                *(f"{round(entry[key], 2) + 0.0:+.2f}" for key in ("drift", "leftmost", "rightmost", "speed")),
                entry["models"],
            )
            for name, entry in self.figures().items()
        ]
        lines = [f"step of the pitch command: {self.command:.3f}", text_table(head, cells)]
        told = ", ".join(f"than {name} on {wins} of {of}" for name, (wins, of) in self.nearer_than().items())
        if told:
            lines.append(f"\nof {self.draws} {self.many}, the law ends nearer to straight ahead {told}")
        return "\n".join(lines)


@dataclass(frozen=True, repr=False)
class DecouplingDesign(WithController):
    """The controller of a coaxial helicopter: height and yaw held, roll and pitch decoupled.

    Attributes:
        vehicle, hover: what it was made from.
        controller: the autopilot, fed with the states.
        mode: least stable of the loop [1/s].
        margins: None in mode "manual", where a pilot holds the lean.
        step: flown where one was asked for.
        late: how late commands are taken to be, in words.
    """

    vehicle: Vehicle
    hover: Trim
    controller: Autopilot
    mode: complex
    margins: Margins | None
    step: FlownStep | None
    late: str

    @property
    def problems(self) -> tuple[str, ...]:
        """None: a loop that does not stand is an error."""
        return ()

    def lag(self, *, less: float = 0.0) -> float:
        """Phase lag that is taken out at the hover's motor command [deg], with the battery by `less` volts lower."""
        volts = float(self.hover.environment.voltage) - less
        return math.degrees(estimated_lag(self.controller.numbers.law, self.hover.commands()["motor_lower"], volts))

    @property
    def mixing(self) -> str:
        """Form of the equations that are inverted."""
        return "rotation" if self.controller.numbers.law.mixing > 0 else "as_printed"

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        document: dict[str, Any] = {
            "vehicle": self.vehicle.name,
            "model": self.vehicle.card.title,
            "mode": self.controller.mode,
            "rate": self.controller.rate,
            "mixing": self.mixing,
            "lag_at_hover_deg": self.lag(),
            "law": self.controller.numbers.law._asdict(),
            "late": self.late,
            "least_stable_mode": {"real": self.mode.real, "imaginary": abs(self.mode.imag)},
        }
        if self.margins is not None:
            document["margins"] = margins_document(self.margins)
        if self.step is not None:
            document["step"] = {"command": self.step.command, **self.step.figures()}
            if against := self.step.nearer_than():
                gusts = None if self.step.gusts is None else asdict(self.step.gusts)
                document["step"] |= {"nearer_than": against, "gusts": gusts}
        return document

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes: the two paths.

        Raises:
            SwashError: where no step was flown.
        """
        if self.step is None:
            raise SwashError("has no flown step to report.", where=self.vehicle.name, hint="Give step or to_speed.")
        return compose_straightness(
            self.vehicle,
            self.step.runs,
            command=self.step.command,
            lag=self.lag(),
            many=self.step.many,
            nearer_than=self.step.nearer_than(),
            title=title,
        )

    def __repr__(self) -> str:
        law, lag = self.controller.numbers.law, self.lag()
        across = 100.0 * math.sin(math.radians(lag))
        rows = [
            ("form of the equations", self.mixing, ""),
            ("lower rotor at hover", f"{self.hover.states()['omega_lower']:.1f}", "rad/s"),
            ("phase lag taken out at hover", f"{lag:.2f}", "deg"),
            ("  at the same command, 1 V less", f"{self.lag(less=1.0):.2f}", "deg"),
            ("of a command goes across without it", f"{across:.0f}", "%"),
            ("roll command against 1 m/s ahead", f"{(law.across_u + law.across_u_linear) / law.linkage:+.3f}", "1"),
            ("pitch command against 1 m/s right", f"{-(law.across_v + law.across_v_linear) / law.linkage:+.3f}", "1"),
            ("least stable mode of the loop", f"{self.mode.real:+.3f} +- {abs(self.mode.imag):.3f}j", "1/s"),
        ]
        head = (f"decoupling of {self.vehicle.name}, mode {self.controller.mode}", "", "")
        parts = [f"late: {self.late}\n{text_table(head, rows, left=(0, 2))}"]
        parts += [repr(part) for part in (self.margins, self.step) if part is not None]
        return "\n\n".join(parts)


def decouple_coaxial(asked: Decouple, vehicle: Vehicle) -> DecouplingDesign:
    """The controller that was asked for, of a vehicle with its changes: Fankhauser et al., eqs 19 to 22."""
    flown = asked.step is not None or asked.to_speed is not None or asked.paged
    step, to_speed = asked.step, asked.to_speed
    if asked.paged and step is None and to_speed is None:
        to_speed = PAPERS_SPEED
    _refuse(asked, flown=flown)
    nominal = vehicle.card.values().get("voltage_nominal")
    hover = trim(vehicle, voltage=nominal if asked.voltage is None else asked.voltage)
    rule = ("straight" if asked.mode == "manual" else "battery") if asked.lag is None else _lag_of(asked.lag)
    papers = autopilot(
        vehicle,
        hover,
        mode=asked.mode,  # pyrefly: ignore[bad-argument-type]
        rate=asked.rate,
        lag="battery" if rule == "straight" else rule,
        speed_terms=asked.speed_terms,
        mixing=asked.mixing,  # pyrefly: ignore[bad-argument-type]
    )
    made = papers
    if to_speed is not None:
        step = command_for_speed(vehicle, papers, hover, speed=to_speed)
    if rule == "straight":
        made = _straight(vehicle, papers, hover, step)
        if to_speed is not None:  # the straight law flies the step a little faster
            step = command_for_speed(vehicle, made, hover, speed=to_speed)
            made = _straight(vehicle, papers, hover, step)
    if asked.drift is not None and step is not None:
        made = corrected_by_step(vehicle, made, hover, command=step, drift=asked.drift)
    slowest = loop_modes(vehicle, made, hover)[0]
    if made.mode != "manual":  # a pilot damps what "manual" leaves alone
        require_stable(slowest, rate=made.rate, where=str(vehicle.card.path or vehicle.name))
    return DecouplingDesign(
        vehicle,
        hover,
        made,
        complex(slowest),
        None if made.mode == "manual" else loop_margins(vehicle, made, hover),
        None if step is None else _flown(asked, vehicle, made, papers if made is not papers else None, hover, step),
        lateness(vehicle, made, given=None),
    )


def _refuse(asked: Decouple, *, flown: bool) -> None:
    if asked.step is not None and asked.to_speed is not None:
        raise SwashError("are two steps.", channel="--step and --to-speed", hint="Give one.")
    if asked.fit is not None and not flown:
        raise SwashError("is for the paths of a --step.", channel="--fit", hint="Add --step 0.2.")
    if asked.gusts not in (None, "none") and not flown:
        raise SwashError("blow on a flown --step.", channel="--gusts", hint="Add --step 0.2 or --to-speed 1.8.")
    if asked.drift is not None and not flown:
        raise SwashError("was seen on a step.", channel="--drift", hint="Add that step: --step 0.4 or --to-speed 1.8.")


def _straight(vehicle: Vehicle, papers: Autopilot, hover: Trim, step: float | None) -> Autopilot:
    """With the lag that makes the step straight; the paper's step where none was asked for."""
    flown = papers if papers.mode == "manual" else autopilot(vehicle, hover, mode="manual", rate=papers.rate)
    flown = replace(flown, numbers=flown.numbers._replace(law=papers.numbers.law))
    command = command_for_speed(vehicle, flown, hover, speed=PAPERS_SPEED) if step is None else step
    law = straightened(vehicle, flown, hover, command=command).numbers.law
    return replace(papers, numbers=papers.numbers._replace(law=law))


def _flown(
    asked: Decouple, vehicle: Vehicle, made: Autopilot, papers: Autopilot | None, hover: Trim, step: float
) -> FlownStep:
    fit, gusts, draws, seed = asked.fit, turbulence(asked.gusts), asked.draws, asked.seed
    bare = autopilot(vehicle, hover, mode="manual", rate=made.rate, decoupled=False)
    drawn = None if fit is None else draw_models(vehicle, fit, count=draws, seed=seed)
    wind, many = None, "flights of the model" if fit is None else "models drawn from the fit's covariance"
    if gusts is not None:  # of another seed than the draws
        samples = round(DURATION * made.rate) + 1
        wind = dryden(gusts, samples=samples, rate=made.rate, seed=seed + 1_000_003, count=draws)
        many = f"{many}, each in gusts of its own ({gusts.sigma[0]:.2g} m/s)"
    flown = {"without": bare, "by the paper": papers, "with": made}
    runs = {
        name: step_run(vehicle, controller, hover, command=step, parameters=drawn, wind=wind)
        for name, controller in flown.items()
        if controller is not None
    }
    if runs["with"].drawn is None:
        return FlownStep(step, runs, draws)
    return FlownStep(step, runs, draws, many, gusts)


def _lag_of(text: Any) -> Any:
    """A rule's name, or degrees as radians."""
    from swashplate.api.languages import numbers
    from swashplate.control.laws.decoupling import LAGS

    if text in ("straight", *LAGS):
        return text
    if str(text).isalpha():
        raise SwashError(f"is '{text}', expected straight, {', '.join(LAGS)} or a number.", channel="lag")
    degrees = numbers(str(text), "--lag", count=1)[0]
    if not abs(degrees) <= 180.0:
        raise SwashError(f"is {text} degrees, expected at most 180 either way.", channel="--lag")
    return math.radians(degrees)
