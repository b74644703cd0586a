"""Gains of a whole autopilot from a vehicle's model: rate and attitude, height, place, one after the other.

Every stage tries a grid, keeps what holds the margins at every crossing with all loops so far closed, and takes of that
what rejects disturbances fastest; stability is that of the law itself, sampled and linearised about the hover.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.control.analysis.cascade import (
    COARSE,
    COMMANDS,
    OUTPUTS,
    BrokenLoops,
    CascadePlant,
    broken_at_commands,
    broken_at_leans,
    cascade_plant,
    feedback,
)
from swashplate.control.analysis.gain_premises import refuse_turned_commands, refused_by_card
from swashplate.control.analysis.sampled_loop import sampled_loop
from swashplate.control.analysis.stability import modes_of
from swashplate.control.laws.ardupilot.law import ArduPilotLaw, FlightMode
from swashplate.control.laws.ardupilot.parameters import AXES
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

Law = TypeVar("Law")
GAIN_KEPT, PHASE_KEPT, PEAK_KEPT = 6.0, 45.0, 2.0
"""dB, degrees and largest sensitivity that every loop keeps with all others closed."""
_RESERVE: Mapping[FlightMode, tuple[float, float, float]] = {
    "stabilize": (1.5, 10.0, 0.2),
    "alt_hold": (1.0, 5.0, 0.1),
    "loiter": (0.2, 1.0, 0.02),
}
"""Of the three, what a stage leaves to those around it, and to the grid."""
_BANDS: Mapping[FlightMode, tuple[float, float]] = {
    "stabilize": (0.2, 15.0),
    "alt_hold": (0.1, 5.0),
    "loiter": (0.05, 2.0),
}
"""rad/s: where a stage holds disturbances down."""
_SEEN = (1.0, 10.0)
"""rad/s: where a rate per command is read off."""
_NEAR = 6.0
"""rad/s: where commands are compared between vehicles and axes."""
_SHARES = np.geomspace(0.02, 5.0, 20)
_STRONGEST, _LOUDEST = 0.5, 3.0
"""Of a full command per rad/s: P alone, the end of ArduPilot's range for roll and pitch, and with D for noise."""
_SLOW = 1.0
"""rad/s: modes of place and speed below it may grow while no place is held."""
_DAMPED, _SWIFT = 0.04, 50.0
"""Of every mode's size [1/s], up to a size [rad/s], what it must decay by."""
_TRIED = 40
"""Sets whose modes are looked at before a stage asks for less reserve."""
_STILL = 1e-4
"""1/s: smaller modes are places and headings that nobody holds."""
_EPS = 1e-6


@dataclass(frozen=True)
class LoopWorth:
    """One loop of the cascade, broken with the others closed.

    Attributes:
        name: of it.
        gain: margin [dB]. phase: margin [deg]. delay: margin [s]. crossover, bandwidth, rejection: [rad/s].
        peak: largest sensitivity.
    """

    name: str
    gain: float
    phase: float
    delay: float
    crossover: float
    bandwidth: float
    rejection: float
    peak: float

    @property
    def holds(self) -> bool:
        """Whether it has 6 dB, 45 degrees and a sensitivity below two."""
        return self.gain >= GAIN_KEPT - _EPS and self.phase >= PHASE_KEPT - _EPS and self.peak <= PEAK_KEPT + _EPS


@dataclass(frozen=True)
class CascadeGains(Generic[Law]):
    """Gains of a whole autopilot.

    Attributes:
        law: with them, in the mode that holds a place.
        loops: what each is worth.
        stabilize: roll, pitch and yaw where neither height nor place is held: what a sweep at the mixer measures.
        slowest: the least stable mode of the sampled law on the linear model [1/s].
        delays: from output to actuator, by input [s]; the law's own (`output_delays`) come to them.
    """

    law: Law
    loops: tuple[LoopWorth, ...]
    stabilize: tuple[LoopWorth, ...]
    slowest: complex
    delays: Mapping[str, float]

    @property
    def grows(self) -> bool:
        """Whether a mode grows with these gains."""
        return self.slowest.real > _EPS

    @property
    def problems(self) -> tuple[str, ...]:
        """Where margins are missed or a mode grows, in words."""
        problems = [
            f"The {loop.name} loop keeps {loop.gain:.1f} dB, {loop.phase:.0f} degrees and a sensitivity of "
            f"{loop.peak:.2f}; expected {GAIN_KEPT:g} dB, {PHASE_KEPT:g} degrees and {PEAK_KEPT:g}."
            for loop in self.loops
            if not loop.holds
        ]
        if self.grows:
            problems.append(f"A mode grows: {self.slowest.real:+.3g} +- {abs(self.slowest.imag):.3g}j 1/s.")
        return tuple(problems)


def judge_cascade(
    vehicle: Vehicle, hover: Trim, law: ArduPilotLaw, *, delays: Mapping[str, float]
) -> CascadeGains[ArduPilotLaw]:
    """What a law with its gains is worth on a vehicle, whoever chose them.

    Args:
        vehicle, hover: what flies, its hover.
        law: with its gains.
        delays: from command to actuator, by input [s].

    Raises:
        ControllerError: naming the command that the vehicle turns against.
    """
    k, delay_row = law.parameters, _row(vehicle, delays) + law.output_delays
    plant = cascade_plant(vehicle, hover, law.mixer, k, rate=law.rate, delays=delay_row)
    refuse_turned_commands(plant.omega, plant.response, commands=COMMANDS, outputs=OUTPUTS, where=vehicle.name)
    total, inner = feedback(plant.omega, k), feedback(plant.omega, k, place=False)
    commands, leans = broken_at_commands(plant, total, (0, 1, 2, 3)), broken_at_leans(plant, inner, total)
    names = ("roll", "pitch", "yaw", "height")
    loops = [*worth_of(commands, names), *worth_of(leans, ("place right", "place ahead"))]
    alone = broken_at_commands(plant, feedback(plant.omega, k, height=False, place=False), (0, 1, 2))
    modes = _modes(vehicle, hover, law, "loiter", delays)
    slowest = complex(modes[0]) if modes.size else 0j
    return CascadeGains(law, tuple(loops), tuple(worth_of(alone, names[:3])), slowest, dict(delays))


def cascade_gains(
    vehicle: Vehicle, hover: Trim, start: ArduPilotLaw, *, delays: Mapping[str, float]
) -> CascadeGains[ArduPilotLaw]:
    """Gains for a vehicle in hover.

    Args:
        vehicle, hover: the model, its hover.
        start: the law with its filters, mixer and hover's throttle; its gains are replaced.
        delays: from command to actuator, by input [s].

    Raises:
        ControllerError: naming the stage at which nothing that was tried holds the margins, the command that the
            vehicle turns against, or the axis that was fitted although no flight moved it.
    """
    if unmoved := refused_by_card(vehicle.card):
        raise ControllerError(f"no gains are given: {unmoved}", where=vehicle.name)
    delay_row = _row(vehicle, delays) + start.output_delays
    open_loops = {f"ATC_RAT_{axis}_{name}": 0.0 for axis in AXES for name in "PID"}
    k: dict[str, float] = {**start.parameters, **open_loops}
    plant = cascade_plant(vehicle, hover, start.mixer, k, rate=start.rate, delays=delay_row, omega=COARSE)
    refuse_turned_commands(plant.omega, plant.response, commands=COMMANDS, outputs=OUTPUTS, where=vehicle.name)
    law = start

    def settle(stage: str, mode: FlightMode, sets: Mapping[str, Array], broken: Callable[..., BrokenLoops]) -> None:
        nonlocal law
        loops, spare, order = broken({**k, **sets}), _RESERVE[mode], list[int]()
        worth = loops.quiet(*_BANDS[mode])[:, : 2 if mode == "loiter" else None].min(axis=1)
        ranked = np.argsort(-worth, kind="stable")
        growing: set[float] = set()
        for share in (1.0, 0.5, 0.0):
            each = (loops.gain >= GAIN_KEPT + share * spare[0]) & (loops.phase >= PHASE_KEPT + share * spare[1])
            kept = np.asarray(np.all(each & (loops.peak <= PEAK_KEPT - share * spare[2]), axis=1))
            order = [int(i) for i in ranked if kept[i]]
            for i in [i for i in order if loops.turns[i] not in growing][:_TRIED]:
                if loops.turns[i] in growing:
                    continue
                chosen = {name: float(np.broadcast_to(value, kept.shape)[i]) for name, value in sets.items()}
                tuned = replace(start, parameters={**k, **chosen})
                modes = _modes(vehicle, hover, tuned, mode, delays)
                modes = modes[np.abs(modes) > (0.0 if mode == "loiter" else _SLOW)]
                if np.all(modes.real <= -_DAMPED * np.minimum(np.abs(modes), _SWIFT)):
                    k.update(chosen)
                    law = tuned
                    return
                if np.any(modes.real > _STILL):
                    growing.add(float(loops.turns[i]))
        text = f"{len(order)} of {len(worth)} sets keep {GAIN_KEPT:g} dB, {PHASE_KEPT:g} degrees and a sensitivity of "
        text += f"{PEAK_KEPT:g} with every loop around it" + (
            ", and a mode grows or hardly decays with each" if order else ""
        )
        raise ControllerError(
            f"no gains of the {stage} loop hold: {text}.",
            where=vehicle.name,
            hint="Less delay or faster filters would leave room; fly this one by hand first.",
        )

    cyclic = _attitude_sets(plant, k, (0, 1))
    settle("roll and pitch", "stabilize", cyclic, lambda trial: _commands(plant, trial, (0, 1)))
    settle("yaw", "stabilize", _attitude_sets(plant, k, (2,)), lambda trial: _commands(plant, trial, (2,)))
    settle("height", "alt_hold", _height_sets(plant, k), lambda trial: _commands(plant, trial, (3,), height=True))
    settle("place", "loiter", _place_sets(), lambda trial: _placed(plant, trial))
    return judge_cascade(vehicle, hover, law, delays=delays)


def _row(vehicle: Vehicle, delays: Mapping[str, float]) -> Array:
    return np.array([delays.get(name, 0.0) for name in vehicle.input_names])


def _modes(
    vehicle: Vehicle, hover: Trim, law: ArduPilotLaw, mode: FlightMode, delays: Mapping[str, float]
) -> NDArray[np.complex128]:
    """Modes of the law about the hover [1/s], the least stable first, without memories that nothing moves."""
    moded = law.in_mode(mode).at(vehicle, hover)
    modes = modes_of(sampled_loop(vehicle, moded, hover, delays=dict(delays)))
    return modes[np.abs(modes) > _STILL]


def _commands(
    plant: CascadePlant, trial: Mapping[str, Array | float], which: tuple[int, ...], *, height: bool = False
) -> BrokenLoops:
    return broken_at_commands(plant, feedback(plant.omega, trial, height=height, place=False), which)


def _placed(plant: CascadePlant, trial: Mapping[str, Array | float]) -> BrokenLoops:
    """The place loop, and roll and pitch with it around them; the first two are what the choice is for."""
    total, inner = feedback(plant.omega, trial), feedback(plant.omega, trial, place=False)
    leans, commands = broken_at_leans(plant, inner, total), broken_at_commands(plant, total, (0, 1, 2, 3))
    return BrokenLoops(plant.omega, np.concatenate([leans.loop, commands.loop], axis=-1), commands.turns)


def largest_rate(plant: CascadePlant, output: str, command: int) -> float:
    """The largest rate per command from 1 to 10 rad/s [rad/s]."""
    band = (plant.omega >= _SEEN[0]) & (plant.omega <= _SEEN[1])
    return float(np.max(np.abs(plant.response[band, OUTPUTS.index(output), command])))


def _attitude_sets(plant: CascadePlant, k: Mapping[str, float], axes: tuple[int, ...]) -> dict[str, Array]:
    """P per rate per command near the crossover, I and D per P, the angle's P; the axes alike."""
    angles = (1.0, 1.5, 2.0, 2.75, 3.5, 4.5, 6.0)
    grid = np.array(list(product(_SHARES, (0.5, 1.5), (0.0, 0.02, 0.05, 0.1, 0.2), angles))).T
    sets: dict[str, Array] = {}
    near = int(np.argmin(np.abs(plant.omega - _NEAR)))
    ones = {i: 1.0 / float(np.abs(plant.response[near, i, i])) for i in axes}
    loud = grid[0] * (1.0 + grid[2] * 2.0 * np.pi * max(k[f"ATC_RAT_{AXES[i]}_FLTD"] for i in axes))
    most = max(ones.values())
    grid = grid[:, (loud * most <= _LOUDEST) & (grid[0] * most <= _STRONGEST)]
    for i in axes:
        p = grid[0] * ones[i]
        axis = AXES[i]
        sets |= {f"ATC_RAT_{axis}_P": p, f"ATC_RAT_{axis}_I": grid[1] * p, f"ATC_RAT_{axis}_D": grid[2] * p}
        sets[f"ATC_ANG_{axis}_P"] = grid[3]
    return sets


def _height_sets(plant: CascadePlant, k: Mapping[str, float]) -> dict[str, Array]:
    """The integral is the acceleration's, or the climb's where the law has none of the acceleration (PX4)."""
    band = (plant.omega >= _SEEN[0]) & (plant.omega <= _SEEN[1])
    lift = 1j * plant.omega[band] * plant.response[band, OUTPUTS.index("down"), 3]
    one, shares = 10.0 / float(np.max(np.abs(lift))), np.geomspace(0.02, 1.5, 14)
    grid = np.array(list(product(shares, (0.5, 1.0, 2.0), (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0), (0.3, 0.5, 0.7, 1.0)))).T
    sets = {"PSC_ACCZ_P": grid[0] * one, "PSC_VELZ_P": grid[2], "PSC_POSZ_P": grid[3] * np.minimum(1.0, grid[2])}
    integral = k["PSC_ACCZ_I"] > 0.0
    return sets | ({"PSC_ACCZ_I": grid[1] * grid[0] * one} if integral else {"PSC_VELZ_I": 0.3 * grid[1] * grid[2]})


def _place_sets() -> dict[str, Array]:
    speeds = np.geomspace(0.1, 3.0, 16)
    grid = np.array(list(product(speeds, (0.1, 0.2, 0.35, 0.5), (0.0, 0.1, 0.25), (0.15, 0.25, 0.35, 0.5)))).T
    return {
        "PSC_VELXY_P": grid[0],
        "PSC_VELXY_I": grid[1] * grid[0],
        "PSC_VELXY_D": grid[2] * grid[0],
        "PSC_POSXY_P": np.minimum(1.0, grid[3] * grid[0] + 0.0),
    }


def worth_of(loops: BrokenLoops, names: tuple[str, ...]) -> list[LoopWorth]:
    """What the loops of one set of gains are worth, by their names."""
    return [
        LoopWorth(
            name,
            float(loops.gain[0, i]),
            float(loops.phase[0, i]),
            float(loops.delay[0, i]),
            float(loops.crossover[0, i]),
            float(loops.bandwidth[0, i]),
            float(loops.rejection[0, i]),
            float(loops.peak[0, i]),
        )
        for i, name in enumerate(names)
    ]
