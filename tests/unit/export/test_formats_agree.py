"""One flight of one model, flown by every format that it is exported to, and what each format says it was made from."""

from __future__ import annotations

import ctypes
import io
import json
import re
import subprocess
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import chromium
import swashplate as sp
from exported import FLY
from flown_here import World
from swashplate.commit import commit
from swashplate.compiler import STRICT, compiler, shared_library, web_compiler
from swashplate.engine.equations import parameter_row
from swashplate.engine.fly import FlightPlan, fly
from swashplate.export.control_json import read_linear
from swashplate.export.formats import Export, export_model
from swashplate.export.linear import Linear
from swashplate.export.matlab import read_matlab
from swashplate.links.live.axes import STICKS
from swashplate.links.web.libraries import PAGE

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")
PERIODS, SUBSTEPS, STEP = 150, 5, 0.002
STUBS = Path(__file__).resolve().parents[2] / "stubs"


@dataclass(frozen=True)
class Flown:
    """A flight under moving sticks without any holding: inputs of each period, those that act, states at its end."""

    world: World
    sticks: np.ndarray
    inputs: np.ndarray
    acting: np.ndarray
    states: np.ndarray

    @property
    def by_angles(self) -> np.ndarray:
        """Its states where Euler angles are what is integrated, as C's step does, and no quaternion."""
        vehicle, around = self.world.vehicle, [0.0, 0.0, 0.0, self.world.setting.voltage]
        rows = np.repeat(np.column_stack([self.acting, np.tile(around, (PERIODS, 1))]), SUBSTEPS, axis=0)
        rows, numbers = np.vstack([rows, rows[-1:]]), parameter_row(vehicle, self.world.environment)
        plan = FlightPlan(self.states[0][:, None], numbers[:, None], rows[:, :, None], STEP, keep=SUBSTEPS)
        return fly(vehicle, plan, quaternion=False)[0][:, :, 0]

    def columns(self, names: tuple[str, ...]) -> np.ndarray:
        return self.states[:, [self.world.vehicle.state_names.index(name) for name in names]]


@lru_cache
def flown(name: str, size: float = 1.0) -> Flown:
    """As Python flies it."""
    world = World(sp.vehicle(name))
    assert (world.period, world.substeps) == (SUBSTEPS * STEP, SUBSTEPS)
    world.set_mode("raw")
    at = np.arange(PERIODS) * world.period
    sticks = size * np.stack([0.5 * np.sin(5 * at), 0.4 * np.sin(3 * at), 0.3 * np.cos(at), 0.2 * np.sin(2 * at)], 1)
    inputs, states = [], [world.trim.state]
    for row in sticks:
        world.setting.sticks = dict(zip(STICKS, row, strict=True))
        world.step()
        states.append(world.moment().crafts["own"][0].copy())
        inputs.append(world.moment().crafts["own"][1].copy())
    assert not world.trouble
    late = int(world.steps_back.max())
    assert np.all(world.steps_back[0] == late), "whole periods"
    acting = np.concatenate([np.tile(world.trim.inputs, (late, 1)), inputs])[:PERIODS]
    return Flown(world, sticks, np.array(inputs), acting, np.array(states))


def made(flight: Flown, form: str) -> Export:
    vehicle = flight.world.vehicle
    trim = None if vehicle.structure is not None else flight.world.trim
    return export_model(vehicle, form, name="model", trim=trim)


# ---- how each format flies: states at the end of each period, and their names --------------------------------------
Found = tuple[tuple[str, ...], np.ndarray]


def names_in(header: str, kind: str) -> tuple[str, ...]:
    """Names of states or inputs in the order of C's arrays, from its header."""
    found = re.search(rf"enum model_{kind} \{{(.*?)\}};", header, re.DOTALL)
    assert found is not None
    return tuple(re.findall(rf"^  model_{kind}_(\w+)", found[1], re.MULTILINE))


def of_c(export: Export, flight: Flown, folder: Path) -> Found:
    export.save(folder)
    (folder / "fly.c").write_text(FLY.replace("NAME", "model"))
    library = ctypes.CDLL(
        str(shared_library([folder / "model.c", folder / "fly.c"], folder / "model.so", options=["-O0"]))
    )
    names = names_in(export.files["model.h"].decode(), "state")
    start = flight.columns(names)[0]
    rows = np.repeat(flight.acting, SUBSTEPS, axis=0)
    rows = np.ascontiguousarray(np.vstack([rows, rows[-1:]]))
    states = np.zeros((len(rows), len(names)))
    states[0] = start
    pointer: Callable[[np.ndarray], ctypes.c_void_p] = lambda a: ctypes.c_void_p(a.ctypes.data)  # noqa: E731
    constants = [ctypes.c_double.in_dll(library, f"model_start_{kind}") for kind in "sp"]
    library.fly(
        pointer(rows), pointer(states), len(rows), ctypes.c_double(STEP), *(ctypes.byref(one) for one in constants)
    )
    return names, states[::SUBSTEPS]


def of_fmu(export: Export, flight: Flown, folder: Path) -> Found:
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi2 import FMU2Slave

    (path,) = export.save(folder)
    told = fmpy.read_model_description(str(path))
    slave = FMU2Slave(
        guid=told.guid,
        unzipDirectory=fmpy.extract(str(path)),
        modelIdentifier=told.coSimulation.modelIdentifier,
        instanceName="tested",
    )
    at = {variable.name: variable.valueReference for variable in told.modelVariables}
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.setReal([at["step_size"]], [STEP])
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    names = tuple(name for name in flight.world.vehicle.state_names if name in at)
    places, rows = [at[name] for name in names], []
    rows.append(slave.getReal(places))
    for k, row in enumerate(flight.inputs):
        slave.setReal([at[name] for name in flight.world.vehicle.input_names], row.tolist())
        slave.doStep(k * STEP * SUBSTEPS, STEP * SUBSTEPS)
        rows.append(slave.getReal(places))
    slave.terminate()
    slave.freeInstance()
    return names, np.array(rows)


ENGINE = """
#include <stdio.h>
static const real_T table[][%d] = {%s};
int main(void) { /* Runge and Kutta's steps, as a solver of fixed step takes them */
  static SimStruct S;
  static const double share[] = {0.5, 0.5, 1.0}, weight[] = {1, 2, 2, 1};
  int i, k, stage, port;
  mdlInitializeSizes(&S);
  mdlInitializeSampleTimes(&S);
  mdlInitializeConditions(&S);
  for (port = 0; port < 2; ++port)
    for (i = 0; i < 64; ++i) S.in_pointers[port][i] = &S.in[port][i];
  for (i = 0; S.inputs > 1 && i < S.in_width[1]; ++i) S.in[1][i] = model_start_s[i];
  for (k = 0; k < %d; ++k) {
    real_T start[64], sum[64] = {0};
    for (i = 0; i < S.in_width[0]; ++i) S.in[0][i] = table[k / %d][i];
    for (i = 0; i < S.continuous; ++i) start[i] = S.x[i];
    for (stage = 0; stage < 4; ++stage) {
      mdlDerivatives(&S);
      for (i = 0; i < S.continuous; ++i) {
        sum[i] += weight[stage] * S.dx[i];
        if (stage < 3) S.x[i] = start[i] + %.17g * share[stage] * S.dx[i];
      }
    }
    for (i = 0; i < S.continuous; ++i) S.x[i] = start[i] + %.17g / 6 * sum[i];
    if ((k + 1) %% %d == 0)
      for (i = 0; i < S.continuous; ++i) printf("%%.17g ", S.x[i]);
  }
  mdlOutputs(&S, 0);
  mdlTerminate(&S);
  return 0;
}
"""


def of_simulink(export: Export, flight: Flown, folder: Path) -> Found:
    export.save(folder)
    table = ", ".join("{" + ", ".join(f"{value:.17g}" for value in row) + "}" for row in flight.acting)
    width, steps = flight.acting.shape[1], PERIODS * SUBSTEPS
    (folder / "cg_sfun.h").write_text(ENGINE % (width, table, steps, SUBSTEPS, STEP, STEP, SUBSTEPS))
    program = compiler()
    assert program is not None
    built = [*program, *STRICT, "-O0", f"-I{STUBS}", f"-I{folder}", "model_sfun.c", "model.c", "-lm", "-o", "engine"]
    subprocess.run(built, cwd=folder, check=True)
    said = subprocess.run([folder / "engine"], capture_output=True, text=True, check=True).stdout
    names = names_in(export.files["model.h"].decode(), "state")
    found = np.array(said.split(), dtype=float).reshape(PERIODS, len(names))
    return names, np.vstack([flight.columns(names)[0], found])


def of_matrices(linear: Linear, flight: Flown) -> Found:
    """Runge and Kutta's steps of a linear model, in deviations from where it says that it is."""
    about = np.array([linear.about.get(name, 0.0) for name in linear.states])
    held = np.array([linear.about.get(name, 0.0) for name in linear.inputs])
    x, rows = np.zeros(len(linear.states)), [about]
    for row in flight.acting:
        u = row - held
        for _ in range(SUBSTEPS):
            k1 = linear.A @ x + linear.B @ u
            k2 = linear.A @ (x + STEP / 2 * k1) + linear.B @ u
            k3 = linear.A @ (x + STEP / 2 * k2) + linear.B @ u
            k4 = linear.A @ (x + STEP * k3) + linear.B @ u
            x = x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        rows.append(about + x)
    return linear.states, np.array(rows)


def of_control(export: Export, flight: Flown, folder: Path) -> Found:
    (path,) = export.save(folder)
    return of_matrices(read_linear(path), flight)


def of_matlab(export: Export, flight: Flown, folder: Path) -> Found:
    (path,) = export.save(folder)
    return of_matrices(read_matlab(path), flight)


FLIES = """plan => {
  const { connection } = swash, { flight } = connection;
  connection.runs = false;
  flight.setMode("raw");
  flight.reset();
  const own = flight.places[0], states = [[...own.x]], inputs = [];
  for (const row of plan.sticks) {
    flight.setting.sticks = Object.fromEntries(plan.axes.map((axis, i) => [axis, row[i]]));
    flight.step();
    states.push([...own.x]);
    inputs.push([...own.inputs]);
  }
  return { states, inputs };
}"""


def of_web(export: Export, flight: Flown, folder: Path) -> Found:
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    (path,) = export.save(folder)
    browsing = chromium.running_browser(webgl=True)
    page = next(browsing).new_context(offline=True).new_page()
    page.goto(path.as_uri())
    page.locator("html[data-drawn]").wait_for(state="attached", timeout=90_000)
    told = page.evaluate(FLIES, {"axes": list(STICKS), "sticks": flight.sticks.tolist()})
    assert next(browsing, None) is None
    np.testing.assert_allclose(told["inputs"], flight.inputs, rtol=1e-9, atol=1e-9)
    return flight.world.vehicle.state_names, np.array(told["states"])


FORMATS = {
    "c": pytest.param(of_c, marks=needs_compiler),
    "fmu": pytest.param(of_fmu, marks=needs_compiler),
    "simulink": pytest.param(of_simulink, marks=needs_compiler),
    "control": of_control,
    "matlab": of_matlab,
    "web": pytest.param(of_web, marks=pytest.mark.skipif(web_compiler() is None, reason="nothing makes WebAssembly")),
}


@pytest.mark.parametrize("flies", FORMATS.values(), ids=FORMATS.keys())
@pytest.mark.parametrize("name", ["coax", "thirteen_state"])
def test_every_format_flies_what_python_flies(
    name: str, flies: Callable[[Export, Flown, Path], Found], tmp_path: Path
) -> None:
    """To 1e-9 with the same integration; matrices of a vehicle to first order: twice the sticks leave four times it."""
    flight, form = flown(name), flies.__name__.removeprefix("of_")
    export = made(flight, form)
    names, found = flies(export, flight, tmp_path)
    expected = flight.columns(names)
    assert len(names) >= 12
    assert np.ptp(expected[:, names.index("p")]) > 0.05, "it is a flight"
    if form in ("control", "matlab") and name == "coax":
        small, smaller = (
            float(np.linalg.norm(flies(export, one, tmp_path)[1] - one.columns(names)))
            for one in (flown(name, 0.02), flown(name, 0.01))
        )
        assert small == pytest.approx(4.0 * smaller, rel=0.1)
        assert small < 0.02 * np.linalg.norm(flown(name, 0.02).columns(names) - expected[0])
        return
    if form in ("c", "fmu", "simulink"):
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
        expected = flight.by_angles[:, [flight.world.vehicle.state_names.index(name) for name in names]]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_the_comparison_can_fail(tmp_path: Path) -> None:
    """A thousandth of one number of the card is seen."""
    flight = flown("thirteen_state")
    linear = read_linear(made(flight, "control").save(tmp_path)[0])
    linear.A[linear.states.index("p")] *= 1.001
    names, found = of_matrices(linear, flight)
    assert np.max(np.abs(found - flight.columns(names))) > 1e-6


def text_of(export: Export) -> str:
    """What a person or a program finds in the files."""
    told = []
    for name, content in export.files.items():
        if name.endswith(".fmu"):
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                told.append(archive.read("modelDescription.xml").decode())
        elif name.endswith(".mat"):
            told += [str(line[0]) for line in loadmat(io.BytesIO(content))["origin"].ravel()]
        elif name.endswith(".json"):
            told += json.loads(content)["origin"]
        else:
            told.append(content.decode())
    return re.sub(r"[\s*]+", " ", " ".join(told))


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_says_commit_card_and_data(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if form == "web" and not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    monkeypatch.setattr("swashplate.links.live.single_page.web_assembly", lambda source: b"")
    published, fitted = sp.vehicle("coax"), sp.vehicle("coax")
    mass = fitted.card.parameters["mass"]
    source = "identified by filter error from flight_2011-08-01_vertical"
    numbers = {**fitted.card.parameters, "mass": replace(mass, value=0.31, source=source, status="identified")}
    fitted = fitted.with_card(replace(fitted.card, parameters=numbers))
    first, second = (text_of(sp.export_model(one, form, name="model")) for one in (published, fitted))
    for text in (first, second):
        assert "Made by swashplate 0." in text
        assert commit() in text
    (one, other) = (re.search(r"Card ([0-9a-f]{12}) of coax", text) for text in (first, second))
    assert one is not None
    assert other is not None
    assert one[1] != other[1]
    assert "Data: no flight" in first
    assert "Data: filter error from flight_2011-08-01_vertical (" in second
