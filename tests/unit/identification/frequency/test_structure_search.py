"""The search for a structure: it finds the parts that made the responses, drops the hopeless and says why."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from coupled_helicopter import INPUTS, STATES, matrices, measured
from swashplate.errors import CardError, IdentificationError, SwashError
from swashplate.identification.frequency import structure_search
from swashplate.identification.frequency.search_candidates import cores, exchanges, offered
from swashplate.identification.frequency.search_result import StructureSearch
from swashplate.identification.frequency.structure_score import squared_misfit
from swashplate.identification.frequency.structure_search import LOOK, search_structures
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure


def heave_and_yaw(**kind: bool) -> FrequencyResponse:
    """Vertical speed and yaw rate alone, of a helicopter without a weathercock."""
    a, b = matrices(**kind)
    r, v = STATES.index("r"), STATES.index("v")
    a[r, v] = 0.0
    a[r, STATES.index("w")] = 0.0
    return measured(a, b, noise=0.01, averages=30.0).select(("w", "az", "r"), ("pedal", "collective"))


NEAR = [structure("compose:heave+yaw+inflow+torque"), structure("compose:heave+yaw+lead+torque")]
"""Two that these responses cannot tell apart."""


@pytest.fixture(scope="module")
def found() -> StructureSearch:
    return search_structures(heave_and_yaw())


def test_the_parts_that_made_the_responses_are_picked(found: StructureSearch) -> None:
    assert found.pick.name == "heave+yaw+inflow+torque", found
    assert found.pick.cost < 5.0
    assert found.tried[0] is found.pick
    told = "\n".join(found.reasons)
    assert "without 'inflow'" in told
    assert "without 'torque'" in told
    assert "r / collective from" in told
    assert "cannot tell it from heave+yaw+lead+torque" in told


def test_parts_that_are_not_there_are_not_picked() -> None:
    assert search_structures(heave_and_yaw(engine=False, inflow=False)).pick.name == "heave+yaw"


def test_what_is_hopeless_is_dropped_after_a_first_look() -> None:
    named = [structure(f"compose:heave+yaw{more}") for more in ("", "+inflow+torque", "+gyro")]
    found = search_structures(heave_and_yaw(), structures=named)
    assert found.pick.name == "heave+yaw+inflow+torque"
    dropped = {c.name: c for c in found.tried if c.abandoned}
    assert "heave+yaw" in dropped
    assert all(len(c.fit.history) <= 2 * LOOK + 2 for c in dropped.values())
    assert all("abandoned after the first look" in row[-1] for row in found.rows()[-len(dropped) :])


def test_a_structure_that_ends_above_what_it_contains_is_a_failed_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its iterations and its starts from relatives are taken away: it was called not worth its parameters."""
    own = structure_search.fit_targets

    def stuck(model: StateSpaceModel, targets: Any, **how: Any) -> Any:
        if model.name == "heave+yaw+inflow+torque":
            model, how = model.with_values({"Nr": -20.0, "Zw": -9.0}), how | {"others": {}, "iterations": 1}
        return own(model, targets, **how)

    monkeypatch.setattr(structure_search, "fit_targets", stuck)
    named = [structure(f"compose:heave+yaw{more}") for more in ("", "+torque", "+inflow+torque")]
    found = search_structures(heave_and_yaw(inflow=False), structures=named)
    assert found.pick.name == "heave+yaw+torque"
    (one,) = (c for c in found.tried if c.name == "heave+yaw+inflow+torque")
    assert one.failed
    assert one.cost > found.pick.cost
    (row,) = (row for row in found.rows() if row[0] == one.name)
    assert row[-1] == f"its fit failed: {one.failed}, which it contains, fits better"
    assert any("heave+yaw+inflow+torque" in text and "Its fit failed" in text for text in found.reasons)
    assert not any("nothing gained" in text and "inflow" in text for text in found.reasons)


def test_a_hold_out_decides_where_the_responses_do_not() -> None:
    def judge(model: StateSpaceModel) -> float:
        return 0.5 if "col_lag" in model.states else 1.0

    found = search_structures(heave_and_yaw(), structures=NEAR, judge=judge)
    assert found.pick.name == "heave+yaw+lead+torque"
    assert "hold-out prefers it to heave+yaw+inflow+torque: J_rms 0.50 against 1.00" in found.reasons[-1]
    assert "held-out J_rms" in found.rows()[0]
    agreed = search_structures(heave_and_yaw(), structures=NEAR, judge=lambda model: 1.0)
    assert agreed.pick.name == "heave+yaw+inflow+torque"
    assert any(text.strip().startswith("heave+yaw+lead+torque: J_ave") for text in agreed.reasons)
    assert "hold-out agrees" in agreed.reasons[-1]


def test_that_all_are_wrong_is_said() -> None:
    """A second lag in the pedals that no structure of these has."""
    responses = heave_and_yaw()
    h = responses.response.copy()
    h[:, responses.outputs.index("r"), 0] *= 1.0 / (1.0 + (1j * responses.omega / 12.0) ** 2 + 0.1j * responses.omega)
    found = search_structures(replace(responses, response=h), structures=[structure("compose:heave+yaw+inflow+torque")])
    assert any("none of these is all of the aircraft" in text for text in found.reasons)


def test_a_structure_that_answers_to_less_has_no_advantage() -> None:
    """Heave alone misses nothing of the yaw that it does not have: only what both answer to is compared."""
    both = [structure("compose:heave+inflow"), NEAR[0]]
    found = search_structures(heave_and_yaw(), structures=both)
    assert {t.name for c in found.tried for t in c.fit.targets} == {"w / collective", "az / collective"}
    assert "without r/pedal, r/collective" in found.reasons[-1]
    with pytest.raises(IdentificationError, match="no response in common"):
        search_structures(heave_and_yaw(), structures=[structure("compose:heave"), structure("compose:yaw")])


def test_an_edited_structure_stays_as_edited_and_namesakes_stay_apart() -> None:
    held = NEAR[0].with_values({"tau_ped": 0.2}, free=False)
    found = search_structures(heave_and_yaw(), structures=[held, NEAR[0]])
    assert {c.name for c in found.tried} == {"heave+yaw+inflow+torque #1", "heave+yaw+inflow+torque #2"}
    assert found.pick.name.endswith("#2"), "a delay of 0.2 s is wrong"
    alone = search_structures(heave_and_yaw(), structures=[held])
    assert alone.pick.fit.solution.parameters["tau_ped"].value == 0.2


def test_candidates_are_what_the_channels_allow() -> None:
    whole = measured(*matrices())
    assert cores(whole) == [("body",), ("body", "flap_decoupled"), ("body", "flap")]
    rates = whole.select(("p", "q", "r"), INPUTS)
    assert ("cyclic", "yaw", "flap") in cores(rates)
    assert not any("cyclic" in core for core in cores(replace(rates, outputs=("p", "q", "phi"))))
    assert cores(whole.select(("w",), ("collective",))) == [("heave",)]
    with pytest.raises(IdentificationError, match="no composed structure has these responses"):
        cores(replace(whole, inputs=("a", "b", "c", "d")))
    assert offered(whole) == ("bar", "lead", "droop", "governor", "torque", "gyro")
    assert offered(whole.select(("w", "az"), ("collective",))) == ("lead", "droop", "governor")
    assert ["body", "inflow"] in [sorted(e) for e in exchanges(("body", "lead"), whole)]
    assert ["body", "flap"] in exchanges(("body", "flap_decoupled"), whole)


def test_the_verb_searches_prints_and_has_a_page() -> None:
    study = sp.fit_ss([*NEAR[:1], "compose:heave+yaw"], heave_and_yaw(), search=True, fix={"tau_ped": 0.015})
    assert study.structure is not None
    assert "*heave+yaw+inflow+torque" in repr(study)
    assert study.to_document()["search"]["picked"] == "heave+yaw+inflow+torque"
    assert not study.structure.parameters["tau_ped"].free
    page = study.page()
    assert any(section.title == "Which structures were tried?" for section in page.sections)
    with pytest.raises(CardError, match="no parameter of any structure of this search"):
        sp.fit_ss(None, heave_and_yaw(), search=True, fix={"tau_pedd": 0.0})
    with pytest.raises(SwashError, match="takes one structure"):
        sp.fit_ss(None, heave_and_yaw())
    with pytest.raises(SwashError, match="no start values from elsewhere"):
        sp.fit_ss(None, heave_and_yaw(), search=True, start_from="r50")


def test_a_point_that_is_far_off_counts_less_than_its_square(found: StructureSearch) -> None:
    targets = list(found.pick.fit.targets)
    one = targets[0]
    wrong = one.measured.copy()
    wrong[3] *= np.exp(2.0)
    error = 0.0 if one.error is None else float(one.error[3])
    times = 2.0 / np.hypot(error, 0.03)
    grown = squared_misfit(found.pick.fit.solution, [replace(one, measured=wrong)])
    assert grown < 0.3 * times**2
    assert grown > squared_misfit(found.pick.fit.solution, [one])
