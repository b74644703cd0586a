"""The controller's C, compiled, against the Python step: in double, in float, and in what it calls."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.commit import commit
from swashplate.control.laws.autopilot import MODES, Autopilot, Memory, Reference, autopilot, step, unpack
from swashplate.control.laws.height_yaw import HeightYawGains, HeightYawMemory
from swashplate.export.controller_c import Precision, controller_code
from swashplate.physics.backend import FloatBackend
from swashplate.physics.rigid_body import RigidBody

Step = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
COMPILER = shutil.which("cc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


def compiled(source: str, folder: Path, precision: Precision) -> Step:
    """The C step as a Python function of rows."""
    file, library = folder / "controller.c", folder / "controller.so"
    file.write_text(source)
    assert COMPILER is not None
    strict = ["-std=c99", "-pedantic", "-Werror", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run([COMPILER, *strict, "-o", library, file, "-lm"], check=True)
    function = ctypes.CDLL(str(library)).swash_step
    kind = np.float64 if precision == "double" else np.float32
    real = ctypes.c_double if precision == "double" else ctypes.c_float

    def run(memory: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = [np.ascontiguousarray(row, dtype=kind) for row in (memory.copy(), measured, reference, np.zeros(4))]
        function(*(row.ctypes.data_as(ctypes.POINTER(real)) for row in rows))
        return rows[0].astype(float), rows[3].astype(float)

    return run


def in_python(controller: Autopilot) -> Step:
    gains, xp = unpack(controller.gains), FloatBackend()

    def run(memory: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        m, y, r = (row.tolist() for row in (memory, measured, reference))
        carried = Memory(HeightYawMemory(*m[:3]), *m[3:])
        after, command = step(carried, RigidBody(*y[:12]), y[12], Reference(*r), gains, xp)
        return np.array([*after.motors, after.ahead, after.right]), np.array(command)

    return run


def worst(one: Step, other: Step, start: np.ndarray, *, scale: float) -> float:
    """Largest relative difference of memory and commands over 300 steps from the same memory each."""
    random = np.random.default_rng(0)
    memory, found = start, 0.0
    for _ in range(300):
        measured = np.append(scale * random.standard_normal(12), 11.5 + 0.5 * random.standard_normal())
        reference = scale * random.standard_normal(8)
        (m1, c1), (m2, c2) = (run(memory, measured, reference) for run in (one, other))
        both = np.abs(np.append(m1 - m2, c1 - c2)) / np.maximum(1.0, np.abs(np.append(m1, c1)))
        found = max(found, float(np.max(both)))
        memory = m1
    return found


@needs_compiler
@pytest.mark.parametrize("mode", MODES)
def test_the_c_step_is_the_python_step(mode: str, tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    motors = HeightYawGains(soft_start=0.4 if mode == "place" else 0.0)
    controller = autopilot(coax, sp.trim(coax), mode=mode, motors=motors)  # type: ignore[arg-type]
    run = compiled(controller_code(controller).source, tmp_path, "double")
    for scale in (0.05, 1.0):  # within all limits, and against them
        assert worst(in_python(controller), run, controller.memory, scale=scale) < 1e-12


@needs_compiler
def test_in_single_precision_it_keeps_five_digits(tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    controller = autopilot(coax, sp.trim(coax))
    run = compiled(controller_code(controller, precision="float").source, tmp_path, "float")
    assert worst(in_python(controller), run, controller.memory, scale=0.3) < 2e-5


@pytest.mark.parametrize("precision", ["double", "float"])
def test_it_calls_nothing_but_four_functions_and_allocates_nothing(precision: Precision) -> None:
    coax = sp.vehicle("coax")
    code = controller_code(autopilot(coax, sp.trim(coax)), precision=precision)
    body = re.sub(r"/\*.*?\*/|^#.*$", "", code.source, flags=re.DOTALL | re.MULTILINE)
    called = set(re.findall(r"(?<![\w])([a-z_]\w*)\(", body)) - {"for", "if", "sizeof", "visibility"}
    suffix = "f" if precision == "float" else ""
    assert {name for name in called if "casadi" not in name and "swash" not in name} <= {
        name + suffix for name in ("sin", "cos", "sqrt", "atan2")
    }
    assert "malloc" not in code.source
    if precision == "float":
        assert not re.search(r"(?<![\w])double(?![\w])", body)
        assert not re.search(r"\d\.\d*(e[+-]?\d+)?(?![\df.e])", body)  # every constant is a float's
    assert 100 < code.operations < 400
    assert code.work_bytes < 1024


def test_it_says_commit_controller_and_the_card_with_its_data() -> None:
    coax = sp.vehicle("coax")
    fitted = coax.with_card(replace(coax.card, title=f"{coax.card.title}, identified from flight.mat"))
    first, second = (controller_code(autopilot(one, sp.trim(one))).source for one in (coax, fitted))
    gentler = controller_code(autopilot(coax, sp.trim(coax)).with_gains(place=0.01)).source
    assert commit() in first
    assert "identified from flight.mat" in second
    (one, other) = (re.search(r"controller ([0-9a-f]{12})\n", text) for text in (first, gentler))
    assert one is not None
    assert other is not None
    assert one[1] != other[1]
