"""The FMU: accepted by FMPy's validator, flown in FMPy, rewound, and complete without a compiler."""

from __future__ import annotations

import io
import subprocess
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.compiler import compiler
from swashplate.errors import ExportError
from swashplate.export import fmu as fmu_module
from swashplate.export.fmu import fmu, fmu_platform, internal_step
from swashplate.export.formats import export_model
from swashplate.export.linear import of_state_space
from swashplate.export.traced import Traced, trace_linear, trace_vehicle
from swashplate.flights.base_units import base_units, gain_unit, is_unit
from swashplate.models.linear.state_space_file import structure
from swashplate.models.vehicle import Vehicle

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
fmpy = pytest.importorskip("fmpy")
needs_binary = pytest.mark.skipif(compiler() is None or fmu_platform() is None, reason="no C compiler for FMI")


@pytest.fixture(scope="module")
def coax() -> tuple[Vehicle, Traced]:
    vehicle = sp.vehicle("coax")
    return vehicle, trace_vehicle(vehicle, sp.trim(vehicle), name="coax")


@pytest.fixture(scope="module")
def unit(coax: tuple[Vehicle, Traced], tmp_path_factory: pytest.TempPathFactory) -> Path:
    content, message = fmu(coax[1], version="0.1")
    assert message == ""
    path = tmp_path_factory.mktemp("fmu") / "coax.fmu"
    path.write_bytes(content)
    return path


@contextmanager
def running(path: Path) -> Iterator[tuple[Any, dict[str, int]]]:
    """An instance that is ready to step, and value references by name."""
    description = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path))
    from fmpy.fmi2 import FMU2Slave

    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="tested",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    try:
        yield slave, {v.name: v.valueReference for v in description.modelVariables}
    finally:
        slave.terminate()
        slave.freeInstance()


def fly(slave: Any, at: dict[str, int], inputs: dict[str, np.ndarray], outputs: list[str], dt: float) -> np.ndarray:
    rows = []
    n = len(next(iter(inputs.values())))
    for k in range(n):
        slave.setReal([at[name] for name in inputs], [float(series[k]) for series in inputs.values()])
        rows.append(slave.getReal([at[name] for name in outputs]))
        if k < n - 1:
            slave.doStep(currentCommunicationPoint=k * dt, communicationStepSize=dt)
    return np.array(rows)


@needs_binary
def test_the_validator_has_nothing_to_say(unit: Path, tmp_path: Path) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit)) == []
    linear = trace_linear(of_state_space(structure("hybrid"), name="hybrid"), name="hybrid")
    (tmp_path / "hybrid.fmu").write_bytes(fmu(linear, version="0.1")[0])
    assert validate_fmu(str(tmp_path / "hybrid.fmu")) == []


@needs_binary
def test_ten_seconds_are_pythons_with_accelerometers_and_derivatives(unit: Path, coax: tuple[Vehicle, Traced]) -> None:
    vehicle, trim = coax[0], sp.trim(coax[0])
    n, dt = 1001, 0.01
    time = np.arange(n) * dt
    inputs = {name: value + 0.01 * np.sin((3.0 + i) * time) for i, (name, value) in enumerate(trim.commands().items())}
    flight = sp.simulate(vehicle, inputs, start=trim, rate=100, substeps=5)  # the FMU's steps of 2 ms
    names = [*vehicle.state_names, "az", "der(q)"]
    with running(unit) as (slave, at):
        rows = fly(slave, at, inputs, names, dt)
    python = np.stack([flight.values(name) for name in vehicle.state_names], axis=1)
    assert np.max(np.abs(rows[:, :-2] - python) / np.maximum(1.0, np.abs(python))) < 1e-6
    assert abs(rows[0, -2] + 9.81) < 1e-3
    by_difference = np.gradient(python[:, vehicle.index("q")], dt)
    assert np.max(np.abs(rows[5:-5, -1] - by_difference[5:-5])) < 0.05 * np.max(np.abs(by_difference))


@needs_binary
def test_what_an_identified_card_remembers_of_delays_goes_along_where_asked_for(tmp_path: Path) -> None:
    """The unit without delays, under inputs that are moved by hand, flies the same; that it is Python: above."""
    plain = sp.vehicle("coax")
    nuisance = {"nuisance": {"delay_servo": 0.03, "delay_motor": 0.06, "lever_x": 0.1}}
    vehicle = plain.with_card(replace(plain.card, observer=nuisance))
    export_model(vehicle, "fmu", name="late", delays=True).save(tmp_path)
    trim = sp.trim(plain, voltage=plain.card.values()["voltage_nominal"])
    n, dt = 301, 0.01
    moved = {name: 0.02 * np.sin((3.0 + i) * np.arange(n) * dt) for i, name in enumerate(plain.input_names)}
    inputs = {name: trim.commands()[name] + series for name, series in moved.items()}
    steps = {name: 6 if name.startswith("motor") else 3 for name in inputs}
    shifted = {
        name: np.concatenate([np.full(steps[name], trim.commands()[name]), series[: n - steps[name]]])
        for name, series in inputs.items()
    }
    export_model(plain, "fmu", name="plain").save(tmp_path)
    rows = {}
    for name, given in (("late", inputs), ("plain", shifted)):
        with running(tmp_path / f"{name}.fmu") as (slave, at):
            rows[name] = fly(slave, at, given, list(plain.state_names), dt)
    assert np.ptp(rows["plain"], axis=0).max() > 0.1
    assert np.max(np.abs(rows["late"] - rows["plain"]) / np.maximum(1.0, np.abs(rows["plain"]))) < 1e-6
    said = " ".join(export_model(vehicle, "c", name="late", trim=trim, delays=True).notes)
    assert "hold back motor_lower by 0.06 s; motor_upper by 0.06 s; servo_roll by 0.03 s" in said
    assert "hold back motor_lower" in " ".join(export_model(vehicle, "c", name="late", trim=trim).notes)
    bare = export_model(vehicle, "c", name="late", trim=trim, delays=False).notes
    assert bare[-1].startswith("Left out: the identified delays of the inputs (motor_lower 60 ms")
    with pytest.raises(ExportError, match="the card remembers no delays"):
        export_model(plain, "c", name="late", trim=trim, delays=True)
    with pytest.raises(ExportError, match="brings its own delays"):
        export_model(structure("six_dof"), "c", name="late", delays=True)


@needs_binary
def test_delays_of_a_linear_model_are_in_it(tmp_path: Path) -> None:
    """Each input acts one delay later than without; steps of any length, saved states and resets keep that."""
    given = of_state_space(structure("six_dof"), name="six_dof")
    late = replace(given, delays={"lateral": 0.03, "longitudinal": 0.0, "pedal": 0.05, "collective": 0.01})
    for name, model in (("late", late), ("plain", replace(given, delays={}))):
        (tmp_path / f"{name}.fmu").write_bytes(fmu(trace_linear(model, name="six_dof"), version="0.1")[0])
    names, n, dt = list(given.states), 60, 0.01
    random = np.random.default_rng(0)
    inputs = {name: random.standard_normal(n) for name in given.inputs}
    shifted = {}
    for name, series in inputs.items():
        steps = round(late.delays[name] / dt)
        shifted[name] = np.concatenate([np.zeros(steps), series[: n - steps]])
    with running(tmp_path / "plain.fmu") as (slave, at):
        expected = fly(slave, at, shifted, names, dt)
    with running(tmp_path / "late.fmu") as (slave, at):
        np.testing.assert_allclose(fly(slave, at, inputs, names, dt), expected, rtol=1e-12, atol=1e-12)
        slave.reset()
        slave.setReal([at["step_size"]], [1e-5])  # more steps in a delay than are remembered one by one
        fine = fly(slave, at, inputs, names, dt)
        assert np.max(np.abs(fine - expected)) < 0.02 * np.max(np.abs(expected))
        slave.reset()
        slave.setReal([at["pedal"]], [1.0])
        slave.doStep(0.0, 0.04)
        saved = slave.getFMUstate()
        assert slave.getReal([at["r"]]) == [0.0]
        slave.doStep(0.04, 0.04)
        (first,) = slave.getReal([at["r"]])
        assert first > 0.1
        slave.setFMUstate(saved)
        slave.doStep(0.04, 0.04)
        assert slave.getReal([at["r"]]) == [first]
        slave.freeFMUstate(saved)


@needs_binary
def test_states_are_saved_and_parameters_set(unit: Path) -> None:
    with running(unit) as (slave, at):
        slave.setReal([at["p"]], [0.2])
        saved = slave.getFMUstate()
        kept = slave.serializeFMUstate(saved)
        slave.doStep(0.0, 0.5)
        (first,) = slave.getReal([at["phi"]])
        slave.setFMUstate(slave.deSerializeFMUstate(kept))
        slave.doStep(0.0, 0.5)
        assert slave.getReal([at["phi"]]) == [first]
        slave.freeFMUstate(saved)
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.setReal([at["parameters.mass"]], [0.5])  # too heavy for its hover
        slave.exitInitializationMode()
        slave.doStep(0.0, 0.5)
        assert slave.getReal([at["w"]])[0] > 0.5


@needs_binary
@pytest.mark.parametrize(
    ("name", "value"), [("der(q)", 0.0), ("az", 0.0), ("step_size", 0.0), ("phi", float("nan")), (None, 0.0)]
)
def test_what_cannot_be_set_is_an_error(unit: Path, name: str | None, value: float) -> None:
    with running(unit) as (slave, at), pytest.raises(Exception, match=r"SetReal|status"):
        slave.setReal([at[name] if name else 10_000], [value])


@needs_binary
def test_leaving_the_finite_numbers_is_an_error(unit: Path) -> None:
    with running(unit) as (slave, at):
        slave.setReal([at["p"]], [1e200])
        with pytest.raises(Exception, match=r"DoStep|status"):
            slave.doStep(0.0, 1.0)


def test_the_description_names_units_derivatives_and_parameters(coax: tuple[Vehicle, Traced]) -> None:
    content, _ = fmu(coax[1], version="0.1")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))
        names = set(archive.namelist())
    assert {"sources/coax.c", "sources/coax.h", "sources/fmu2.c", "sources/fmu_model.h"} <= names
    variables = {v.get("name"): v for v in root.iter("ScalarVariable")}
    real = variables["der(q)"][0]
    assert (real.get("unit"), real.get("derivative")) == ("rad/s^2", str(1 + coax[0].index("q")))
    assert variables["parameters.mass"][0].get("unit") == "kg"
    assert "published" in (variables["parameters.mass"].get("description") or "")
    assert variables["servo_roll"][0].get("min") == "-1.0"
    unit = next(u for u in root.iter("Unit") if u.get("name") == "N s^2/rad^2")
    assert unit[0].attrib == {"kg": "1", "m": "1", "rad": "-2"}


def test_a_fast_mode_shortens_the_internal_step() -> None:
    slow = of_state_space(structure("heave"), name="heave")
    assert internal_step(trace_linear(slow, name="heave")) == 0.002
    fast = trace_linear(replace(slow, A=np.array([[-1000.0]])), name="heave")
    assert internal_step(fast) == pytest.approx(0.0005)
    with zipfile.ZipFile(io.BytesIO(fmu(fast, version="0.1")[0])) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))
    step = next(v for v in root.iter("ScalarVariable") if v.get("name") == "step_size")
    assert float(step[0].get("start", "")) == pytest.approx(0.0005)


def test_the_same_model_gives_the_same_bytes_and_words_stay_words(coax: tuple[Vehicle, Traced]) -> None:
    hostile = replace(coax[1], title='<!ENTITY a "b">]]> & \x00 " é', trust="")
    with pytest.MonkeyPatch.context() as without:
        without.setattr(fmu_module, "compiler", lambda: None)
        first, message = fmu(hostile, version="0.1")
        assert fmu(hostile, version="0.1")[0] == first
    assert "no C compiler" in message
    with zipfile.ZipFile(io.BytesIO(first)) as archive:
        assert not [name for name in archive.namelist() if name.startswith("binaries")]
        assert "<!ENTITY" in (ET.fromstring(archive.read("modelDescription.xml")).get("description") or "")


@needs_binary
def test_the_sources_link_statically_under_the_models_prefix(unit: Path, tmp_path: Path) -> None:
    """As an importer does that builds the FMU into a program of its own (FMI 2.0.4, sec. 2.1.1)."""
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
    (tmp_path / "sources" / "main.c").write_text(
        "const char *coax_fmi2GetVersion(void);\nint main(void) { return coax_fmi2GetVersion()[0] == '2' ? 0 : 1; }\n"
    )
    program = compiler()
    assert program is not None
    command = [*program, "-std=c99", "-DFMI2_STATIC_LINKING", "main.c", "fmu2.c", "coax.c", "-lm", "-o", "main"]
    subprocess.run(command, cwd=tmp_path / "sources", check=True)
    subprocess.run([tmp_path / "sources" / "main"], check=True)


@pytest.mark.parametrize(
    ("unit_text", "expected"),
    [
        ("kg m^2", (1.0, {"kg": 1, "m": 2})),
        ("rad/s/V", (1.0, {"rad": 1, "kg": -1, "m": -2, "s": 2, "A": 1})),
        ("rad s^2/m^2", (1.0, {"rad": 1, "s": 2, "m": -2})),
        ("rad/(m s)", (1.0, {"rad": 1, "m": -1, "s": -1})),
        ("1/s^2", (1.0, {"s": -2})),
        ("deg", (np.pi / 180.0, {"rad": 1})),
        ("1", (1.0, {})),
        ("furlong", None),
        ("m)", None),
        ("m^" + "9" * 400, None),
        ("(" * 3000 + "m" + ")" * 3000, None),
        ("/".join(["s/us^9"] * 12), None),
        ("^2", None),
        ("", None),
    ],
)
def test_units_in_base_units(unit_text: str, expected: tuple[float, dict[str, int]] | None) -> None:
    assert base_units(unit_text) == expected


def test_every_unit_of_every_card_is_known() -> None:
    from swashplate.models.card import packaged_cards

    units = {p.unit for card in packaged_cards().values() for p in card.parameters.values()}
    assert [unit for unit in sorted(units) if base_units(unit) is None] == []


def test_what_is_a_unit_and_the_unit_of_a_gain() -> None:
    assert all(map(is_unit, ("deg/s", "%", "rad/(m s)", "ft/s^2/in", "m/s²", "rad/s^2/%")))
    assert not any(map(is_unit, ("furlong/s", "1/fortnight", "rad/(m s", "")))
    assert gain_unit("rad/s", "1", 2) == "rad/s^3"
    assert gain_unit("m/s^2", "1", 0) == "m/s^2"
    assert gain_unit("rad", "rad/s", 1) == "1"
    assert gain_unit("m/s", "rad", -1) == "m/rad"
    assert gain_unit("rad/s", "m", 1) == "rad/(s^2 m)"
    assert gain_unit("furlong", "1", 0) == ""
