"""Linear models for python-control and MATLAB: what goes out comes back."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import ExportError
from swashplate.export.control_json import read_control, read_linear
from swashplate.export.formats import export_model
from swashplate.export.linear import Linear, of_state_space, of_vehicle
from swashplate.export.matlab import read_matlab
from swashplate.models.linear.expressions import Expression
from swashplate.models.linear.state_space_file import structure


def models() -> list[Linear]:
    raptor = sp.vehicle("raptor50")
    coax = sp.vehicle("coax")
    return [
        of_vehicle(raptor, sp.trim(raptor, speed=5.0), name="raptor50"),
        of_vehicle(coax, sp.trim(coax), name="coax"),
        of_state_space(structure("hybrid"), name="hybrid"),
    ]


@pytest.mark.parametrize("place", [0, 1, 2])
def test_json_brings_back_every_bit_name_and_unit(place: int, tmp_path: Path) -> None:
    from swashplate.export.control_json import control_json

    model = models()[place]
    path = tmp_path / "model.json"
    path.write_text(control_json(model))
    found = read_linear(path)
    for name in "ABCD":
        np.testing.assert_array_equal(getattr(found, name), getattr(model, name))
    for name in ("name", "title", "trust", "states", "inputs", "outputs", "units", "delays", "about"):
        assert getattr(found, name) == getattr(model, name)
    system = read_control(path, pade=0)
    assert system.state_labels == list(model.states)
    assert system.input_labels == list(model.inputs)
    assert system.output_labels == list(model.outputs)
    np.testing.assert_array_equal(system.A, model.A)
    assert system.dt == 0


@pytest.mark.parametrize("place", [0, 2])
def test_what_left_as_mat_comes_back_and_goes_on(place: int, tmp_path: Path) -> None:
    model = models()[place]
    export_model(model, "matlab", name=model.name).save(tmp_path)
    found = read_matlab(tmp_path / f"{model.name}.mat")
    for name in "ABCD":
        np.testing.assert_array_equal(getattr(found, name), getattr(model, name))
    for name in ("name", "title", "trust", "states", "inputs", "outputs"):
        assert getattr(found, name) == getattr(model, name)
    assert {n: u for n, u in found.units.items() if u} == {
        n: model.units[n] for n in (*model.states, *model.inputs, *model.outputs) if model.units.get(n)
    }
    assert all(found.delay(o, i) == model.delay(o, i) for o in model.outputs for i in model.inputs)
    assert all(found.about.get(name, 0.0) == value for name, value in model.about.items())
    again, first = (export_model(m, "c", name="same").files["same.c"] for m in (found, model))
    assert again == first


@pytest.mark.parametrize(
    ("leave", "said"), [("io_delay", "io_delay: is no matrix"), ("state_names", "state_names: is mis")]
)
def test_a_mat_file_that_lacks_a_variable_is_told(leave: str, said: str, tmp_path: Path) -> None:
    from scipy.io import loadmat, savemat

    export_model(models()[2], "matlab", name="hybrid").save(tmp_path)
    whole = loadmat(tmp_path / "hybrid.mat")
    savemat(tmp_path / "less.mat", {k: v for k, v in whole.items() if k != leave and not k.startswith("__")})
    with pytest.raises(ExportError, match=said):
        read_matlab(tmp_path / "less.mat")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"kind": "pickle"}, "no linear model of kind"),
        ({"A": [[1.0, 2.0]]}, "A: is no matrix of 10 by 10"),
        ({"B": [["__import__('os')"] * 4] * 10}, "B: is no matrix"),
        ({"states": ["a", "a"]}, "states: is missing or is no list of different names"),
        ({"inputs": None}, "inputs: is missing"),
        ({"delays": {"lateral": True}}, "delays.lateral: is True"),
        ({"about": [1]}, "about: is no table"),
    ],
)
def test_a_damaged_file_is_told_by_its_entry(change: dict[str, object], said: str, tmp_path: Path) -> None:
    made = export_model(structure("hybrid"), "control", name="hybrid")
    document = json.loads(made.files["hybrid_control.json"]) | change
    path = tmp_path / "damaged.json"
    path.write_text(json.dumps(document))
    with pytest.raises(ExportError, match=said):
        read_linear(path)
    for text in ("", "[" * 100_000, '{"kind": NaN'):
        path.write_text(text)
        with pytest.raises(ExportError):
            read_linear(path)


def test_mat_brings_back_matrices_names_units_delays_and_the_trim() -> None:
    from scipy.io import loadmat

    (content,) = export_model(structure("hybrid"), "matlab", name="hybrid").files.values()
    assert content == export_model(structure("hybrid"), "matlab", name="hybrid").files["hybrid.mat"]
    found = loadmat(io.BytesIO(content), simplify_cells=True)
    truth = of_state_space(structure("hybrid"), name="hybrid")
    for name in "ABCD":
        np.testing.assert_array_equal(found[name], getattr(truth, name))
    assert list(found["state_names"]) == list(truth.states)
    assert list(found["input_units"]) == [truth.units[name] for name in truth.inputs]
    assert found["io_delay"].shape == (len(truth.outputs), len(truth.inputs))
    assert np.all(found["io_delay"] == 0.02)

    raptor = sp.vehicle("raptor50")
    trim = sp.trim(raptor, speed=5.0)
    (content,) = export_model(raptor, "matlab", name="raptor50", trim=trim).files.values()
    found = loadmat(io.BytesIO(content), simplify_cells=True)
    np.testing.assert_array_equal(found["state_start"], trim.state)
    np.testing.assert_array_equal(found["input_start"], trim.inputs)
    assert str(found["name"]) == "raptor50"


def test_c_and_fmu_refuse_delays_that_differ_between_outputs_or_leave_them_out_with_words() -> None:
    model = replace(structure("hybrid"), delays={})
    first, second = (f"{output}/{model.inputs[0]}" for output in model.outputs[:2])
    torn = replace(model, delays={first: Expression("0.02"), second: Expression("0.04")})
    for form in ("c", "fmu"):
        with pytest.raises(ExportError, match=rf"differ between outputs \({first} 20 ms.*--no-delays"):
            export_model(torn, form, name="torn")
    made = export_model(torn, "c", name="torn", delays=False)
    assert f"{first} 20 ms, {second} 40 ms" in " ".join(made.notes)
    assert made.files["torn.c"] == export_model(model, "c", name="torn").files["torn.c"]
    assert not export_model(model, "c", name="torn", delays=False).notes
