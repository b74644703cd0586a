"""A controller on a vehicle, judged: margins, disturbance rejection, handling qualities, steps and cross-coupling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.control.analysis.check_steps import (
    COUPLING_WITHIN,
    STEPS,
    Coupling,
    InGusts,
    Step,
    couplings_of,
    fly_gusts,
    fly_steps,
)
from swashplate.control.analysis.judged_loop import Aircraft
from swashplate.control.analysis.margins import Margins
from swashplate.control.analysis.requirements import (
    BANDWIDTH,
    REJECTION,
    REJECTION_PEAK,
    TASKS,
    Boundary,
    delay_margin,
    froude_scale,
)
from swashplate.control.analysis.sampled_loop import SampledLoop
from swashplate.control.analysis.stability import frequencies_of, margins_of, modes_of
from swashplate.control.kinds import kind_of
from swashplate.errors import ControllerError, IdentificationError, SwashError
from swashplate.identification.frequency.handling import Handling, delay_words, handling_qualities
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import flown_delays
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim
from swashplate.simulation.wind import INDOOR, Gusts

Command = Literal["auto", "rate", "attitude"]

ATTITUDES: Mapping[str, tuple[str, float]] = {"phi": ("roll", 1.0), "theta": ("pitch", -1.0), "psi": ("psi", 1.0)}
"""Attitude by name: the reference that a pilot moves it by, and its sign (a pitch command is nose down positive)."""
_DISTURBED = ("phi", "theta", "psi", "x", "y", "z", "u", "v")
"""States whose disturbance rejection is told."""
_NEUTRAL = 1e-6
"""1/s."""
_LONGEST_DELAY = 1.0
"""s."""
_HALF_POWER = 10.0 ** (-3.0 / 20.0)
_ATTITUDE_LAG = -60.0
_LAST_LEAD = 60.0
"""Degrees of lead above which an outer loop still takes the pilot's command back; the response is read above it."""


@dataclass(frozen=True)
class AttitudeResponse:
    """An attitude's response to the pilot's command.

    Attributes:
        state, reference: names.
        omega, response: the frequency response, the sign a pilot's [rad/s].
        handling: bandwidth and phase delay; None with the reason in `problem`.
        kind: "attitude" or "rate", what a steady command gives; it says which bandwidth counts.
        level: of the bandwidth.
    """

    state: str
    reference: str
    omega: Array
    response: NDArray[np.complex128]
    handling: Handling | None
    kind: str
    level: int | None
    problem: str = ""

    @property
    def oscillates(self) -> bool:
        """Bandwidth by gain below that by phase (or none): prone to pilot-induced oscillation (ADS-33E-PRF, fig. 4)."""
        h = self.handling
        return h is not None and not h.bandwidth_gain.value >= h.bandwidth_phase.value


@dataclass(frozen=True)
class Rejection:
    """What a loop leaves of a disturbance on a measured state.

    Attributes:
        state: name.
        bandwidth: lowest frequency at which it leaves 3 dB less than all [rad/s]; NaN where it never does.
        peak: the most that it leaves [dB], at `peak_frequency` [rad/s].
        omega, size: |S| against frequency.
        level, peak_level: of both; None where no standard speaks of the state.
    """

    state: str
    bandwidth: float
    peak: float
    peak_frequency: float
    omega: Array
    size: Array
    level: int | None
    peak_level: int | None


@dataclass(frozen=True)
class ControlCheck:
    """Everything that was found; a part that could not be is in `problems`.

    Attributes:
        vehicle, trim: what flies, where.
        scale: of the Froude scaling, N.
        task: of the bandwidth's boundaries.
        modes: of the closed loop [1/s], least stable first.
        margins: None for a loop that does not stand.
        omega, opened: the loop opened at the inputs, for the plots; empty with an observer.
        notes: what is not told here, and why.
        in_gusts: how far it strays in turbulence; None where none was flown.
        delays: from command to actuator by input [s], in the loop and in the flights.
        delay_boundary: what every delay margin must reach.
    """

    vehicle: Vehicle
    trim: Trim
    rate: float
    scale: float
    task: str
    modes: NDArray[np.complex128]
    margins: Margins | None
    omega: Array
    opened: NDArray[np.complex128]
    attitudes: tuple[AttitudeResponse, ...]
    rejections: tuple[Rejection, ...]
    steps: tuple[Step, ...]
    couplings: tuple[Coupling, ...]
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()
    in_gusts: InGusts | None = None
    delays: Mapping[str, float] = field(default_factory=dict)
    delay_boundary: Boundary = field(default_factory=lambda: delay_margin(0.0))

    @property
    def slowest(self) -> complex:
        """The least stable mode that is one: not a place that nobody holds, nor memory that nothing writes [1/s]."""
        moving = self.modes[np.abs(self.modes) > _NEUTRAL]
        return complex(moving[0]) if moving.size else 0j

    def boundary(self, state: str) -> Boundary:
        """Of an attitude's bandwidth."""
        return BANDWIDTH[self.task][state]


def check_controller(
    vehicle: Vehicle,
    controller: Controller,
    trim: Trim,
    *,
    task: str = "other",
    command: Command = "auto",
    scale: float | None = None,
    duration: float = 20.0,
    gusts: Gusts | None = INDOOR,
    delays: Mapping[str, float] | float | None = None,
    computation: float | None = None,
    required_delay: float | None = None,
    points: int = 600,
) -> ControlCheck:
    """Judge a controller about a trim.

    Args:
        vehicle: what flies, which need not be what the controller was designed on.
        controller: see `swashplate.simulation.closed_loop.Controller`.
        trim: the hover or steady flight.
        task: of the bandwidth's boundaries, one of `TASKS`.
        command: type of the attitude response. "rate" counts the lower of the two bandwidths, "attitude" that by
            phase; "auto" takes it for attitude where the phase at a tenth of the bandwidth is above -60 degrees.
        scale: of the Froude scaling; by default the UH-60's rotor radius over the vehicle's.
        duration: of the steps and of the flights in gusts [s].
        gusts: the turbulence of those flights; None for none.
        delays: from command to actuator [s], for the loop and for the flights; where not given those of
            `swashplate.simulation.closed_loop.flown_delays`: what the vehicle's card knows counts, whatever the
            controller believes.
        computation: from a reading to its command [s]. It is not in the loop: the delay margin must have room for it.
        required_delay: delay margin that every loop and all together must have [s]; where not given a sample of the
            controller and the computation. Less is a problem.
        points: of the frequency grid.

    Raises:
        SwashError: for a task that is not known, or a vehicle without a rotor radius where no scale is given.
    """
    if task not in TASKS:
        raise SwashError(f"is '{task}', expected {', '.join(TASKS)}.", channel="task")
    if duration <= COUPLING_WITHIN:
        raise SwashError(f"is {duration:g} s, expected more than {COUPLING_WITHIN:g} s.", channel="duration")
    n = scale if scale is not None else _scale_of(vehicle)
    delay_by_input = dict(
        zip(vehicle.input_names, flown_delays(vehicle, controller, delays=delays).tolist(), strict=True)
    )
    room = 1.0 / controller.rate + (computation or 0.0) if required_delay is None else required_delay
    if not 0.0 <= room <= _LONGEST_DELAY:
        raise SwashError(f"is {room:g} s, expected 0 to {_LONGEST_DELAY:g}.", channel="delay margin")
    flying = Aircraft(vehicle, trim, delay_by_input)
    kind, problems = kind_of(controller), list[str]()
    judged = kind.judged(controller, flying)
    loop, notes = judged.loop, list(judged.notes)
    w = frequencies_of(loop, points=judged.points or points)
    margins = None
    try:
        margins = margins_of(loop, points=len(w), where=vehicle.name)
    except ControllerError as error:
        problems.append(f"No margins: {error.problem}")
    separate = judged.held is None  # the loop has the references in it
    if judged.held is None:
        held = tuple(r for r, (s, _, _) in STEPS.items() if s in loop.states and loop.answers(r, s))
    else:
        held = judged.held
    left = {state: judged.sensitivity(w, state) for state in _DISTURBED} if margins else {}
    steps = fly_steps(flying, controller, held, duration, problems)
    blown = fly_gusts(flying, controller, gusts, held if margins else (), duration, problems, notes)
    commanded = _commanded(loop) if separate else []
    check = ControlCheck(
        vehicle=vehicle,
        trim=trim,
        rate=controller.rate,
        scale=n,
        task=task,
        modes=modes_of(loop),
        margins=margins,
        omega=w if separate else w[:0],
        opened=loop.opened(w) if separate else np.zeros(0, dtype=np.complex128),
        attitudes=tuple(_attitude(loop, w, state, BANDWIDTH[task], command, n) for state in commanded),
        rejections=_rejections(w, {state: np.abs(s) for state, s in left.items() if s is not None}, n),
        steps=tuple(steps),
        couplings=tuple(couplings_of({step.reference: step for step in steps})),
        problems=tuple(problems),
        notes=(*notes, *kind.differences(controller, flying, margins)),
        in_gusts=blown,
        delays=delay_by_input,
    )
    return with_delay_verdict(check, room)


def with_delay_verdict(check: ControlCheck, required: float) -> ControlCheck:
    """The check with a problem more where a delay margin is less than required [s]."""
    boundary = delay_margin(required)
    problems = check.problems
    if check.margins is not None and check.margins.least_delay < required:
        short = [a for a in check.margins.axes if a.delay < required]
        short_of = [f"{a.name} {delay_words(a.delay)}" for a in short]
        if check.margins.delay < required:
            short_of.append(f"all inputs together {delay_words(check.margins.delay)}")
        problems = (*problems, f"Delay margin: {', '.join(short_of)}; required are {boundary.level1:.3g} ms.")
    return replace(check, problems=problems, delay_boundary=boundary)


def _scale_of(vehicle: Vehicle) -> float:
    radius = vehicle.card.values().get("rotor_radius")
    if radius is None:
        raise SwashError(
            "has no rotor_radius to scale the boundaries by.",
            where=vehicle.card.path or vehicle.name,
            hint="Give the scale (--scale; 1 for full size).",
        )
    return froude_scale(radius)


def _commanded(loop: SampledLoop) -> list[str]:
    return [s for s, (reference, _) in ATTITUDES.items() if s in loop.states and loop.answers(reference, s)]


def _attitude(
    loop: SampledLoop,
    w: Array,
    state: str,
    boundaries: Mapping[str, Boundary],
    command: Command,
    scale: float,
) -> AttitudeResponse:
    reference, sign = ATTITUDES[state]
    response = sign * loop.response(w, reference, state)
    # The phase is counted from where the rate's response is largest; there an attitude lags by about 90 degrees.
    phase = np.degrees(np.unwrap(np.angle(response)))
    middle = int(np.argmax(np.abs(response) * w))
    phase -= 360.0 * np.ceil((phase[middle] - 90.0) / 360.0)
    leading = np.flatnonzero(phase[: middle + 1] > _LAST_LEAD)
    first = int(leading[-1]) + 1 if leading.size else 0
    band = slice(first, None)
    kind = command
    try:
        qualities = handling_qualities(w[band], response[band], command="attitude")
        if command == "auto":
            low = float(np.interp(qualities.bandwidth_phase.value / 10.0, w, phase))
            kind = "attitude" if low > _ATTITUDE_LAG else "rate"
        if kind == "rate":
            qualities = handling_qualities(w[band], response[band])
    except IdentificationError as error:
        return AttitudeResponse(state, reference, w, response, None, kind, None, error.problem)
    level = boundaries[state].level(qualities.bandwidth.value, scale=scale)
    return AttitudeResponse(state, reference, w, response, qualities, kind, level)


def _rejections(w: Array, sizes: Mapping[str, Array], scale: float) -> tuple[Rejection, ...]:
    rejections = []
    for state, size in sizes.items():
        if np.min(size) > _HALF_POWER:  # nobody holds it
            continue
        below = size < _HALF_POWER
        up = np.flatnonzero(below[:-1] & ~below[1:])
        bandwidth = float("nan")
        if up.size:
            k = int(up[0])
            part = np.log(_HALF_POWER / size[k]) / np.log(size[k + 1] / size[k])
            bandwidth = float(w[k] * (w[k + 1] / w[k]) ** part)
        worst = int(np.argmax(size))
        peak = float(20.0 * np.log10(size[worst]))
        standard = REJECTION.get(state)
        level = None if standard is None else standard.level(bandwidth, scale=scale)
        peak_level = None if standard is None else REJECTION_PEAK.level(peak)
        rejections.append(Rejection(state, bandwidth, peak, float(w[worst]), w, size, level, peak_level))
    return tuple(rejections)
