"""Gains of a whole autopilot from a vehicle's model, judged and flown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from swashplate.api.asking import name_of
from swashplate.api.languages import in_seconds
from swashplate.api.link import mapping_of
from swashplate.atomic import write_text
from swashplate.control.analysis.cascade_gains import CascadeGains, cascade_gains, judge_cascade
from swashplate.control.analysis.gain_premises import refused_by_card
from swashplate.control.analysis.rotorflight_gains import judge_rotorflight, rotorflight_gains
from swashplate.control.kinds import save_controller
from swashplate.control.laws.ardupilot.law import FLIGHT_MODES, RATE_OF_LOOPS, ArduPilotLaw, FlightMode
from swashplate.control.laws.ardupilot.parameters import RENAMED
from swashplate.control.laws.rotorflight.law import MODES as ROTORFLIGHT_MODES
from swashplate.control.laws.rotorflight.law import RATE_OF_LOOPS as ROTORFLIGHT_RATE
from swashplate.control.laws.rotorflight.law import RotorflightLaw, RotorflightMode, rotorflight_law
from swashplate.control.laws.rotorflight.parameters import DEFAULTS as ROTORFLIGHT_DEFAULTS
from swashplate.control.laws.rotorflight.parameters import cli_dump
from swashplate.errors import ControllerError, DivergenceError, SwashError
from swashplate.identification.frequency.handling import delay_words
from swashplate.links.ardupilot.gains import ASSUMED_DELAY, ardupilot_law, read_parameter_file, written_gains
from swashplate.links.ardupilot.parameters import parameter_file
from swashplate.links.ardupilot.parameters import parameters as ardupilot_parameters
from swashplate.links.px4.gains import RATE as PX4_RATE
from swashplate.links.px4.gains import px4_file, px4_gains, px4_law
from swashplate.links.px4.parameters import parameters as px4_parameters
from swashplate.models.surroundings import complete_delays, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.figures.of_results import plain_page, section_of_loops
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.trim import Trim, trim
from swashplate.text_table import text_table

if TYPE_CHECKING:
    from swashplate.api.verbs.control import FindGains

AutopilotName = Literal["ardupilot", "px4", "rotorflight"]
FlownModeName = FlightMode | RotorflightMode
CALLED: Mapping[AutopilotName, str] = {"ardupilot": "ArduPilot", "px4": "PX4", "rotorflight": "Rotorflight"}
STRAYS = 0.5
"""m: how far LOITER may stray in still air."""
_SUFFIX: Mapping[AutopilotName, str] = {"ardupilot": ".parm", "px4": ".params", "rotorflight": ".txt"}
_UPSET: Mapping[str, float] = {"phi": math.radians(2.0), "theta": math.radians(-2.0), "u": 0.1, "v": -0.1}
_DURATION, _LAST = 60.0, 20.0
_PLACED = ("loiter", "hover")
"""Modes that hold a place."""


@dataclass(frozen=True)
class FlownMode:
    """A mode flown nonlinearly in still air, integrals at zero at the start: how far it strays from what it holds.

    Attributes:
        mode: "stabilize", "alt_hold" or "loiter"; Rotorflight's "angle", and "hover" with a pilot of ours.
        lean: from the hover's attitude [deg]. heading: [deg]. height, place: [m]; NaN where the mode holds none.
        still: the same of the place in the last 20 s.
        fell: why it did not get to the end; empty where it did.
    """

    mode: FlownModeName
    lean: float
    heading: float
    height: float
    place: float
    still: float
    fell: str = ""


@dataclass(frozen=True)
class AutopilotGains(Shown):
    """Gains of a whole autopilot for a vehicle.

    Attributes:
        autopilot: "ardupilot", "px4" or "rotorflight".
        title: of the vehicle's card.
        found: the law with its gains, what each loop is worth.
        parameters: all lines of the file by the firmware's names, outputs and frame included.
        gains: those of them that are gains and filters.
        flown: modes flown; empty where none was.
        late: how late commands are taken to be, in words.
        premise: why the model carries no gains, in words; "" where it does.
        judged: whether the gains were given, and only judged.
    """

    autopilot: AutopilotName
    title: str
    found: CascadeGains[ArduPilotLaw] | CascadeGains[RotorflightLaw]
    parameters: Mapping[str, float]
    gains: tuple[str, ...]
    flown: tuple[FlownMode, ...]
    late: str
    premise: str = ""
    judged: bool = False

    @property
    def problems(self) -> tuple[str, ...]:
        """Why these gains should not be flown; empty where margins hold and the flights stay where they should."""
        problems = [*filter(None, (self.premise,)), *self.found.problems]
        if self.judged and self.found.grows:
            problems.append("If the aircraft flies with these parameters, its flight refutes this model: use neither.")
        for flight in self.flown:
            if flight.fell:
                problems.append(f"{flight.mode} does not fly: {flight.fell}")
            elif flight.mode in _PLACED and not flight.place <= STRAYS:
                problems.append(f"{flight.mode} strays by {flight.place:.2f} m, expected {STRAYS:g} m or less.")
        return tuple(problems)

    def controller(self, mode: FlownModeName | None = None) -> ArduPilotLaw | RotorflightLaw:
        """The law as a controller, for `sp.simulate_closed_loop`, `sp.check_controller` and `sp.live`.

        Args:
            mode: as of `FlownMode`; the one that holds a place where None.
        """
        return _in_mode(self.found.law, mode)

    def save(self, path: str | Path) -> Path:
        """Write the parameter file (.parm or .params), or the controller's (.toml).

        Raises:
            SwashError: for another ending.
        """
        file = Path(path)
        if file.suffix == ".toml":
            save_controller(self.controller(), file)
            return file
        expected = _SUFFIX[self.autopilot]
        if file.suffix != expected:
            raise SwashError(f"ends in '{file.suffix}', expected {expected} or .toml.", where=file)
        if self.autopilot == "rotorflight":
            return write_text(file, cli_dump(self.parameters, title=self.title))
        if self.autopilot == "ardupilot":
            return write_text(file, parameter_file(dict(self.parameters), title=self.title))
        return write_text(file, px4_file(dict(self.parameters), title=self.title))

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        return {
            "autopilot": self.autopilot,
            "vehicle": self.found.law.vehicle,
            "late": self.late,
            "parameters": dict(self.parameters),
            "loops": [asdict(loop) | {"holds": loop.holds} for loop in self.found.loops],
            "stabilize": [asdict(loop) for loop in self.found.stabilize],
            "slowest": {"real": self.found.slowest.real, "imaginary": abs(self.found.slowest.imag)},
            "flown": [asdict(flight) for flight in self.flown],
            "problems": list(self.problems),
        }

    def page(self, *, title: str | None = None) -> Report:
        """The page of `sp.report`, under a heading, its own where None."""
        worth = {
            loop.name: f"{loop.gain:.1f} dB, {loop.phase:.1f} deg, {1e3 * loop.delay:.1f} ms, rejects to "
            f"{loop.rejection:.2f} rad/s, max |S| {loop.peak:.2f}"
            for loop in self.found.loops
        }
        numbers = ", ".join(f"{name} {self.parameters[name]:.4g}" for name in self.gains if name not in RENAMED)
        return plain_page(
            title or f"Gains for {self.title}",
            summary={"Commands are late by": self.late, **worth, "Parameters": numbers},
            sections=[section_of_loops(self.found.loops)],
            problems=self.problems,
        )

    def __repr__(self) -> str:
        law = self.found.law
        lines = [f"{self.title}: {CALLED[self.autopilot]}, loops at {law.rate:g} Hz"]
        lines.append(f"late: {self.late}")
        head = ("loop", "gain [dB]", "phase [deg]", "delay", "crossover", "bandwidth", "rejects to", "max |S|")
        rows = [
            (
                loop.name,
                *(f"{value:.1f}" for value in (loop.gain, loop.phase)),
                delay_words(loop.delay),
                *(f"{value:.2f}" for value in (loop.crossover, loop.bandwidth, loop.rejection, loop.peak)),
            )
            for loop in (
                *self.found.loops,
                *(replace(each, name=f"{each.name} alone") for each in self.found.stabilize),
            )
        ]
        lines += ["", text_table(head, rows), "each broken with the others closed; frequencies in rad/s"]
        alone = "ANGLE" if self.autopilot == "rotorflight" else "STABILIZE"
        lines += [f"alone: in {alone}, no height or place held; what a sweep at the mixer measures", ""]
        shown = [(name, f"{self.parameters[name]:.4g}") for name in self.gains if name not in RENAMED]
        lines.append(text_table(("parameter", "value"), shown))
        if self.flown:
            above = ("flown in still air", "lean [deg]", "heading [deg]", "height [m]", "place [m]", "last 20 s [m]")
            cells = [
                (
                    flight.mode,
                    *(_cell(v) for v in (flight.lean, flight.heading, flight.height, flight.place, flight.still)),
                )
                for flight in self.flown
            ]
            lines += ["", text_table(above, cells)]
            lines.append("from 2 degrees of lean and 0.14 m/s, integrals at zero: the farthest from what is held")
        return "\n".join([*lines, *(["", *self.problems] if self.problems else [])])


def find_gains(asked: FindGains) -> AutopilotGains:
    """The gains that were asked for, judged and flown."""
    autopilot, notch, parameters = asked.autopilot, asked.notch, asked.parameters
    if autopilot != "ardupilot" and notch is not None:
        raise ControllerError("is for ArduPilot's parameters only.", channel="notch")
    if autopilot == "px4" and parameters is not None:
        raise ControllerError("is for ArduPilot's and Rotorflight's parameters only.", channel="parameters")
    if notch is not None and len(notch) != 2:
        raise SwashError("is not HZ, WIDTH.", channel="notch")
    if notch is not None and not (0.0 < notch[1] < 2.0 * notch[0] and notch[0] < 400.0):
        raise ControllerError(f"is {notch[0]:g} Hz, {notch[1]:g} Hz wide.", channel="notch")
    vehicle = asked.flying(asked.vehicle)
    nominal = vehicle.card.values().get("voltage_nominal")
    hover = trim(vehicle, voltage=nominal if asked.voltage is None else asked.voltage)
    late, told = _late(vehicle, in_seconds(asked.delay))
    design: CascadeGains[ArduPilotLaw] | CascadeGains[RotorflightLaw]
    modes: tuple[FlownModeName, ...] = FLIGHT_MODES
    if autopilot == "rotorflight":
        if isinstance(parameters, Path):
            raise ControllerError("of Rotorflight are given by name, not as a file.", channel="parameters")
        start = replace(rotorflight_law(vehicle, hover, given=parameters), rate=asked.rate or ROTORFLIGHT_RATE)
        design = (rotorflight_gains if parameters is None else judge_rotorflight)(vehicle, hover, start, delays=late)
        lines = gains = {n: v for n, v in design.law.parameters.items() if v != ROTORFLIGHT_DEFAULTS[n]}
        modes = ROTORFLIGHT_MODES
    elif autopilot == "px4":
        mapping = mapping_of(vehicle, asked.servos, name=name_of(asked.vehicle), suffix="_px4")
        design = cascade_gains(
            vehicle, hover, px4_law(mapping, vehicle, hover, rate=asked.rate or PX4_RATE), delays=late
        )
        gains = px4_gains(design.law)
        lines = {**px4_parameters(mapping), **gains}
    else:
        mapping = mapping_of(vehicle, asked.servos, name=name_of(asked.vehicle), suffix="")
        given = read_parameter_file(parameters) if isinstance(parameters, Path) else parameters
        begun = ardupilot_law(
            mapping,
            vehicle,
            hover,
            given=None if given is None else dict(given),
            notch=None if notch is None else (notch[0], notch[1]),
            rate=asked.rate or RATE_OF_LOOPS,
        )
        design = (cascade_gains if given is None else judge_cascade)(vehicle, hover, begun, delays=late)
        gains = written_gains(design.law)
        lines = {**ardupilot_parameters(mapping, vehicle, hover), **gains}
    return AutopilotGains(
        autopilot,  # pyrefly: ignore[bad-argument-type]
        vehicle.card.title,
        design,
        lines,
        tuple(gains),
        tuple(_flown(vehicle, hover, design, mode) for mode in modes) if asked.fly else (),
        told + _sent_later(design.law),
        refused_by_card(vehicle.card),
        parameters is not None,
    )


def _late(vehicle: Vehicle, given: Mapping[str, float] | float | None) -> tuple[dict[str, float], str]:
    known = input_delays(vehicle)
    late = complete_delays(vehicle, given if given is not None else known or ASSUMED_DELAY)
    if given is not None:
        whose = "as given"
    elif known:
        whose = "identified"
    else:
        whose = "assumed: the model knows no delay and may know no servos; --delay says more, and 0 is a SITL's"
    return dict(late), f"{', '.join(f'{name} {1e3 * value:.3g} ms' for name, value in late.items())} ({whose})"


def _in_mode(law: ArduPilotLaw | RotorflightLaw, mode: FlownModeName | None) -> ArduPilotLaw | RotorflightLaw:
    if isinstance(law, RotorflightLaw):
        asked: RotorflightMode = "angle" if mode == "angle" else "hover"
        if mode not in (None, *ROTORFLIGHT_MODES):
            raise ControllerError(f"is '{mode}', expected {', '.join(ROTORFLIGHT_MODES)}.", channel="mode")
        return law.in_mode(asked)
    if mode == "angle" or mode == "hover":
        raise ControllerError(f"is '{mode}', expected {', '.join(FLIGHT_MODES)}.", channel="mode")
    return law.in_mode(mode or "loiter")


def _sent_later(law: ArduPilotLaw | RotorflightLaw) -> str:
    if isinstance(law, RotorflightLaw):
        return ""
    by_delay = [f"{1e3 * delay:.3g} ms" for delay in sorted(set(law.output_delays) - {0.0})]
    return f"; outputs of servos that the firmware sends a loop later: {by_delay[0]} more" if by_delay else ""


def _flown(
    vehicle: Vehicle,
    hover: Trim,
    design: CascadeGains[ArduPilotLaw] | CascadeGains[RotorflightLaw],
    mode: FlownModeName,
) -> FlownMode:
    rest = hover.states()
    start = {**rest, **{name: rest.get(name, 0.0) + by for name, by in _UPSET.items()}}
    reference = {name: rest.get(name, 0.0) for name in ("x", "y", "z", "psi")}
    law = replace(_in_mode(design.law, mode), settled=())
    nothing = (math.nan,) * 5
    try:
        flight = simulate_closed_loop(
            vehicle,
            law,
            duration=_DURATION,
            start=start,
            reference=reference,
            rate=law.rate,
            delays=dict(design.delays),
            voltage=float(hover.environment.voltage),
            environment=hover.environment,
        )
    except DivergenceError as error:
        return FlownMode(mode, *nothing, fell=error.problem)
    time = flight.time("x")

    def away(state: str) -> np.ndarray[Any, Any]:
        return np.asarray(flight.values(state)) - rest.get(state, 0.0)

    lean = np.degrees(np.max(np.hypot(away("phi"), away("theta"))))
    heading, height = np.degrees(np.max(np.abs(away("psi")))), float(np.max(np.abs(away("z"))))
    place = np.hypot(away("x"), away("y"))
    holds, keeps = mode in _PLACED, mode not in ("stabilize", "angle")
    return FlownMode(
        mode,
        float(lean),
        float(heading),
        height if keeps else math.nan,
        float(np.max(place)) if holds else math.nan,
        float(np.max(place[time > time[-1] - _LAST])) if holds else math.nan,
    )


def _cell(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"
