"""Rotorflight's gains for a helicopter's model: rate and angle loops, then the pilot's height and place around them.

As `cascade_gains` does for ArduPilot: of a grid, what keeps the margins at every crossing with all loops so far closed
and holds disturbances down most. What is told of the result is the law itself, sampled and linearised about the hover,
opened at one input with the others closed. Gains are the whole numbers that the firmware has.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.cascade import (
    COARSE,
    COMMANDS,
    FREQUENCIES,
    OUTPUTS,
    BrokenLoops,
    CascadePlant,
    broken_at_commands,
    broken_at_leans,
    cascade_plant,
)
from swashplate.control.analysis.cascade_gains import (
    GAIN_KEPT,
    PEAK_KEPT,
    PHASE_KEPT,
    CascadeGains,
    LoopWorth,
    largest_rate,
    worth_of,
)
from swashplate.control.analysis.gain_premises import refuse_turned_commands, refused_by_card
from swashplate.control.analysis.sampled_loop import sampled_loop
from swashplate.control.analysis.stability import modes_of
from swashplate.control.laws.ardupilot.mixers import Mixed
from swashplate.control.laws.rotorflight.law import GRAVITY, Rigging, RotorflightLaw, RotorflightMode, SticksPilot
from swashplate.control.laws.rotorflight.parameters import AXES, SCALES
from swashplate.control.laws.rotorflight.pid import OFFSET_CHARGE, table
from swashplate.engine.symbols import ArrayFunctions, Symbols
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

_RESERVE: Mapping[str, tuple[float, float, float]] = {
    "rates": (2.0, 12.0, 0.25),
    "height": (1.0, 5.0, 0.1),
    "place": (0.2, 1.0, 0.02),
}
"""dB, degrees and sensitivity that a stage leaves to those around it."""
_BANDS: Mapping[str, tuple[float, float]] = {"rates": (0.2, 15.0), "height": (0.1, 5.0), "place": (0.05, 2.0)}
_SHARES = np.geomspace(0.02, 6.0, 24)
_LEVELS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
"""1/s: ten of the firmware's `angle_level_strength` are one."""
_STILL, _SLOW = 1e-4, 1.0
"""1/s: smaller modes are places and headings that nobody holds; rad/s: modes of place and speed, which may grow while
nobody holds a place."""
_DAMPED, _SWIFT = 0.04, 50.0
"""Of every mode's size [1/s], up to a size [rad/s], what it must decay by."""
_TRIED = 6
"""Sets of the same number of turns of the loops whose modes are looked at."""
_DEGREES = 180.0 / np.pi


@dataclass(frozen=True)
class _Commands:
    """The mixer's commands as `cascade_plant` asks for them: roll right, pitch nose up, yaw right, collective."""

    rigging: Rigging

    def mix(self, wanted: Symbols, k: Mapping[str, Any], xp: ArrayFunctions) -> Mixed:
        rig = self.rigging
        blades = [
            rig.pitch * wanted[3],
            -rig.pitch * wanted[1],
            rig.pitch * wanted[0],
            rig.centre - rig.tail * wanted[2],
        ]
        return Mixed(xp.stack([*blades, 1.0 + 0.0 * wanted[0]]), xp.zeros(3))

    def unmixed(self, inputs: Any, k: Mapping[str, float]) -> Array:
        rig, (theta0, b1, a1, tail) = self.rigging, inputs[:4]
        return np.array([a1 / rig.pitch, -b1 / rig.pitch, (rig.centre - tail) / rig.tail, theta0 / rig.pitch])


def rotorflight_gains(
    vehicle: Vehicle, hover: Trim, start: RotorflightLaw, *, delays: Mapping[str, float]
) -> CascadeGains[RotorflightLaw]:
    """Gains for a helicopter in hover.

    Args:
        vehicle, hover: the model, its hover.
        start: the law with its filters and rigging; its gains, angle strength and pilot are replaced.
        delays: from output to actuator, by input [s].

    Raises:
        ControllerError: naming the stage at which nothing that was tried holds the margins, the command that the
            vehicle turns against, or the axis that was fitted although no flight moved it.
    """
    if unmoved := refused_by_card(vehicle.card):
        raise ControllerError(f"no gains are given: {unmoved}", where=vehicle.name)
    plant = _plant(vehicle, hover, start, delays, COARSE)
    refuse_turned_commands(plant.omega, plant.response, commands=COMMANDS, outputs=OUTPUTS, where=vehicle.name)
    k: dict[str, Any] = {**start.parameters, **start.pilot._asdict(), "collective": start.hover}
    k |= {f"{axis}_{name}": 0.0 for axis in AXES for name in ("p_gain", "i_gain", "d_gain", "b_gain")}
    for i, axis in enumerate(AXES[:2]):
        k[f"{axis}_f_gain"] = _firmware_number(1.0 / largest_rate(plant, "pq"[i], i), axis, "f_gain")

    def law_with(values: Mapping[str, Any]) -> RotorflightLaw:
        pilot = SticksPilot(**{name: float(values[name]) for name in SticksPilot._fields})
        return replace(start, parameters={name: float(values[name]) for name in start.parameters}, pilot=pilot)

    def settle(
        stage: str, kind: str, sets: Mapping[str, Array], broken: Callable[[Mapping[str, Any]], BrokenLoops]
    ) -> None:
        mode: RotorflightMode = "angle" if kind == "rates" else "hover"
        slow = _SLOW if kind == "rates" else 0.0

        def decays(chosen: Mapping[str, float]) -> bool:
            modes = _modes(vehicle, hover, law_with({**k, **chosen}).in_mode(mode), delays)
            modes = modes[np.abs(modes) > slow]
            return bool(np.all(modes.real <= -_DAMPED * np.minimum(np.abs(modes), _SWIFT)))

        k.update(_best(stage, kind, sets, broken({**k, **sets}), decays))

    for stage, axes in (("roll and pitch", (0, 1)), ("yaw", (2,))):
        settle(
            stage,
            "rates",
            _rate_sets(plant, axes),
            lambda trial, axes=axes: broken_at_commands(plant, _feedback(plant.omega, trial), axes),
        )
    settle(
        "height",
        "height",
        _height_sets(plant),
        lambda trial: broken_at_commands(plant, _feedback(plant.omega, trial, height=True), (3,)),
    )
    settle("place", "place", _place_sets(), lambda trial: _placed(plant, trial))
    return judge_rotorflight(vehicle, hover, law_with(k), delays=delays)


def _modes(vehicle: Vehicle, hover: Trim, law: RotorflightLaw, delays: Mapping[str, float]) -> NDArray[np.complex128]:
    """Modes of the law about the hover [1/s], the least stable first, without memories that nothing moves."""
    modes = modes_of(sampled_loop(vehicle, law.at(vehicle, hover), hover, delays=dict(delays)))
    return modes[np.abs(modes) > _STILL]


def judge_rotorflight(
    vehicle: Vehicle, hover: Trim, law: RotorflightLaw, *, delays: Mapping[str, float]
) -> CascadeGains[RotorflightLaw]:
    """What a law with its gains is worth on a helicopter, whoever chose them: the sampled law about the hover."""
    loops: dict[str, tuple[LoopWorth, ...]] = {}
    slowest = 0j
    modes_flown: tuple[RotorflightMode, ...] = ("angle", "hover")
    for mode in modes_flown:
        trimmed_law = law.in_mode(mode).at(vehicle, hover)
        loop = sampled_loop(vehicle, trimmed_law, hover, delays=dict(delays))
        names = {"A1": "roll", "B1": "pitch", "theta0T": "yaw"} | ({"theta0": "height"} if mode == "hover" else {})
        opened = loop.opened(FREQUENCIES)
        closed = np.linalg.inv(np.eye(opened.shape[1]) + opened)
        at = [loop.inputs.index(name) for name in names]
        each: Complex = np.stack([1.0 / closed[:, i, i] - 1.0 for i in at], axis=-1, dtype=np.complex128)[None]
        loops[mode] = tuple(worth_of(BrokenLoops(FREQUENCIES, each, np.zeros(1)), tuple(names.values())))
        if mode == "hover":
            modes = _modes(vehicle, hover, law.in_mode(mode), delays)
            slowest = complex(modes[0]) if modes.size else 0j
    return CascadeGains(law, loops["hover"], loops["angle"], slowest, dict(delays))


def _plant(
    vehicle: Vehicle, hover: Trim, law: RotorflightLaw, delays: Mapping[str, float], omega: Array
) -> CascadePlant:
    delay_row = np.array([delays.get(name, 0.0) for name in vehicle.input_names])
    mixer: Any = _Commands(law.rigging)
    return cascade_plant(vehicle, hover, mixer, law.parameters, rate=law.rate, delays=delay_row, omega=omega)


def _first_order(s: Complex, hertz: float) -> Complex:
    return np.asarray(1.0 / (1.0 + s / (2.0 * np.pi * hertz)) if hertz > 0.0 else np.ones_like(s))


def _feedback(omega: Array, k: Mapping[str, Any], *, height: bool = False, place: bool = False) -> Complex:
    """K of u = -K y with `COMMANDS` and `OUTPUTS`, shape (m, n, 4, 12), as `cascade.feedback` for this law.

    The offset counts as an integral beside I's; what decays is left out.
    """
    s: Complex = np.asarray(1j * np.asarray(omega), dtype=np.complex128)
    m = max(np.size(value) for value in k.values())
    at = {name: np.broadcast_to(np.asarray(value, float), (m,))[:, None] for name, value in k.items()}
    K = np.zeros((m, s.size, 4, 12), dtype=np.complex128)
    sensed = _first_order(s, float(np.max(k["gyro_lpf1_static_hz"])))
    share = abs(float(k["collective"]))
    charged = share * float(table(np.float64(0.8 * share), OFFSET_CHARGE, np)) / 100.0
    demanded = []
    for i, axis in enumerate(AXES):
        g = {
            name: at[f"{axis}_{name}"] * scales[i] * _DEGREES
            for name, scales in SCALES.items()
            if f"{axis}_{name}" in at
        }
        gyro = sensed * _first_order(s, float(np.max(k[f"{axis}_gyro_cutoff"])))
        fall = s * _first_order(s, float(np.max(k[f"{axis}_d_cutoff"])))
        errors = g["p_gain"] + (g["i_gain"] + charged * g.get("o_gain", 0.0)) / s
        K[:, :, i, i] = (errors + g["d_gain"] * fall) * gyro
        ahead = g["f_gain"] + errors + g["b_gain"] * s * _first_order(s, float(np.max(k[f"{axis}_b_cutoff"])))
        demanded.append(ahead * (at["heading"] if axis == "yaw" else 0.1 * at["angle_level_strength"]))
        K[:, :, i, 3 + i] = demanded[i]
    if place:
        pushed = (at["speed"] * np.ones_like(s) + at["place_sum"] / s) / GRAVITY
        for command, output, sign in ((0, 7, 1.0), (1, 6, -1.0)):
            K[:, :, command, output] = sign * demanded[command] * pushed
            K[:, :, command, 3 + output] = sign * demanded[command] * (pushed * at["place"])
    if height:
        lift = at["climb"] + at["climb_sum"] / s
        K[:, :, 3, 8], K[:, :, 3, 11] = -lift, -lift * at["height"]
    return K


def _placed(plant: CascadePlant, trial: Mapping[str, Any]) -> BrokenLoops:
    """The place loop, and all commands with it around them; the first two are what the choice is for."""
    inner, total = (_feedback(plant.omega, trial, height=True, place=place) for place in (False, True))
    leans, commands = broken_at_leans(plant, inner, total), broken_at_commands(plant, total, (0, 1, 2, 3))
    return BrokenLoops(plant.omega, np.concatenate([leans.loop, commands.loop], axis=-1), commands.turns)


def _best(
    stage: str,
    kind: str,
    sets: Mapping[str, Array],
    loops: BrokenLoops,
    decays: Callable[[Mapping[str, float]], bool],
) -> dict[str, float]:
    """The set that holds disturbances down most among those that keep the margins and with which every mode decays."""
    worth = loops.quiet(*_BANDS[kind])[:, : 2 if kind == "place" else None].min(axis=1)
    ranked = np.argsort(-worth, kind="stable")
    for share in (1.0, 0.5, 0.0):
        gain, phase, peak = (share * each for each in _RESERVE[kind])
        each = (loops.gain >= GAIN_KEPT + gain) & (loops.phase >= PHASE_KEPT + phase)
        kept = np.all(each & (loops.peak <= PEAK_KEPT - peak), axis=1)
        turned: dict[float, int] = {}
        for i in (int(i) for i in ranked if kept[i]):
            turns = float(loops.turns[i])
            if turned.get(turns, 0) >= _TRIED:
                continue
            turned[turns] = turned.get(turns, 0) + 1
            chosen = {name: float(value[i]) for name, value in sets.items()}
            if decays(chosen):
                return chosen
    raise ControllerError(
        f"no gains of the {stage} loop hold: none of {len(worth)} sets keeps {GAIN_KEPT:g} dB, {PHASE_KEPT:g} degrees "
        f"and a sensitivity of {PEAK_KEPT:g} with every loop around it, and lets every mode decay.",
        hint="Less delay or faster filters would leave room; fly this one by hand first.",
    )


def _firmware_number(per_radian: Any, axis: str, name: str) -> Any:
    """A gain per rad/s as the firmware's whole number."""
    return np.clip(np.round(per_radian / (SCALES[name][AXES.index(axis)] * _DEGREES)), 0.0, 1000.0)


def _rate_sets(plant: CascadePlant, axes: tuple[int, ...]) -> dict[str, Array]:
    """P per rate per command, I and D per P, O half of I, and the strength of ANGLE mode; the axes alike."""
    angles = _LEVELS if axes == (0, 1) else (1.0, 2.0, 3.0)
    grid = np.array(list(product(_SHARES, (0.5, 1.5, 4.0), (0.0, 0.03, 0.08), angles))).T
    near = int(np.argmin(np.abs(plant.omega - 6.0)))
    sets: dict[str, Array] = {}
    for i in axes:
        p, axis = grid[0] / float(np.abs(plant.response[near, i, i])), AXES[i]
        sets[f"{axis}_p_gain"] = _firmware_number(p, axis, "p_gain")
        sets[f"{axis}_i_gain"] = _firmware_number(grid[1] * p, axis, "i_gain")
        sets[f"{axis}_d_gain"] = _firmware_number(grid[2] * p, axis, "d_gain")
        if axis != "yaw":
            sets[f"{axis}_o_gain"] = np.round(0.5 * sets[f"{axis}_i_gain"])
    sets["heading" if axes == (2,) else "angle_level_strength"] = grid[3] if axes == (2,) else 10.0 * grid[3]
    return sets


def _height_sets(plant: CascadePlant) -> dict[str, Array]:
    band = (plant.omega >= 1.0) & (plant.omega <= 10.0)
    lift = 1j * plant.omega[band] * plant.response[band, OUTPUTS.index("down"), 3]
    grid = np.array(list(product(np.geomspace(0.1, 5.0, 14), (0.2, 0.5, 1.0), (0.3, 0.5, 0.8)))).T
    climb = grid[0] / float(np.max(np.abs(lift)))
    return {"climb": climb, "climb_sum": grid[1] * climb, "height": grid[2]}


def _place_sets() -> dict[str, Array]:
    grid = np.array(list(product(np.geomspace(0.1, 3.0, 14), (0.1, 0.2, 0.35), (0.15, 0.25, 0.4)))).T
    return {"speed": grid[0], "place_sum": grid[1] * grid[0], "place": grid[2]}
