"""Three published coupled helicopters in hover, flown in gusts, and what a search for structures made of the sweeps.

R-50: Mettler, Tischler and Kanade (2002), thirteen states; the gyro's Nrfb Kr is one number here, Krfb a rate. HeLion:
Cai, Chen and Lee (2011), eleven states. X-Cell 60: Gavrilets, Mettler and Feron (2001), the published physics with bar
and governed engine, linearised by this package. Not published, and taken: the X-Cell's inflow as a state (Pitt and
Peters 1981; its tilt follows at once), 0.1 rad of blade a unit of stick (tail 0.2), all delays, the sensors' noise.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomli_w

import gusty_sweeps
import r50
from published_helicopters import HELION, r50_identified
from swashplate.arrays import Array
from swashplate.identification.frequency.response_cost import Target, cost_of
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.state_space_search import answers
from swashplate.identification.frequency.structure_search import search_structures
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.matrices_file import state_space_of_matrices
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse, structure, to_toml
from swashplate.models.linear.structure_parts import PARTS

SLOWEST = 0.4
"""Modes that are asked for are faster than this [rad/s] and inside what was swept."""
NEAR, DEARER = 0.05, 1.3
"""What is asked: relative error of each mode, and J over that of the true structure."""
SIZE = r50.AMPLITUDE["lateral"] / gusty_sweeps.SIZES["lateral"]
"""Of what the pilot does: small sweeps leave nothing coherent below 2 rad/s in gusts."""
STICKS = {"theta0": ("collective", 0.1), "B1": ("longitudinal", 0.1), "A1": ("lateral", 0.1), "theta0T": ("pedal", 0.2)}


@dataclass(frozen=True)
class Published:
    """A helicopter: its model, the parts with states of their own that it has, and its attitude in hover [rad]."""

    model: StateSpaceModel
    parts: frozenset[str]
    attitude: Mapping[str, float]


def r50_hover(data: Path) -> Published:
    numbers = r50_identified(data)
    numbers |= {"tau_f": numbers["tf"], "tau_s": numbers["ts"], "Krfb": -numbers["Krfb"]}
    numbers["Nrfb"] *= numbers["Kr"]
    return _composed("body+flap+bar+gyro+Za+Zb+Zr", numbers)


def helion_hover(data: Path) -> Published:
    del data
    return _composed("body+flap+hub+gyro+Za+Zb+Zr", HELION)


def _composed(parts: str, numbers: Mapping[str, float]) -> Published:
    model = r50.without_angles(structure(f"compose:{parts}"))
    known = {**numbers, **r50.DELAYS}
    model = model.with_values({name: known.get(name, 0.0) for name in model.free})
    return Published(model, frozenset(own_states(parts.split("+"))), {})


def xcell_hover(data: Path) -> Published:
    del data
    flown = vehicle("xcell60", inflow="pitt-peters", rotor_speed="governed", bar=True).linearize()
    fast = np.isin(flown.states, ("lam_c", "lam_s"))
    follow = np.linalg.solve(flown.A[fast][:, fast], np.hstack([flown.A[fast][:, ~fast], flown.B[fast]]))
    both = np.hstack([flown.A[~fast][:, ~fast], flown.B[~fast]]) - flown.A[~fast][:, fast] @ follow
    states = tuple(np.array(flown.states)[~fast])
    names, sizes = zip(*(STICKS[name] for name in flown.inputs), strict=True)
    attitude = {name: value for name, value in flown.trim.states().items() if name in ("phi", "theta")}
    made = state_space_of_matrices(
        (both[:, : len(states)], both[:, len(states) :] * np.array(sizes)),
        states=states, inputs=names, units=flown.units, trim={"u": 0.0, "v": 0.0, "w": 0.0, **attitude}, limits={},
        delays={name: r50.DELAYS[f"tau_{name[:3]}"] for name in names}, name="xcell", title="X-Cell 60",
    )  # fmt: skip
    document = tomllib.loads(to_toml(made))
    ready = tomllib.loads(to_toml(r50.without_angles(structure("compose:body"))))
    document["outputs"] = ready["outputs"]
    document["parameters"]["g"] = ready["parameters"]["g"]
    return Published(
        parse(tomli_w.dumps(document)),
        frozenset({"flap", "bar", "inflow", "governor"}),
        {f"{name}0": value for name, value in attitude.items()},
    )


PUBLISHED = {"R-50": r50_hover, "HeLion": helion_hover, "X-Cell 60": xcell_hover}


def own_states(parts: Mapping[str, object] | list[str] | tuple[str, ...]) -> set[str]:
    """The parts with states that are not the body's."""
    return {name for name in parts if name in PARTS and (PARTS[name].states or name == "actuators")} - {"body"}


def responses_of(published: Published, kind: str, *, gust: float, seed: int) -> FrequencyResponse:
    """From eight sweeps of two minutes, two an axis, as large as the published ones of the R-50."""
    model = published.model
    axes = list(model.inputs) * 2
    asked = [gusty_sweeps.Question(axis, kind, gust, 100 * seed + k) for k, axis in enumerate(axes)]
    return respond(
        gusty_sweeps.fly(model, asked, size=SIZE),
        inputs=model.inputs,
        outputs=model.outputs,
        band=gusty_sweeps.BANDS[kind],
        bystanders=(),
    )


@dataclass(frozen=True)
class Found:
    """What a search found, beside the truth.

    Attributes:
        picked: parts. J, own: J_ave of the pick and of the true structure, on the pick's responses.
        worst, own_worst: largest relative error of a mode that is asked for, of both; None for true numbers.
        invented, missed: parts with states of their own.
    """

    picked: str
    J: float
    own: float
    worst: float
    own_worst: float | None
    invented: tuple[str, ...]
    missed: tuple[str, ...]

    @property
    def parts(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        return self.invented, self.missed

    @property
    def right(self) -> tuple[bool, bool, bool]:
        """J, modes and parts."""
        return self.J / self.own <= DEARER, self.worst <= NEAR, not self.invented


def search_and_judge(published: Published, responses: FrequencyResponse, *, fastest: float) -> Found:
    """Search the responses and hold the pick against the truth; modes up to `fastest` [Hz] are asked for."""
    pick = search_structures(responses, prepare=lambda m: m.with_values(_there(m, published.attitude), free=False)).pick
    cost, modes = own_fit(published, responses, pick.fit.targets)
    true = published.model.eigenvalues()
    return Found(
        picked=pick.name,
        J=pick.cost,
        own=cost,
        worst=worst_mode(pick.fit.solution.eigenvalues(), true, fastest=fastest),
        own_worst=None if modes is None else worst_mode(modes, true, fastest=fastest),
        invented=tuple(sorted(own_states(pick.parts) - published.parts)),
        missed=tuple(sorted(published.parts - own_states(pick.parts))),
    )


def _there(model: StateSpaceModel, values: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if name in model.parameters}


def own_fit(
    published: Published, responses: FrequencyResponse, targets: tuple[Target, ...]
) -> tuple[float, Array | None]:
    """J_ave and modes of the true structure fitted from the truth; J_ave of its numbers, None where none is free."""
    if published.model.free:
        every = {f"{output}/{name}" for output in responses.outputs for name in responses.inputs}
        left = tuple(sorted(every - {f"{t.output}/{t.input}" for t in targets}))
        fit = fit_state_space(published.model, responses, starts=1, without=left)
        return fit.cost, fit.solution.eigenvalues()
    known = answers(published.model, targets)
    return float(np.mean([cost_of(h, t) for h, t in zip(known, targets, strict=True)])), None


def worst_mode(found: Array, true: Array, *, fastest: float) -> float:
    """The largest relative error of the true modes that are asked for: distance of the nearest one found."""
    asked = [v for v in true if SLOWEST < abs(v) < TWO_PI * fastest and v.imag >= 0.0]
    return max(float(np.min(np.abs(found - v)) / abs(v)) for v in asked)
