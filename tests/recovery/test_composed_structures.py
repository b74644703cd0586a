"""A coupled helicopter whose rotor, inflow and engine are hidden, found again by structures composed of parts."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

import gusty_sweeps
import r50
from coupled_helicopter import LAG, PITCH, ROLL, THRUST_BY_W, matrices, measured
from proof_page import leave
from swashplate.arrays import Array
from swashplate.identification.frequency.state_space_fit import STARTED, fit_state_space
from swashplate.identification.frequency.state_space_result import StateSpaceFit
from swashplate.identification.frequency.structure_search import search_structures
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure

SMALL = {
    "Xu": -0.04, "Yv": -0.12, "Yped": 1.5, "Zw": -0.8, "Zcol": -32.0, "Lu": -0.05, "Lv": -0.12, "Lped": -3.0,
    "Lb": 310.0, "Mu": 0.05, "Mv": -0.02, "Ma": 185.0, "Nv": 0.4, "Nr": -1.9, "Nped": 28.0, "Ncol": -6.0,
    "tau_f": 0.1, "Ab": -0.12, "Alat": 0.02, "Alon": -0.22, "Ba": 0.15, "Blat": 0.22, "Blon": 0.02,
    "tau_lat": 0.03, "tau_lon": 0.03, "tau_ped": 0.03, "tau_col": 0.03,
}  # fmt: skip
"""A helicopter of 8 kg in hover, of the size of published ones."""
RIGHT = "compose:body+flap+inflow+torque"
TOLD = 0.05
"""Relative error of a mode that the responses tell; one that they tell less has three of its own bounds."""


@pytest.fixture(scope="module")
def responses() -> FrequencyResponse:
    return measured(*matrices(), noise=0.02, averages=20.0)


@pytest.mark.parametrize("starts", [1, pytest.param(STARTED, marks=pytest.mark.proof)])
def test_the_right_parts_find_the_helicopter_from_the_start_values_of_the_package(
    starts: int, responses: FrequencyResponse
) -> None:
    """From these alone, and among the starting points of a usual fit."""
    found: StateSpaceFit = fit_state_space(structure(RIGHT), responses, starts=starts)
    assert found.cost < 5.0
    assert max(found.costs) < 50.0
    known = np.linalg.eigvals(matrices()[0])
    for mode in found.details.modes:
        if mode.inside:
            error = min(abs(known - mode.eigenvalue))
            assert error < max(TOLD * mode.frequency, 3.0 * mode.frequency_bound), mode
    values = {p.name: p.value for p in found.estimates}
    assert values["Lb"] == pytest.approx(ROLL, rel=0.03)
    assert values["Ma"] == pytest.approx(PITCH, rel=0.03)
    assert values["tau_f"] == pytest.approx(LAG, rel=0.03)
    assert values["Zw"] == pytest.approx(-THRUST_BY_W / 60.0, abs=3.0 * found["Zw"].sigma)
    assert not any("not all of the aircraft" in text for text in found.warnings)


@pytest.mark.proof
def test_a_structure_without_the_engine_is_told_to_lack_something(responses: FrequencyResponse) -> None:
    fit = fit_state_space(structure("compose:body+flap+inflow"), responses, starts=2)
    (words,) = (text for text in fit.warnings if "not all of the aircraft" in text)
    assert "r / collective" in words


@pytest.mark.proof
def test_a_rotor_is_found_in_clean_sweeps_of_a_small_helicopter() -> None:
    """Four sweeps without gusts of one like an X-Cell: the search ended at 321.9 with the rotor and picked the body."""
    truth = r50.without_angles(structure("compose:body+flap")).with_values(SMALL)
    flights = gusty_sweeps.fly(
        truth, [gusty_sweeps.Question(axis, "automatic", 0.0, 100 + k) for k, axis in enumerate(truth.inputs)]
    )
    responses = respond(flights, inputs=truth.inputs, outputs=truth.outputs, band=(0.05, 6.0), bystanders=())
    own = fit_state_space(structure("compose:body+flap"), responses, starts=1)
    assert own.cost < 5.0
    for name in ("Lb", "Ma", "tau_f", "Zw", "Zcol", "Nped", "Alon", "Blat"):
        assert own[name].value == pytest.approx(SMALL[name], rel=0.05), name
    found = search_structures(responses)
    assert found.pick.name == "body+flap", found
    assert found.pick.cost < 1.05 * own.cost
    assert next(c.cost for c in found.tried if c.name == "body") > 20.0 * own.cost
    assert not found.pick.failed
    for candidate in found.tried:  # the actuators' fit ends above the structure that it contains, and is told as failed
        if candidate.failed:
            assert f"{candidate.name}: J_ave" in str(found)
            assert "Its fit failed: that says nothing against its parts." in str(found)


@pytest.mark.proof
@pytest.mark.parametrize(
    ("kind", "parts"),
    [
        ({}, {"flap", "inflow", "torque"}),
        ({"engine": False}, {"flap", "inflow"}),
        ({"inflow": False}, {"flap", "torque"}),
    ],
)
def test_the_search_picks_the_parts_that_are_there(kind: dict[str, bool], parts: set[str]) -> None:
    """Level with it is only the lead-lag that stands for an inflow, and the search costs eight right fits at most."""
    responses = measured(*matrices(**kind), noise=0.02, averages=20.0)
    began = time.process_time()
    fit_state_space(structure("compose:body+" + "+".join(sorted(parts))), responses)
    right, began = time.process_time() - began, time.process_time()
    found = search_structures(responses)
    assert set(found.pick.name.split("+")) == {"body"} | parts, found
    assert time.process_time() - began < 12.0 * right
    assert {c.name for c in found.tried if c.abandoned} == {"body", "body+flap_decoupled"}
    assert all(c.fit.seconds < 1.0 * found.seconds / 5.0 for c in found.tried if c.abandoned)


@pytest.mark.proof
def test_a_wrong_structure_costs_no_eight_times_the_right_one(
    responses: FrequencyResponse, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the responses with all their derivatives that a fit looks at, which no load on the machine changes."""
    looked: list[int] = []
    own = StateSpaceModel.sensitivities

    def counted(self: StateSpaceModel, free: tuple[str, ...], numbers: Array, pairs: Any) -> Any:
        looked.append(len(pairs))
        return own(self, free, numbers, pairs)

    monkeypatch.setattr(StateSpaceModel, "sensitivities", counted)
    wrong = {
        "no engine": "compose:body+flap+inflow",
        "no inflow": "compose:body+flap+torque",
        "no rotor": "compose:body+inflow+torque",
        "rotor without coupling": "compose:body+flap_decoupled+inflow+torque",
        "a lead-lag for the inflow": "compose:body+flap+lead+torque",
        "an engine's speed for its torque": "compose:body+flap+inflow+droop",
        "a bar that is not there": "compose:body+flap+bar+inflow+torque",
    }
    spent = {}
    for name in ("right", *wrong):
        looked.clear()
        fit = fit_state_space(structure(wrong.get(name, RIGHT)), responses)
        spent[name] = (sum(looked), fit.cost)
    right = spent["right"][0]
    worst = max(count / right for count, _ in spent.values())
    leave(
        "wrong_structures",
        {
            "title": "What a wrong structure costs",
            "text": "A coupled helicopter with flapping, inflow and engine, four starting points each. Counted are "
            f"responses with all their derivatives. The dearest costs {worst:.1f} times the right one (8 allowed).",
            "columns": ["structure", "evaluations", "over the right one", "J_ave"],
            "rows": [[name, count, count / right, cost] for name, (count, cost) in spent.items()],
            "passed": bool(worst < 8.0),
        },
    )
    assert worst < 8.0, spent
