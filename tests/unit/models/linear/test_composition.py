"""Structures composed of parts: sensible ones are whole, nonsense is refused, the physics is checked independently."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from coupled_helicopter import AIR, DELAYS, DENSITY, DISC, INDUCED, LAG, MASS, OUTPUTS, THRUST_BY_W, matrices, response
from swashplate.errors import CardError
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.composition import nonsense
from swashplate.models.linear.model_units import unit_words
from swashplate.models.linear.state_space_file import parse, structure, to_toml
from swashplate.models.linear.structure_parts import PARTS
from swashplate.models.linear.written import WrittenStructure, equation_lines

ALL = "compose:body+coupled+flap+forces+hub+bar+inflow+torque+droop+gyro+actuators"
SENSIBLE = [c for k in (1, 2, 3) for c in itertools.combinations(PARTS, k) if not nonsense(c)]

NUMBERS = {
    "Xu": -0.03, "Yv": -0.11, "Yped": 2.2, "Lu": -0.15, "Lv": -0.28, "Lw": 0.0, "Lped": -3.0, "Lcol": 0.0, "Lb": 210.0,
    "Mu": 0.12, "Mv": -0.09, "Mw": 0.0, "Mcol": 4.0, "Ma": 95.0, "Nv": 0.35, "Nw": 0.15, "Np": 0.0, "Nr": -1.1,
    "Nped": 38.0, "Ncol": 0.0, "tau_f": LAG, "Ab": -0.30, "Ba": 0.42, "Alon": -0.21, "Alat": 0.035, "Blat": 0.24,
    "Blon": 0.03, "Zw": -THRUST_BY_W / MASS, "Zcol": -26.0, "mass_nu": MASS / AIR,
    "rate_nu": 4.0 * DENSITY * DISC * INDUCED / AIR, "rate_q": 2.6, "Kq": 2.6 * 22.0, "tau_lat": DELAYS["lateral"],
    "tau_lon": DELAYS["longitudinal"], "tau_ped": DELAYS["pedal"], "tau_col": DELAYS["collective"],
}  # fmt: skip
"""The helicopter of `coupled_helicopter` in the parts' own words."""


def test_with_the_numbers_of_a_helicopter_the_parts_answer_as_its_own_equations_do() -> None:
    model = structure("compose:body+flap+inflow+torque").with_values(NUMBERS)
    assert set(NUMBERS) == set(model.free)
    omega = np.geomspace(0.3, 60.0, 25)
    rows = [model.outputs.index(name) for name in OUTPUTS]
    np.testing.assert_allclose(model.response(omega)[:, rows], response(*matrices(), omega), rtol=1e-9, atol=1e-12)
    off = model.with_values({"rate_nu": 1.1 * NUMBERS["rate_nu"]})
    own, known = off.response(omega)[:, rows], response(*matrices(), omega)
    heave = OUTPUTS.index("w"), 3
    assert np.abs(own[:, *heave] / known[:, *heave] - 1.0).max() > 0.01


def test_a_fast_inflow_leaves_the_hover_damping_of_the_quasi_steady_formula() -> None:
    """Zw = -2 a0 Ab rho OmegaR lambda0 / ((16 lambda0 + a0 s) m) (Padfield 2007): half of a frozen one and less."""
    solidity, speed, slope, area = 0.05, 130.0, 5.5, 0.05 * DISC
    ratio = INDUCED / speed
    frozen = -DENSITY * speed * area * slope / 4.0 / MASS
    model = structure("compose:heave+inflow").with_values(
        {"Zw": frozen, "rate_nu": 500.0, "mass_nu": 500.0 * MASS / (4.0 * DENSITY * DISC * INDUCED)}
    )
    expected = -2.0 * slope * area * DENSITY * speed * ratio / ((16.0 * ratio + slope * solidity) * MASS)
    assert max(model.eigenvalues().real) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("parts", SENSIBLE, ids="+".join)
def test_sensible_parts_make_a_whole_structure(parts: tuple[str, ...]) -> None:
    model = structure("compose:" + "+".join(parts))
    assert unit_words(model) == []
    assert np.all(np.isfinite(model.response(np.array([0.5, 5.0]))))
    assert all(p.unit and p.note for p in model.parameters.values())


def test_all_parts_together_come_back_from_their_file_and_are_a_vehicle() -> None:
    model = structure(ALL)
    assert unit_words(model) == []
    again = parse(to_toml(model))
    assert again.numbers() == model.numbers()
    assert again.document["composed"] == model.document["composed"]
    assert vehicle(ALL).structure is not None


def test_what_a_unit_that_does_not_fit_would_say() -> None:
    text = to_toml(structure("compose:heave+inflow")).replace('unit = "1/s"', 'unit = "s"', 1)
    assert "units do not fit" in unit_words(parse(text))[0]


def test_a_rotor_takes_the_place_of_quasi_steady_derivatives_and_leaves_the_trims() -> None:
    body, flap = structure("compose:body"), structure("compose:body+flap")
    assert {"Lp", "Mq", "Llat", "Mlon", "Xlon", "Ylat"} <= set(body.parameters)
    assert not {"Lp", "Lq", "Mp", "Mq", "Llat", "Llon", "Xlon", "Ylat"} & set(flap.parameters)
    assert flap.document["equations"]["u"]["q"] == "-W0"
    assert {"Lq", "Mp"} <= set(structure("compose:body+flap+gyroscopic").parameters)
    forces = structure("compose:body+flap+forces")
    assert forces.document["equations"]["u"]["a"] == "Xa"
    assert structure("compose:body+flap").document["equations"]["u"]["a"] == "-g"


def test_coupled_has_beside_a_rotor_every_derivative_but_those_of_an_axis_own_rate_and_stick() -> None:
    coupled = structure("compose:body+flap+coupled")
    axes = {"X": "u", "Y": "v", "Z": "w", "L": "p", "M": "q", "N": "r"}
    columns = ("u", "v", "w", "p", "q", "r", "lat", "lon", "ped", "col")
    of_rotor = {"Lp", "Mq", "Llat", "Mlon", "Xlon", "Ylat"}
    assert {f"{letter}{column}" for letter in axes for column in columns} - of_rotor <= set(coupled.parameters)
    assert not of_rotor & set(coupled.parameters)
    assert coupled.document["equations"]["u"]["q"] == "-W0 + Xq"
    assert of_rotor <= set(structure("compose:body+flap+coupled+" + "+".join(sorted(of_rotor))).parameters)
    assert set(structure("compose:body+coupled").parameters) >= set(structure("six_dof_coupled").free) - {"Zq0"}


def test_derivatives_among_the_parts_stand_in_their_equations() -> None:
    model = structure("compose:body+flap+bar+gyro+Yb+Xp+Za+Au+Xc+Yrfb")
    equations = model.document["equations"]
    assert equations["v"]["b"] == "Yb", "what was tied to gravity is free"
    assert equations["u"]["a"] == "-g"
    assert (equations["u"]["p"], equations["u"]["c"], equations["w"]["a"]) == ("Xp", "Xc", "Za")
    assert (equations["a"]["u"], equations["v"]["r_fb"]) == ("Au", "Yrfb")
    assert unit_words(model) == []
    assert parse(to_toml(model)).document["composed"] == "compose:body+flap+bar+gyro+Xp+Xc+Yb+Yrfb+Za+Au"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("compose:body+flapp", "'flapp' is no part of a structure. Did you mean 'flap'? Parts are body, cyclic"),
        ("compose:flap", "there is nothing that flies: it lacks one of body, cyclic, heave, yaw"),
        ("compose:body+bar", "'bar' needs flap or flap_decoupled: a bar tilts a rotor that flaps"),
        ("compose:body+gyroscopic", "'gyroscopic' adds nothing: Lq, Mp are there already"),
        ("compose:body+flap+coupled+gyroscopic", "'gyroscopic' adds nothing: Lq, Mp are there already"),
        ("compose:heave+gyroscopic", "'gyroscopic' needs body or cyclic: it couples roll and pitch"),
        ("compose:cyclic+flap+forces", "'forces' has no place: these parts have no du/dt by a, dv/dt by b"),
        ("compose:body+flap+forces+Xa", "'Xa' adds nothing: Xa is there already"),
        ("compose:body+actuators+Llat", "'Llat' adds nothing: Llat is there already"),
        ("compose:body+Za", "'Za' has no place: these parts have no dw/dt by a"),
        ("compose:body+flap+Aq", "'Aq' is no part of a structure"),
        ("compose:heave+torque", "'torque' needs body or yaw: torque shows in yaw"),
        ("compose:body+inflow+lead", "'inflow' and 'lead' cannot stand together"),
        ("compose:body+flap+flap_decoupled", "'flap_decoupled' adds nothing: Lb, Ma"),
        ("compose:body+heave", "'heave' adds nothing: Zw, Zcol are there already"),
        ("compose:body+body", "'body' is named twice"),
        ("compose:", "names no part. An example: compose:body+flap"),
        ("compose:yaw+r/pedals", "'r/pedals' is no pair output/input of these parts, which could have a delay"),
        ("compose:yaw+p/pedal", "Outputs are r; inputs are pedal, collective"),
        ("compose:yaw+r/pedal+r/pedal", "'r/pedal' is named twice"),
        ("compose:r/pedal", "names no part"),
        ("body+flap", "Did you mean 'compose:body+flap'?"),
    ],
)
def test_what_makes_no_sense_is_refused_with_the_reason(text: str, words: str) -> None:
    with pytest.raises(CardError) as caught:
        structure(text)
    assert words in str(caught.value)


def test_a_pair_among_the_parts_has_a_delay_of_its_own() -> None:
    model = structure("compose:cyclic+q/lateral").with_values({"tau_lat": 0.02, "tau_q_lat": 0.06})
    plain = structure("compose:cyclic").with_values({"tau_lat": 0.02})
    omega = np.geomspace(1.0, 30.0, 9)
    later = np.exp(-0.04j * omega)
    for output, factor in (("p", 1.0), ("q", later)):
        at = model.outputs.index(output), model.inputs.index("lateral")
        model_h, plain_h = (one.with_values({"Mlat": 3.0}).response(omega)[:, *at] for one in (model, plain))
        np.testing.assert_allclose(model_h, plain_h * factor, rtol=1e-12)
    again = parse(to_toml(model))
    assert again.delay("q", "lateral") == 0.06
    assert again.document["composed"] == "compose:cyclic+q/lateral"
    # An input whose responses all have their own has no other delay, which nothing could tell.
    assert set(structure("compose:yaw+r/pedal").delays) == {"r/pedal", "collective"}


def test_a_derivative_and_an_input_among_the_parts_have_a_delay_of_that_entry() -> None:
    model = structure("compose:cyclic+q_dot/lateral").with_values({"tau_lat": 0.02, "tau_q_dot_lat": 0.06, "Mlat": 3.0})
    assert model.delays.keys() == {"lateral", "longitudinal", "q_dot/lateral"}
    assert parse(to_toml(model)).delays.keys() == model.delays.keys()
    # An input whose entries all have their own has no other delay.
    assert set(structure("compose:yaw+r_dot/pedal").delays) == {"r_dot/pedal", "collective"}
    with pytest.raises(CardError, match=r"'q_dot/pedal' is no pair .* entries are"):
        structure("compose:cyclic+q_dot/pedal")


def test_order_of_the_parts_does_not_matter() -> None:
    one, other = (structure(f"compose:{text}") for text in ("body+flap+inflow", "inflow + flap+body"))
    assert to_toml(one) == to_toml(other)


def test_equations_are_written_as_a_person_would() -> None:
    lines = equation_lines(structure("compose:body+flap+inflow"))
    assert "du/dt = Xu u - W0 q + V0 r - g theta - g a" in lines
    assert "tau_f da/dt = -tau_f q - a + Ab b + Alat lateral + Alon longitudinal" in lines
    assert "ax = W0 q - V0 r + g theta + du/dt" in lines
    assert "pedal acts tau_ped later" in lines
    shown = repr(WrittenStructure(structure("compose:heave+inflow")))
    assert "Pitt and Peters 1981" in shown
    assert "5 free parameters, 0 held or tied" in shown
