"""Exported C, compiled with warnings as errors, against Python: ten seconds of flight, Jacobians, accelerometers."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from exported import compiled
from swashplate.compiler import compiler, shared_library
from swashplate.engine.emit import comment_text, identifier
from swashplate.engine.statements import literal
from swashplate.errors import ExportError
from swashplate.export.formats import export_model
from swashplate.export.linear import of_state_space
from swashplate.export.model_c import model_code
from swashplate.export.traced import Traced, late_notes, trace_linear, trace_vehicle
from swashplate.models.linear.state_space_file import structure
from swashplate.models.nesting import leaves
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.trim import Trim

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")

VEHICLES = [
    ("coax", {}, 0.0),
    pytest.param("coax", {"bar": False, "mixing": "as_printed"}, 0.0, marks=pytest.mark.proof),
    pytest.param("raptor50", {}, 5.0, marks=pytest.mark.proof),
]
WINDY = Environment(wind_north=0.5, wind_east=-0.3, wind_down=0.1, air_density=1.15, gravity=9.80665, voltage=11.8)


def flown_from(name: str, options: dict[str, Any], speed: float) -> tuple[Vehicle, Trim]:
    vehicle = sp.vehicle(name, **options)
    return vehicle, sp.trim(vehicle, speed=speed, environment=WINDY)


def shaken(vehicle: Vehicle, trim: Trim, n: int, rate: float) -> np.ndarray:
    """Inputs about a trim that move every axis, shape (n, n_inputs), within the limits."""
    time = np.arange(n)[:, None] / rate
    low, high = np.array(vehicle.input_limits).T
    wave = 0.01 * (high - low) * np.sin(2.0 * np.pi * time * (0.4 + 0.3 * np.arange(low.size)))
    return np.clip(trim.inputs + wave, low, high)


def starts(model: Traced, kind: str) -> np.ndarray:
    return np.array([v.start for v in getattr(model, kind)])


@lru_cache(maxsize=1)
def by_xla(name: str, options: tuple[tuple[str, Any], ...] = (), speed: float = 0.0) -> sp.Flight:
    """Ten seconds with shaken inputs."""
    vehicle, trim = flown_from(name, dict(options), speed)
    rows = shaken(vehicle, trim, 2001, 200.0)
    return sp.simulate(vehicle, rows, start=trim, rate=200.0, environment=WINDY)


@needs_compiler
@pytest.mark.parametrize(("name", "options", "speed"), VEHICLES)
def test_ten_seconds_and_the_jacobians_are_pythons(
    name: str, options: dict[str, Any], speed: float, tmp_path: Path
) -> None:
    vehicle, trim = flown_from(name, options, speed)
    model = trace_vehicle(vehicle, trim, name=name)
    run = compiled(model_code(model), tmp_path)
    rate, n = 200.0, 2001
    rows = shaken(vehicle, trim, n, rate)
    s, p = starts(model, "surroundings"), starts(model, "parameters")
    states = run.fly(trim.state, rows, 1.0 / rate, s, p)
    flight = by_xla(name, tuple(options.items()), speed)
    python = np.stack([flight.values(state) for state in vehicle.state_names], axis=1)
    assert np.ptp(python[:, vehicle.index("phi")]) > 0.01  # it did fly
    difference = np.max(np.abs(states - python) / np.maximum(1.0, np.abs(python)))
    assert difference < 1e-10

    linear = sp.linearize(vehicle, trim)
    A, B = run.call("jacobians", trim.state, trim.inputs, s, p, out=(linear.A.size, linear.B.size))
    for found, expected in ((A, linear.A), (B, linear.B)):
        np.testing.assert_allclose(found.reshape(expected.shape), expected, rtol=1e-9, atol=1e-9)
    # At rest in the steady flight's axes accelerometers read the weight.
    (force,) = run.call("outputs", trim.state, trim.inputs, s, p, out=(3,))
    np.testing.assert_allclose(np.linalg.norm(force), WINDY.gravity, rtol=1e-9)


@needs_compiler
def test_roots_in_one_loop_are_those_of_all_the_steps(tmp_path: Path) -> None:
    """Main and tail rotor's inflow, climbing and sinking through their own wakes, thrust of either sign."""
    vehicle, trim = flown_from("raptor50", {}, 0.0)
    model = trace_vehicle(vehicle, trim, name="heli")
    code = model_code(model)
    assert model.looped is not None
    assert code.source.count("for (step") == 1
    assert len(re.findall(r"-= move\d", code.source)) == len(model.looped.steps) == 2
    run = compiled(code, tmp_path)
    s, p = starts(model, "surroundings"), starts(model, "parameters")
    for sink in np.linspace(-8.0, 12.0, 41):
        x, u = np.array(trim.state), np.array(trim.inputs)
        x[vehicle.index("w")], x[vehicle.index("v")] = sink, 0.5 * sink
        u[vehicle.input_names.index("theta0")] *= 1.0 - 0.1 * sink
        (found,) = run.call("rates", x, u, s, p, out=(len(x),))
        unrolled = np.array(model.rates.call([x, u, s, p])[0]).ravel()
        np.testing.assert_allclose(found, unrolled, rtol=1e-12, atol=1e-10)

        # A step's later stages seek from where the first one found, also where they move as far as nothing flies.
        for dt in (0.002, 0.05, 0.5):

            def rates(row: np.ndarray, u: np.ndarray = u) -> np.ndarray:
                return run.call("rates", row, u, s, p, out=(row.size,))[0]

            k1 = rates(x)
            k2 = rates(x + 0.5 * dt * k1)
            k3 = rates(x + 0.5 * dt * k2)
            k4 = rates(x + dt * k3)
            stepped = run.fly(x, np.stack([u, u]), dt, s, p)[1]
            expected = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            np.testing.assert_allclose(stepped, expected, rtol=1e-11, atol=1e-11)


@needs_compiler
@pytest.mark.parametrize(("name", "constants"), [("raptor50", 39), pytest.param("coax", 16, marks=pytest.mark.proof)])
def test_what_no_state_moves_is_computed_once_a_step(name: str, constants: int) -> None:
    """Products of parameters only, and their sines: none is left in the function that every stage calls."""
    vehicle, trim = flown_from(name, {}, 0.0)
    source = model_code(trace_vehicle(vehicle, trim, name="heli")).source
    before, _, moving = source.partition("static void moving(")
    moving, fixed = moving.partition("\n}\n")[0], before.partition("static void fixed(")[2]
    assert fixed.count("  c[") > constants
    for line in moving.splitlines():
        found = re.fullmatch(r"  const heli_real (\w+) = (.*);", line)
        if found is not None:
            assert re.search(r"\b(t\d+|i_\w+|x|root\d?)\b", found[2]), line
    assert "x[" not in fixed


@needs_compiler
def test_every_option_of_a_helicopter_evaluates_as_plain_floats_do(tmp_path: Path) -> None:
    options = {"bar": True, "gyro": True, "servos": True, "rotor_speed": "throttle", "inflow": "pitt-peters"}
    vehicle = sp.vehicle("raptor50", ground=True, rotation="ccw", coning=True, **options)
    x0 = np.array(list(leaves(vehicle.state)))
    low, high = np.array(vehicle.input_limits).T
    start = Trim(x0, 0.5 * (low + high), vehicle.state_names, vehicle.input_names, WINDY, 0.0, 0.0, 0.0, 0.0)
    model = trace_vehicle(vehicle, start, name="heli")
    run = compiled(model_code(model), tmp_path)
    s, p = starts(model, "surroundings"), starts(model, "parameters")

    def plain(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.array(vehicle.rates(x.tolist(), u.tolist(), vehicle.values(), WINDY, FloatBackend()))

    random = np.random.default_rng(0)
    for scale in (0.05, 0.3, 1.0) * 20:
        x = x0 * random.uniform(0.7, 1.3, x0.size) + scale * random.standard_normal(x0.size) * np.where(x0 == 0, 1, 0.1)
        u = random.uniform(low, high)
        (rates,) = run.call("rates", x, u, s, p, out=(x.size,))
        expected = plain(x, u)
        np.testing.assert_allclose(rates, expected, rtol=1e-10, atol=1e-10)

    x, u = x0 + 0.05 * random.standard_normal(x0.size), 0.5 * (low + high)
    found = run.call("jacobians", x, u, s, p, out=(x.size**2, x.size * u.size))
    for matrix, row, move in zip(found, (x, u), (lambda v: (v, u), lambda v: (x, v)), strict=True):
        nudges = 1e-6 * np.eye(row.size)
        slopes = np.stack([(plain(*move(row + d)) - plain(*move(row - d))) / 2e-6 for d in nudges], axis=1)
        np.testing.assert_allclose(matrix.reshape(slopes.shape), slopes, rtol=1e-4, atol=1e-4 * np.abs(slopes).max())


@needs_compiler
def test_in_single_precision_a_second_keeps_four_digits(tmp_path: Path) -> None:
    vehicle, trim = flown_from("coax", {}, 0.0)
    model = trace_vehicle(vehicle, trim, name="coax")
    code = model_code(model, precision="single")
    run = compiled(code, tmp_path)
    rows = shaken(vehicle, trim, 201, 200.0)
    states = run.fly(trim.state, rows, 0.005, starts(model, "surroundings"), starts(model, "parameters"))
    flight = by_xla("coax")
    for name in ("u", "phi", "p", "q", "omega_lower"):
        expected = flight.values(name)[:201]
        scale = max(1.0, float(np.max(np.abs(expected))))
        assert np.max(np.abs(states[:, vehicle.index(name)] - expected)) / scale < 1e-4
    bare = re.sub(r"/\*.*?\*/", "", code.source, flags=re.DOTALL)
    assert "double" not in bare
    assert not re.search(r"\d\.\d*(e[+-]?\d+)?(?![\df.e])", bare)  # no constant lifts the arithmetic to double
    assert not re.search(r"\b(sin|cos|tan|sqrt|fabs|atan2)\(", bare)


@needs_compiler
def test_a_linear_model_steps_as_its_matrices_say(tmp_path: Path) -> None:
    linear = of_state_space(structure("hybrid"), name="hybrid")
    model = trace_linear(linear, name="hybrid")
    assert "hold back lateral by 0.02 s" in late_notes(model)[0]
    run = compiled(model_code(model), tmp_path)
    random = np.random.default_rng(0)
    x, u, nothing = random.standard_normal(10), random.standard_normal(4), np.zeros(1)
    (rates,) = run.call("rates", x, u, nothing, nothing, out=(10,))
    (outputs,) = run.call("outputs", x, u, nothing, nothing, out=(len(linear.outputs),))
    A, B = run.call("jacobians", x, u, nothing, nothing, out=(100, 40))
    np.testing.assert_allclose(rates, linear.A @ x + linear.B @ u, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(outputs, linear.C @ x + linear.D @ u, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(A.reshape(10, 10), linear.A)
    np.testing.assert_array_equal(B.reshape(10, 4), linear.B)
    held = run.fly(x, np.tile(u, (2, 1)), 0.001, nothing, nothing)[1]
    truth = x + _held(linear.A, linear.A @ x + linear.B @ u, 0.001)
    np.testing.assert_allclose(held, truth, rtol=1e-8)


def _held(A: np.ndarray, slope: np.ndarray, dt: float) -> np.ndarray:
    """What a constant slope adds over dt: an integral of the matrix exponential."""
    from scipy.linalg import expm

    n = len(A)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = A, slope
    return np.asarray(expm(dt * whole)[:n, n])


@needs_compiler
def test_the_example_flies(tmp_path: Path) -> None:
    vehicle = sp.vehicle("coax")
    export_model(vehicle, "c", name="coax").save(tmp_path)
    program = compiler()
    assert program is not None
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([*program, *strict, "-O1", "coax_example.c", "coax.c", "-lm", "-o", "fly"], cwd=tmp_path, check=True)
    lines = subprocess.run([tmp_path / "fly"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(lines) == 11
    numbers = np.array([line.split()[2:] for line in lines], dtype=float)
    np.testing.assert_allclose(numbers, numbers[:1].repeat(11, axis=0), atol=1e-3)  # a hover stays where it is


@needs_compiler
def test_nothing_that_a_card_says_becomes_code(tmp_path: Path) -> None:
    hostile = 'a */ int x; /* "; system("x"); // \\ ??/ \x00 \n #error no é'
    vehicle = sp.vehicle("coax", bar=False)
    card = replace(vehicle.card, title=hostile, trust=hostile * 3)
    card = replace(
        card,
        parameters={name: replace(p, source=hostile, note=hostile) for name, p in card.parameters.items()},
    )
    code = model_code(trace_vehicle(vehicle.with_card(card), sp.trim(vehicle), name="coax"))
    for text in code.files().values():
        assert "system(" not in re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        assert all(c == "\n" or " " <= c <= "~" for c in text)
    compiled(code, tmp_path)


@needs_compiler
def test_nor_what_a_linear_models_file_names_its_signals(tmp_path: Path) -> None:
    hostile = "w = 0 }; int system(); //"
    model = replace(of_state_space(structure("heave"), name="heave"), states=(hostile,), units={hostile: "*/ x"})
    code = model_code(trace_linear(model, name="heave"))
    assert "heave_state_w_0_int_system" in code.header
    assert "system()" not in "".join(code.files().values())
    compiled(code, tmp_path)
    clash = replace(of_state_space(structure("six_dof"), name="six_dof"), inputs=("a b", "a-b", "c", "d"))
    with pytest.raises(ExportError, match="are the same in C"):
        trace_linear(clash, name="six_dof")


def test_numbers_for_c() -> None:
    assert literal(0.1, "double") == "0.1"
    assert literal(2.0, "single") == "2.0f"
    assert literal(1e-60, "single") == "0.0f"
    assert literal(-1e-7, "single") == "-1e-07f"
    for value, precision in ((float("nan"), "double"), (float("inf"), "single"), (1e60, "single")):
        with pytest.raises(ExportError, match=r"no (double|single) in C"):
            literal(value, precision)  # type: ignore[arg-type]


def test_words_and_names_for_c() -> None:
    assert comment_text("a/* b */ c\\\n??/") == "a/ * b * / c| ? ?/"
    assert identifier("fit-2/model") == "fit_2_model"
    assert identifier("50raptor") == "model_50raptor"
    assert identifier("double") == "model_double"
    with pytest.raises(ExportError, match="gives no name"):
        identifier("///")


def test_what_is_refused() -> None:
    vehicle = sp.vehicle("coax", bar=False)
    trim = sp.trim(vehicle)
    with pytest.raises(ExportError, match="are double"):
        export_model(vehicle, "fmu", name="x", trim=trim, precision="single")
    with pytest.raises(ExportError, match="is no format"):
        export_model(vehicle, "vhdl", name="x", trim=trim)  # type: ignore[arg-type]
    with pytest.raises(ExportError, match="one flight"):
        export_model(structure("hybrid"), "c", name="x", trim=trim)


@needs_compiler
def test_a_compiler_that_refuses_is_told_of(tmp_path: Path) -> None:
    (tmp_path / "bad.c").write_text("int f(void) { return x; }")
    with pytest.raises(ExportError, match=r"refused the exported sources.*bad\.c"):
        shared_library([tmp_path / "bad.c"], tmp_path / "bad.so")
