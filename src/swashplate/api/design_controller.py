"""A linear-quadratic controller from a model's own trims and linear models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swashplate.api.asking import one_or_more
from swashplate.api.languages import in_seconds
from swashplate.control.analysis.gain_premises import refused_by_card
from swashplate.control.analysis.margins import Margins
from swashplate.control.kinds import save_controller
from swashplate.control.lateness import lateness
from swashplate.control.lqg.analysis import Analysis, analyse
from swashplate.control.lqg.constant_gain import steady_sigmas, with_steady_gain
from swashplate.control.lqg.controller import Lqg
from swashplate.control.lqg.design import design
from swashplate.export.controller_c import ControllerCode, Precision, controller_code
from swashplate.filtering.sensor_suite import suite
from swashplate.reporting.controller_design import compose_design
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.controller import Controller
from swashplate.text_table import text_table

if TYPE_CHECKING:
    from swashplate.api.verbs.control import DesignController

_NEARLY = 1.05
"""Of a limit: closer is none."""


class WithController(Shown):
    """A design whose controller has a file, and a step in C."""

    if TYPE_CHECKING:

        @property
        def controller(self) -> Controller: ...

    def save(self, path: str | Path) -> Path:
        """Write the controller's file (.toml)."""
        save_controller(self.controller, path)
        return Path(path)

    def code(self, *, precision: Precision = "double") -> ControllerCode:
        """One step as C99; needs the extra `model`."""
        return controller_code(self.controller, precision=precision)


@dataclass(frozen=True, repr=False)
class ControllerDesign(WithController):
    """A designed controller, and what linear algebra promises of it.

    Attributes:
        controller: it flies: `sp.simulate_closed_loop`, `sp.check_controller`, `sp.monte_carlo`.
        analyses: modes, margins and expected spread at every speed.
        speeds: of the trims [m/s].
        late: how late commands are taken to be, in words.
        fast: loops that cross higher than what is late together asks for, in words; "" for none.
        premise: why the model carries no controller, in words; "" where it does.
    """

    controller: Lqg
    analyses: tuple[Analysis, ...]
    speeds: tuple[float, ...]
    late: str
    fast: str = ""
    premise: str = ""

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        made = self.controller
        return {
            "vehicle": made.vehicle.name,
            "model": made.vehicle.card.title,
            "rate": made.rate,
            "sensors": [str(sensor) for sensor in made.plan.sensors],
            "delays": [d / made.rate for d in made.plan.delays],
            "late": self.late,
            **({"fast": self.fast} if self.fast else {}),
            **({"premise": self.premise} if self.premise else {}),
            "trims": [
                {
                    "speed": speed,
                    "least_stable_mode": {"real": a.modes[0].real, "imaginary": abs(a.modes[0].imag)},
                    "margins": margins_document(a.margins),
                    "spread": a.spread,
                    "uncertainty": a.uncertainty,
                }
                for speed, a in zip(self.speeds, self.analyses, strict=True)
            ],
        }

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        rows = spread_rows(self.controller, self.analyses[0])
        return compose_design(
            self.controller,
            self.speeds,
            self.analyses,
            rows,
            title=title,
            late=self.late,
            fast=" ".join(filter(None, (self.premise, self.fast))),
        )

    def __repr__(self) -> str:
        plan, vehicle = self.controller.plan, self.controller.vehicle
        told = ", ".join(map(str, plan.sensors)) or "the states themselves"
        lines = [f"{'LQG' if plan.sensors else 'LQR'} of {vehicle.called}, {plan.rate:g} Hz, {plan.n} states"]
        if plan.period:
            told += f"; constant gains, a cycle of {plan.period}"
        lines += [
            f"sensors: {told}",
            f"late: {self.late}",
            *(f"Careful: {told}" for told in (self.premise, self.fast) if told),
        ]
        waits = ", ".join(f"{name} {d}" for name, d in zip(vehicle.input_names, plan.delays, strict=True) if d)
        if waits:
            lines.append(f"in whole samples: {waits}")
        for speed, analysis in zip(self.speeds, self.analyses, strict=True):
            mode = analysis.modes[0]
            lines.append(f"\nAt {speed:g} m/s, least stable mode {mode.real:+.3f} +- {abs(mode.imag):.3f}j 1/s")
            lines.append(repr(analysis.margins))
        head = (f"in gusts as assumed, at {self.speeds[0]:g} m/s", "strays (1 sigma)", "known to")
        lines += ["", text_table(head, spread_rows(self.controller, self.analyses[0]))]
        return "\n".join(lines)


def margins_document(margins: Margins) -> dict[str, Any]:
    """Margins as what becomes JSON."""
    together = margins.together
    return {
        **{a.name: {"gain": a.gain, "phase_deg": math.degrees(a.phase), "delay": a.delay} for a in margins.axes},
        "together": {
            "disc": together.alpha,
            "gain": together.gain,
            "phase_deg": math.degrees(together.phase),
            "delay": margins.delay,
        },
    }


def spread_rows(made: Lqg, analysis: Analysis) -> list[tuple[str, str, str]]:
    """Of every state how far it strays and how well it is known, angles in degrees."""
    units = dict(zip(made.vehicle.state_names, made.vehicle.state_units, strict=True))
    rows = []
    for name, value in analysis.spread.items():
        angle = "rad" in units[name]
        factor, unit = (math.degrees(1.0), units[name].replace("rad", "deg")) if angle else (1.0, units[name])
        known = analysis.uncertainty.get(name)
        rows.append((f"{name} [{unit}]", f"{factor * value:.3g}", "-" if known is None else f"{factor * known:.3g}"))
    return rows


def design_lq_controller(asked: DesignController) -> ControllerDesign:
    """The controller that was asked for."""
    vehicle, speeds, delays = asked.flying(asked.vehicle), one_or_more(asked.speed), in_seconds(asked.delay)
    made = design(
        vehicle,
        sensors=() if asked.method == "lqr" else suite(asked.sensors),
        rate=asked.rate,
        delays=delays,
        computation=in_seconds(asked.computation),
        holding=asked.holding,  # pyrefly: ignore[bad-argument-type]
        speeds=speeds,
        allowed=asked.allow or {},
        effort=asked.effort or None,
        Q=asked.state_weights,
        R=asked.input_weights,
        voltage=asked.voltage,
    )
    where = str(vehicle.card.path or vehicle.name)
    analyses = [analyse(made, at=i, where=where) for i in range(len(speeds))]
    if asked.gain == "steady":
        made = with_steady_gain(made)
        kept = dict(zip(made.plan.names, map(float, steady_sigmas(made)), strict=True))
        analyses = [replace(each, uncertainty={n: kept[n] for n in each.uncertainty if n in kept}) for each in analyses]
    took = "not known, one sample is left for it" if asked.computation is None else f"{asked.computation:g} ms"
    late = f"{lateness(vehicle, None, given=delays)}; computation: {took}"
    return ControllerDesign(made, tuple(analyses), speeds, late, _fast(made, analyses), refused_by_card(vehicle.card))


def _fast(made: Lqg, analyses: Sequence[Analysis]) -> str:
    """Loops that cross above what the design aimed at and could not reach with less effort, in words."""
    told = []
    for name, limit in made.figures["crossover_limits"].items():
        highest = max((a.crossover for one in analyses for a in one.margins.axes if a.name == name), default=0.0)
        if highest > _NEARLY * limit:
            told.append(f"{name} at {highest:.3g} rad/s (asked for: {limit:.3g})")
    if not told:
        return ""
    return (
        f"loops that cross above 1/(3 T), T what is late together: {', '.join(told)}. Less effort does not slow them: "
        "judge them by the delay margin"
    )
