"""What a controller is worth on a model."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from swashplate.api.asking import turbulence
from swashplate.api.controllers import flown_by
from swashplate.api.languages import in_seconds
from swashplate.control.analysis.check import ControlCheck, check_controller
from swashplate.control.analysis.check_steps import InGusts
from swashplate.control.analysis.requirements import ATTITUDE_COUPLING, GAIN_MARGIN, PHASE_MARGIN, REJECTION_PEAK
from swashplate.control.lateness import lateness
from swashplate.reporting.control_check import compose_check
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.trim import trim
from swashplate.text_table import text_table

if TYPE_CHECKING:
    from swashplate.api.verbs.control import CheckController


@dataclass(frozen=True, repr=False)
class ControllerCheck(Shown):
    """A controller on a model: what was found.

    Attributes:
        found: every number.
        controller: what it is called.
        late: how late commands are taken to be, in words.
    """

    found: ControlCheck
    controller: str
    late: str

    @property
    def problems(self) -> tuple[str, ...]:
        """Why the loop does not stand, or what could not be found; empty for a controller that may fly."""
        return self.found.problems

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        return _document(self.found, self.controller) | {"late": self.late}

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return compose_check(self.found, title=title or f"{self.controller} on {self.found.vehicle.name}")

    def __repr__(self) -> str:
        return f"late: {self.late}\n{_tables(self.found)}"


def judge_controller(asked: CheckController) -> ControllerCheck:
    """What was asked of a controller."""
    vehicle = asked.flying(asked.vehicle)
    nominal = vehicle.card.values().get("voltage_nominal")
    at = trim(vehicle, speed=asked.speed, voltage=nominal if asked.voltage is None else asked.voltage)
    made, name = flown_by(asked.controller, vehicle, at)
    delays = in_seconds(asked.delay)
    check = check_controller(
        vehicle,
        made,
        at,
        task=asked.task,
        command=asked.response,  # pyrefly: ignore[bad-argument-type]
        scale=asked.scale,
        duration=asked.duration,
        gusts=turbulence(asked.gusts),
        delays=delays,
        computation=in_seconds(asked.computation),
        required_delay=in_seconds(asked.delay_margin),
    )
    return ControllerCheck(check, name, lateness(vehicle, made, given=delays))


def _document(check: ControlCheck, controller: str) -> dict[str, Any]:
    """The check as what becomes JSON."""
    boundaries = [GAIN_MARGIN, PHASE_MARGIN, check.delay_boundary, REJECTION_PEAK, ATTITUDE_COUPLING]
    boundaries += [check.boundary(a.state) for a in check.attitudes]
    margins = None
    if check.margins is not None:
        t = check.margins.together
        margins = {
            "loops": {
                a.name: {
                    "gain": a.gain,
                    "gain_down": a.gain_down,
                    "phase_deg": math.degrees(a.phase),
                    "crossover": a.crossover,
                    "delay": a.delay,
                    "disc": a.disc.alpha,
                    "sensitivity": a.sensitivity,
                }
                for a in check.margins.axes
            },
            "together": {
                "disc": t.alpha,
                "frequency": t.frequency,
                "gain": t.gain,
                "phase_deg": math.degrees(t.phase),
                "delay": check.margins.delay,
            },
        }
    handling = {}
    for a in check.attitudes:
        h = a.handling
        handling[a.state] = {"command": a.reference, "type": a.kind, "level": a.level, "problem": a.problem} | (
            {
                "bandwidth": h.bandwidth.value,
                "bandwidth_phase": h.bandwidth_phase.value,
                "bandwidth_gain": h.bandwidth_gain.value,
                "omega_180": h.omega_180.value,
                "phase_delay": h.phase_delay.value,
            }
            if h
            else {}
        )
    rejection = ("bandwidth", "peak", "peak_frequency", "level", "peak_level")
    steps = ("rise", "overshoot", "settling", "peak", "quickness", "error")
    return {
        "kind": "control-check",
        "vehicle": check.vehicle.name,
        "model": check.vehicle.card.title,
        "controller": controller,
        "rate": check.rate,
        "froude_scale": check.scale,
        "task": check.task,
        "least_stable_mode": {"real": check.slowest.real, "imaginary": abs(check.slowest.imag)},
        "margins": margins,
        "rejection": {r.state: {name: getattr(r, name) for name in rejection} for r in check.rejections},
        "handling": handling,
        "steps": {
            s.reference: {"state": s.state, "size": s.size} | {name: getattr(s.metrics, name) for name in steps}
            for s in check.steps
        },
        "couplings": {c.name: {"value": c.value, "unit": c.unit, "level": c.level} for c in check.couplings},
        "in_gusts": None if check.in_gusts is None else asdict(check.in_gusts),
        "boundaries": [
            {
                "name": b.name,
                "level1": b.level1,
                "scaled": b.scaled(check.scale)[0],
                "source": b.source,
                "checked": b.checked,
            }
            for b in boundaries
        ],
        "problems": list(check.problems),
        "notes": list(check.notes),
        "delays": dict(check.delays),
    }


def _shown(value: float | None, form: str = ".3g") -> str:
    return "-" if value is None or not math.isfinite(value) else format(value, form)


def _level(number: int | None) -> str:
    return "-" if number is None else str(number)


def _tables(check: ControlCheck) -> str:
    slowest = check.slowest
    parts = [f"least stable mode {slowest.real:+.3f} +- {abs(slowest.imag):.2f}j 1/s, Froude scale {check.scale:.3g}"]
    if check.margins is not None:
        parts.append(repr(check.margins))
    if check.rejections:
        head = ("disturbance on", "bandwidth [rad/s]", "level", "peak [dB]", "level")
        rows = [
            (r.state, _shown(r.bandwidth), _level(r.level), _shown(r.peak, ".1f"), _level(r.peak_level))
            for r in check.rejections
        ]
        parts.append(text_table(head, rows))
    if check.attitudes:
        head = ("answer of pilot's", "type", "bandwidth [rad/s]", "phase delay [s]", "level")
        handled = []
        for a in check.attitudes:
            values = (a.handling.bandwidth.value, a.handling.phase_delay.value) if a.handling else (None, None)
            handled.append((f"{a.state} of {a.reference}", a.kind, *map(_shown, values), _level(a.level)))
        parts.append(text_table(head, handled, left=(0, 1)))
    if check.steps:
        head = ("step of", "rise [s]", "overshoot [%]", "settled [s]", "quickness [1/s]")
        stepped = [
            (s.reference, _shown(s.metrics.rise), _shown(100.0 * s.metrics.overshoot, ".0f"),
             _shown(s.metrics.settling), _shown(s.metrics.quickness))
            for s in check.steps
        ]  # fmt: skip
        parts.append(text_table(head, stepped))
        coupled = [(c.name, _shown(c.value), c.unit, _level(c.level)) for c in check.couplings]
        parts.append(text_table(("coupling", "largest over largest", "unit", "level"), coupled))
    if check.in_gusts is not None:
        parts.append(_in_gusts(check.in_gusts))
    parts += check.notes
    parts.append("Levels by boundaries that were not checked against the standards' text: provisional.")
    return "\n\n".join(parts)


def _in_gusts(blown: InGusts) -> str:
    held = [
        f"{name} {_shown(factor * value)} {unit}"
        for name, value, factor, unit in (
            ("place", blown.place, 1e3, "mm"),
            ("speed", blown.speed, 1.0, "m/s"),
            ("height", blown.height, 1e3, "mm"),
            ("heading", blown.heading, math.degrees(1.0), "deg"),
            ("lean", blown.lean, math.degrees(1.0), "deg"),
        )
        if math.isfinite(value)
    ]
    return f"in gusts of {max(blown.gusts.sigma):.2g} m/s, {blown.flights} flights, RMS: {', '.join(held)}"
