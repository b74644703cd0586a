"""One function loads every kind of model, and a linear model from Python is what it is on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import CardError, TrimError
from swashplate.export.formats import export_model
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space_file import structure_names
from swashplate.validation.verify import verify


@pytest.fixture(scope="module")
def mettler() -> sp.Vehicle:
    return sp.structure("thirteen_state")


@pytest.mark.parametrize("name", structure_names())
def test_a_state_space_model_is_saved_and_loaded_as_a_vehicle(name: str, tmp_path: Path) -> None:
    made = sp.vehicle(name)
    made.save(tmp_path / "m.toml")
    again = sp.vehicle(tmp_path / "m.toml")
    assert again.card.values() == made.card.values()
    assert structure_of(again).numbers() == structure_of(made).numbers()


def test_its_numbers_change_by_the_names_of_its_file_and_the_matrices_follow(mettler: sp.Vehicle) -> None:
    other = mettler.with_values({"Xu": -0.2})
    assert other.card.values()["u_by_u"] == -0.2
    assert structure_of(other).parameters["Xu"].value == -0.2
    entry = mettler.with_values({"u_by_u": -0.3})
    assert entry.card.values()["u_by_u"] == -0.3
    with pytest.raises(CardError, match="has no matrices of named parameters"):
        structure_of(entry)
    with pytest.raises(CardError, match="has no parameter Xx"):
        mettler.with_values({"Xx": 1.0})


def test_one_entry_that_was_changed_is_what_is_saved(mettler: sp.Vehicle, tmp_path: Path) -> None:
    mettler.with_values({"u_by_u": -0.3}).save(tmp_path / "m.toml")
    assert sp.vehicle(tmp_path / "m.toml").card.values()["u_by_u"] == -0.3


def test_a_structure_is_trimmed_linearised_held_and_flown(mettler: sp.Vehicle) -> None:
    hover = sp.trim(mettler)
    found = sp.linearize(mettler, hover)
    model = structure_of(mettler)
    rows = [found.states.index(name) for name in model.states]
    np.testing.assert_allclose(found.A[np.ix_(rows, rows)], model.explicit()[0], atol=1e-12)
    hold = sp.state_hold(mettler, hover, rate=50.0)
    flight = sp.simulate_closed_loop(mettler, hold, duration=6.0, reference={"z": -1.0}, rate=50.0)
    assert flight.values("z")[-1] == pytest.approx(-1.0, abs=0.1)


def test_a_model_of_less_than_a_body_is_flown_from_rest_and_says_why_it_is_not_trimmed() -> None:
    heave = sp.structure("heave")
    flight = sp.simulate(heave, {"mixer_collective": np.full(201, 0.1)}, rate=100.0, delays=0.0)
    values = heave.card.values()
    damping, power = values["w_by_w"], values["w_by_mixer_collective"]
    exact = 0.1 * power / damping * (np.exp(damping * flight.time("w")) - 1.0)
    np.testing.assert_allclose(flight.values("w"), exact, rtol=1e-7, atol=1e-9)
    for flown in (sp.trim, sp.linearize):
        with pytest.raises(TrimError, match=r"no equation for u, v, phi, theta, p, q, r.*needs the motion of a whole"):
            flown(heave)


def test_fits_and_exports_take_the_vehicle(mettler: sp.Vehicle) -> None:
    heave = sp.structure("heave")
    omega = np.geomspace(0.5, 20.0, 40)
    truth = structure_of(heave.with_values({"Zw": -1.1, "Zcol": -9.0}))
    h = truth.response(omega)
    one = np.ones(h.shape)
    told = (h, 0.99 * one, 0.99 * one[:, :, 0], 0.02 * one, one[:, 0], one[:, :, 0], one[:, :1, :])
    fit = fit_state_space(heave, FrequencyResponse(omega, truth.inputs, truth.outputs, *told), starts=1)
    assert isinstance(fit.model, sp.Vehicle)
    assert structure_of(fit.model).parameters["Zw"].value == pytest.approx(-1.1, rel=1e-3)
    assert all(isinstance(one, sp.Vehicle) for one in fit.draw(2, seed=0))
    assert sp.simulate(fit.model, {"mixer_collective": np.zeros(20)}, rate=50.0).values("w").max() == 0.0
    files = export_model(mettler, "control", name="m").files
    assert files == export_model(structure_of(mettler), "control", name="m").files
    with pytest.raises(CardError, match="has no matrices of named parameters"):
        verify(sp.vehicle("coax"), [])


def test_what_is_no_model_is_told_with_what_is_near(tmp_path: Path) -> None:
    with pytest.raises(CardError, match=r"neither a vehicle's name nor a file.*Did you mean 'raptor50'\?"):
        sp.vehicle("raptor5")
    with pytest.raises(CardError, match=r"Did you mean 'thirteen_state'\?"):
        sp.vehicle("thirteen_states")
    other = tmp_path / "c.toml"
    other.write_text('kind = "controller"\nschema = 1\n')
    with pytest.raises(CardError, match=r"kind is 'controller', expected a model.*--controller"):
        sp.vehicle(other)
    card = tmp_path / "glider.toml"
    card.write_text(sp.vehicle("coax").card.to_toml().replace('vehicle = "coax"', 'vehicle = "coaxx"'))
    with pytest.raises(CardError, match=r"vehicle is 'coaxx', expected one of .*Did you mean 'coax'"):
        sp.vehicle(card)
    with pytest.raises(CardError, match="has no options"):
        sp.vehicle("thirteen_state", bar=True)
